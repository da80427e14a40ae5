//! What each effect looks like: a drive that shows all of them, with it and without it.

use crate::drive::STEP_S;
use crate::manoeuvre::family::held;
use crate::manoeuvre::simulation::measured_drive;
use bicycle::effect::{Description, add_in_order};
use bicycle::{Column, Command, DriveLog, DriveLogError, Effect, GroundSample};

/// Distance of the axles of the vehicle that drives [m].
const WHEELBASE_M: f64 = 1.0;
/// Speed that it begins with [m/s].
const SPEED_MPS: f64 = 1.5;
/// What the vehicle is like before the effect: a speed loop for forces to work against, and tyres that yield.
const ORDINARY: [(&str, f64); 3] = [("speed_loop", 0.4), ("understeer", 0.01), ("rear_slip", 0.01)];
/// The ground: vegetation, loose ground, and a slope to the north-east, each from and to [s].
const VEGETATION_S: [f64; 2] = [10.0, 13.0];
const LOOSE_S: [f64; 2] = [13.0, 16.0];
const SLOPE_S: [f64; 2] = [18.0, 24.0];
/// Rise east and north on the slope [-].
const GRADIENT: [f64; 2] = [0.08, 0.05];

/// What a drive measures with an effect less what it measures without, row by row, free of noise.
#[derive(Clone, Debug, PartialEq)]
pub struct Signature {
    /// The effect as it was tried.
    pub effect: Effect,
    /// Since the start [s].
    pub time_s: Vec<f64>,
    /// Forward speed [m/s].
    pub speed_mps: Vec<f64>,
    /// Yaw rate [rad/s].
    pub yaw_rate_radps: Vec<f64>,
    /// Yaw [rad].
    pub yaw_rad: Vec<f64>,
    /// Distance between the two positions [m].
    pub distance_m: Vec<f64>,
}

/// The signature of an effect at the middle of the values that the catalogue tries, on a drive of 24 s with steps of
/// speed and steering, a weave, vegetation, loose ground and a slope.
///
/// # Errors
/// The model left the numbers.
pub fn signature(description: &Description) -> Result<Signature, DriveLogError> {
    let effect = middle(description);
    let ordinary: Vec<Effect> =
        ORDINARY.iter().filter_map(|&(id, value)| Effect::from_values(id, [value, 0.0, 0.0, 0.0])).collect();
    let commands = commands();
    let drive = |effects: &[Effect]| measured_drive(WHEELBASE_M, effects, (SPEED_MPS, &commands), &ground);
    let mut with_effect = ordinary.clone();
    add_in_order(&mut with_effect, effect);
    let (without, with) = (drive(&ordinary)?, drive(&with_effect)?);
    let [x, y] = [Column::X, Column::Y].map(|column| difference(&with, &without, column));
    Ok(Signature {
        effect,
        time_s: (0..commands.len()).map(|row| row as f64 * STEP_S).collect(),
        speed_mps: difference(&with, &without, Column::Vx),
        yaw_rate_radps: difference(&with, &without, Column::Wz),
        yaw_rad: difference(&with, &without, Column::Yaw),
        distance_m: x.iter().zip(&y).map(|(x, y)| x.hypot(*y)).collect(),
    })
}

/// Every parameter at the middle of the values that are tried.
fn middle(description: &Description) -> Effect {
    let mut values = [0.0; 4];
    for (value, parameter) in values.iter_mut().zip(description.parameters) {
        *value = parameter.tried[parameter.tried.len() / 2];
    }
    Effect::from_values(description.id, values).unwrap_or_else(|| unreachable!("an effect of the catalogue"))
}

/// Duration [s], speed [m/s], angle [rad]; then a weave that quickens.
fn commands() -> Vec<Command> {
    let steps = [
        (2.0, SPEED_MPS, 0.0),
        (2.0, SPEED_MPS, 0.2),
        (2.0, 3.0, 0.2),
        (2.0, 3.0, -0.2),
        (2.0, 0.8, -0.05),
        (14.0, 2.5, 0.0),
    ];
    let mut commands = held(&steps);
    for (row, command) in commands.iter_mut().enumerate() {
        let since_s = row as f64 * STEP_S - 14.0;
        if (0.0..6.0).contains(&since_s) {
            command.steering_rad = (0.25 * (1.5 * since_s + 0.25 * since_s * since_s).sin()) as f32;
        }
    }
    commands
}

fn ground(row: usize) -> GroundSample {
    let time_s = row as f64 * STEP_S;
    let within = |[from, to]: [f64; 2]| time_s >= from && time_s < to;
    let class = if within(VEGETATION_S) { 2.0 } else { f64::from(u8::from(within(LOOSE_S))) };
    let gradient = if within(SLOPE_S) { GRADIENT } else { [0.0; 2] };
    GroundSample { class, gradient, ..GroundSample::FIRM }
}

fn difference(with: &DriveLog, without: &DriveLog, column: Column) -> Vec<f64> {
    let values = |log: &DriveLog| log.runs().next().and_then(|run| run.column(column).map(<[f64]>::to_vec));
    let (with, without) = (values(with).unwrap_or_default(), values(without).unwrap_or_default());
    with.iter().zip(&without).map(|(with, without)| with - without).collect()
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a panic is how a test fails")]

    use super::*;
    use bicycle::effect::CATALOGUE;

    fn of(id: &str) -> Signature {
        signature(CATALOGUE.iter().find(|description| description.id == id).unwrap()).unwrap()
    }

    fn largest(values: &[f64]) -> f64 {
        values.iter().fold(0.0, |most, value| most.max(value.abs()))
    }

    #[test]
    fn every_effect_shows_in_something_that_is_measured() {
        for description in CATALOGUE {
            let Signature { speed_mps, yaw_rate_radps, yaw_rad, distance_m, .. } =
                signature(description).unwrap();
            let shown = [speed_mps, yaw_rate_radps, yaw_rad, distance_m].map(|values| largest(&values));
            assert!(shown.iter().any(|most| *most > 0.01), "{}: {shown:?}", description.id);
        }
    }

    /// A steering gain is silent while the wheels stand straight; a drag of vegetation until vegetation comes; a scale of
    /// the odometer in everything but the speed; a bias of the gyroscope is the same everywhere.
    #[test]
    fn effects_are_silent_where_their_cause_is() {
        let row = |time_s: f64| (time_s / STEP_S) as usize;
        let gain = of("steer_gain");
        assert!(largest(&gain.yaw_rate_radps[..row(2.0)]) == 0.0 && largest(&gain.yaw_rate_radps) > 0.05);
        let vegetation = of("veg_drag");
        assert!(largest(&vegetation.speed_mps[..row(10.0)]) == 0.0);
        assert!(largest(&vegetation.speed_mps[row(10.0)..row(13.0)]) > 0.1);
        let odometer = of("odom_scale");
        assert!(largest(&odometer.distance_m) == 0.0 && largest(&odometer.speed_mps) > 0.05);
        let gyroscope = of("gyro_bias").yaw_rate_radps;
        assert!(gyroscope.iter().all(|value| (value - gyroscope[0]).abs() < 1e-12 && *value != 0.0));
    }
}
