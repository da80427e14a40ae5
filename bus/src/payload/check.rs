//! What makes a message malformed: refused before any reader sees it.

use bicycle::Odometry;
use terrain::{DistantPosition, TerrainClass};
use traversability::Ground;

use super::risk_views;
use crate::channel::{FUTURE_NS, Refusal};
use crate::message::mission::EMERGENCY_STOP;
use crate::message::{
    CheckpointHeader, CommandRecord, FutureRecord, ImuRecord, MissionRecord, OdometryRecord, OrderHeader,
    PlanRecord, PointRecord, RiskHeader, ScanHeader, Stamp, StuckRecord, SurfaceHeader, TRACKS_MAX,
    TrackRecord, TracksHeader,
};

fn check_one<T>(payload: &[T]) -> Result<&T, Refusal> {
    match payload {
        [one] => Ok(one),
        _ => Err(Refusal::Malformed),
    }
}

fn require(holds: bool, refusal: Refusal) -> Result<(), Refusal> {
    if holds { Ok(()) } else { Err(refusal) }
}

pub(crate) fn check_anything<T>(_: &Stamp, payload: &[T]) -> Result<(), Refusal> {
    check_one(payload).map(drop)
}

/// Measurements that are not finite pass here and stop the vehicle at the guard, which is sooner than by their absence.
/// What was applied is no measurement: nobody would look at it again.
pub(crate) fn check_odometry(stamp: &Stamp, payload: &[OdometryRecord]) -> Result<(), Refusal> {
    let record = check_one(payload)?;
    let latest_ns = stamp.published_at_ns.saturating_add(FUTURE_NS);
    require(record.applied_since_ns <= latest_ns, Refusal::FromFuture)?;
    let is_finite = record.applied_speed_mps.is_finite() && record.applied_steering_rad.is_finite();
    require(is_finite, Refusal::NonFinite)?;
    require(record.applied_by <= 1, Refusal::Malformed)
}

/// Samples come in their order, each of its own time and none of after the message: what is lost is a gap that its
/// reader sees.
pub(crate) fn check_imu(stamp: &Stamp, samples: &[ImuRecord]) -> Result<(), Refusal> {
    let last = samples.last().ok_or(Refusal::Malformed)?;
    require(samples.is_sorted_by(|one, next| one.valid_at_ns < next.valid_at_ns), Refusal::Malformed)?;
    let latest_ns = stamp.published_at_ns.saturating_add(FUTURE_NS);
    require(last.valid_at_ns <= latest_ns, Refusal::FromFuture)?;
    let numbers = |sample: &ImuRecord| {
        let [ax, ay, az] = sample.acceleration_mps2;
        let [wx, wy, wz] = sample.angular_rate_radps;
        [ax, ay, az, wx, wy, wz].iter().all(|value| value.is_finite())
    };
    require(samples.iter().all(numbers), Refusal::NonFinite)
}

/// Some points may be no numbers, as sensors give them; the map drops these.
pub(crate) fn check_scan(header: &ScanHeader, _: &[PointRecord]) -> Result<(), Refusal> {
    require(header.origin_m.iter().all(|value| value.is_finite()), Refusal::NonFinite)
}

pub(crate) fn check_plan(_: &Stamp, places: &[PlanRecord]) -> Result<(), Refusal> {
    require(!places.is_empty(), Refusal::Malformed)?;
    let is_finite = |place: &PlanRecord| {
        let [x_m, y_m] = place.position_m;
        [x_m, y_m, place.yaw_rad, place.speed_mps].iter().all(|value| value.is_finite())
    };
    require(places.iter().all(is_finite), Refusal::NonFinite)
}

pub(crate) fn check_futures(_: &Stamp, places: &[FutureRecord]) -> Result<(), Refusal> {
    require(!places.is_empty(), Refusal::Malformed)?;
    let is_finite = |place: &FutureRecord| {
        let [x_m, y_m] = place.position_m;
        [x_m, y_m, place.cost_s].iter().all(|value| value.is_finite())
    };
    require(places.iter().all(is_finite), Refusal::NonFinite)
}

pub(crate) fn check_surface(header: &SurfaceHeader, payload: &[[f32; 8]]) -> Result<(), Refusal> {
    let geometry = header.grid.geometry().ok_or(Refusal::Malformed)?;
    require(geometry.n_cells() == payload.len(), Refusal::Malformed)?;
    let at = header.odometry.odometry(header.odometry_at_ns);
    let [x_m, y_m, _] = at.position_m;
    let turns = [header.jump_yaw_rad, header.shift_yaw_rad];
    let shifts = header.jump_m.iter().chain(&header.shift_m).chain(&turns);
    require(Odometry::is_finite(&at) && shifts.clone().all(|m| m.is_finite()), Refusal::NonFinite)?;
    require(DistantPosition::check([x_m, y_m], geometry.resolution_m).is_ok(), Refusal::Malformed)
}

/// A place that is none could not be kept away from.
pub(crate) fn check_tracks(_: &TracksHeader, payload: &[TrackRecord]) -> Result<(), Refusal> {
    require(payload.len() <= TRACKS_MAX, Refusal::Malformed)?;
    let numbers = |track: &TrackRecord| {
        let ([x_m, y_m], [east_mps, north_mps]) = (track.position_m, track.velocity_mps);
        let amounts = [track.position_m2, track.cross_m2ps, track.velocity_m2ps2, track.radius_m];
        [x_m, y_m, east_mps, north_mps].iter().chain(&amounts).all(|value| value.is_finite())
    };
    require(payload.iter().all(numbers), Refusal::NonFinite)?;
    let amounts = |track: &TrackRecord| {
        [track.position_m2, track.velocity_m2ps2, track.radius_m].iter().all(|amount| *amount >= 0.0)
    };
    require(payload.iter().all(amounts), Refusal::Malformed)
}

pub(crate) fn check_risk(header: &RiskHeader, payload: &[[f32; 4]]) -> Result<(), Refusal> {
    let (map, times) = risk_views(header, payload).ok_or(Refusal::Malformed)?;
    require(matches!(header.map_source, 1 | 2), Refusal::Malformed)?;
    // A finite number times zero is zero; of anything else the sum is no number. One pass, without a branch.
    let of_risks = map.risks.iter().fold(0.0, |sum: f32, risk| {
        sum + 0.0 * (risk.linear_traction + risk.angular_traction + risk.roll_rad + risk.pitch_rad)
    });
    let of_ground =
        map.ground.iter().fold(0.0, |sum: f32, ground| sum + 0.0 * (ground.gradient[0] + ground.gradient[1]));
    let of_times =
        times.seconds.iter().chain(times.turning_s).fold(0.0, |sum: f32, seconds| sum + 0.0 * seconds);
    require(of_risks + of_ground + of_times == 0.0, Refusal::NonFinite)?;
    let known = |ground: &Ground| usize::from(ground.class) < TerrainClass::COUNT;
    require(map.ground.iter().all(known), Refusal::Malformed)
}

/// A command decided on what was measured after it was sent would never grow old.
pub(crate) fn check_command(stamp: &Stamp, payload: &[CommandRecord]) -> Result<(), Refusal> {
    let command = check_one(payload)?;
    let latest_ns = stamp.published_at_ns.saturating_add(FUTURE_NS);
    let is_past = command.odometry_at_ns <= latest_ns && command.scan_at_ns <= latest_ns;
    require(is_past, Refusal::FromFuture)?;
    require(command.speed_mps.is_finite() && command.steering_rad.is_finite(), Refusal::NonFinite)?;
    require(command.decision().is_some(), Refusal::Malformed)
}

pub(crate) fn check_stuck(_: &Stamp, payload: &[StuckRecord]) -> Result<(), Refusal> {
    let stuck = check_one(payload)?;
    let numbers = stuck.position_m.iter().chain([&stuck.yaw_rad]);
    require(numbers.clone().all(|value| value.is_finite()), Refusal::NonFinite)
}

pub(crate) fn check_checkpoint(header: &CheckpointHeader, payload: &[u8]) -> Result<(), Refusal> {
    require(header.n_weight_bytes <= payload.len() as u64, Refusal::Malformed)?;
    let errors = header.recent_emd2.iter().chain(&header.original_emd2);
    require(errors.clone().all(|value| value.is_finite()), Refusal::NonFinite)
}

/// Every state and outcome is a reason to stand but one; a number that is none of them is no mission.
pub(crate) fn check_mission(_: &Stamp, payload: &[MissionRecord]) -> Result<(), Refusal> {
    let mission = check_one(payload)?;
    let MissionRecord { goal_m, tolerance_m, path_speed_mps, alpha, .. } = mission;
    require(mission.n_corners <= mission.corner_x_m.len() as u64, Refusal::Malformed)?;
    let corners = mission.corner_x_m.iter().chain(&mission.corner_y_m);
    let numbers = goal_m.iter().chain([tolerance_m, path_speed_mps, alpha]).chain(corners);
    require(numbers.clone().all(|value| value.is_finite()), Refusal::NonFinite)?;
    let is_path = *path_speed_mps == 0.0 || (*path_speed_mps > 0.0 && mission.n_corners >= 2);
    let is_plan = (0.0..=1.0).contains(alpha) && *tolerance_m >= 0.0;
    require(is_path && is_plan && mission.state <= EMERGENCY_STOP, Refusal::Malformed)
}

/// What an order says is judged by whoever takes it, and answered.
pub(crate) fn check_order(header: &OrderHeader, payload: &[[f64; 2]]) -> Result<(), Refusal> {
    let numbers = [header.tolerance_m, header.speed_mps, header.alpha];
    let mut numbers = numbers.iter().chain(payload.as_flattened());
    require(numbers.all(|value| value.is_finite()), Refusal::NonFinite)
}
