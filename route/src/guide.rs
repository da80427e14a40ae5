//! Where to head for along a route, and what became of it.

use crate::{Planner, Route};

/// Follows a vehicle along the line of a route, and tells a local planner what to head for: the place that lies a reach
/// ahead. On which way it gets there is left to whoever sees the ground.
#[derive(Clone, Debug)]
pub struct Guide {
    points_m: Vec<[f64; 2]>,
    spacing_m: f64,
    reach: usize,
    /// The farthest point that the vehicle was abreast of.
    abreast: usize,
    headed: Option<usize>,
}

impl Guide {
    /// Nobody has set out on it yet; a reach of at least two points [m].
    pub fn new(route: &Route, reach_m: f64) -> Self {
        let points_m = route.line.places_m();
        let reach =
            (reach_m / route.line.spacing_m).round().clamp(2.0, points_m.len().max(2) as f64) as usize;
        Self { points_m, spacing_m: route.line.spacing_m, reach, abreast: 0, headed: None }
    }

    /// Takes in where the vehicle is. Returns the place to head for when it is another than before by a quarter of the
    /// reach.
    pub fn advance(&mut self, at_m: [f64; 2]) -> Option<[f64; 2]> {
        self.abreast = self.foot(at_m);
        let last = self.points_m.len().saturating_sub(1);
        let ahead = (self.abreast + self.reach).min(last);
        let is_due = match self.headed {
            None => true,
            Some(headed) => ahead >= headed + self.reach.div_ceil(4) || (ahead == last && headed < last),
        };
        if !is_due {
            return None;
        }
        self.headed = Some(ahead);
        self.points_m.get(ahead).copied()
    }

    /// The point of the line nearest to a place, none before where the vehicle was abreast and none more than a reach and a
    /// half ahead: a line may come by the same place twice.
    fn foot(&self, at_m: [f64; 2]) -> usize {
        let window = self.abreast..self.points_m.len().min(self.abreast + self.reach + self.reach / 2);
        let away_m = |place: &usize| {
            let [x_m, y_m] = self.points_m[*place];
            libm::hypot(x_m - at_m[0], y_m - at_m[1])
        };
        window.min_by(|one, other| away_m(one).total_cmp(&away_m(other))).unwrap_or(self.abreast)
    }

    /// Way made along the line [m].
    pub fn way_made_m(&self) -> f64 {
        self.abreast as f64 * self.spacing_m
    }

    /// The line from where the vehicle is abreast on [m].
    pub fn ahead_m(&self) -> &[[f64; 2]] {
        &self.points_m[self.abreast.min(self.points_m.len())..]
    }
}

impl Planner {
    /// Takes over obstacles that somebody saw [m]; returns how many cells of the map have become one. Places beyond the map
    /// are none of it.
    pub fn note_obstacles(&mut self, places_m: impl IntoIterator<Item = [f64; 2]>) -> usize {
        let geometry = *self.ground().geometry();
        let cells = places_m.into_iter().filter_map(|[x_m, y_m]| geometry.cell_at(x_m, y_m));
        let mut new: Vec<_> = cells.filter(|cell| !self.ground()[*cell].is_obstacle).collect();
        new.sort_unstable_by_key(|cell| geometry.index(*cell));
        new.dedup();
        for cell in &new {
            self.block(*cell);
        }
        new.len()
    }

    /// The first of some places where a vehicle cannot stand, and why.
    pub fn first_barrier(&self, places_m: &[[f64; 2]]) -> Option<([f64; 2], crate::Barrier)> {
        let barrier = |place_m: &[f64; 2]| {
            let cell = self.ground().geometry().cell_at(place_m[0], place_m[1])?;
            Some((*place_m, self.barrier_at(cell)?))
        };
        places_m.iter().find_map(barrier)
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a panic is how a test fails")]

    use super::*;
    use crate::{Barrier, FrictionCurve, GroundCell, RouteConfig, SpeedLimits};
    use terrain::{GridGeometry, GridMap};

    fn planner() -> Planner {
        let geometry = GridGeometry { resolution_m: 1.0, origin: [0, 0], n_rows: 40, n_cols: 80 };
        let ground = GridMap::filled(geometry, GroundCell::level(FrictionCurve::GRASS));
        Planner::new(ground, RouteConfig::default()).unwrap()
    }

    fn east(planner: &Planner) -> Route {
        planner.route(([5.5, 20.5], 0.0), [70.5, 20.5], &SpeedLimits::default()).unwrap()
    }

    #[test]
    fn the_place_to_head_for_stays_a_reach_ahead_and_ends_at_the_goal() {
        let route = east(&planner());
        let mut guide = Guide::new(&route, 10.0);
        let place_m = guide.advance([5.5, 20.5]).unwrap();
        assert!((place_m[0] - 15.5).abs() <= route.line.spacing_m, "{place_m:?}");
        assert_eq!(guide.advance([6.0, 20.5]), None, "hardly any nearer");
        // Two metres beside the line it is abreast of the same point.
        let place_m = guide.advance([9.5, 22.5]).unwrap();
        assert!((place_m[0] - 19.5).abs() <= route.line.spacing_m, "{place_m:?}");
        assert!((guide.way_made_m() - 4.0).abs() <= route.line.spacing_m);
        assert_eq!(guide.advance([5.5, 20.5]), None, "who goes back heads for the same place");
        assert!((guide.way_made_m() - 4.0).abs() <= route.line.spacing_m);
        let mut last = None;
        for x_m in 10..=70 {
            last = guide.advance([f64::from(x_m) + 0.5, 20.5]).or(last);
        }
        assert_eq!(last, route.line.points.last().map(|point| point.at_m));
    }

    #[test]
    fn an_obstacle_on_the_line_is_a_barrier_there_and_the_next_route_goes_around() {
        let mut planner = planner();
        let route = east(&planner);
        let guide = Guide::new(&route, 10.0);
        assert_eq!(planner.first_barrier(guide.ahead_m()), None);
        let wall = || (10..31).map(|row| [40.5, f64::from(row) + 0.5]);
        assert_eq!(
            planner.note_obstacles(wall().chain([[40.2, 20.2], [-5.0, 3.0]])),
            21,
            "each once, none beyond"
        );
        assert_eq!(planner.note_obstacles(wall()), 0, "it is known");
        let (place_m, barrier) = planner.first_barrier(guide.ahead_m()).unwrap();
        assert_eq!(barrier, Barrier::Obstacle);
        assert!((place_m[0] - 40.0).abs() < 2.0, "{place_m:?}");
        let around = east(&planner);
        assert_eq!(planner.first_barrier(Guide::new(&around, 10.0).ahead_m()), None);
        // The wall's ends are at 10 and 31 m north: hypot(35, 10.5) + hypot(30, 10.5) at least.
        let length_m = around.line.length_m();
        assert!(length_m > 68.3, "{length_m}");
    }
}
