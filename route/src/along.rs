//! What a line that somebody lays by hand is worth.

use crate::line::{Line, RouteLine, RoutePoint, grounded};
use crate::planner::Planner;
use crate::smooth::Spline;
use crate::speed::SpeedLimits;

/// A line with the fastest speeds along it.
#[derive(Clone, Debug, PartialEq)]
pub struct LaidLine {
    /// The line.
    pub line: RouteLine,
    /// Points where nobody can stand, or that lean farther than may be.
    pub n_barred: usize,
}

impl Planner {
    /// The uniform cubic B-spline from the first to the last of at least two control points, as the line of a route is,
    /// with the fastest speeds along it; `None` where no speed will do.
    pub fn along(&self, controls_m: &[[f64; 2]], limits: &SpeedLimits) -> Option<LaidLine> {
        if controls_m.len() < 2 {
            return None;
        }
        let (samples, spacing_m) =
            Spline::between_ends(controls_m.to_vec()).sampled(self.ground().geometry().resolution_m);
        let line = Line { samples, spacing_m };
        let sliding_mps = self.config().sliding_mps as f32;
        let ground = line.samples.iter().map(|sample| grounded(self.ground(), sliding_mps, sample));
        let line = line.driven(ground.collect(), limits).ok()?;
        let n_barred = line.points.iter().filter(|point| self.is_barred(point)).count();
        Some(LaidLine { line, n_barred })
    }

    fn is_barred(&self, point: &RoutePoint) -> bool {
        let [x_m, y_m] = point.at_m;
        let cell = self.ground().geometry().cell_at(x_m, y_m);
        let leans = libm::fabs(point.bend.grade) > libm::tan(self.config().pitch_max_rad)
            || libm::fabs(point.bend.cross_slope) > libm::tan(self.config().roll_max_rad);
        leans || cell.is_none_or(|cell| self.barrier_at(cell).is_some())
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a panic is how a test fails")]

    use super::*;
    use crate::{FrictionCurve, GroundCell, RouteConfig};
    use terrain::{CellRegion, GridGeometry, GridMap};

    fn planner() -> Planner {
        let geometry = GridGeometry { resolution_m: 1.0, origin: [0, 0], n_rows: 40, n_cols: 80 };
        let ground = GridMap::filled(geometry, GroundCell::level(FrictionCurve::GRASS));
        Planner::new(ground, RouteConfig::default()).unwrap()
    }

    /// Where the controls lie on a straight line the route does too, and takes the same time.
    #[test]
    fn a_line_laid_where_the_route_runs_takes_its_time() {
        let (planner, limits) = (planner(), SpeedLimits::default());
        let route = planner.route(([5.5, 20.5], 0.0), [65.5, 20.5], &limits).unwrap();
        let controls_m: Vec<[f64; 2]> = (0..=60).map(|x_m| [5.5 + f64::from(x_m), 20.5]).collect();
        let laid = planner.along(&controls_m, &limits).unwrap();
        assert!((laid.line.duration_s - route.line.duration_s).abs() < 1e-3 * route.line.duration_s);
        assert_eq!((laid.n_barred, laid.line.points.len()), (0, route.line.points.len()));
    }

    #[test]
    fn points_on_an_obstacle_are_barred_and_what_is_no_line_is_none() {
        let (mut planner, limits) = (planner(), SpeedLimits::default());
        let wall = CellRegion { rows: 18..24, cols: 30..34 };
        planner.change(&wall, |_, cell| GroundCell { is_obstacle: true, ..cell }).unwrap();
        let laid = planner.along(&[[5.5, 20.5], [65.5, 20.5]], &limits).unwrap();
        assert!(laid.n_barred >= 4, "{}", laid.n_barred);
        assert_eq!(planner.along(&[[5.5, 20.5]], &limits), None);
        // Ice of friction 0.22 and a share of 0.8 hold 17.6 %.
        let steep = |cell: terrain::Cell, ground: GroundCell| GroundCell {
            height_m: 0.3 * cell.col as f32,
            friction: FrictionCurve::ICE,
            ..ground
        };
        planner.change(&CellRegion { rows: 0..40, cols: 0..80 }, steep).unwrap();
        assert_eq!(planner.along(&[[5.5, 20.5], [65.5, 20.5]], &limits), None);
    }
}
