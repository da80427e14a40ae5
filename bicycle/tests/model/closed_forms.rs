//! Motions with closed forms.

use super::*;
use proptest::prelude::*;

proptest! {
    /// PIETRA, equation 2, written out.
    #[test]
    fn a_step_is_equation_two(
        x in -50.0..50.0f64, y in -50.0..50.0f64, yaw in -3.0..3.0f64,
        v in -2.0..5.0f32, delta in -0.6..0.6f32, psi1 in 0.0..1.0f64, psi2 in 0.0..1.0f64,
    ) {
        let stepper = Stepper::new(&model(vec![]), STEP_S, 1.0).with_instant_actuators();
        let start = State { x_m: x, y_m: y, yaw_rad: yaw, ..State::default() };
        let ground = GroundSample { linear_traction: psi1, angular_traction: psi2, ..GroundSample::FIRM };
        let end = stepper.step_state(&start, command(v, delta), &ground, &mut [], 0);
        let (v, delta) = (f64::from(v), f64::from(delta));
        prop_assert!((end.x_m - (x + STEP_S * psi1 * v * yaw.cos())).abs() < 1e-12);
        prop_assert!((end.y_m - (y + STEP_S * psi1 * v * yaw.sin())).abs() < 1e-12);
        let turned = yaw + STEP_S * psi2 * v * delta.tan() / WHEELBASE_M;
        prop_assert!((end.yaw_rad - turned).sin().abs() < 1e-12 && (end.yaw_rad - turned).cos() > 0.0);
    }
}

/// At constant steering the corners of the track lie on a circle; its radius is that of a regular polygon with side
/// v dt and outer angle v dt tan(delta) / L.
#[test]
fn constant_steering_drives_a_circle() {
    let (v, delta) = (1.5f32, 0.3f32);
    let states = run(vec![], State::default(), command(v, delta), 400);
    let angle = f64::from(v) * STEP_S * f64::from(delta).tan() / WHEELBASE_M;
    let radius_m = f64::from(v) * STEP_S / (2.0 * (angle / 2.0).sin());
    // The first side points east; the centre lies across it, half an outer angle ahead.
    let centre = [radius_m * (angle / 2.0).sin(), radius_m * (angle / 2.0).cos()];
    for state in &states {
        let distance_m = (state.x_m - centre[0]).hypot(state.y_m - centre[1]);
        assert!((distance_m - radius_m).abs() < 1e-9, "{distance_m} {radius_m}");
    }
}

#[test]
fn actuators_keep_their_limits() {
    let stepper = Stepper::new(&model(vec![]), STEP_S, 1.0);
    let mut state = State::default();
    for t in 0..10 {
        state = stepper.step_state(&state, command(5.0, 0.6), &GroundSample::FIRM, &mut [], t);
        let n = (t + 1) as f64;
        // 2 m/s2 and 1 rad/s, until 0.6 rad are reached.
        assert!((state.speed_mps - 0.2 * n).abs() < 1e-6);
        assert!((state.steering_rad - (0.1 * n).min(0.6)).abs() < 1e-6);
    }
}

/// Two lags of T / 2 in series answer a step by 1 - (1 + 2 t / T) exp(-2 t / T). What passes between them is the mean of a step,
/// which is off by some (dt / T)^2 = 0.001 of it.
#[test]
fn a_chain_of_lags_begins_without_a_slope() {
    let states = run(vec![effect("speed_lag_chain", 3.0)], State::default(), command(2.0, 0.0), 40);
    for (step, state) in states.iter().enumerate().skip(1) {
        let halves = (step as f64 - 0.5) * STEP_S / 1.5;
        let expected = 2.0 * (1.0 - (1.0 + halves) * (-halves).exp());
        assert!((state.speed_mps - expected).abs() < 0.003, "{step}: {} {expected}", state.speed_mps);
    }
}

#[test]
fn a_lag_closes_exponentially() {
    let states = run(vec![effect("speed_lag", 0.4)], State::default(), command(2.0, 0.0), 20);
    for (t, state) in states.iter().enumerate() {
        // The mean over the step that led here: 2 (1 - (T / dt) (exp(-(t - dt) / T) - exp(-t / T))).
        let decayed = |step: usize| (-(step as f64) * STEP_S / 0.4).exp();
        let expected = if t == 0 { 0.0 } else { 2.0 * (1.0 - 0.4 / STEP_S * (decayed(t - 1) - decayed(t))) };
        assert!((state.speed_mps - expected).abs() < 1e-9);
    }
    let states = run(vec![effect("steer_lag", 0.4)], State::default(), command(0.0, 0.5), 20);
    let mean = 0.4 / STEP_S * ((-0.75f64).exp() - (-1.0f64).exp());
    assert!((states[4].steering_rad - 0.5 * (1.0 - mean)).abs() < 1e-9);
}

/// A linkage behind a servo of 0.5 rad/s: the wheels turn G times as fast and as far, to v tan(G angle) / L.
#[test]
fn a_linkage_multiplies_what_the_servo_does() {
    for ratio in [0.7, 1.25] {
        let effects = vec![effect("steer_rate", 0.5), effect("steer_linkage", ratio)];
        let states = run(effects, State::default(), command(1.0, 0.4), 20);
        let yaw_rate = |t: usize| (states[t + 1].yaw_rad - states[t].yaw_rad) / STEP_S;
        // Half way on the ramp the servo stands at 0.5 rad/s (3.5 steps), at its end at 0.4 rad.
        for (t, angle_rad) in [(3, 0.5 * 3.5 * STEP_S), (19, 0.4)] {
            let expected_radps = (ratio * angle_rad).tan() / WHEELBASE_M;
            assert!((yaw_rate(t) / expected_radps - 1.0).abs() < 3e-3, "{ratio} {t}: {}", yaw_rate(t));
        }
    }
}

/// At v = 2 m/s tyres of C = 0.1 s2/m answer the steering with a time constant of 0.2 s, in implicit steps of dt:
/// 1 - (1 + dt / (C v))^-n of the yaw rate v tan(steering) / L after n of them. In the end they slip by C v yaw_rate to the
/// outside of the curve.
#[test]
fn tyres_that_slip_answer_late_and_give_way() {
    let (speed_mps, compliance_s2_per_m) = (2.0, 0.1);
    let command = command(2.0, 0.01);
    let state = State { speed_mps, ..State::default() };
    let effects = vec![effect("tyre_slip", compliance_s2_per_m)];
    let states = run(effects, state, command, 60);
    let yaw_rate = |t: usize| (states[t + 1].yaw_rad - states[t].yaw_rad) / STEP_S;
    let whole_radps = speed_mps * f64::from(command.steering_rad).tan() / WHEELBASE_M;
    let per_step = 1.0 + STEP_S / (compliance_s2_per_m * speed_mps);
    for n in [1, 3, 6] {
        let expected_radps = whole_radps * (1.0 - per_step.powi(-n));
        assert!(
            (yaw_rate(n as usize - 1) / expected_radps - 1.0).abs() < 1e-3,
            "{n}: {}",
            yaw_rate(n as usize - 1)
        );
    }
    let [before, after] = [&states[58], &states[59]];
    let (sine, cosine) = before.yaw_rad.sin_cos();
    let sideways_m = (after.y_m - before.y_m) * cosine - (after.x_m - before.x_m) * sine;
    let expected_mps = -compliance_s2_per_m * speed_mps * speed_mps * whole_radps;
    assert!((sideways_m / STEP_S / expected_mps - 1.0).abs() < 1e-3, "{}", sideways_m / STEP_S);
}

/// Standing still before, a delay D shortens the way at constant speed by v D, whole number of steps or not.
#[test]
fn a_delay_shortens_the_way_by_its_length() {
    for delay_s in [0.0, 0.05, 0.1, 0.23, 0.4] {
        let states = run(vec![effect("speed_delay", delay_s)], State::default(), command(2.0, 0.0), 30);
        let expected_m = 2.0 * (3.0 - delay_s);
        assert!((states[30].x_m - expected_m).abs() < 1e-9, "{delay_s}: {}", states[30].x_m);
    }
}

/// What was commanded before the start still comes out of the line, oldest first.
#[test]
fn a_delay_remembers_what_was_sent_before() {
    let stepper =
        Stepper::new(&model(vec![effect("speed_delay", 0.2)]), STEP_S, 1.0).with_instant_actuators();
    let mut memory = vec![0.0; stepper.n_slots()];
    // 1 m/s until 0.1 s before the start, 3 m/s since.
    let past = |age_s: f64| if age_s > 0.1 { command(1.0, 0.0) } else { command(3.0, 0.0) };
    stepper.recall(&past, &mut memory);
    let mut state = State::default();
    let mut speeds = Vec::new();
    for t in 0..4 {
        state = stepper.step_state(&state, command(0.0, 0.0), &GroundSample::FIRM, &mut memory, t);
        speeds.push(state.speed_mps);
    }
    assert_eq!(speeds, [1.0, 3.0, 0.0, 0.0]);
}

#[test]
fn static_effects_have_their_closed_forms() {
    let turned = |effects: Vec<Effect>| run(effects, State::default(), command(2.0, 0.2), 1)[1].yaw_rad;
    let rate = |delta: f64| 2.0 * delta.tan() / WHEELBASE_M * STEP_S;
    let delta = f64::from(0.2f32);
    assert!((turned(vec![effect("steer_gain", 1.2)]) - rate(1.2 * delta)).abs() < 1e-12);
    assert!((turned(vec![effect("steer_bias", -0.05)]) - rate(delta - 0.05)).abs() < 1e-12);
    // 1 + 0.1 x 2^2 = 1.4.
    assert!((turned(vec![effect("understeer", 0.1)]) - rate(delta) / 1.4).abs() < 1e-12);
    assert!((turned(vec![effect("speed_scale", 0.9)]) - 0.9 * rate(delta)).abs() < 1e-12);
    let both = vec![effect("speed_scale", 0.9), effect("steer_gain", 1.2)];
    assert!((turned(both) - 0.9 * rate(1.2 * delta)).abs() < 1e-12);
    let ahead = run(vec![effect("speed_scale", 0.9)], State::default(), command(2.0, 0.0), 10);
    assert!((ahead[10].x_m - 1.8).abs() < 1e-12);
}

#[test]
fn effects_act_in_the_order_in_which_they_are_listed() {
    let steered = |ids: [(&str, f64); 2]| {
        let effects = ids.map(|(id, value)| effect(id, value)).to_vec();
        run(effects, State::default(), command(1.0, 0.2), 2)[2].steering_rad
    };
    let (bias, gain) = (("steer_bias", 0.05), ("steer_gain", 1.3));
    // (0.2 + 0.05) 1.3 = 0.325 and 0.2 x 1.3 + 0.05 = 0.31.
    assert!((steered([bias, gain]) - 0.325).abs() < 1e-7);
    assert!((steered([gain, bias]) - 0.31).abs() < 1e-7);
}

#[test]
fn a_neutral_effect_changes_nothing() {
    let plain = run(vec![], State::default(), command(1.7, 0.25), 30);
    for description in CATALOGUE {
        let mut values = [0.0; 4];
        for (value, parameter) in values.iter_mut().zip(description.parameters) {
            *value = parameter.neutral;
        }
        let neutral = Effect::from_values(description.id, values).unwrap();
        assert_eq!(neutral.validate(), Ok(()));
        assert_eq!(neutral.values(), values);
        for (a, b) in run(vec![neutral], State::default(), command(1.7, 0.25), 30).iter().zip(&plain) {
            let difference = (a.x_m - b.x_m).abs() + (a.y_m - b.y_m).abs() + (a.yaw_rad - b.yaw_rad).abs();
            // No limit is infinite: the largest still take a few parts in a million.
            assert!(difference < 1e-5, "{}", description.id);
        }
    }
}
