//! A slow reference in place of AnyNav's human drivers (table 7): lines that are bent until nothing makes them faster.
//!
//! A direct search (Hooke and Jeeves 1961) on the time of the speed profile itself, which a planner's costs only stand for:
//! from each of several ways it moves stretches of the line to either side, long ones and short ones, and keeps what is
//! faster and meets no more that bars the way. It knows what our planner knows and is bound by the same limits.

use route::{GroundCell, LaidLine, Planner, PlannerError, Route, RouteConfig, RouteLine, SpeedLimits};

use super::plan::Plan;
use scenarios::RouteTask;
use terrain::GridMap;

/// As many other ways are sought on each map of costs.
const N_OTHERS: usize = 3;
/// Rounds over all of them, after which the fastest few are bent to the end.
const ROUNDS_FIRST: usize = 1;
const N_KEPT: usize = 2;
/// Control points of a line are so far apart [m].
const CONTROL_M: f64 = 2.0;
/// Half the length of a stretch that is moved [m].
const STRETCHES_M: [f64; 5] = [64.0, 32.0, 16.0, 8.0, 4.0];
/// How far a stretch is moved: at first, over its half length, and at last [-].
const MOVES: [f64; 3] = [0.25, 0.08, 0.02];
/// Rounds over all stretches end when one gains less than this share of the time, or are so many.
const GAIN_MIN: f64 = 1e-4;
const ROUNDS_MAX: usize = 30;

/// Searches a map for the fastest lines.
pub(super) struct ReferencePlanner {
    planner: Planner,
    /// The same ground with turns that cost nothing.
    unsteered: Planner,
    limits: SpeedLimits,
}

impl ReferencePlanner {
    pub fn new(
        ground: &GridMap<GroundCell>,
        config: RouteConfig,
        limits: SpeedLimits,
    ) -> Result<Self, PlannerError> {
        let unsteered = RouteConfig { steering_weight: 0.0, ..config };
        let [planner, unsteered] = [config, unsteered].map(|config| Planner::new(ground.clone(), config));
        Ok(Self { planner: planner?, unsteered: unsteered?, limits })
    }

    /// The fastest line that was found, never slower than our own; `None` where our planner finds no way.
    pub fn plan(&self, task: &RouteTask) -> Option<Plan> {
        let ways = self.ways(task);
        let ours = ways.first()?;
        let laid = ways.iter().filter_map(|way| self.planner.along(&way.line.places_m(), &self.limits));
        let mut begun: Vec<LaidLine> =
            laid.map(|laid| Bending { of: self, laid }.fastest(ROUNDS_FIRST)).collect();
        begun.sort_by(|one, other| one.line.duration_s.total_cmp(&other.line.duration_s));
        begun.truncate(N_KEPT);
        let bent = begun.into_iter().map(|laid| Bending { of: self, laid }.fastest(ROUNDS_MAX));
        let best = bent.min_by(|one, other| one.line.duration_s.total_cmp(&other.line.duration_s));
        let faster = best.filter(|best| best.line.duration_s < ours.line.duration_s);
        let RouteLine { points, spacing_m, .. } =
            faster.map_or_else(|| ours.line.clone(), |faster| faster.line);
        Some(Plan { points, spacing_m })
    }

    /// Our route, first, and others; none where there is none of ours.
    fn ways(&self, task: &RouteTask) -> Vec<Route> {
        let start = (task.start_m, task.yaw_rad);
        let mut ways = Vec::new();
        for planner in [&self.planner, &self.unsteered] {
            let Ok(route) = planner.route(start, task.goal_m, &self.limits) else { break };
            let others = planner.alternatives(start, task.goal_m, &self.limits, &route, N_OTHERS);
            ways.push(route);
            ways.extend(others);
        }
        ways
    }
}

/// A line that is being bent.
struct Bending<'a> {
    of: &'a ReferencePlanner,
    laid: LaidLine,
}

impl Bending<'_> {
    /// At most so many rounds over all stretches, until one gains nothing.
    fn fastest(mut self, n_rounds: usize) -> LaidLine {
        for _ in 0..n_rounds {
            let before_s = self.laid.line.duration_s;
            for half_m in STRETCHES_M {
                for share in MOVES {
                    self.move_stretches(half_m, share * half_m);
                }
            }
            if self.laid.line.duration_s > (1.0 - GAIN_MIN) * before_s {
                break;
            }
        }
        self.laid
    }

    /// Tries to move every stretch of a length to either side.
    fn move_stretches(&mut self, half_m: f64, by_m: f64) {
        let mut middle_m = 0.0;
        while middle_m < self.laid.line.spacing_m * self.laid.line.points.len() as f64 {
            for by_m in [by_m, -by_m] {
                let moved = self.of.planner.along(&self.moved(middle_m, half_m, by_m), &self.of.limits);
                let is_better = |moved: &LaidLine| {
                    moved.line.duration_s < self.laid.line.duration_s && moved.n_barred <= self.laid.n_barred
                };
                if let Some(moved) = moved.filter(is_better) {
                    self.laid = moved;
                    break;
                }
            }
            middle_m += 0.5 * half_m;
        }
    }

    /// Control points on the line, those near a place of it beside it: the more, the nearer (a raised cosine). Its ends and
    /// its direction at the start stay.
    fn moved(&self, middle_m: f64, half_m: f64, by_m: f64) -> Vec<[f64; 2]> {
        let every = (CONTROL_M / self.laid.line.spacing_m).round().max(1.0) as usize;
        let last = self.laid.line.points.len() - 1;
        let control = |index: usize| {
            let point = &self.laid.line.points[index];
            let along_m = index as f64 * self.laid.line.spacing_m;
            let away = ((along_m - middle_m) / half_m).clamp(-1.0, 1.0);
            let is_free = index > 2 * every && index < last;
            let aside_m =
                if is_free { 0.5 * by_m * (1.0 + (std::f64::consts::PI * away).cos()) } else { 0.0 };
            let (sine, cosine) = point.yaw_rad.sin_cos();
            [point.at_m[0] - aside_m * sine, point.at_m[1] + aside_m * cosine]
        };
        let inner = (0..last).step_by(every).filter(|index| *index == 0 || last - index > every / 2);
        inner.chain([last]).map(control).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use route::FrictionCurve;
    use terrain::{CellRegion, GridGeometry};

    /// Friction and forces that no speed here asks for, so that roughness alone decides: 0.3 m2/s over it.
    fn limits() -> SpeedLimits {
        SpeedLimits {
            traction_max_mps2: 100.0,
            braking_max_mps2: 100.0,
            friction_share: 1.0,
            ..SpeedLimits::default()
        }
    }

    /// 80 x 80 m, of which the northern half may be of another roughness [m].
    fn reference(north_m: f32) -> ReferencePlanner {
        let geometry = GridGeometry { resolution_m: 1.0, origin: [0, 0], n_rows: 80, n_cols: 80 };
        let firm = FrictionCurve {
            static_friction: 2.0,
            sliding_friction: 2.0,
            viscous_friction: 0.0,
            stribeck_speed_mps: 0.5,
        };
        let mut ground =
            GridMap::filled(geometry, GroundCell { roughness_m: 0.06, ..GroundCell::level(firm) });
        for cell in (CellRegion { rows: 40..80, cols: 0..80 }).cells() {
            ground[cell].roughness_m = north_m;
        }
        ReferencePlanner::new(&ground, RouteConfig::default(), limits()).unwrap()
    }

    fn task(start_m: [f64; 2], goal_m: [f64; 2]) -> RouteTask {
        let yaw_rad = (goal_m[1] - start_m[1]).atan2(goal_m[0] - start_m[0]);
        RouteTask { start_m, yaw_rad, goal_m }
    }

    /// From a detour of 15 m on uniform ground, the straight line: 58 m at 5 m/s, and twice as long for the first and the
    /// last metre, from the first point of the line to the next.
    #[test]
    fn on_uniform_ground_a_detour_becomes_the_straight_line() {
        let reference = reference(0.06);
        let detour: Vec<[f64; 2]> =
            (0..=60).map(|x| [10.5 + f64::from(x), 20.5 + 15.0 * (f64::from(x) * 0.05236).sin()]).collect();
        let laid = reference.planner.along(&detour, &limits()).unwrap();
        let begun_s = laid.line.duration_s;
        let found = Bending { of: &reference, laid }.fastest(ROUNDS_MAX);
        let least_s = 58.0 / 5.0 + 2.0 * 2.0 / 5.0;
        assert!(begun_s > 1.1 * least_s, "{begun_s}");
        assert!(
            (0.999..1.005).contains(&(found.line.duration_s / least_s)),
            "{} {least_s}",
            found.line.duration_s
        );
        assert_eq!(found.n_barred, 0);
    }

    /// Into ground on which 0.15 m of roughness allow 2 m/s instead of 5: refraction after Snell, the least of
    /// hypot(x, 30) / 5 + hypot(40 - x, 30) / 2 over where the border is crossed. The straight line takes 4 % longer.
    #[test]
    fn between_two_grounds_the_line_is_refracted() {
        let reference = reference(0.15);
        let time_s = |x_m: f64| x_m.hypot(30.0) / 5.0 + (40.0 - x_m).hypot(30.0) / 2.0;
        let least_s = (0..4000).map(|n| time_s(f64::from(n) * 0.01)).fold(f64::INFINITY, f64::min);
        assert!(time_s(20.0) > 1.035 * least_s);
        let found = reference.plan(&task([20.5, 10.0], [60.5, 70.0])).unwrap();
        // The first and the last metre take twice as long.
        let over = (found.duration_s(0.0) - 1.0 / 5.0 - 1.0 / 2.0) / least_s;
        assert!((0.985..1.015).contains(&over), "{over} of {least_s} s");
    }

    #[test]
    fn it_is_never_slower_than_what_it_began_with() {
        let reference = reference(0.12);
        for goal_m in [[60.5, 70.5], [70.5, 45.5], [20.5, 60.5]] {
            let task = task([10.5, 10.5], goal_m);
            let ours = reference.planner.route((task.start_m, task.yaw_rad), goal_m, &limits()).unwrap();
            let found = reference.plan(&task).unwrap();
            assert!(
                found.duration_s(0.0) <= ours.line.duration_s,
                "{} {}",
                found.duration_s(0.0),
                ours.line.duration_s
            );
        }
    }
}
