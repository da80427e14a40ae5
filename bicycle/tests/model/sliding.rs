//! Tyres that slide against closed forms of rigid bodies on Coulomb friction.

use super::*;

const GRAVITY_MPS2: f64 = 9.80665;
/// Steps so short that what they leave out does not show.
const SHORT_S: f64 = 0.005;

/// Drives a vehicle that begins with a speed to the left [m/s] and a yaw rate [rad/s].
fn slide(grip: f64, start: State, motion: [f64; 2], command: Command, n: usize) -> Vec<State> {
    let stepper =
        Stepper::new(&model(vec![effect("tyre_slide", grip)]), SHORT_S, 1.0).with_instant_actuators();
    let mut memory = vec![0.0; stepper.n_slots()];
    stepper.start_motion(&mut memory, [motion[0], motion[1], 1.0]);
    let mut states = vec![start];
    for t in 0..n {
        states.push(stepper.step_state(&states[t], command, &GroundSample::FIRM, &mut memory, t));
    }
    states
}

fn rolling(speed_mps: f32) -> State {
    State { speed_mps: speed_mps.into(), ..State::default() }
}

/// Thrown sideways at w while it rolls straight on, a body stops after w^2 / (2 M g): the knee of the grip takes no more than
/// some hundredths from the last of it.
#[test]
fn a_body_thrown_sideways_stops_where_friction_stops_it() {
    let (grip, thrown_mps) = (0.4, 3.0);
    let states = slide(grip, rolling(2.0), [thrown_mps, 0.0], command(2.0, 0.0), 400);
    let expected_m = thrown_mps * thrown_mps / (2.0 * grip * GRAVITY_MPS2);
    let found_m = states[400].y_m;
    assert!((found_m / expected_m - 1.0).abs() < 0.03, "{found_m} {expected_m}");
    assert!((states[399].y_m - found_m).abs() < 1e-6 && states[400].yaw_rad.abs() < 1e-9);
}

/// Where there is next to no grip, a body that turns at 1 rad/s turns on, and its rear axle goes on as it began: within a
/// second by M g t^2 / 2 at most, and the yaw by 2 M g t^2 / 2 over the wheelbase.
#[test]
fn a_spinning_body_goes_on_where_there_is_no_grip() {
    let (grip, n) = (0.02, 200);
    let states = slide(grip, rolling(4.0), [0.0, 1.0], command(4.0, 0.0), n);
    let seconds = n as f64 * SHORT_S;
    let reach_m = 0.5 * grip * GRAVITY_MPS2 * seconds * seconds;
    let end = &states[n];
    let off_m = (end.x_m - 4.0 * seconds).hypot(end.y_m);
    assert!(off_m < 1.05 * reach_m, "{off_m} {reach_m}");
    assert!((end.yaw_rad - seconds).abs() < 2.0 * reach_m / WHEELBASE_M, "{}", end.yaw_rad);
}

/// A curve that takes two fifths of the grip is the model's own, to the knee's hundredth.
#[test]
fn a_curve_that_the_grip_allows_is_the_models() {
    let (v, delta) = (4.0f32, 0.25f32);
    let asked_radps = f64::from(v) * f64::from(delta).tan() / WHEELBASE_M;
    let grip = 2.5 * f64::from(v) * asked_radps / GRAVITY_MPS2;
    let states = slide(grip, rolling(v), [0.0, asked_radps], command(v, delta), 400);
    let turned_rad: f64 = states.windows(2).map(|own| turn(&own[0], &own[1])).sum();
    let expected_rad = 400.0 * SHORT_S * asked_radps;
    assert!((turned_rad / expected_rad - 1.0).abs() < 0.01, "{turned_rad} {expected_rad}");
}

/// In a curve that takes twice the grip the rear axle is accelerated by M g and a twentieth at most, which is left for the curve
/// where drive or brakes take everything: the change of its velocity over the ground says so.
#[test]
fn nothing_accelerates_an_axle_by_more_than_its_grip() {
    let (v, delta) = (4.0f32, 0.25f32);
    let asked_mps2 = f64::from(v * v) * f64::from(delta).tan() / WHEELBASE_M;
    let grip = 0.5 * asked_mps2 / GRAVITY_MPS2;
    let states = slide(grip, rolling(v), [0.0, 0.0], command(v, delta), 400);
    let accelerated = |own: &[State]| {
        let second =
            |at: fn(&State) -> f64| (at(&own[0]) - 2.0 * at(&own[1]) + at(&own[2])) / SHORT_S.powi(2);
        second(|state| state.x_m).hypot(second(|state| state.y_m))
    };
    let most_mps2 = states[1..].windows(3).map(accelerated).fold(0.0, f64::max);
    let ratio = most_mps2 / (grip * GRAVITY_MPS2);
    assert!((0.9..1.06).contains(&ratio), "{ratio}");
}

/// Turn from one state to the next [rad].
fn turn(from: &State, to: &State) -> f64 {
    (to.yaw_rad - from.yaw_rad).sin().asin()
}

/// Where nothing was measured of how a body moves, it begins as the model has it.
#[test]
fn a_motion_that_was_not_measured_begins_as_the_models() {
    let (v, delta) = (2.0f32, 0.2f32);
    let states = run(vec![effect("tyre_slide", 10.0)], rolling(v), command(v, delta), 20);
    let plain = run(vec![], rolling(v), command(v, delta), 20);
    for (state, plain) in states.iter().zip(&plain) {
        let off_m = (state.x_m - plain.x_m).hypot(state.y_m - plain.y_m);
        assert!(off_m < 1e-3, "{off_m}");
    }
}
