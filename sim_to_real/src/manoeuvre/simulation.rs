//! A whole drive as a model with its sensors would make it.

use crate::drive::STEP_S;
use bicycle::lanes::{Real, STEERING_DOMAIN_RAD, Scalar};
use bicycle::{
    Column, Command, DriveLog, DriveLogError, DriveRow, Effect, GroundSample, LaneState, Limits, Model,
    SensorModel, Stepper,
};
use std::f64::consts::TAU;

const UNLIMITED: Limits = Limits {
    speed_max_mps: f64::MAX,
    reverse_speed_max_mps: f64::MAX,
    steering_max_rad: STEERING_DOMAIN_RAD,
    steering_rate_max_radps: f64::MAX,
    acceleration_max_mps2: f64::MAX,
    lateral_acceleration_max_mps2: f64::MAX,
    roll_max_rad: f64::MAX,
    pitch_max_rad: f64::MAX,
};

/// What is true at one row: east, north [m], yaw without jumps [rad], forward speed [m/s], yaw rate [rad/s].
type Truth = [f64; 5];

/// The ground of every row of a drive.
pub(crate) type GroundOfRow<'a> = &'a dyn Fn(usize) -> GroundSample;

/// The measurements, free of noise, of a vehicle that begins at a speed and follows commands.
///
/// # Errors
/// The model left the numbers.
pub(crate) fn measured_drive(
    wheelbase_m: f64,
    effects: &[Effect],
    start: (f64, &[Command]),
    ground: GroundOfRow<'_>,
) -> Result<DriveLog, DriveLogError> {
    let commands = start.1;
    let truths = driven(wheelbase_m, effects, start, ground);
    let sensors = SensorModel::of(effects);
    let mut log = DriveLog::default();
    for (row, command) in commands.iter().enumerate() {
        let pose = earlier(&truths, row as f64 - sensors.pose_latency_s / STEP_S);
        let [.., speed, yaw_rate] = truths[row];
        let values = [
            (Column::X, pose[0]),
            (Column::Y, pose[1]),
            (Column::Yaw, pose[2] + sensors.yaw_offset_rad),
            (Column::Vx, speed * sensors.velocity_ratio),
            (Column::Wz, yaw_rate + sensors.yaw_rate_bias_radps),
            (Column::CmdSpeed, f64::from(command.speed_mps)),
            (Column::CmdSteer, f64::from(command.steering_rad)),
        ];
        let empty = DriveRow::new(row as f64 * STEP_S);
        log.push("", &values.into_iter().fold(empty, |row, (column, value)| row.with(column, value)))?;
    }
    Ok(log)
}

fn driven(
    wheelbase_m: f64,
    effects: &[Effect],
    (speed_mps, commands): (f64, &[Command]),
    ground: GroundOfRow<'_>,
) -> Vec<Truth> {
    let model = Model { wheelbase_m, limits: UNLIMITED, effects: effects.to_vec() };
    let stepper = Stepper::new(&model, STEP_S, 1.0).with_instant_actuators();
    let mut memory = vec![0.0; stepper.n_slots()];
    if let Some(&first) = commands.first() {
        stepper.fill_steady_state(Command { speed_mps: speed_mps as f32, ..first }, &mut memory);
    }
    let real = |value: f64| Real(Scalar, value);
    let zero = real(0.0);
    let mut state = LaneState { x: zero, y: zero, turns: zero, speed: real(speed_mps), steering: zero };
    let (mut yaw, mut rates) = (0.0, [speed_mps, 0.0]);
    let mut truths = Vec::with_capacity(commands.len());
    for (step, command) in commands.iter().enumerate() {
        truths.push([state.x.1, state.y.1, yaw, rates[0], rates[1]]);
        let command = [command.speed_mps, command.steering_rad].map(|value| real(f64::from(value)));
        let GroundSample { linear_traction, angular_traction, gradient, class } = ground(step);
        let ground = GroundSample {
            linear_traction: real(linear_traction),
            angular_traction: real(angular_traction),
            gradient: gradient.map(real),
            class: real(class),
        };
        let reached = stepper.step(&mut state, command, &ground, &mut memory, step);
        rates = [reached.speed.1, reached.yaw_rate.1];
        // The state's own yaw wraps.
        let turned = state.turns.1 - yaw / TAU;
        yaw += (turned - turned.round()) * TAU;
    }
    truths
}

/// Linear between rows; before the first, the first.
fn earlier(truths: &[Truth], place: f64) -> Truth {
    let place = place.max(0.0);
    let (below, share) = (place as usize, place.fract());
    let above = (below + 1).min(truths.len() - 1);
    std::array::from_fn(|i| truths[below][i] + share * (truths[above][i] - truths[below][i]))
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a panic is how a test fails")]

    use super::*;
    use crate::manoeuvre::family::held;

    fn column(log: &DriveLog, column: Column) -> Vec<f64> {
        log.runs().next().unwrap().column(column).unwrap().to_vec()
    }

    /// Two turns of a circle: yaw v tan(angle) t / L beyond a whole turn, speed and yaw rate as commanded.
    #[test]
    fn the_bare_bicycle_turns_as_its_formula_says() {
        let log =
            measured_drive(2.0, &[], (1.0, &held(&[(30.0, 1.0, 0.4)])), &|_| GroundSample::FIRM).unwrap();
        let (yaw, wz) = (column(&log, Column::Yaw), column(&log, Column::Wz));
        let rate = 0.4_f32.tan() / 2.0;
        let last = yaw.len() - 1;
        assert!((yaw[last] - f64::from(rate) * last as f64 * STEP_S).abs() < 1e-4, "{}", yaw[last]);
        assert!((wz[last] - f64::from(rate)).abs() < 1e-6 && column(&log, Column::Vx)[last] == 1.0);
    }

    /// A pose that is 0.1 s old lies 0.1 m back at 1 m/s; a yaw offset turns the yaw and not the way.
    #[test]
    fn sensors_misstate_what_they_should() {
        let values = |id: &str, value: f64| Effect::from_values(id, [value, 0.0, 0.0, 0.0]).unwrap();
        let effects = [values("pose_latency", 0.1), values("yaw_misalign", 0.05), values("odom_scale", 1.1)];
        let straight = held(&[(2.0, 1.0, 0.0)]);
        let log = measured_drive(2.0, &effects, (1.0, &straight), &|_| GroundSample::FIRM).unwrap();
        let (x, yaw, vx) = (column(&log, Column::X), column(&log, Column::Yaw), column(&log, Column::Vx));
        assert!((x[50] - 0.9).abs() < 1e-6 && (yaw[50] - 0.05).abs() < 1e-9 && (vx[50] - 1.1).abs() < 1e-6);
    }
}
