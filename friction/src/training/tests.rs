//! Gradients by finite differences from the motion to the weights, and that looks are learned from motion.

use bicycle::Vehicle;
use candle_core::Var;

use super::*;
use crate::recording::Moment;
use crate::roll_out::SUBSTEPS;

fn chassis() -> Chassis {
    let vehicle: Vehicle = formats::read_vehicle("sedan").expect("shipped");
    Chassis::of(&vehicle)
}

/// Two grounds side by side, told apart by their colour, and where a vehicle turned hard over them went under known curves.
fn lesson(curves: [FrictionCurve; 2], steering_rad: f64) -> Lesson {
    let chassis = chassis();
    let (n_rows, n_cols) = (120, 120);
    let is_right = |pixel: usize| usize::from(pixel % n_cols >= 50);
    // A grain, so that units bend at other places in every pixel.
    let grain = |pixel: usize| 0.1 * ((pixel * 7919 % 1009) as f32 / 1009.0 - 0.5);
    let channel =
        |value: [f32; 2]| (0..n_rows * n_cols).map(move |pixel| value[is_right(pixel)] + grain(pixel));
    let values =
        channel([0.2, 0.8]).chain(channel([0.3, 0.8])).chain(channel([0.2, 0.9])).chain(channel([0.0; 2]));
    let view = View { resolution_m: 0.5, south_west_m: [-30.0; 2], n_rows, n_cols, values: values.collect() };
    let controls = vec![Controls { edge_mps: [9.0; 4], steering_rad }; STEPS * SUBSTEPS];
    let mut start =
        State { at_m: [-14.0, -3.0], heading_rad: 0.2, velocity: [9.0, 0.0, 0.0], specific_mps2: [0.0; 2] };
    let mut moments = Vec::new();
    for begin in 0..2 {
        let states = roll_out(&chassis, &start, &controls, |_, state| Ground {
            coefficients: wheels_m(&chassis, state).map(|at_m| {
                let [row, col] = view.pixel(at_m);
                Coefficients::<0>::constant(&curves[is_right(row * n_cols + col)]).0.map(|c| c.value)
            }),
            gradient: [0.0; 2],
        });
        let all = if begin == 0 { vec![start] } else { Vec::new() };
        for state in all.iter().chain(&states) {
            moments.push(moment(&chassis, state, moments.len() as f64 * 0.1, steering_rad));
        }
        start = states[STEPS - 1];
    }
    Lesson::new(chassis, Recording { view, classes: None, moments }, 0)
}

use crate::reasoning::{Coefficients, Controls};

fn moment(chassis: &Chassis, state: &State, time_s: f64, steering_rad: f64) -> Moment {
    let (sin, cos) = state.heading_rad.sin_cos();
    let ahead_m = chassis.cog_ahead_m;
    let [ahead_mps, left_mps, yaw_radps] = state.velocity;
    Moment {
        time_s,
        at_m: [state.at_m[0] - ahead_m * cos, state.at_m[1] - ahead_m * sin],
        yaw_rad: state.heading_rad,
        velocity_mps: [ahead_mps, left_mps - yaw_radps * ahead_m],
        yaw_radps,
        edge_mps: [9.0; 4],
        steering_rad,
        felt: [state.specific_mps2[0] + yaw_radps * yaw_radps * ahead_m, state.specific_mps2[1], yaw_radps],
    }
}

#[test]
fn windows_are_where_the_vehicle_went() {
    let lesson = lesson([FrictionCurve::ASPHALT, FrictionCurve::ICE], 0.1);
    lesson.recording.validate().unwrap();
    let window = &lesson.windows[0];
    let seen = Seen {
        coefficients: (0..120 * 120)
            .map(|pixel| coefficients_of(if pixel % 120 >= 50 { 6 } else { 0 }))
            .collect(),
    };
    let predicted = predict(&lesson, window, &seen);
    let off_m = |states: &[State]| {
        let [a, b] = [states[STEPS - 1].at_m, window.truth[STEPS - 1].at_m];
        (a[0] - b[0]).hypot(a[1] - b[1])
    };
    assert!(off_m(&predicted) < 0.02, "{}", off_m(&predicted));
    let all_ice = Seen { coefficients: vec![coefficients_of(6); 120 * 120] };
    assert!(off_m(&predict(&lesson, window, &all_ice)) > 0.3);
}

#[test]
fn the_gradient_by_coefficients_is_that_of_central_differences() {
    let lesson = lesson([FrictionCurve::GRASS, FrictionCurve::ICE], 0.12);
    let window = &lesson.windows[0];
    let patch = Patch::of(&lesson, window);
    let grounds: [Ground; STEPS] = std::array::from_fn(|step| Ground {
        coefficients: std::array::from_fn(|wheel| {
            std::array::from_fn(|i| [0.5, 0.4, 0.01, 2.0][i] * (1.0 + 0.02 * (step + 3 * wheel) as f64))
        }),
        gradient: [0.01, -0.02],
    });
    let loss = |grounds: &[Ground]| {
        loss_gradient(&lesson.chassis, &window.start, &window.controls, grounds, &|step, state| {
            motion_loss(&lesson.chassis, window, step, state)
        })
    };
    let (_, gradient) = loss(&grounds);
    for (step, wheel, which) in [(0, 0, 0), (3, 1, 1), (7, 2, 3), (12, 3, 0), (18, 0, 2)] {
        let (mut up, mut down) = (grounds, grounds);
        let by = 1e-5;
        up[step].coefficients[wheel][which] += by;
        down[step].coefficients[wheel][which] -= by;
        let difference = (loss(&up).0 - loss(&down).0) / (2.0 * by);
        let found = gradient[step][wheel][which];
        assert!(
            (found - difference).abs() < 1e-6 + 1e-4 * difference.abs(),
            "{step} {wheel} {which}: {found} {difference}"
        );
    }
    assert_eq!(patch.pixels.len(), STEPS);
}

/// In double precision, along a direction in which every weight of a layer moves, layer by layer: of the thousands of units,
/// few bend within so short a step. Biases are not zero: units that nothing reaches would stand right at their bend.
#[test]
fn the_surrogate_s_gradient_by_the_weights_is_that_of_the_motion() {
    let lessons = [lesson([FrictionCurve::GRASS, FrictionCurve::ICE], 0.12)];
    let windows = [&lessons[0].windows[0]];
    let patches = [Patch::of(&lessons[0], windows[0])];
    let input = Network::input(&lessons[0].recording.view, patches[0].corner, [PATCH; 2]);
    let input = Tensor::from_vec(input, (1, PATCH, PATCH, CHANNELS), &Device::Cpu).unwrap();
    let input = input.to_dtype(DType::F64).unwrap();
    let variables: Vec<Var> = Network::new(0.5, 3)
        .unwrap()
        .variables()
        .iter()
        .map(|variable| {
            let [rows, cols] = [0, 1].map(|axis| variable.dim(axis).unwrap());
            let biased = |i: usize| if i / cols == rows - 1 { 0.05 + 0.01 * (i % cols) as f64 } else { 0.0 };
            let biases = Tensor::from_vec((0..rows * cols).map(biased).collect(), (rows, cols), &Device::Cpu);
            Var::from_tensor(&(variable.to_dtype(DType::F64).unwrap() + biases.unwrap()).unwrap()).unwrap()
        })
        .collect();
    let loss = || {
        let weights: Vec<Tensor> = variables.iter().map(|variable| variable.as_tensor().clone()).collect();
        surrogate(&lessons, &windows, &patches, &Network::apply(&weights, &input).unwrap()).unwrap()
    };
    let gradients = loss().0.backward().unwrap();
    for variable in &variables {
        let slopes = gradients.get(variable).unwrap().flatten_all().unwrap().to_vec1::<f64>().unwrap();
        let before = variable.flatten_all().unwrap().to_vec1::<f64>().unwrap();
        let direction: Vec<f64> =
            slopes.iter().enumerate().map(|(i, slope)| slope.signum() * (1.0 + (i % 7) as f64)).collect();
        let found: f64 = slopes.iter().zip(&direction).map(|(slope, by)| slope * by).sum();
        let at = |by: f64| {
            let moved = before.iter().zip(&direction).map(|(value, direction)| value + by * direction);
            let moved = Tensor::from_vec(moved.collect(), variable.dims(), &Device::Cpu).unwrap();
            variable.set(&moved).unwrap();
            loss().1
        };
        let by = 1e-8;
        let difference = (at(by) - at(-by)) / (2.0 * by);
        at(0.0);
        assert!((found / difference - 1.0).abs() < 1e-6, "{:?}: {found} {difference}", variable.dims());
    }
}

/// Of two grounds that a vehicle slid over, the network learns from the motion alone which holds less.
#[test]
fn motion_alone_teaches_what_ice_looks_like() {
    let curves = [FrictionCurve::ASPHALT, FrictionCurve::ICE];
    let lessons = [0.12, -0.1].map(|steering_rad| lesson(curves, steering_rad));
    let lessons: Vec<Lesson> = lessons
        .into_iter()
        .enumerate()
        .map(|(index, lesson)| Lesson::new(lesson.chassis, lesson.recording, index))
        .collect();
    let network = Network::new(0.5, 1).unwrap();
    let settings = Settings { losses: Losses::Motion, batches: 40, batch: 4, ..Settings::default() };
    let mut losses = Vec::new();
    train(&network, &lessons, settings, &mut |_, [motion, _]| losses.push(motion)).unwrap();
    let mean = |losses: &[f64]| losses.iter().sum::<f64>() / losses.len() as f64;
    assert!(mean(&losses[30..]) < 0.5 * mean(&losses[..10]), "{losses:?}");
    let seen = network.see(&lessons[0].recording.view).unwrap();
    let friction = |pixel: usize| {
        let [statics, sliding, viscous, speed] = seen[pixel].map(f64::from);
        Coefficients::<0>([statics, sliding, viscous, speed].map(Into::into)).at(1.0.into()).value
    };
    let [left, right] = [54 * 120 + 40, 54 * 120 + 60].map(friction);
    assert!(left > 1.3 * right, "{left} {right}");
}

#[test]
fn prior_knowledge_needs_classes() {
    let lessons = [lesson([FrictionCurve::GRASS, FrictionCurve::ICE], 0.1)];
    let network = Network::new(0.5, 3).unwrap();
    let refused = train(&network, &lessons, Settings::default(), &mut |_, _| {}).unwrap_err();
    assert!(refused.to_string().contains("expected a class for every pixel"), "{refused}");
    let nothing = train(&network, &[], Settings::default(), &mut |_, _| {}).unwrap_err();
    assert!(nothing.to_string().contains("two seconds of driving"), "{nothing}");
}
