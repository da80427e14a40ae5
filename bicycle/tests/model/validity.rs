//! Models that are refused, and those that are not step finite.

use super::*;
use bicycle::LaneState;
use bicycle::lanes::{Lanes, Portable, Real, Scalar};
use rand::{RngExt, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;

#[test]
fn impossible_models_are_refused_with_field_and_value() {
    let refused = |change: &dyn Fn(&mut Model)| {
        let mut model = model(vec![]);
        change(&mut model);
        model.validate().unwrap_err().to_string()
    };
    assert_eq!(model(vec![]).validate(), Ok(()));
    let message = refused(&|model| model.wheelbase_m = 0.0);
    assert_eq!(message, "wheelbase_m: expected a finite number > 0, found 0");
    assert!(refused(&|model| model.limits.speed_max_mps = f64::NAN).starts_with("limits.speed_max_mps"));
    assert!(refused(&|model| model.limits.steering_max_rad = 1.0).contains("0.8"));
    let message = refused(&|model| model.wheelbase_m = 1e-9);
    assert_eq!(message, "wheelbase_m: expected a length from 0.01 to 100 m, found 0.000000001");
    let message = refused(&|model| model.limits.speed_max_mps = 1e9);
    assert_eq!(message, "limits.speed_max_mps: expected a speed of at most 200 m/s, found 1000000000");
    let message = refused(&|model| model.effects = vec![effect("steer_lag", -1.0)]);
    assert_eq!(message, "effect steer_lag: time_constant_s: expected 0 to 2 s, found -1");
}

#[test]
fn ids_are_unique_and_known() {
    for (index, description) in CATALOGUE.iter().enumerate() {
        assert!(CATALOGUE[..index].iter().all(|other| other.id != description.id));
        assert!(Effect::from_values(description.id, [0.0; 4]).is_some());
    }
    assert_eq!(Effect::from_values("flat_tyre", [0.0; 4]), None);
}

/// 1 + K v^2 is 0 at 10 m/s for K = -0.01: at a limit of 9 m/s the yaw rate would be five times the kinematic one, at
/// 9 m/s that a speed scale makes 10 of it, infinite.
#[test]
fn understeer_that_divides_by_zero_within_the_limits_is_refused() {
    for id in ["understeer", "steer_yield"] {
        let told = |speed_max_mps: f64, effects: Vec<Effect>| {
            let mut model = model(effects);
            model.limits.speed_max_mps = speed_max_mps;
            model.validate().map_err(|error| error.to_string())
        };
        assert_eq!(told(8.9, vec![effect(id, -0.01)]), Ok(()));
        let found = told(10.0, vec![effect(id, -0.01)]).unwrap_err();
        let expected = format!("effect {id}: gradient_s2_per_m2: expected -0.008 to 1 s2/m2, found -0.01");
        assert_eq!(found, format!("{expected}, for speeds of up to 10 m/s"));
        let scaled = vec![effect("speed_scale", 1.25), effect(id, -0.01)];
        assert!(told(8.0, scaled).unwrap_err().ends_with("for speeds of up to 10 m/s"));
    }
}

/// Downhill a vehicle exceeds its limit of speed: for K = -0.0079, 1 + K v^2 goes through zero at 11.25 m/s. It turns in
/// the same direction there, at most five times as fast as the kinematic bicycle.
#[test]
fn understeer_beyond_the_limit_of_speed_stays_away_from_zero() {
    let real = |value: f64| Real(Scalar, value);
    for id in ["understeer", "steer_yield"] {
        let mut model = model(vec![effect(id, -0.0079)]);
        model.limits.speed_max_mps = 10.0;
        assert_eq!(model.validate(), Ok(()));
        let stepper = Stepper::new(&model, STEP_S, 1.0);
        for speed_mps in (0..4000).map(|k| 0.01 * f64::from(k)) {
            let [zero, speed, steering] = [0.0, speed_mps, 0.1].map(real);
            let mut state = LaneState { x: zero, y: zero, turns: zero, speed, steering };
            let ground = GroundSample {
                linear_traction: real(1.0),
                angular_traction: real(1.0),
                gradient: [zero; 2],
                class: zero,
            };
            let rates = stepper.step(&mut state, [speed, steering], &ground, &mut [], 0);
            let kinematic_radps = speed_mps * 0.1_f64.tan() / WHEELBASE_M;
            let bounds = kinematic_radps - 1e-9..=5.0 * kinematic_radps + 1e-9;
            assert!(bounds.contains(&rates.yaw_rate.1), "{id} at {speed_mps} m/s: {}", rates.yaw_rate.1);
        }
    }
}

/// A model of up to four effects of the catalogue with any parameters that it allows, limits that vehicles have.
fn any_model(random: &mut Xoshiro256PlusPlus) -> Model {
    let mut uniform = |low: f64, high: f64| low + (high - low) * random.random_range(0.0..=1.0);
    let effects = (0..4)
        .map(|_| {
            let place = uniform(0.0, CATALOGUE.len() as f64) as usize;
            let description = &CATALOGUE[place.min(CATALOGUE.len() - 1)];
            let mut values = [0.0; 4];
            for (value, parameter) in values.iter_mut().zip(description.parameters) {
                // The bounds themselves as often as what lies between.
                let share = uniform(-0.5, 1.5).clamp(0.0, 1.0);
                *value = parameter.low + share * (parameter.high - parameter.low);
            }
            Effect::from_values(description.id, values).unwrap()
        })
        .collect();
    let mut model = model(effects);
    model.wheelbase_m = uniform(0.1, 5.0);
    model.limits.speed_max_mps = uniform(0.1, 40.0);
    model.limits.reverse_speed_max_mps = uniform(0.0, 10.0);
    model.limits.steering_max_rad = uniform(0.05, 0.8);
    model.limits.acceleration_max_mps2 = uniform(0.1, 20.0);
    model
}

/// Whatever model passes, every step of it from any state within the limits is finite, in f64 and on every instruction
/// set: five seconds of commands within the limits, on ground that slopes and drags.
#[test]
fn a_model_that_validates_steps_finite() {
    any_models(Scalar, |value| vec![value as f32]);
    any_models(Portable, |value| value.to_vec());
    #[cfg(target_arch = "x86_64")]
    {
        use pulp::cast;
        if let Some(v3) = pulp::x86::V3::try_new() {
            any_models(v3, |value| cast::<_, [f32; 8]>(value).to_vec());
        }
        if let Some(v4) = pulp::x86::V4::try_new() {
            any_models(v4, |value| cast::<_, [f32; 16]>(value).to_vec());
        }
    }
    #[cfg(target_arch = "aarch64")]
    if let Some(neon) = pulp::aarch64::Neon::try_new() {
        any_models(neon, |value| pulp::cast::<_, [f32; 8]>(value).to_vec());
    }
}

fn any_models<L: Lanes>(lanes: L, unpack: impl Fn(L::Value) -> Vec<f32>) {
    let mut random = Xoshiro256PlusPlus::seed_from_u64(23);
    let (mut n_valid, mut n_refused) = (0, 0);
    for _ in 0..4000 {
        let model = any_model(&mut random);
        if model.validate().is_err() {
            n_refused += 1;
            continue;
        }
        n_valid += 1;
        let limits = model.limits;
        let stepper = Stepper::new(&model, STEP_S, 1.0);
        let mut memory = vec![lanes.real(0.0).1; stepper.n_slots()];
        // At the limits more often than not: there lie the poles.
        let mut of =
            |low: f64, high: f64| lanes.real(random.random_range(low - 1.0..=high + 1.0).clamp(low, high));
        let speeds = (-limits.reverse_speed_max_mps, limits.speed_max_mps);
        let angles = (-limits.steering_max_rad, limits.steering_max_rad);
        let mut state = LaneState {
            x: lanes.real(0.0),
            y: lanes.real(0.0),
            turns: of(-0.5, 0.5),
            speed: of(speeds.0, speeds.1),
            steering: of(angles.0, angles.1),
        };
        for t in 0..50 {
            let command = [of(speeds.0, speeds.1), of(angles.0, angles.1)];
            let ground = GroundSample {
                linear_traction: of(0.0, 1.0),
                angular_traction: of(0.0, 1.0),
                gradient: [of(-0.5, 0.5), of(-0.5, 0.5)],
                class: of(0.0, 3.0),
            };
            let rates = stepper.step(&mut state, command, &ground, &mut memory, t);
            let LaneState { x, y, turns, speed, steering } = state;
            for value in [x, y, turns, speed, steering, rates.speed, rates.yaw_rate] {
                assert!(unpack(value.1).iter().all(|value| value.is_finite()), "step {t} of {model:?}");
            }
        }
    }
    assert!(n_valid > 2000 && n_refused > 50, "{n_valid} valid, {n_refused} refused");
}
