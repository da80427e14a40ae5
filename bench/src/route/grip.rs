//! What friction foretells of turns and climbs, beside the plant (AnyNav, figure 12 and table 3).

use std::f64::consts::FRAC_PI_2;
use std::sync::Arc;

use bicycle::{Command, Vehicle};
use route::{Bend, FrictionCurve, RoutePoint};
use scenarios::{GroundKind, Patch, Plant, Stribeck, World, WorldError};
use serde::Serialize;
use terrain::GridGeometry;

use super::plan::Plan;
use super::track::{CONTROL_HZ, Follower, Foot, PdFollower, TrackError};
use crate::friction::{FrictionBenchError, found_grounds};
use crate::sweep::in_turns;

/// Standard gravity [m/s2].
const GRAVITY_MPS2: f64 = 9.806_65;
/// Speed of sliding that predictions are for [m/s].
const SLIDING_MPS: f64 = 1.0;
/// Radius of the turn, its run-up, the way over which it begins, and its angle: AnyNav's, its own ones [m, rad].
const RADIUS_M: f64 = 20.0;
const RUN_UP_M: f64 = 90.0;
const EASING_M: f64 = 12.0;
const TURN_RAD: f64 = FRAC_PI_2;
/// What a turn that holds keeps within: off the line, and slip of the rear axle [m, degrees].
const OFF_MAX_M: f64 = 0.5;
const SLIP_MAX_DEG: f64 = 10.0;
/// Speeds over the safe one that are tried.
const TRIED: [f64; 5] = [0.7, 0.8, 0.9, 1.0, 1.15];
/// A climb is made that gains so much way in so long, from standing, at a commanded speed [m, s, m/s].
const CLIMB: (f64, f64, f64) = (5.0, 12.0, 1.0);
/// Climbs are told apart by so much [degrees].
const CLIMB_STEP_DEG: f64 = 0.25;

/// Where a prediction comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Source {
    /// The published curve, on ground that is as published.
    Published,
    /// A drive of two minutes without labels, on ground of 0.6 to 1.4 times the published friction.
    Driven,
}

/// A turn at a share of the safe speed.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Turn {
    /// Speed over the safe one [-].
    pub share: f64,
    /// Farthest from the line in the turn [m].
    pub off_m: f64,
    /// Largest slip angle of the rear axle [degrees].
    pub slip_deg: f64,
    /// Whether both stay within their bounds.
    pub holds: bool,
}

/// One ground.
#[derive(Clone, Debug, Serialize)]
pub struct GripRow {
    /// Class.
    pub ground: &'static str,
    /// Where the friction comes from.
    pub source: Source,
    /// Predicted friction [-].
    pub friction: f64,
    /// Equation 52 [m/s].
    pub safe_mps: f64,
    /// Turns at shares of it.
    pub turns: Vec<Turn>,
    /// Equation 53 [degrees].
    pub climb_deg: f64,
    /// What the plant climbs [degrees].
    pub climbed_deg: f64,
}

/// Why there is no table.
#[derive(Debug, thiserror::Error)]
pub enum GripError {
    /// No friction was found.
    #[error(transparent)]
    Friction(#[from] FrictionBenchError),
    /// The plant cannot be put there.
    #[error(transparent)]
    Track(#[from] TrackError),
    /// The ground cannot be made.
    #[error(transparent)]
    World(#[from] WorldError),
    /// The system refused the threads.
    #[error("threads: {0}")]
    Threads(#[from] rayon::ThreadPoolBuildError),
}

struct Case {
    ground: &'static str,
    source: Source,
    truth: Stribeck,
    friction: f64,
}

/// Turns and climbs on the seven grounds as published, and on those that drives of `n_drives` seeds from `seed` on
/// found. `after` is called after each drive and after each ground, with how many of both there are as far as is known.
///
/// # Errors
/// A vehicle that cannot be driven.
pub fn measure_grip(
    (vehicle, n_threads): (&Vehicle, usize),
    (seed, n_drives): (u64, u64),
    after: impl Fn(usize) + Sync,
) -> Result<Vec<GripRow>, GripError> {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(n_threads).build()?;
    let published = GroundKind::ALL.map(|kind| Case {
        ground: kind.name(),
        source: Source::Published,
        truth: kind.friction(),
        friction: f64::from(FrictionCurve::PUBLISHED[kind as usize].1.at(SLIDING_MPS as f32)),
    });
    let n_drives = n_drives as usize;
    let found = in_turns(&pool, n_drives, |index| {
        let found = found_grounds(vehicle, seed + index as u64);
        after(n_drives + GroundKind::ALL.len());
        found
    })?;
    let found = found.into_iter().flatten().map(|found| Case {
        ground: found.name,
        source: Source::Driven,
        truth: found.truth,
        friction: found.friction,
    });
    let cases: Vec<Case> = published.into_iter().chain(found).collect();
    let mut vehicle = super::unbound(vehicle);
    vehicle.limits.speed_max_mps = 25.0;
    in_turns(&pool, cases.len(), |index| {
        let row = row(&vehicle, &cases[index]);
        after(n_drives + cases.len());
        row
    })
}

fn row(vehicle: &Vehicle, case: &Case) -> Result<GripRow, GripError> {
    let safe_mps = (RADIUS_M * GRAVITY_MPS2 * case.friction).sqrt();
    let turns = TRIED.map(|share| turn(vehicle, case.truth, share, share * safe_mps));
    Ok(GripRow {
        ground: case.ground,
        source: case.source,
        friction: case.friction,
        safe_mps,
        turns: turns.into_iter().collect::<Result<_, _>>()?,
        climb_deg: case.friction.atan().to_degrees(),
        climbed_deg: climbed_deg(vehicle, case.truth)?,
    })
}

/// A straight run-up, a turn that begins gently, and a straight end, at one speed.
fn turning_plan(speed_mps: f64) -> (Plan, std::ops::Range<usize>) {
    let spacing_m = 0.25;
    let curvature = |along_m: f64| {
        let in_turn_m = along_m - RUN_UP_M;
        let round_m = TURN_RAD * RADIUS_M;
        let rise = (in_turn_m / EASING_M).clamp(0.0, 1.0);
        let fall = ((round_m + EASING_M - in_turn_m) / EASING_M).clamp(0.0, 1.0);
        rise.min(fall) / RADIUS_M
    };
    let (mut at_m, mut yaw_rad) = ([10.0, 40.0], 0.0_f64);
    let n = ((RUN_UP_M + TURN_RAD * RADIUS_M + EASING_M + 30.0) / spacing_m) as usize;
    let mut points = Vec::with_capacity(n);
    for index in 0..n {
        let curvature_per_m = curvature(index as f64 * spacing_m);
        let bend = Bend { curvature_per_m, grade: 0.0, cross_slope: 0.0, friction: 1.0, roughness_m: 0.0 };
        points.push(RoutePoint { at_m, yaw_rad, height_m: 0.0, bend, speed_mps });
        let middle_rad = yaw_rad + 0.5 * spacing_m * curvature_per_m;
        at_m = [at_m[0] + spacing_m * middle_rad.cos(), at_m[1] + spacing_m * middle_rad.sin()];
        yaw_rad += spacing_m * curvature_per_m;
    }
    let of_turn = |along_m: f64| (along_m / spacing_m) as usize;
    let judged = of_turn(RUN_UP_M)..of_turn(RUN_UP_M + TURN_RAD * RADIUS_M + EASING_M);
    (Plan { points, spacing_m }, judged)
}

fn turn(vehicle: &Vehicle, ground: Stribeck, share: f64, speed_mps: f64) -> Result<Turn, GripError> {
    let (plan, judged) = turning_plan(speed_mps);
    let geometry = GridGeometry { resolution_m: 1.0, origin: [0, 0], n_rows: 140, n_cols: 190 };
    let world = Arc::new(World::from_fn("level", geometry, |_, _| 0.0, |_, _| Patch::open(ground))?);
    let mut plant = Plant::new(vehicle, world, [10.0, 40.0, 0.0]).map_err(TrackError::from)?;
    let (wheelbase_m, steering_max_rad) = (vehicle.geometry.wheelbase_m, vehicle.limits.steering_max_rad);
    let mut follower = PdFollower { wheelbase_m, steering_max_rad };
    let mut foot = Foot::new(&plan);
    let (mut off_m, mut slip_deg) = (0.0_f64, 0.0_f64);
    let most = (CONTROL_HZ * 4.0 * RUN_UP_M / speed_mps.min(5.0)) as usize;
    for _ in 0..most {
        let motion = plant.motion();
        let off = foot.follow([motion.pose.x_m, motion.pose.y_m]);
        if judged.contains(&foot.index) {
            off_m = off_m.max(off.abs());
            let [ahead, left, _] = motion.velocity_mps;
            slip_deg = slip_deg.max(left.atan2(ahead).abs().to_degrees());
        }
        if foot.index >= judged.end || off.abs() > 10.0 || plant.rolled_over() {
            break;
        }
        plant.set_command(follower.command(&motion, &foot, off)).map_err(TrackError::from)?;
        plant.advance(1.0 / CONTROL_HZ);
    }
    let is_done = foot.index >= judged.end && !plant.rolled_over();
    Ok(Turn { share, off_m, slip_deg, holds: is_done && off_m < OFF_MAX_M && slip_deg < SLIP_MAX_DEG })
}

/// The steepest slope that is climbed from standing [degrees].
fn climbed_deg(vehicle: &Vehicle, ground: Stribeck) -> Result<f64, GripError> {
    let (mut made_deg, mut failed_deg) = (0.0, 60.0);
    while failed_deg - made_deg > CLIMB_STEP_DEG {
        let middle_deg = 0.5 * (made_deg + failed_deg);
        if climbs(vehicle, ground, middle_deg)? {
            made_deg = middle_deg;
        } else {
            failed_deg = middle_deg;
        }
    }
    Ok(0.5 * (made_deg + failed_deg))
}

fn climbs(vehicle: &Vehicle, ground: Stribeck, slope_deg: f64) -> Result<bool, GripError> {
    let rise = slope_deg.to_radians().tan();
    let geometry = GridGeometry { resolution_m: 1.0, origin: [0, 0], n_rows: 20, n_cols: 60 };
    let world = Arc::new(World::from_fn("slope", geometry, |x_m, _| rise * x_m, |_, _| Patch::open(ground))?);
    let start_m = [25.0, 10.0];
    let mut plant = Plant::new(vehicle, world, [start_m[0], start_m[1], 0.0]).map_err(TrackError::from)?;
    let begun_m = plant.pose().x_m;
    let command = Command { speed_mps: CLIMB.2 as f32, steering_rad: 0.0 };
    plant.set_command(command).map_err(TrackError::from)?;
    let way_m = |plant: &Plant| (plant.pose().x_m - begun_m) / slope_deg.to_radians().cos();
    for _ in 0..(CLIMB.1 * CONTROL_HZ) as usize {
        plant.advance(1.0 / CONTROL_HZ);
        if way_m(&plant) >= CLIMB.0 {
            return Ok(true);
        }
        if plant.rolled_over() || way_m(&plant) < -3.0 {
            return Ok(false);
        }
    }
    Ok(false)
}

/// What rows come to, by where their friction came from.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct GripScore {
    /// Rows.
    pub n: usize,
    /// Turns at the safe speed that hold.
    pub n_safe: usize,
    /// Turns at 1.15 of it that do not.
    pub n_unsafe: usize,
    /// Largest share of the safe speed that was tried and held by every ground; 0 for none.
    pub held_share: f64,
    /// Mean absolute error of the climb [degrees].
    pub climb_error_deg: f64,
}

impl GripScore {
    /// Of the rows of a source.
    pub fn of(rows: &[GripRow], source: Source) -> Self {
        let of_source = || rows.iter().filter(|row| row.source == source);
        let holds =
            |row: &GripRow, share: f64| row.turns.iter().any(|turn| turn.share == share && turn.holds);
        let n = of_source().count();
        let held = TRIED.into_iter().filter(|share| of_source().all(|row| holds(row, *share)));
        let errors_deg = of_source().map(|row| (row.climb_deg - row.climbed_deg).abs());
        Self {
            n,
            n_safe: of_source().filter(|row| holds(row, 1.0)).count(),
            n_unsafe: of_source().filter(|row| !holds(row, 1.15)).count(),
            held_share: held.fold(0.0, f64::max),
            climb_error_deg: errors_deg.sum::<f64>() / n.max(1) as f64,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_planned_turn_is_a_quarter_of_a_circle_with_easings() {
        let (plan, judged) = turning_plan(5.0);
        let [first, last] = [&plan.points[0], &plan.points[plan.points.len() - 1]];
        // Half of each easing turns as much as if it were round: 20 m x pi / 2 of way at full curvature in all.
        assert!((last.yaw_rad - first.yaw_rad - TURN_RAD).abs() < 0.02, "{}", last.yaw_rad);
        let most = plan.points.iter().map(|point| point.bend.curvature_per_m).fold(0.0, f64::max);
        assert!((most - 1.0 / RADIUS_M).abs() < 1e-12);
        assert!(plan.points[..judged.start].iter().all(|point| point.bend.curvature_per_m == 0.0));
        let step = (plan.points[1].at_m[0] - first.at_m[0]).hypot(plan.points[1].at_m[1] - first.at_m[1]);
        assert!((step - plan.spacing_m).abs() < 1e-12);
    }

    #[test]
    fn ice_is_climbed_less_than_rock_and_neither_beyond_its_friction() {
        let vehicle = super::super::unbound(&formats::read_vehicle("pietra_full_size").unwrap());
        let [ice, rock] =
            [Stribeck::ICE, Stribeck::ROCK].map(|ground| climbed_deg(&vehicle, ground).unwrap());
        assert!(ice < rock, "{ice} {rock}");
        // atan of the largest friction that each has, 0.4 and 0.93.
        assert!(ice < 21.9 && rock < 43.0 && ice > 3.0 && rock > 20.0, "{ice} {rock}");
    }
}
