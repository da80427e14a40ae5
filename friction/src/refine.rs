//! Coefficients of places from drives without labels: the inner problem of AnyNav's bilevel optimisation (equations 26b to
//! 33), from what a network sees on; the outer one learns them as if somebody had told them.
//!
//! Every stretch of a drive over ground that looks alike has coefficients of its own, so that two grounds of one look are
//! told apart by how they drive. With them is sought what else is uncertain: inertia, scale of the wheel speed, stiffness of
//! the tyres, trims and biases.

use route::FrictionCurve;

use crate::chassis::Chassis;
use crate::find::{FindError, Problem};
use crate::least_squares::Belief;
use crate::model::{Layout, OF_CLASS, class_beliefs, coefficients, run_beliefs, vehicle_beliefs};
use crate::network::COEFFICIENTS;
use crate::recording::state;
use crate::samples::of_recording;
use crate::training::{COEFFICIENT_SCALES, Labels, Lesson, Seen, coefficients_of, wheels_m};

/// Looks are taken over this time to both sides [s].
const LOOK_S: f64 = 0.3;
/// How far a network's friction may be off, in the logarithm.
const SEEN_DEVIATION: f64 = 0.6;

/// What stays as it is described or measured: the rows of the paper's Table 5.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Held {
    /// Nothing.
    Nothing,
    /// The moment of inertia.
    Inertia,
    /// The wheel speed.
    WheelSpeed,
}

/// What was found of a vehicle and of the ground under its wheels.
#[derive(Clone, Debug)]
pub struct Refined {
    /// With the inertia and the tyres that were found.
    pub chassis: Chassis,
    /// Moment of inertia about the vertical over that of the description [-].
    pub inertia_factor: f64,
    /// Wheel speed over what was measured [-].
    pub wheel_scale: f64,
    /// Angle of the front wheels that reads as none [rad], and angle over what was measured [-].
    pub steering: [f64; 2],
    /// For each recording, by pixel: coefficients where wheels went over a stretch that says something.
    pub labels: Vec<Labels>,
}

impl Refined {
    /// A drive of the same vehicle with what it measured put right.
    pub fn corrected(&self, lesson: &Lesson, index: usize) -> Lesson {
        let [trim_rad, scale] = self.steering;
        let mut recording = lesson.recording.clone();
        for moment in &mut recording.moments {
            moment.edge_mps = moment.edge_mps.map(|edge_mps| self.wheel_scale * edge_mps);
            moment.steering_rad = scale * moment.steering_rad + trim_rad;
        }
        Lesson::new(self.chassis.clone(), recording, index)
    }
}

/// A stretch of a recording: its class in each row, and what is seen there.
struct Stretches {
    classes: Vec<usize>,
    curves: Vec<FrictionCurve>,
}

/// Finds what drives of one vehicle say, starting from what a network sees of each.
///
/// # Errors
/// No drive, or too little driving in one.
pub fn refine(lessons: &[Lesson], seen: &[Seen], held: Held) -> Result<Refined, FindError> {
    let Some(first) = lessons.first() else { return Err(FindError::NoDrive) };
    let chassis = &first.chassis;
    let mut curves = Vec::new();
    let (mut samples, mut classes) = (Vec::new(), Vec::new());
    for (index, (lesson, seen)) in lessons.iter().zip(seen).enumerate() {
        let found = stretches(lesson, seen, curves.len());
        let driven = of_recording(chassis, &lesson.recording, &found.classes, index);
        samples.extend(driven.map_err(|source| FindError::Drive { index: index + 1, source })?);
        classes.push(found.classes);
        curves.extend(found.curves);
    }
    let layout = Layout { n_runs: lessons.len(), n_classes: curves.len() };
    let named: Vec<(&str, FrictionCurve)> = curves.iter().map(|curve| ("", *curve)).collect();
    let beliefs = beliefs(held, layout.n_runs, &curves);
    let start: Vec<f64> = beliefs.iter().map(|belief| belief.mean.clamp(belief.low, belief.high)).collect();
    let problem = Problem { chassis, classes: &named, samples: &samples, layout, beliefs };
    let values = problem.solve(&[start]).0.values;
    // Stretches without a sample say nothing.
    let mut told = vec![None; curves.len()];
    for sample in &samples {
        told[sample.class].get_or_insert_with(|| of_class(&values, layout, sample.class, &curves));
    }
    let labels = |(lesson, classes): (&Lesson, &Vec<usize>)| labels(lesson, classes, &told);
    Ok(Refined {
        chassis: Chassis {
            yaw_inertia_kgm2: chassis.yaw_inertia_kgm2 * values[2].exp(),
            slip_stiffness: [0, 1].map(|axle| chassis.slip_stiffness[axle] * values[axle].exp()),
            ..chassis.clone()
        },
        inertia_factor: values[2].exp(),
        wheel_scale: 1.0 + values[3],
        steering: [values[4], 1.0 + values[5]],
        labels: lessons.iter().zip(&classes).map(labels).collect(),
    })
}

fn beliefs(held: Held, n_runs: usize, curves: &[FrictionCurve]) -> Vec<Belief> {
    let mut vehicle = vehicle_beliefs();
    let fixed = match held {
        Held::Nothing => None,
        Held::Inertia => Some(2),
        Held::WheelSpeed => Some(3),
    };
    if let Some(fixed) = fixed {
        vehicle[fixed] = Belief { low: 0.0, high: 0.0, ..vehicle[fixed] };
    }
    let of_stretch = |curve: &FrictionCurve| -> [Belief; OF_CLASS] {
        let mut beliefs = class_beliefs(curve);
        beliefs[0] =
            Belief { mean: f64::from(curve.static_friction).ln(), deviation: SEEN_DEVIATION, ..beliefs[0] };
        beliefs
    };
    let runs = (0..n_runs).flat_map(|_| run_beliefs());
    vehicle.into_iter().chain(runs).chain(curves.iter().flat_map(of_stretch)).collect()
}

/// Coefficients of a class, within what a network may say.
fn of_class(values: &[f64], layout: Layout, class: usize, curves: &[FrictionCurve]) -> [f32; 4] {
    let first = layout.class(class);
    let found = coefficients::<0>([0, 1, 2].map(|i| values[first + i].into()), &curves[class]).0;
    std::array::from_fn(|i| found[i].value.clamp(COEFFICIENTS[i][0], COEFFICIENTS[i][1]) as f32)
}

/// Rows that look alike one after another, by the nearest published curve to what is seen under the wheels; classes count from
/// `first` on.
fn stretches(lesson: &Lesson, seen: &Seen, first: usize) -> Stretches {
    let (moments, chassis) = (&lesson.recording.moments, &lesson.chassis);
    let view = &lesson.recording.view;
    let under = |moment| {
        let wheels = seen.under(view, chassis, &state(chassis, moment));
        std::array::from_fn(|i| wheels.iter().map(|wheel| 0.25 * wheel[i]).sum::<f64>())
    };
    let looks: Vec<[f64; 4]> = moments.iter().map(under).collect();
    let half = (LOOK_S / lesson.recording.spacing_s()).round() as usize;
    let kind = |row: usize| {
        let around = &looks[row.saturating_sub(half)..(row + half + 1).min(looks.len())];
        nearest(&mean(around))
    };
    let mut found = Stretches { classes: Vec::new(), curves: Vec::new() };
    let (mut last, mut begin) = (None, 0);
    for row in 0..moments.len() {
        let kind = kind(row);
        if last.is_some_and(|last| last != kind) {
            found.curves.push(curve(&mean(&looks[begin..row])));
            begin = row;
        }
        last = Some(kind);
        found.classes.push(first + found.curves.len());
    }
    found.curves.push(curve(&mean(&looks[begin..])));
    found
}

fn mean(of: &[[f64; 4]]) -> [f64; 4] {
    std::array::from_fn(|i| of.iter().map(|coefficients| coefficients[i]).sum::<f64>() / of.len() as f64)
}

fn nearest(coefficients: &[f64; 4]) -> u8 {
    let far = |class: u8| {
        let published = coefficients_of(class);
        (0..4).map(|i| (coefficients[i] - f64::from(published[i])).abs() / COEFFICIENT_SCALES[i]).sum::<f64>()
    };
    (0..7).min_by(|a, b| far(*a).total_cmp(&far(*b))).unwrap_or(0)
}

fn curve(coefficients: &[f64; 4]) -> FrictionCurve {
    let [static_friction, sliding_friction, viscous_friction, stribeck_speed_mps] =
        coefficients.map(|value| value as f32);
    FrictionCurve { static_friction, sliding_friction, viscous_friction, stribeck_speed_mps }
}

/// Coefficients of the pixels under the wheels, by the class of each row.
fn labels(lesson: &Lesson, classes: &[usize], told: &[Option<[f32; 4]>]) -> Labels {
    let (view, chassis) = (&lesson.recording.view, &lesson.chassis);
    let mut labels = vec![None; view.n_rows * view.n_cols];
    for (moment, class) in lesson.recording.moments.iter().zip(classes) {
        let Some(coefficients) = told[*class] else { continue };
        for at_m in wheels_m(chassis, &state(chassis, moment)) {
            let [row, col] = view.pixel(at_m);
            labels[row * view.n_cols + col] = Some(coefficients);
        }
    }
    labels
}
