//! The skid-steered model against closed forms, and its packs against its reference.
#![allow(clippy::unwrap_used, reason = "a test that cannot be set up has failed")]

use bicycle::lanes::{Lanes, Portable, Real, Scalar};
use bicycle::{
    Decision, Extent, GroundSample, HoldReason, LaneState, MotionModel, MotionState, MotionStepper,
    SkidSteer, SkidSteerCommand, SkidSteerLimits, SkidSteerStepper, StopReason,
};
use proptest::prelude::*;
use rand::{RngExt, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;
use std::f64::consts::{FRAC_PI_2, TAU};

const STEP_S: f64 = 0.1;

fn model() -> SkidSteer {
    let limits = SkidSteerLimits {
        speed_max_mps: 2.0,
        reverse_speed_max_mps: 1.0,
        yaw_rate_max_radps: 1.5,
        acceleration_max_mps2: 2.0,
        yaw_acceleration_max_radps2: 3.0,
        lateral_acceleration_max_mps2: 3.0,
        roll_max_rad: 0.5,
        pitch_max_rad: 0.5,
    };
    SkidSteer { limits, speed_lag_s: 0.0, yaw_rate_lag_s: 0.0, turning_point_ahead_m: 0.0 }
}

fn instant() -> SkidSteerStepper {
    model().stepper(STEP_S, 1.0).with_instant_actuators()
}

fn ground(linear_traction: f64, angular_traction: f64) -> GroundSample {
    GroundSample { linear_traction, angular_traction, ..GroundSample::FIRM }
}

/// The states of `n` steps under one command, the start first.
fn run(stepper: &SkidSteerStepper, command: [f32; 2], ground: &GroundSample, n: usize) -> Vec<MotionState> {
    let mut states = vec![MotionState::default()];
    for t in 0..n {
        states.push(stepper.step_one(&states[t], command, ground, &mut [], t));
    }
    states
}

#[test]
fn straight_ahead_is_speed_times_time_and_traction() {
    for (traction, expected_m) in [(1.0, 7.5), (0.5, 3.75)] {
        let states = run(&instant(), [1.5, 0.0], &ground(traction, 1.0), 50);
        assert!((states[50].x_m - expected_m).abs() < 1e-12 && states[50].y_m == 0.0);
        assert!(states.iter().all(|state| state.yaw_rad == 0.0));
    }
}

/// Steps of v dt that turn by w dt are the sides of a polygon in a circle of radius v dt / (2 sin(w dt / 2)), which is
/// v / w for short steps. Linear traction shortens the sides, angular traction the turns.
#[test]
fn a_turn_is_a_circle_of_speed_over_yaw_rate() {
    let (speed, yaw_rate) = (1.5, 0.75);
    for (linear, angular) in [(1.0, 1.0), (0.5, 1.0), (1.0, 0.5), (0.5, 0.25)] {
        let states = run(&instant(), [speed as f32, yaw_rate as f32], &ground(linear, angular), 60);
        let (side_m, turn_rad) = (linear * speed * STEP_S, angular * yaw_rate * STEP_S);
        let radius_m = side_m / (2.0 * (turn_rad / 2.0).sin());
        assert!((radius_m / (linear * speed / (angular * yaw_rate)) - 1.0).abs() < 1e-3);
        let (sine, cosine) = (turn_rad / 2.0).sin_cos();
        let centre_m = [radius_m * sine, radius_m * cosine];
        for (t, state) in states.iter().enumerate() {
            let found_m = (state.x_m - centre_m[0]).hypot(state.y_m - centre_m[1]);
            assert!((found_m - radius_m).abs() < 1e-9, "{linear} {angular} {t}: {found_m} {radius_m}");
            let turned_rad = (state.yaw_rad - turn_rad * t as f64) / TAU;
            assert!((turned_rad - turned_rad.round()).abs() < 1e-9);
        }
    }
}

/// Half the traction of both kinds: the same circle, half of the arc.
#[test]
fn half_the_traction_halves_the_arc() {
    let whole = run(&instant(), [1.0, 0.5], &GroundSample::FIRM, 20);
    let half = run(&instant(), [1.0, 0.5], &ground(0.5, 0.5), 40);
    assert!((half[40].yaw_rad - whole[20].yaw_rad).abs() < 1e-9);
    // Sides half as long are nearer to the circle: 2 m of radius, turned by half a step's 0.05 rad less.
    assert!((half[40].x_m - whole[20].x_m).hypot(half[40].y_m - whole[20].y_m) < 0.05);
    let arc_m = |states: &[MotionState]| -> f64 {
        states.windows(2).map(|two| (two[1].x_m - two[0].x_m).hypot(two[1].y_m - two[0].y_m)).sum()
    };
    assert!((arc_m(&half[..21]) - 0.5 * arc_m(&whole)).abs() < 1e-9);
}

#[test]
fn it_turns_where_it_stands() {
    let states = run(&instant(), [0.0, 1.0], &GroundSample::FIRM, 10);
    assert!((states[10].yaw_rad - 1.0).abs() < 1e-12);
    assert!(states.iter().all(|state| state.x_m == 0.0 && state.y_m == 0.0));
}

#[test]
fn the_drives_follow_within_their_limits() {
    let stepper = model().stepper(STEP_S, 1.0);
    assert_eq!(stepper.extent(), Extent::Plain);
    let states = run(&stepper, [1.0, -1.5], &GroundSample::FIRM, 10);
    for (t, state) in states.iter().enumerate() {
        // 2 m/s2 and 3 rad/s2.
        assert!((state.speed_mps - (0.2 * t as f64).min(1.0)).abs() < 1e-12);
        assert!((state.turn + (0.3 * t as f64).min(1.5)).abs() < 1e-12);
    }
}

/// Turning where it stands, the vehicle keeps the place of the point that it turns about: the rear axle goes around it.
/// A step is a side of the polygon, 5 mrad of it.
#[test]
fn the_rear_axle_goes_around_the_turning_point() {
    let long = SkidSteer { turning_point_ahead_m: 0.6, ..model() };
    for (unit_m, angular) in [(1.0, 1.0), (1.0, 0.5), (0.25, 1.0)] {
        let mut stepper = long.stepper(0.005, 1.0).with_instant_actuators();
        stepper.rescale(unit_m);
        for state in run(&stepper, [0.0, 1.0], &ground(1.0, angular), 400).iter().skip(1) {
            let (sine, cosine) = state.yaw_rad.sin_cos();
            let point_m = [state.x_m * unit_m + 0.6 * cosine, state.y_m * unit_m + 0.6 * sine];
            assert!((point_m[0] - 0.6).hypot(point_m[1]) < 0.004, "{point_m:?}");
        }
    }
    // Driving straight, it makes no difference.
    let (near, far) = (instant(), long.stepper(STEP_S, 1.0).with_instant_actuators());
    let straight = [&near, &far].map(|stepper| run(stepper, [1.5, 0.0], &GroundSample::FIRM, 20));
    assert_eq!(straight[0], straight[1]);
}

/// A first-order lag leaves exp(-t / T) of a step to be made good.
#[test]
fn a_lag_is_exponential() {
    let lagging = SkidSteer { speed_lag_s: 0.4, yaw_rate_lag_s: 0.25, ..model() };
    let stepper = lagging.stepper(STEP_S, 1.0).with_instant_actuators();
    assert_eq!(stepper.extent(), Extent::Whole);
    for (t, state) in run(&stepper, [1.5, 0.75], &GroundSample::FIRM, 20).iter().enumerate() {
        let time_s = STEP_S * t as f64;
        assert!((state.speed_mps - 1.5 * (1.0 - (-time_s / 0.4).exp())).abs() < 1e-9);
        assert!((state.turn - 0.75 * (1.0 - (-time_s / 0.25).exp())).abs() < 1e-9);
    }
}

#[test]
fn to_stand_still_is_not_to_turn() {
    let last = SkidSteerCommand { speed_mps: 1.0, yaw_rate_radps: 0.7 };
    assert_eq!(Decision::Drive(last).command(SkidSteerCommand::default()), last);
    for stopped in [Decision::Hold(HoldReason::AtGoal), Decision::Stop(StopReason::StaleScan)] {
        assert_eq!(stopped.command(last), SkidSteerCommand::default());
    }
}

#[test]
fn impossible_models_are_refused_with_field_and_value() {
    let told = |change: &dyn Fn(&mut SkidSteer)| {
        let mut model = model();
        change(&mut model);
        model.validate().map_or_else(|error| error.to_string(), |()| "accepted".to_owned())
    };
    assert_eq!(told(&|_| ()), "accepted");
    assert_eq!(
        told(&|model| model.limits.yaw_rate_max_radps = 0.0),
        "limits.yaw_rate_max_radps: expected a yaw rate > 0 of at most 100 rad/s, found 0"
    );
    assert_eq!(
        told(&|model| model.speed_lag_s = -1.0),
        "speed_lag_s: expected a time from 0 to 10 s, found -1"
    );
    assert!(told(&|model| model.limits.speed_max_mps = f64::NAN).starts_with("limits.speed_max_mps"));
    assert!(told(&|model| model.limits.reverse_speed_max_mps = -0.1).starts_with("limits.reverse"));
    assert!(told(&|model| model.limits.yaw_acceleration_max_radps2 = 0.0).starts_with("limits.yaw_acc"));
    assert!(told(&|model| model.limits.roll_max_rad = f64::INFINITY).starts_with("limits.roll_max_rad"));
}

/// Command of a step and traction under it.
type Leg = ([f32; 2], [f32; 2]);

/// Command and traction of every step of one vehicle, drawn for its number.
fn journey(lane: usize) -> Vec<Leg> {
    let mut random = Xoshiro256PlusPlus::seed_from_u64(lane as u64);
    let mut draw = |low: f32, high: f32| random.random_range(low..high);
    (0..50).map(|_| ([draw(-1.0, 2.0), draw(-1.5, 1.5)], [draw(0.3, 1.0), draw(0.3, 1.0)])).collect()
}

/// Every lane of a pack ends where the reference ends that drives the lane's journey.
fn compare<L: Lanes>(lanes: L, unpack: impl Fn(L::Value) -> Vec<f32>, pack: impl Fn(&[f32]) -> L::Value) {
    let lagging = SkidSteer { speed_lag_s: 0.2, yaw_rate_lag_s: 0.3, turning_point_ahead_m: 0.4, ..model() };
    for stepper in [model().stepper(STEP_S, 1.0), instant(), lagging.stepper(STEP_S, 1.0)] {
        let journeys: Vec<_> = (0..L::WIDTH).map(journey).collect();
        let zero = lanes.real(0.0);
        let mut state = LaneState { x: zero, y: zero, turns: zero, speed: zero, steering: zero };
        for t in 0..journeys[0].len() {
            let real = |of: &dyn Fn(&Leg) -> f32| {
                let values: Vec<f32> = journeys.iter().map(|journey| of(&journey[t])).collect();
                Real(lanes, pack(&values))
            };
            let (linear_traction, angular_traction) = (real(&|met| met.1[0]), real(&|met| met.1[1]));
            let ground = GroundSample { linear_traction, angular_traction, gradient: [zero; 2], class: zero };
            stepper.step(&mut state, [real(&|met| met.0[0]), real(&|met| met.0[1])], &ground, &mut [], t);
        }
        let found = [state.x, state.y, state.turns, state.speed, state.steering].map(|value| unpack(value.1));
        for (lane, journey) in journeys.iter().enumerate() {
            let expected =
                journey.iter().enumerate().fold(MotionState::default(), |state, (t, (command, traction))| {
                    let ground = ground(f64::from(traction[0]), f64::from(traction[1]));
                    stepper.step_one(&state, *command, &ground, &mut [], t)
                });
            let [x, y, turns, speed, turn] = found.each_ref().map(|lanes| f64::from(lanes[lane]));
            let off_m = (x - expected.x_m).hypot(y - expected.y_m);
            let off_turns = turns - expected.yaw_rad / TAU;
            assert!(off_m < 2e-5 && (off_turns - off_turns.round()).abs() < 2e-6, "lane {lane}: {off_m} m");
            assert!((speed - expected.speed_mps).abs() < 1e-5 && (turn - expected.turn).abs() < 1e-5);
        }
    }
}

#[test]
fn every_lane_goes_where_one_vehicle_goes() {
    compare(Portable, |value| value.to_vec(), |values| <[f32; 8]>::try_from(values).unwrap());
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

/// The scalar twin is the lanes' step of one lane: the same bits.
#[test]
fn the_reference_is_the_step_of_one_lane_to_the_bit() {
    let stepper = SkidSteer { speed_lag_s: 0.2, ..model() }.stepper(STEP_S, 1.0);
    let real = |value: f64| Real(Scalar, value);
    let mut lane =
        LaneState { x: real(0.0), y: real(0.0), turns: real(0.0), speed: real(0.0), steering: real(0.0) };
    let one = stepper.step_one(&MotionState::default(), [1.0, 0.5], &ground(0.7, 0.6), &mut [], 0);
    let firm = GroundSample {
        linear_traction: real(0.7),
        angular_traction: real(0.6),
        gradient: [real(0.0); 2],
        class: real(0.0),
    };
    stepper.step(&mut lane, [real(1.0), real(0.5)], &firm, &mut [], 0);
    assert_eq!([one.x_m, one.y_m, one.yaw_rad], [lane.x.1, lane.y.1, lane.turns.1 * TAU]);
    assert_eq!([one.speed_mps, one.turn], [lane.speed.1, lane.steering.1]);
}

proptest! {
    /// From anywhere: a step is as long as speed times traction, turns by yaw rate times traction, and what is asked
    /// within limits is reached.
    #[test]
    fn a_step_is_what_the_equations_say(
        yaw_rad in -3.1..3.1f64,
        speed in -1.0..2.0f32,
        yaw_rate in -1.5..1.5f32,
        linear in 0.0..1.0f64,
        angular in 0.0..1.0f64,
    ) {
        let start = MotionState { x_m: 3.0, y_m: -2.0, yaw_rad, ..MotionState::default() };
        let end = instant().step_one(&start, [speed, yaw_rate], &ground(linear, angular), &mut [], 0);
        let along_m = STEP_S * f64::from(speed) * linear;
        prop_assert!((end.x_m - 3.0 - along_m * yaw_rad.cos()).abs() < 1e-12);
        prop_assert!((end.y_m + 2.0 - along_m * yaw_rad.sin()).abs() < 1e-12);
        let turned = (end.yaw_rad - yaw_rad - STEP_S * f64::from(yaw_rate) * angular) / TAU;
        prop_assert!((turned - turned.round()).abs() < 1e-12);
        prop_assert_eq!([end.speed_mps, end.turn], [f64::from(speed), f64::from(yaw_rate)]);
    }

    /// Where a vehicle goes does not depend on the frame: turned by a quarter, the way is turned by a quarter.
    #[test]
    fn the_way_turns_with_the_start(speed in 0.1..2.0f32, yaw_rate in -1.5..1.5f32) {
        let stepper = model().stepper(STEP_S, 1.0);
        let end = |yaw_rad: f64| {
            let start = MotionState { yaw_rad, ..MotionState::default() };
            let step = |state: MotionState, t: usize| {
                stepper.step_one(&state, [speed, yaw_rate], &GroundSample::FIRM, &mut [], t)
            };
            (0..30).fold(start, step)
        };
        let (east, north) = (end(0.0), end(FRAC_PI_2));
        prop_assert!((north.x_m + east.y_m).abs() < 1e-9 && (north.y_m - east.x_m).abs() < 1e-9);
    }
}
