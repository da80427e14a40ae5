//! Speed controllers against closed forms.
#![allow(clippy::unwrap_used, reason = "a test that cannot be set up has failed")]

use bicycle::lanes::{Real, Scalar};
use bicycle::{Command, Effect, GroundSample, Limits, Model, State, Stepper};

const STEP_S: f64 = 0.02;
const SPEED_MPS: f64 = 2.0;

fn effect(id: &str, value: f64) -> Effect {
    Effect::from_values(id, [value, 0.0, 0.0, 0.0]).unwrap()
}

fn stepper(effects: &[(&str, f64)]) -> Stepper {
    stepper_of(effects.iter().map(|&(id, value)| effect(id, value)).collect())
}

fn stepper_of(effects: Vec<Effect>) -> Stepper {
    let limits = Limits {
        speed_max_mps: 5.0,
        reverse_speed_max_mps: 1.0,
        steering_max_rad: 0.5,
        steering_rate_max_radps: 1.0,
        acceleration_max_mps2: 2.0,
        lateral_acceleration_max_mps2: 3.0,
        roll_max_rad: 0.5,
        pitch_max_rad: 0.5,
    };
    Stepper::new(&Model { wheelbase_m: 2.0, limits, effects }, STEP_S, 1.0).with_instant_actuators()
}

/// Speeds after every step of a drive with one command, from `speed_mps`; what is held at its end.
fn speeds(stepper: &Stepper, speed_mps: f64, n: usize) -> (Vec<f64>, Vec<f64>) {
    let command = Command { speed_mps: SPEED_MPS as f32, steering_rad: 0.0 };
    let mut memory = vec![0.0; stepper.n_slots()];
    stepper.fill_steady_state(Command { speed_mps: speed_mps as f32, ..command }, &mut memory);
    let mut state = State { speed_mps, ..State::default() };
    let mut step = |t| {
        state = stepper.step_state(&state, command, &GroundSample::FIRM, &mut memory, t);
        state.speed_mps
    };
    let speeds = (0..n).map(&mut step).collect();
    (speeds, stepper.held(&mut memory).to_vec())
}

/// Speed at the end of a long drive up a slope, from and to [`SPEED_MPS`].
fn speed_uphill_mps(effects: &[(&str, f64)], slope: f64) -> f64 {
    let stepper = stepper(effects);
    let command = Command { speed_mps: SPEED_MPS as f32, steering_rad: 0.0 };
    let ground = GroundSample { gradient: [slope, 0.0], ..GroundSample::FIRM };
    let mut memory = vec![0.0; stepper.n_slots()];
    stepper.fill_steady_state(command, &mut memory);
    let mut state = State { speed_mps: SPEED_MPS, ..State::default() };
    (0..1000).for_each(|t| state = stepper.step_state(&state, command, &ground, &mut memory, t));
    state.speed_mps
}

/// A loop of time constant T that pushes against the share C of gravity holds (e / T + C g s) / M = g s on a slope s with a
/// mass ratio of M: e = (M - C) g s T, T being the discrete one of the drag's test. What is lost of C counts as less of it.
#[test]
fn hill_compensation_leaves_what_it_does_not_push_against() {
    let slope = 0.05;
    let per_share_mps = 9.80665 * slope * STEP_S / (1.0 - (-STEP_S / 0.4).exp());
    let with = |more: &[(&str, f64)]| {
        let loop_ = [("speed_loop", 0.4), ("hill_compensation", 0.6)];
        let after = [("slope_gravity", 1.0)];
        SPEED_MPS - speed_uphill_mps(&[&loop_, more, &after].concat(), slope)
    };
    for (more, share) in [
        (&[][..], 1.0 - 0.6),
        (&[("mass", 1.5)], 1.5 - 0.6),
        (&[("compensation_loss", 0.2)], 1.0 - 0.6 + 0.2),
    ] {
        let behind_mps = with(more);
        assert!((behind_mps - share * per_share_mps).abs() < 1e-6, "{more:?}: {behind_mps}");
    }
}

/// Against a drag D a drive of power P comes to P / D, however fast it is asked to go.
#[test]
fn power_bounds_the_speed_under_drag() {
    let (speeds, _) = speeds(
        &stepper(&[("speed_loop", 0.1), ("drive_power", 0.6), ("rolling_drag", 0.5)]),
        SPEED_MPS,
        2000,
    );
    assert!((speeds[1999] - 0.6 / 0.5).abs() < 1e-3, "{}", speeds[1999]);
}

/// A drag D leaves a loop that closes the share 1 - exp(-dt / T) of its distance every step D dt over that share behind its
/// command, about D T.
#[test]
fn a_proportional_loop_droops_under_drag() {
    let (speeds, held) = speeds(&stepper(&[("speed_loop", 0.4), ("rolling_drag", 0.5)]), SPEED_MPS, 500);
    let behind_mps = 0.5 * STEP_S / (1.0 - (-STEP_S / 0.4).exp());
    assert!((SPEED_MPS - speeds[499] - behind_mps).abs() < 1e-9, "{}", speeds[499]);
    assert!(held.is_empty());
}

/// With an integral the error obeys e'' + e' / T + J e = 0; at T = 0.4 s and J = 1.5 / s2 its roots are -1 and -1.5 / s, so
/// that a drag D that sets in leaves e = -D (exp(-t) - exp(-1.5 t)) / 0.5, and in the end the integral holds D.
#[test]
fn an_integral_takes_a_drag_back() {
    let controlled = stepper(&[("speed_loop", 0.4), ("speed_integral", 1.5), ("rolling_drag", 0.5)]);
    let (speeds, held) = speeds(&controlled, SPEED_MPS, 1000);
    for (step, speed_mps) in speeds.iter().enumerate() {
        let t = (step + 1) as f64 * STEP_S;
        let error_mps = -0.5 * ((-t).exp() - (-1.5 * t).exp()) / 0.5;
        assert!((speed_mps - SPEED_MPS - error_mps).abs() < 0.006, "{t} s: {speed_mps} {error_mps}");
    }
    assert!((held[0] - 0.5).abs() < 1e-3, "{held:?}");
}

/// Asked for 20 m/s with a drive that gives 1 m/s2, the loop wants more than that throughout: the speed after 3 s is that of
/// the limit, and nothing is built up. Wound up, the integral would hold 1.5 times the mean distance of 18.5 m/s times 3 s.
#[test]
fn an_integral_waits_while_the_drive_gives_less_than_it_asks_for() {
    let limited = stepper(&[("speed_loop", 0.4), ("speed_integral", 1.5), ("drive_limit", 1.0)]);
    let command = Command { speed_mps: 20.0, steering_rad: 0.0 };
    let mut memory = vec![0.0; limited.n_slots()];
    let mut state = State::default();
    let mut reached = |n: usize, memory: &mut [f64]| {
        (0..n).for_each(|t| state = limited.step_state(&state, command, &GroundSample::FIRM, memory, t));
        state.speed_mps
    };
    assert!((reached(150, &mut memory) - 3.0).abs() < 1e-9);
    assert_eq!(limited.held(&mut memory)[0], 0.0);
}

/// Held against a drag D the drive gives D, with which wheels of slip S read v (1 + S D): the loop holds these as far behind
/// the command as without slip the vehicle.
#[test]
fn a_loop_that_reads_slipping_wheels_holds_the_wheels() {
    let slip = Effect::from_values("wheel_slip", [0.1, 0.3, 0.0, 0.0]).unwrap();
    let controlled = stepper_of(vec![slip, effect("speed_loop", 0.4), effect("rolling_drag", 0.5)]);
    let (speeds, held) = speeds(&controlled, SPEED_MPS, 1000);
    let behind_mps = 0.5 * STEP_S / (1.0 - (-STEP_S / 0.4).exp());
    let expected_mps = (SPEED_MPS - behind_mps) / (1.0 + 0.1 * 0.5);
    assert!((speeds[999] - expected_mps).abs() < 1e-9, "{}", speeds[999]);
    assert!((held[0] - 0.5).abs() < 1e-9, "{held:?}");
}

/// On a slope that begins at once what is felt of it is 1 - exp(-t / T).
#[test]
fn a_slope_is_felt_late() {
    let late = Effect::from_values("felt_slope", [0.6, 0.5, 0.0, 0.0]).unwrap();
    let controlled = stepper_of(vec![effect("speed_loop", 0.4), late]);
    let command = Command { speed_mps: SPEED_MPS as f32, steering_rad: 0.0 };
    let ground = GroundSample { gradient: [0.05, 0.0], ..GroundSample::FIRM };
    let mut memory = vec![0.0; controlled.n_slots()];
    let mut state = State { speed_mps: SPEED_MPS, ..State::default() };
    for step in 1..=100 {
        state = controlled.step_state(&state, command, &ground, &mut memory, step - 1);
        let felt = 1.0 - (-(step as f64) * STEP_S / 0.5).exp();
        let held = controlled.held(&mut memory)[0];
        assert!((held - 0.6 * 9.80665 * 0.05 * felt).abs() < 1e-9, "{step}: {held}");
    }
}

/// A reference grows by A and falls by B a second, forwards and, being one of speed, backwards.
#[test]
fn ramps_are_one_up_and_one_down() {
    let ramps = Effect::from_values("speed_ramp", [0.5, 0.8, 0.0, 0.0]).unwrap();
    let after_1_s = |from_mps: f64, to_mps: f64| {
        let stepper = stepper_of(vec![ramps]);
        let mut memory = vec![0.0; stepper.n_slots()];
        let command = |speed_mps: f64| Command { speed_mps: speed_mps as f32, steering_rad: 0.0 };
        stepper.fill_steady_state(command(from_mps), &mut memory);
        let mut state = State { speed_mps: from_mps, ..State::default() };
        for step in 0..50 {
            state = stepper.step_state(&state, command(to_mps), &GroundSample::FIRM, &mut memory, step);
        }
        memory[0]
    };
    for (from_mps, to_mps, expected_mps) in
        [(1.0, 3.0, 1.5), (3.0, 1.0, 2.2), (-0.2, -1.0, -0.7), (-1.0, 0.0, -0.2), (0.0, 2.0, 0.5)]
    {
        let reached_mps = after_1_s(from_mps, to_mps);
        assert!((reached_mps - expected_mps).abs() < 1e-5, "{from_mps} to {to_mps}: {reached_mps}");
    }
}

/// Behind a ramp of A a loop of time constant T lags by A T; the whole of the command's acceleration fed forward leaves
/// nothing of that, half of it the half.
#[test]
fn feed_forward_takes_the_lag_behind_a_ramp() {
    for (share, lag_mps) in [(0.0, 0.2), (0.5, 0.1), (1.0, 0.0)] {
        let controlled = stepper(&[("accel_limit", 0.5), ("speed_loop", 0.4), ("feed_forward", share)]);
        let (speeds, _) = speeds(&controlled, 0.0, 150);
        let ramped_mps = 0.5 * 150.0 * STEP_S;
        assert!((ramped_mps - speeds[149] - lag_mps).abs() < 0.006, "{share}: {}", speeds[149]);
    }
}

/// A speed that stays where it is although 1 m/s2 is held: what is held falls by the share sqrt(J) dt / 4 every step.
#[test]
fn what_is_held_follows_what_was_measured() {
    let controlled = stepper(&[("speed_loop", 0.4), ("speed_integral", 1.5)]);
    let command = Command { speed_mps: SPEED_MPS as f32, steering_rad: 0.0 };
    let state = State { speed_mps: SPEED_MPS, ..State::default() };
    let mut memory = vec![0.0; controlled.n_slots()];
    controlled.held(&mut memory)[0] = 1.0;
    for step in 1..=50 {
        let foretold = controlled.step_state(&state, command, &GroundSample::FIRM, &mut memory, step);
        controlled.correct_held(&mut memory, Real(Scalar, SPEED_MPS - foretold.speed_mps));
        let expected_mps2 = (1.0 - 1.5_f64.sqrt() * STEP_S / 4.0).powi(step as i32);
        assert!((controlled.held(&mut memory)[0] - expected_mps2).abs() < 1e-9);
    }
}

/// A motor with the time constant T behind a loop with the time constant P: the error obeys T e'' + e' + e / P = 0. At
/// T = 0.1 s and P = 0.625 s its roots are -2 and -8 / s, so that a step of the command leaves
/// e = (8 exp(-2 t) - 2 exp(-8 t)) / 6 of itself.
#[test]
fn a_slow_motor_makes_the_loop_one_of_second_order() {
    let controlled = stepper(&[("speed_loop", 0.625), ("drive_lag", 0.1)]);
    let (speeds, _) = speeds(&controlled, 0.0, 150);
    for (step, speed_mps) in speeds.iter().enumerate() {
        let t = (step + 1) as f64 * STEP_S;
        let left = (8.0 * (-2.0 * t).exp() - 2.0 * (-8.0 * t).exp()) / 6.0;
        assert!((speed_mps - SPEED_MPS * (1.0 - left)).abs() < 0.02, "{t} s: {speed_mps}");
    }
}
