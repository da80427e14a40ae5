//! Packs against the reference.

use super::*;
use bicycle::LaneState;
use bicycle::lanes::{Lanes, Portable, Real, Scalar};
use rand::{RngExt, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;

/// Sets of effects that leave one another something to do; together they hold every effect that moves a vehicle.
fn sets_of_effects() -> [Vec<Effect>; 3] {
    let first: [(&str, &[f64]); 29] = [
        ("steer_delay", &[0.17]),
        ("speed_delay", &[0.25]),
        ("motor_deadband", &[0.8]),
        ("speed_scale", &[0.95]),
        ("steer_gain", &[1.1]),
        ("steer_bias", &[0.02]),
        ("backlash", &[0.02]),
        ("steer_lag", &[0.15]),
        ("steer_servo", &[0.12, 0.6]),
        ("limited_servo", &[0.1, 0.8, 0.7]),
        ("steer_swing", &[0.1]),
        ("speed_lag", &[0.3]),
        ("wheel_slip", &[0.1, 0.2]),
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
        ("yaw_load", &[-0.04, 0.02]),
        ("rear_slip", &[0.01]),
        ("rear_steer", &[0.2]),
    ];
    let second: [(&str, &[f64]); 15] = [
        ("steer_rate", &[0.8]),
        ("speed_lag_chain", &[0.3]),
        ("accel_limit", &[1.5]),
        ("speed_ramp", &[1.1, 0.7]),
        ("compensation_loss", &[0.3]),
        ("felt_slope", &[0.4, 0.3]),
        ("drive_force_limit", &[1.1]),
        ("mass", &[1.3]),
        ("quad_drag", &[0.1]),
        ("loose_drag", &[0.4]),
        ("cross_slope", &[1.1]),
        ("wind", &[0.3, -0.2]),
        ("steer_yield", &[0.1]),
        ("friction", &[0.08, 0.8, 0.5]),
        ("tyre_slip", &[0.02]),
    ];
    // On ground that holds as little as tyres that slide find, little else would show.
    let third: [(&str, &[f64]); 1] = [("tyre_slide", &[0.2, 0.6])];
    let made = |given: &[(&str, &[f64])]| given.iter().map(|&(id, values)| effect_of(id, values)).collect();
    [made(&first), made(&second), made(&third)]
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
    #[cfg(target_arch = "aarch64")]
    if let Some(neon) = pulp::aarch64::Neon::try_new() {
        use pulp::cast;
        compare(
            neon,
            |value| cast::<_, [f32; 8]>(value).to_vec(),
            |values| cast(<[f32; 8]>::try_from(values).unwrap()),
        );
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
    #[cfg(target_arch = "aarch64")]
    if let Some(neon) = pulp::aarch64::Neon::try_new() {
        accuracy(neon, |value| pulp::cast::<_, [f32; 8]>(value).to_vec());
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
