//! Steering that has inertia, bends the body or turns the rear wheels, against closed forms.

use super::*;

const ASKED_RAD: f64 = 0.5;

/// A servo of second order with W = 2 Z / T after a step: 1 - x is exp(-W t) (1 + W t) at Z = 1, below it
/// exp(-Z W t) (cos(w t) + Z W / w sin(w t)) with w = W sqrt(1 - Z^2), and at Z = 1.25 (4 exp(-W t / 2) - exp(-2 W t)) / 3.
#[test]
fn a_servo_rings_as_its_damping_says() {
    let left = |damping: f64, t: f64| {
        let natural = 2.0 * damping / 0.3;
        let phase = natural * t * (1.0 - damping * damping).abs().sqrt();
        match damping {
            1.0 => (-natural * t).exp() * (1.0 + natural * t),
            1.25 => (4.0 * (-natural * t / 2.0).exp() - (-2.0 * natural * t).exp()) / 3.0,
            _ => {
                let ring = damping / (1.0 - damping * damping).sqrt() * phase.sin();
                (-damping * natural * t).exp() * (phase.cos() + ring)
            }
        }
    };
    for damping in [0.5, 0.8, 1.0, 1.25] {
        let servo = effect_of("steer_servo", &[0.3, damping]);
        let states = run(vec![servo], State::default(), command(0.0, ASKED_RAD as f32), 20);
        for (step, state) in states.iter().enumerate() {
            let expected_rad = ASKED_RAD * (1.0 - left(damping, step as f64 * STEP_S));
            assert!(
                (state.steering_rad - expected_rad).abs() < 1e-6,
                "{damping} {step}: {}",
                state.steering_rad
            );
        }
    }
}

/// Far from the command a servo turns at its limit, whatever its inertia, and comes to rest at the command without the lag
/// that a ramp before a servo adds; without a limit it is [`a_servo_rings_as_its_damping_says`]'s but for what steps of a
/// quarter leave.
#[test]
fn a_limited_servo_turns_no_faster_than_its_limit() {
    let limited = effect_of("limited_servo", &[0.1, 1.0, 0.4]);
    let states = run(vec![limited], State::default(), command(0.0, ASKED_RAD as f32), 40);
    let steps = states.windows(2).map(|pair| (pair[1].steering_rad - pair[0].steering_rad) / STEP_S);
    let rates: Vec<f64> = steps.collect();
    assert!(rates.iter().all(|rate| *rate <= 0.4 + 1e-6), "{rates:?}");
    assert!(rates[1..8].iter().all(|rate| (rate - 0.4).abs() < 1e-6), "{rates:?}");
    assert!((states[40].steering_rad - ASKED_RAD).abs() < 1e-3, "{}", states[40].steering_rad);
    let at = |id: &str, values: &[f64]| {
        run(vec![effect_of(id, values)], State::default(), command(0.0, ASKED_RAD as f32), 20)
    };
    let pairs = at("limited_servo", &[0.3, 0.8, 1e6]).into_iter().zip(at("steer_servo", &[0.3, 0.8]));
    for (limited, exact) in pairs {
        assert!((limited.steering_rad - exact.steering_rad).abs() < 0.03, "{limited:?} {exact:?}");
    }
}

/// Yaw rate v tan(0.2) / L = w in a curve of lateral acceleration v w: with C = -0.04 at 2 m/s2 and Q = 0.02 it is
/// 0.92 w / (1 + 0.02 (v w)^2).
#[test]
fn load_changes_the_turning() {
    let effects = |values: &[f64]| vec![effect("speed_loop", 0.0), effect_of("yaw_load", values)];
    let start = State { speed_mps: 3.0, ..State::default() };
    let turned =
        |values: &[f64], to_mps: f64| run(effects(values), start, command(to_mps as f32, 0.2), 1)[1].yaw_rad;
    let to_mps = 3.0 + 2.0 * STEP_S;
    let plain_radps = turned(&[0.0, 0.0], to_mps) / STEP_S;
    let expected = 0.92 * plain_radps / (1.0 + 0.02 * (to_mps * plain_radps).powi(2));
    let found = turned(&[-0.04, 0.02], to_mps) / STEP_S;
    assert!((found - expected).abs() < 1e-5, "{found} {expected}");
}

/// Steering that grows by 0.5 rad/s in a body that swings by 0.4 m at 2 m/s stands 0.5 * 0.4 / 2 = 0.1 rad further on,
/// 0.1 rad less far where the way is one of tyres.
#[test]
fn a_swing_leads_by_its_way() {
    for (lead_m, ahead_rad) in [(0.4, 0.1), (-0.4, -0.1)] {
        let effects = vec![effect("steer_rate", 0.5), effect("steer_swing", lead_m)];
        let start = State { speed_mps: 2.0, ..State::default() };
        let states = run(effects, start, command(2.0, 0.5), 8);
        // The ramp stands half a step behind its end.
        let expected_rad = 0.5 * (8.0 - 0.5) * STEP_S + ahead_rad;
        assert!((states[8].steering_rad - expected_rad).abs() < 1e-6, "{lead_m}: {}", states[8].steering_rad);
    }
}

/// Rear wheels at 0.3 of the front ones' tangent, against them: in a step the rear axle moves by -0.3 tan(0.2) v dt across
/// its heading.
#[test]
fn steered_rear_wheels_move_the_rear_axle_sideways() {
    let one_step = |effects| run(effects, State::default(), command(1.5, 0.2), 1)[1];
    let (plain, steered) = (one_step(vec![]), one_step(vec![effect("rear_steer", 0.3)]));
    let sideways_m = -0.3 * 0.2_f64.tan() * 1.5 * STEP_S;
    assert!((steered.y_m - plain.y_m - sideways_m).abs() < 1e-6, "{} {}", steered.y_m, plain.y_m);
    assert_eq!(steered.yaw_rad, plain.yaw_rad);
}
