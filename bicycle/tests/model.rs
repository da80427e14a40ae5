//! The model against closed forms, and its packs against its reference.
#![allow(clippy::unwrap_used, reason = "a test that cannot be set up has failed")]

use bicycle::effect::{CATALOGUE, Effect};
use bicycle::lanes::{Lanes, Portable, Real, Scalar};
use bicycle::{Command, GroundSample, LaneState, Limits, Model, State, Stepper};
use proptest::prelude::*;
use rand::{RngExt, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;

const STEP_S: f64 = 0.1;
const WHEELBASE_M: f64 = 2.0;

fn model(effects: Vec<Effect>) -> Model {
    let limits = Limits {
        speed_max_mps: 5.0,
        reverse_speed_max_mps: 2.0,
        steering_max_rad: 0.6,
        steering_rate_max_radps: 1.0,
        acceleration_max_mps2: 2.0,
        lateral_acceleration_max_mps2: 5.0,
        roll_max_rad: 0.5,
        pitch_max_rad: 0.5,
    };
    Model { wheelbase_m: WHEELBASE_M, limits, effects }
}

fn effect(id: &str, value: f64) -> Effect {
    effect_of(id, &[value])
}

/// An effect with these values of its first parameters; the others change nothing.
fn effect_of(id: &str, first: &[f64]) -> Effect {
    let parameters = CATALOGUE.iter().find(|description| description.id == id).unwrap().parameters;
    let mut values = [0.0; 4];
    for (place, parameter) in parameters.iter().enumerate() {
        values[place] = first.get(place).copied().unwrap_or(parameter.neutral);
    }
    Effect::from_values(id, values).unwrap()
}

/// Drives `n` steps with one command on firm ground with actuators that follow at once.
fn run(effects: Vec<Effect>, start: State, command: Command, n: usize) -> Vec<State> {
    let stepper = Stepper::new(&model(effects), STEP_S, 1.0).with_instant_actuators();
    let mut memory = vec![0.0; stepper.n_slots()];
    let mut states = vec![start];
    for t in 0..n {
        let next = stepper.step_state(&states[t], command, &GroundSample::FIRM, &mut memory, t);
        states.push(next);
    }
    states
}

fn command(speed_mps: f32, steering_rad: f32) -> Command {
    Command { speed_mps, steering_rad }
}

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

/// Sets of effects that leave one another something to do; together they hold every effect that moves a vehicle.
fn sets_of_effects() -> [Vec<Effect>; 2] {
    let first: [(&str, &[f64]); 23] = [
        ("steer_delay", &[0.17]),
        ("speed_delay", &[0.25]),
        ("motor_deadband", &[0.8]),
        ("speed_scale", &[0.95]),
        ("steer_gain", &[1.1]),
        ("steer_bias", &[0.02]),
        ("backlash", &[0.02]),
        ("steer_lag", &[0.15]),
        ("speed_lag", &[0.3]),
        ("speed_loop", &[0.4]),
        ("feed_forward", &[0.4]),
        ("speed_integral", &[1.5]),
        ("hill_compensation", &[0.4]),
        ("drive_limit", &[1.4, 1.2]),
        ("drive_power", &[1.5]),
        ("drive_lag", &[0.2]),
        ("rolling_drag", &[0.2]),
        ("veg_drag", &[0.4]),
        ("cornering_drag", &[0.5]),
        ("slope_gravity", &[0.9]),
        ("steer_linkage", &[1.1]),
        ("understeer", &[0.02]),
        ("rear_slip", &[0.01]),
    ];
    let second: [(&str, &[f64]); 11] = [
        ("steer_rate", &[0.8]),
        ("accel_limit", &[1.5]),
        ("compensation_loss", &[0.3]),
        ("drive_force_limit", &[1.1]),
        ("mass", &[1.3]),
        ("quad_drag", &[0.1]),
        ("loose_drag", &[0.4]),
        ("cross_slope", &[1.1]),
        ("wind", &[0.3, -0.2]),
        ("steer_yield", &[0.1]),
        ("friction", &[0.08, 0.8, 0.5]),
    ];
    let made = |given: &[(&str, &[f64])]| given.iter().map(|&(id, values)| effect_of(id, values)).collect();
    [made(&first), made(&second)]
}

#[test]
fn the_sets_hold_every_effect_that_moves_a_vehicle() {
    let mut held: Vec<&str> =
        sets_of_effects().iter().flatten().map(|effect| effect.description().id).collect();
    held.sort_unstable();
    let moves = |id: &&str| !effect_of(id, &[]).acts_on_sensors();
    let mut expected: Vec<&str> = CATALOGUE.iter().map(|description| description.id).filter(moves).collect();
    expected.sort_unstable();
    assert_eq!(held, expected);
}

/// What one vehicle meets in a step.
#[derive(Clone, Copy)]
struct Met {
    command: [f32; 2],
    traction: [f32; 2],
    gradient: [f32; 2],
    class: f32,
}

/// What a vehicle meets in five seconds: another command every half second, other ground every step.
fn journey(lane: usize) -> Vec<Met> {
    let mut random = Xoshiro256PlusPlus::seed_from_u64(11 + lane as u64);
    let mut draw = move |low: f32, high: f32| random.random_range(low..high);
    let mut command = [0.0; 2];
    let meet = |t: usize| {
        if t.is_multiple_of(5) {
            command = [draw(-2.0, 5.0), draw(-0.6, 0.6)];
        }
        Met {
            command,
            traction: [draw(0.3, 1.0), draw(0.3, 1.0)],
            gradient: [draw(-0.3, 0.3), draw(-0.3, 0.3)],
            class: draw(0.0, 2.0),
        }
    };
    (0..50).map(meet).collect()
}

/// Where the reference ends.
fn reference(effects: Vec<Effect>, journey: &[Met]) -> State {
    let stepper = Stepper::new(&model(effects), STEP_S, 1.0);
    let mut memory = vec![0.0; stepper.n_slots()];
    let step = |state: State, (t, met): (usize, &Met)| {
        let ground = GroundSample {
            linear_traction: f64::from(met.traction[0]),
            angular_traction: f64::from(met.traction[1]),
            gradient: met.gradient.map(f64::from),
            class: f64::from(met.class),
        };
        stepper.step_state(&state, command(met.command[0], met.command[1]), &ground, &mut memory, t)
    };
    journey.iter().enumerate().fold(State::default(), step)
}

/// What rounding of 50 steps in single precision may add up to, over some ten metres: ten times what it does.
const APART_M: f64 = 2e-5;
const APART_TURNS: f64 = 2e-6;

/// False of what is no number.
fn agree(a: &State, b: &State) -> bool {
    let turned = (a.yaw_rad - b.yaw_rad) / std::f64::consts::TAU;
    (a.x_m - b.x_m).hypot(a.y_m - b.y_m) < APART_M && (turned - turned.round()).abs() < APART_TURNS
}

/// An effect that the others leave nothing to do could be wrong in the packs and nobody would see it.
#[test]
fn every_effect_of_a_set_shows_where_the_journey_ends() {
    for set in sets_of_effects() {
        for (place, left_out) in set.iter().enumerate() {
            let mut others = set.clone();
            others.remove(place);
            let shows = |lane: &usize| {
                let journey = journey(*lane);
                let (with, without) = (reference(set.clone(), &journey), reference(others.clone(), &journey));
                (with.x_m - without.x_m).hypot(with.y_m - without.y_m) > 100.0 * APART_M
            };
            // The narrowest packs are eight vehicles wide.
            let n_shown = (0..8).filter(shows).count();
            assert!(n_shown >= 4, "{}: shows in {n_shown} of 8", left_out.description().id);
        }
    }
}

/// Every lane with a journey of its own, f32 against f64.
#[test]
fn packs_agree_with_the_reference() {
    compare(Portable, |value| value.to_vec(), |values| values.try_into().unwrap());
    #[cfg(target_arch = "x86_64")]
    {
        use pulp::cast;
        if let Some(v3) = pulp::x86::V3::try_new() {
            compare(
                v3,
                |value| cast::<_, [f32; 8]>(value).to_vec(),
                |values| cast(<[f32; 8]>::try_from(values).unwrap()),
            );
        }
        if let Some(v4) = pulp::x86::V4::try_new() {
            compare(
                v4,
                |value| cast::<_, [f32; 16]>(value).to_vec(),
                |values| cast(<[f32; 16]>::try_from(values).unwrap()),
            );
        }
    }
}

fn compare<L: Lanes>(lanes: L, unpack: impl Fn(L::Value) -> Vec<f32>, pack: impl Fn(&[f32]) -> L::Value) {
    for set in sets_of_effects() {
        let stepper = Stepper::new(&model(set.clone()), STEP_S, 1.0);
        let journeys: Vec<Vec<Met>> = (0..L::WIDTH).map(journey).collect();
        let zero = lanes.real(0.0);
        let mut state = LaneState { x: zero, y: zero, turns: zero, speed: zero, steering: zero };
        let mut memory = vec![zero.1; stepper.n_slots()];
        for t in 0..journeys[0].len() {
            let real = |of: &dyn Fn(&Met) -> f32| {
                let values: Vec<f32> = journeys.iter().map(|journey| of(&journey[t])).collect();
                Real(lanes, pack(&values))
            };
            let ground = GroundSample {
                linear_traction: real(&|met| met.traction[0]),
                angular_traction: real(&|met| met.traction[1]),
                gradient: [real(&|met| met.gradient[0]), real(&|met| met.gradient[1])],
                class: real(&|met| met.class),
            };
            let command = [real(&|met| met.command[0]), real(&|met| met.command[1])];
            stepper.step(&mut state, command, &ground, &mut memory, t);
        }
        let [x, y, turns] = [state.x, state.y, state.turns].map(|value| unpack(value.1));
        for (lane, journey) in journeys.iter().enumerate() {
            let expected = reference(set.clone(), journey);
            let found = State {
                x_m: f64::from(x[lane]),
                y_m: f64::from(y[lane]),
                yaw_rad: f64::from(turns[lane]) * std::f64::consts::TAU,
                ..expected
            };
            assert!(agree(&found, &expected), "lane {lane}: {found:?} instead of {expected:?}");
        }
    }
}

/// The bare step is the whole step of a model without effects and with instant actuators.
#[test]
fn the_bare_step_is_the_step_without_effects() {
    let stepper = Stepper::new(&model(vec![]), STEP_S, 0.25).with_instant_actuators();
    let real = |value: f64| Real(Scalar, value);
    let start =
        LaneState { x: real(1.0), y: real(2.0), turns: real(0.3), speed: real(0.0), steering: real(0.0) };
    let ground = GroundSample {
        linear_traction: real(0.8),
        angular_traction: real(0.6),
        gradient: [real(0.0); 2],
        class: real(0.0),
    };
    let (mut bare, mut whole) = (start, start);
    let wish = [real(1.5), real(-0.4)];
    let rates = stepper.step_bare(&mut bare, wish, &ground);
    let same = stepper.step(&mut whole, wish, &ground, &mut [], 0);
    for (a, b) in
        [(bare.x, whole.x), (bare.y, whole.y), (bare.turns, whole.turns), (rates.yaw_rate, same.yaw_rate)]
    {
        assert!((a.1 - b.1).abs() < 1e-15);
    }
}

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

/// Square roots, tangents and sines of packs over their domains, and what becomes of NaN.
#[test]
fn functions_of_packs_are_accurate() {
    accuracy(Portable, |value| value.to_vec());
    #[cfg(target_arch = "x86_64")]
    {
        use pulp::cast;
        if let Some(v3) = pulp::x86::V3::try_new() {
            accuracy(v3, |value| cast::<_, [f32; 8]>(value).to_vec());
        }
        if let Some(v4) = pulp::x86::V4::try_new() {
            accuracy(v4, |value| cast::<_, [f32; 16]>(value).to_vec());
        }
    }
}

fn accuracy<L: Lanes>(lanes: L, unpack: impl Fn(L::Value) -> Vec<f32>) {
    let first = |value: Real<L>| f64::from(unpack(value.1)[0]);
    for i in -500..=500 {
        let share = f64::from(i) / 500.0;
        let turns = f64::from((0.5 * share) as f32);
        let (sine, cosine) = lanes.real(turns).sin_cos_turns();
        let angle = turns * std::f64::consts::TAU;
        assert!((first(sine) - angle.sin()).abs() < 5e-7 && (first(cosine) - angle.cos()).abs() < 5e-7);
        let steering = f64::from((0.8 * share) as f32);
        assert!((first(lanes.real(steering).tan()) - steering.tan()).abs() < 5e-7);
        let square = f64::from((10.0f64.powf(6.0 * share)) as f32);
        // Rounded once: the same number on every machine.
        assert_eq!(first(lanes.real(square).sqrt()), f64::from((square as f32).sqrt()), "{square}");
        let whole = f64::from((f64::from(i) * 0.3717) as f32);
        assert!((first(lanes.real(whole).wrap_turns()) - (whole - whole.round())).abs() < 2e-5);
    }
    assert!((0.0..1e-5).contains(&first(lanes.real(0.0).sqrt())));
    assert!(first(lanes.real(f64::NAN).sqrt()).is_nan());
    let (nan, one) = (lanes.real(f64::NAN), lanes.real(1.0));
    let [zero, two] = [0.0, 2.0].map(|value| lanes.real(value));
    assert_eq!(first(nan.max(one)), 1.0);
    assert_eq!(first(nan.min(one)), 1.0);
    assert!(first(one.max(nan)).is_nan() && first(one.min(nan)).is_nan());
    // Bounds keep NaN, and whole turns leave no rest of infinity.
    assert!(first(nan.clamp(zero, one)).is_nan());
    assert_eq!([first(two.clamp(zero, one)), first((-two).clamp(zero, one))], [1.0, 0.0]);
    for infinite in [f64::INFINITY, f64::NEG_INFINITY, f64::NAN] {
        assert!(first(lanes.real(infinite).wrap_turns()).is_nan(), "{infinite}");
    }
    assert_eq!(first(two.or_else(nan.exceeds(one), zero)), 2.0);
    assert_eq!(first(two.or_else(one.exceeds(one), zero)), 0.0);
    assert_eq!(first(two.or_else(nan.less(one), zero)), 0.0);
    assert_eq!(first(zero.add_where(one.less(two), two)), 2.0);
    assert_eq!(first(zero.add_where(two.less(one), nan)), 0.0);
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
