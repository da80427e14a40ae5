//! From a drive to measured traversability: what the vehicle did over what was asked of it, and where that means
//! nothing.

mod config;
mod response;
mod signals;

use bicycle::{Column, DriveLog, Geometry, Run};

pub use config::{LabelConfig, LabelError, Reversing};
pub use response::{Response, Responses};
use signals::{Aligned, Signals};

/// What was measured at one instant of a drive.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Label {
    /// Time since the run began [s].
    pub time_s: f64,
    /// Rear axle's centre and heading in the map frame: x [m], y [m], yaw [rad].
    pub pose: [f64; 3],
    /// Linear traction [-], angular traction [-], |roll| [rad], |pitch| [rad]; NaN where it means nothing.
    pub measured: [f32; 4],
}

/// How the wheels rolled around a label.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Rolling {
    /// Mean speed over ground along the body [m/s].
    pub speed_mps: f64,
    /// Speed of the wheels over the speed that was asked for; NaN where linear traction means nothing.
    pub wheel_share: f64,
    /// Share of the wheels' way that was lost to slip; NaN where the wheels hardly turn.
    pub slip: f64,
}

/// Ratios outside are cut: they say no more than "rolled back" and "ran away".
const RATIOS: [f64; 2] = [-1.0, 2.0];

/// Estimates how commands become motion, over all runs of a log.
///
/// # Errors
/// A setting out of range, a column that is missing; see [`labels`].
pub fn estimate_responses(
    log: &DriveLog,
    geometry: &Geometry,
    config: &LabelConfig,
) -> Result<Responses, LabelError> {
    config.validate()?;
    let signals: Vec<Signals> =
        log.runs().map(|run| Signals::of(&run, geometry)).collect::<Result<_, _>>()?;
    Ok(Responses::estimate(&signals))
}

/// Labels of one run, in time order, at [`LabelConfig::period_s`].
///
/// Traction is the mean of what was achieved over the mean of what was commanded in a short window, the command passed
/// through its [`Responses`] first, so that it stands beside its own effect (PIETRA, section IV-A, where the two are
/// taken as simultaneous). A parameter is NaN where its command is near zero, still on its way, or asks for reverse,
/// near the ends of the run, and where anything in the window is not finite. A vehicle that was told to move and did
/// not has traction zero.
///
/// # Errors
/// A setting out of range, or a column that is missing: needed are x, y, yaw, vx, wz, and cmd_speed with cmd_steer or
/// cmd_wz, or cmd_left with cmd_right. Without roll or pitch these stay NaN.
pub fn labels(
    run: &Run<'_>,
    geometry: &Geometry,
    responses: &Responses,
    config: &LabelConfig,
) -> Result<Vec<Label>, LabelError> {
    config.validate()?;
    let signals = Signals::of(run, geometry)?;
    let aligned = signals.aligned(responses);
    let (Some(first_s), Some(last_s)) = (signals.time_s.first(), signals.time_s.last()) else {
        return Ok(Vec::new());
    };
    let span_s = first_s + config.start_s..=last_s - config.end_s;
    let mut labels: Vec<Label> = Vec::new();
    for row in (0..signals.time_s.len()).filter(|&row| span_s.contains(&signals.time_s[row])) {
        let is_due = labels.last().is_none_or(|last| is_due(&signals, row, last, config));
        if is_due && let Some(label) = label(&signals, &aligned, row, config) {
            labels.push(label);
        }
    }
    Ok(labels)
}

/// How the wheels rolled around labels of a run; without a column of their speed, both shares are NaN.
///
/// # Errors
/// See [`labels`].
pub(crate) fn rolling(
    run: &Run<'_>,
    geometry: &Geometry,
    responses: &Responses,
    config: &LabelConfig,
    labels: &[Label],
) -> Result<Vec<Rolling>, LabelError> {
    let signals = Signals::of(run, geometry)?;
    let aligned = signals.aligned(responses);
    let missing = vec![f64::NAN; signals.time_s.len()];
    let wheels_mps = run.column(Column::WheelSpeed).unwrap_or(&missing);
    let forward_mps = run.column(Column::Vx).unwrap_or(&missing);
    let of = |label: &Label| {
        let row = signals.time_s.partition_point(|&time_s| time_s < label.time_s);
        let window = signals.window(row.min(missing.len() - 1), config.window_s);
        let mean = |values: &[f64]| values[window.clone()].iter().sum::<f64>() / window.len() as f64;
        let [speed_mps, wheel_mps] = [forward_mps, wheels_mps].map(mean);
        let is_rolling = wheel_mps.abs() >= config.speed_min_mps;
        let is_asked = !label.measured[0].is_nan();
        Rolling {
            speed_mps,
            wheel_share: if is_asked { wheel_mps / mean(&aligned.speed_mps) } else { f64::NAN },
            slip: if is_rolling { 1.0 - speed_mps / wheel_mps } else { f64::NAN },
        }
    };
    Ok(labels.iter().map(of).collect())
}

/// Whether enough time has passed since the last label. A vehicle that stands says the same again and again: it is
/// asked less often.
fn is_due(signals: &Signals, row: usize, last: &Label, config: &LabelConfig) -> bool {
    // Half a nanosecond against the rounding of decimal times.
    let since_s = signals.time_s[row] - last.time_s + 5e-10;
    let [x_m, y_m, _] = signals.pose(row);
    let has_moved = (x_m - last.pose[0]).hypot(y_m - last.pose[1]) >= config.moved_min_m;
    since_s >= config.period_s && (has_moved || since_s >= config.standing_period_s)
}

/// The label of a row; `None` when nothing can be said there or nothing was going on.
fn label(signals: &Signals, aligned: &Aligned, row: usize, config: &LabelConfig) -> Option<Label> {
    let pose = signals.pose(row);
    let window = signals.window(row, config.window_s);
    let mean = |values: &[f64]| values[window.clone()].iter().sum::<f64>() / window.len() as f64;
    let speed_mps = mean(&signals.speed_mps);
    let commanded_mps = mean(&aligned.speed_mps);
    let is_still = speed_mps.abs() < config.speed_min_mps && commanded_mps.abs() < config.speed_min_mps;
    if is_still || !pose.iter().all(|value| value.is_finite()) {
        return None;
    }
    let is_forward = aligned.speed_mps[window.clone()].iter().all(|&speed_mps| speed_mps >= 0.0);
    let is_meant = is_forward || config.reversing == Reversing::Labelled;
    let settled = |raw: &[f64], arrived: &[f64], most: f64| {
        window.clone().all(|row| (raw[row] - arrived[row]).abs() <= most)
    };
    let speed_most_mps = config.unsettled_speed_share_max * commanded_mps.abs();
    let is_speed_settled = settled(&signals.commanded_mps, &aligned.speed_mps, speed_most_mps);
    let linear = (is_meant && is_speed_settled && commanded_mps.abs() >= config.speed_min_mps)
        .then(|| speed_mps / commanded_mps);
    let commanded_radps = mean(&aligned.yaw_rate_radps);
    let turn_most_radps = config.unsettled_turn_share_max * commanded_radps.abs();
    let is_turn_settled = settled(&signals.commanded_radps, &aligned.yaw_rate_radps, turn_most_radps);
    let angular = (is_meant && is_turn_settled && commanded_radps.abs() >= config.yaw_rate_min_radps)
        .then(|| mean(&signals.yaw_rate_radps) / commanded_radps);
    let ratio = |ratio: Option<f64>| {
        let ratio = ratio.filter(|ratio| ratio.is_finite());
        ratio.map_or(f32::NAN, |ratio| ratio.clamp(RATIOS[0], RATIOS[1]) as f32)
    };
    let angle = |values: &Option<Vec<f64>>| {
        let angle_rad = values.as_ref().map(|values| mean(values).abs()).filter(|angle| angle.is_finite());
        angle_rad.map_or(f32::NAN, |angle_rad| angle_rad as f32)
    };
    let measured = [ratio(linear), ratio(angular), angle(&signals.roll_rad), angle(&signals.pitch_rad)];
    let label = Label { time_s: signals.time_s[row], pose, measured };
    measured.iter().any(|value| !value.is_nan()).then_some(label)
}
