//! Other ways to the same goal: the penalty method (Bader et al. 2011, Alternative Route Graphs in Road Networks). What lies
//! near a way that was found is made dearer, and the search repeated.

use crate::{Planner, Route, SpeedLimits};
use terrain::CellRegion;

/// How much dearer ground near a way becomes.
const DEARER: f32 = 1.6;
/// How near that is, as a share of the length of the way.
const NEAR_SHARE: f64 = 0.05;
/// Share of another way that may run near those before.
const SHARED_MAX: f64 = 0.6;
/// Expected time of another way over that of the best.
const TIME_RATIO_MAX: f64 = 1.5;
/// Searches for each way that is asked for.
const TRIES: usize = 3;

impl Planner {
    /// At most `n` ways beside the best, the one first that was found first: none shares more than 0.6 of its length with
    /// those before it and the best, and none takes more than 1.5 times as long as that. Fewer where no other is found that
    /// can be driven.
    pub fn alternatives(
        &self,
        start: ([f64; 2], f64),
        goal_m: [f64; 2],
        limits: &SpeedLimits,
        best: &Route,
        n: usize,
    ) -> Vec<Route> {
        let mut dearer = self.clone();
        let mut is_near = vec![false; self.ground().geometry().n_cells()];
        let near_m = (NEAR_SHARE * best.line.length_m()).max(self.clear_width_m());
        let mut found: Vec<Route> = Vec::new();
        dearer.burden(best, near_m, &mut is_near);
        for _ in 0..TRIES * n {
            if found.len() == n {
                break;
            }
            let Ok(next) = dearer.route(start, goal_m, limits) else { break };
            let is_another = self.shared(&next, &is_near) <= SHARED_MAX;
            dearer.burden(&next, near_m, &mut is_near);
            if is_another && next.line.duration_s <= TIME_RATIO_MAX * best.line.duration_s {
                found.push(next);
            }
        }
        found
    }

    /// Makes the ground near a way dearer, and marks it.
    fn burden(&mut self, way: &Route, near_m: f64, is_near: &mut [bool]) {
        let geometry = *self.ground().geometry();
        let reach = (near_m / geometry.resolution_m).ceil() as usize;
        let mut is_new = vec![false; is_near.len()];
        // Regions overlap: every half a reach there is one.
        for cell in way.cells.iter().step_by(reach.div_ceil(2).max(1)) {
            let near = CellRegion::of_cell(*cell).grown(reach, &geometry);
            for row in near.rows {
                is_new[row * geometry.n_cols..][near.cols.clone()].fill(true);
            }
        }
        for (index, _) in is_new.iter().enumerate().filter(|(_, is_new)| **is_new) {
            is_near[index] = true;
            self.make_dearer(index, DEARER);
        }
    }

    /// Share of a way's cells that lie near others.
    fn shared(&self, way: &Route, is_near: &[bool]) -> f64 {
        let geometry = self.ground().geometry();
        let n_near = way.cells.iter().filter(|cell| is_near[geometry.index(**cell)]).count();
        n_near as f64 / way.cells.len().max(1) as f64
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a panic is how a test fails")]

    use super::*;
    use crate::{FrictionCurve, GroundCell, RouteConfig};
    use terrain::{Cell, GridGeometry, GridMap};

    /// A plain with a pond from 40 to 60 m east that leaves a southern ford of rows 10 to 19 and, where asked for, a
    /// northern one of rows 70 to 79.
    fn planner(has_north: bool) -> Planner {
        let geometry = GridGeometry { resolution_m: 1.0, origin: [0, 0], n_rows: 80, n_cols: 100 };
        let mut ground = GridMap::filled(geometry, GroundCell::level(FrictionCurve::GRASS));
        for row in 0..80 {
            let is_ford = (10..20).contains(&row) || (has_north && row >= 70);
            for col in 40..60 {
                ground[Cell { row, col }].is_obstacle = !is_ford;
            }
        }
        Planner::new(ground, RouteConfig::default()).unwrap()
    }

    fn alternatives(planner: &Planner, n: usize) -> (Route, Vec<Route>) {
        let (start, goal_m, limits) = (([10.5, 40.5], 0.0), [90.5, 40.5], SpeedLimits::default());
        let best = planner.route(start, goal_m, &limits).unwrap();
        let others = planner.alternatives(start, goal_m, &limits, &best, n);
        (best, others)
    }

    fn north_m(route: &Route) -> f64 {
        let over = route.line.points.iter().filter(|point| (45.0..55.0).contains(&point.at_m[0]));
        let (sum_m, n) = over.fold((0.0, 0.0), |(sum_m, n), point| (sum_m + point.at_m[1], n + 1.0));
        sum_m / n
    }

    #[test]
    fn the_other_ford_is_the_other_way() {
        let planner = planner(true);
        let (best, others) = alternatives(&planner, 1);
        assert!((10.0..20.0).contains(&north_m(&best)), "{}", north_m(&best));
        let [other] = &others[..] else { panic!("expected one other way, found {}", others.len()) };
        assert!((70.0..80.0).contains(&north_m(other)), "{}", north_m(other));
        assert!(
            other.line.duration_s >= best.line.duration_s
                && other.line.duration_s <= 1.5 * best.line.duration_s
        );
        assert_eq!(planner.route(([10.5, 40.5], 0.0), [90.5, 40.5], &SpeedLimits::default()).unwrap(), best);
    }

    #[test]
    fn ways_that_meet_at_the_one_ford_are_others_before_and_behind_it() {
        let planner = planner(false);
        let (best, others) = alternatives(&planner, 2);
        assert_eq!(others.len(), 2);
        let mut is_near = vec![false; planner.ground().geometry().n_cells()];
        planner.clone().burden(&best, NEAR_SHARE * best.line.length_m(), &mut is_near);
        for other in &others {
            assert!((10.0..20.0).contains(&north_m(other)), "{}", north_m(other));
            let shared = planner.shared(other, &is_near);
            // The ford is 20 of some 110 m.
            assert!((0.15..=SHARED_MAX).contains(&shared), "{shared}");
        }
        assert!(alternatives(&planner, 0).1.is_empty(), "nobody asked");
    }
}
