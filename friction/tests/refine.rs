//! Coefficients of places, inertia and wheel speed, found back from a drive of the reasoning itself over three grounds of
//! which two look alike.

#![allow(clippy::unwrap_used, reason = "a panic is how a test fails")]

use friction::{
    Chassis, Coefficients, Controls, FrictionCurve, GRAVITY_MPS2, Held, Lesson, Moment, Recording, Refined,
    Seen, State, Surface, View, refine, wheels_m,
};

const STEP_S: f64 = 1e-3;
const ROW_STEPS: usize = 20;
/// Measured and described over what is.
const WHEEL_SCALE: f64 = 0.97;
const INERTIA_FACTOR: f64 = 1.3;
const SIDE: usize = 400;
const PIXEL_M: f64 = 0.5;

/// Grass, asphalt and ice in stripes.
fn ground(x_m: f64) -> usize {
    ((x_m / 15.0).floor() as i64).rem_euclid(4) as usize
}

const CURVES: [FrictionCurve; 4] =
    [FrictionCurve::GRASS, FrictionCurve::ASPHALT, FrictionCurve::ICE, FrictionCurve::ASPHALT];

fn lesson() -> Lesson {
    let vehicle = formats::read_vehicle("sedan").unwrap();
    let chassis = Chassis { lean: [1.0; 2], is_locked: true, driven: [true; 2], ..Chassis::of(&vehicle) };
    let mut state =
        State { at_m: [0.0, -10.0], heading_rad: 0.5, velocity: [8.0, 0.0, 0.0], specific_mps2: [0.0; 2] };
    let mut moments = Vec::new();
    for step in 0..60_000 {
        let time_s = step as f64 * STEP_S;
        // Out of 60 m it turns back; bends to and fro otherwise.
        let home_rad = (-state.at_m[1]).atan2(-state.at_m[0]) - state.heading_rad;
        let is_far = state.at_m[0].hypot(state.at_m[1]) > 60.0;
        let turn_rad = if is_far {
            0.4 * home_rad.sin()
        } else {
            0.1 * (1.3 * time_s).sin() + 0.05 * (5.0 * time_s).sin()
        };
        let edge_mps = 8.0 + 1.5 * (0.9 * time_s).sin();
        let controls = Controls { edge_mps: [edge_mps; 4], steering_rad: turn_rad };
        let friction =
            wheels_m(&chassis, &state).map(|at_m| Coefficients::constant(&CURVES[ground(at_m[0])]));
        let surface = Surface::<0> { friction, pull_mps2: [0.0; 2], across_mps2: GRAVITY_MPS2 };
        let before_radps = state.velocity[2];
        state = State::of_values(&chassis.advance(&state.values(), &controls, &surface, STEP_S));
        if step % ROW_STEPS == 0 {
            let yaw_radps2 = (state.velocity[2] - before_radps) / STEP_S;
            moments.push(moment(&chassis, &state, yaw_radps2, time_s, &controls));
        }
    }
    let values = vec![0.5; 4 * SIDE * SIDE];
    let south_west_m = [-0.5 * SIDE as f64 * PIXEL_M; 2];
    let view = View { resolution_m: PIXEL_M, south_west_m, n_rows: SIDE, n_cols: SIDE, values };
    let yaw_inertia_kgm2 = INERTIA_FACTOR * chassis.yaw_inertia_kgm2;
    Lesson::new(Chassis { yaw_inertia_kgm2, ..chassis }, Recording { view, classes: None, moments }, 0)
}

/// As measured at the middle of the rear axle.
fn moment(chassis: &Chassis, state: &State, yaw_radps2: f64, time_s: f64, controls: &Controls) -> Moment {
    let (sin, cos) = state.heading_rad.sin_cos();
    let ahead_m = chassis.cog_ahead_m;
    let [ahead_mps, left_mps, yaw_radps] = state.velocity;
    Moment {
        time_s,
        at_m: [state.at_m[0] - ahead_m * cos, state.at_m[1] - ahead_m * sin],
        yaw_rad: state.heading_rad,
        velocity_mps: [ahead_mps, left_mps - yaw_radps * ahead_m],
        yaw_radps,
        edge_mps: controls.edge_mps.map(|edge_mps| WHEEL_SCALE * edge_mps),
        steering_rad: controls.steering_rad,
        felt: [
            state.specific_mps2[0] + yaw_radps * yaw_radps * ahead_m,
            state.specific_mps2[1] - yaw_radps2 * ahead_m,
            yaw_radps,
        ],
    }
}

/// Ice looks like grass.
fn seen(lesson: &Lesson) -> Seen {
    let view = &lesson.recording.view;
    let looks = [FrictionCurve::GRASS, FrictionCurve::ASPHALT, FrictionCurve::GRASS, FrictionCurve::ASPHALT];
    let pixel = |index: usize| {
        let curve = looks[ground(view.south_west_m[0] + (index % SIDE) as f64 * PIXEL_M + 0.25)];
        [curve.static_friction, curve.sliding_friction, curve.viscous_friction, curve.stribeck_speed_mps]
    };
    Seen { coefficients: (0..SIDE * SIDE).map(pixel).collect() }
}

/// Mean over labelled pixels of a ground of the friction at 1 m/s.
fn mean_label(lesson: &Lesson, refined: &Refined, which: usize) -> f64 {
    let view = &lesson.recording.view;
    let (mut sum, mut n) = (0.0, 0.0);
    for (index, label) in refined.labels[0].iter().enumerate() {
        let x_m = view.south_west_m[0] + (index % SIDE) as f64 * PIXEL_M + 0.25;
        let is_inside = ground(x_m - 2.0) == which && ground(x_m + 2.0) == which;
        if let Some(label) = label.filter(|_| is_inside) {
            let coefficients = Coefficients::<0>(label.map(|value| f64::from(value).into()));
            sum += coefficients.at(1.0.into()).value;
            n += 1.0;
        }
    }
    sum / n
}

#[test]
fn grounds_that_look_alike_inertia_and_wheel_speed_come_back_from_how_they_drive() {
    let lesson = lesson();
    let seen = [seen(&lesson)];
    let lessons = [lesson];
    let refined = refine(&lessons, &seen, Held::Nothing).unwrap();
    assert!((refined.wheel_scale * WHEEL_SCALE - 1.0).abs() < 0.01, "{}", refined.wheel_scale);
    assert!((refined.inertia_factor * INERTIA_FACTOR - 1.0).abs() < 0.1, "{}", refined.inertia_factor);
    let [grass, asphalt, ice] = [0, 1, 2].map(|which| mean_label(&lessons[0], &refined, which));
    for (which, found) in [grass, asphalt].into_iter().enumerate() {
        let truth = f64::from(CURVES[which].at(1.0));
        assert!((found / truth - 1.0).abs() < 0.2, "{which}: {found} {truth}");
    }
    // Short stretches of ice are a mixture of what was seen and what was felt.
    assert!(ice < 0.6 * grass, "{ice} {grass}");
    let corrected = refined.corrected(&lessons[0], 0);
    let [told, right] = [&lessons[0], &corrected].map(|lesson| lesson.recording.moments[99].edge_mps[0]);
    assert!((right / told - refined.wheel_scale).abs() < 1e-12);
}

#[test]
fn what_is_held_stays() {
    let lesson = lesson();
    let seen = [seen(&lesson)];
    let lessons = [lesson];
    assert_eq!(refine(&lessons, &seen, Held::Inertia).unwrap().inertia_factor, 1.0);
    assert_eq!(refine(&lessons, &seen, Held::WheelSpeed).unwrap().wheel_scale, 1.0);
    assert!(refine(&[], &[], Held::Nothing).unwrap_err().to_string().contains("at least one drive"));
}
