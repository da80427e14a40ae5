//! Predictions that see no friction: a kinematic bicycle, a particle filter, a network for what the bicycle leaves, and one
//! friction for all ground.

use candle_core::{Device, Tensor, Var};
use candle_nn::{AdamW, Optimizer, ParamsAdamW};
use friction::{
    Chassis, Coefficients, Ground, Lesson, Moment, PERIOD_S, STEPS, SUBSTEPS, State, Surface, Window,
    roll_out,
};
use rand::RngExt;
use rand_distr::StandardNormal;
use rand_xoshiro::Xoshiro256PlusPlus;
use scenarios::stream;

/// Mean of the seven published rows: static, sliding, viscous, Stribeck speed.
pub(super) const MEAN_CURVE: [f64; 4] = [0.679, 0.583, 0.0063, 4.86];
/// Levels of friction over the mean that are tried for one that suits all ground.
const LEVELS: [f64; 9] = [0.3, 0.5, 0.7, 0.85, 1.0, 1.15, 1.3, 1.5, 1.8];
const PARTICLES: usize = 200;
/// How far a particle wanders in a step, in the logarithm, and what the unit errs by [m/s2].
const WANDER: f64 = 0.08;
const NOISE_MPS2: f64 = 1.0;

fn level_curve(level: f64) -> [f64; 4] {
    let [statics, sliding, viscous, speed] = MEAN_CURVE;
    [level * statics, level * sliding, level * viscous, speed]
}

/// Wheels roll where they point, as fast as the driven ones turn.
pub(super) fn bicycle(lesson: &Lesson, window: &Window) -> Vec<State> {
    let chassis = &lesson.chassis;
    let ahead_m = chassis.cog_ahead_m;
    let (sin, cos) = window.start.heading_rad.sin_cos();
    let mut rear_m = [window.start.at_m[0] - ahead_m * cos, window.start.at_m[1] - ahead_m * sin];
    let mut heading_rad = window.start.heading_rad;
    let mut states = Vec::with_capacity(STEPS);
    let step_s = PERIOD_S / SUBSTEPS as f64;
    for controls in window.controls.chunks(SUBSTEPS) {
        for controls in controls {
            let speed_mps = chassis.driven_mps(&controls.edge_mps);
            let (sin, cos) = heading_rad.sin_cos();
            rear_m = [rear_m[0] + step_s * speed_mps * cos, rear_m[1] + step_s * speed_mps * sin];
            heading_rad += step_s * speed_mps * controls.steering_rad.tan() / chassis.wheelbase_m;
        }
        let (sin, cos) = heading_rad.sin_cos();
        let at_m = [rear_m[0] + ahead_m * cos, rear_m[1] + ahead_m * sin];
        states.push(State { at_m, heading_rad, ..window.start });
    }
    states
}

/// The reasoning with one level of the mean curve for all ground.
pub(super) fn constant(lesson: &Lesson, window: &Window, level: f64) -> Vec<State> {
    roll_out(&lesson.chassis, &window.start, &window.controls, |_, state| Ground {
        coefficients: [level_curve(level); 4],
        gradient: lesson.gradient(state.at_m),
    })
}

/// The level under which the training drives come out best.
pub(super) fn best_level(lessons: &[&Lesson]) -> f64 {
    let error_m = |level: f64| -> f64 {
        let windows =
            lessons.iter().flat_map(|lesson| lesson.windows.iter().step_by(4).map(move |w| (lesson, w)));
        windows
            .map(|(lesson, window)| {
                super::errors::WindowError::of(&constant(lesson, window, level), &window.truth).ate_m
            })
            .sum()
    };
    LEVELS.into_iter().min_by(|a, b| error_m(*a).total_cmp(&error_m(*b))).unwrap_or(1.0)
}

/// Levels of friction at the begin of each window, by a particle filter over all that was felt before (after Vosahlik and
/// others 2021, over the same reasoning).
pub(super) fn particle_levels(lesson: &Lesson, seed: u64) -> Vec<f64> {
    let moments = &lesson.recording.moments;
    let mut rng = stream(seed, &[0x9F]);
    let mut particles = vec![0.0_f64; PARTICLES];
    particles.iter_mut().for_each(|particle| *particle = 0.4 * rng.sample::<f64, _>(StandardNormal));
    let every = (PERIOD_S / lesson.recording.spacing_s()).round().max(1.0) as usize;
    let mut levels = Vec::with_capacity(lesson.windows.len());
    let mut windows = lesson.windows.iter().peekable();
    for (index, moment) in moments.iter().enumerate() {
        while windows.next_if(|window| window.first <= index).is_some() {
            levels.push((particles.iter().sum::<f64>() / PARTICLES as f64).exp());
        }
        if index % every == 0 && moment.velocity_mps[0] > 1.0 {
            particles = resampled(&lesson.chassis, moment, &particles, &mut rng);
        }
    }
    levels
}

fn resampled(
    chassis: &Chassis,
    moment: &Moment,
    particles: &[f64],
    rng: &mut Xoshiro256PlusPlus,
) -> Vec<f64> {
    let moved: Vec<f64> =
        particles.iter().map(|particle| particle + WANDER * rng.sample::<f64, _>(StandardNormal)).collect();
    let weights: Vec<f64> =
        moved.iter().map(|particle| likelihood(chassis, moment, particle.exp())).collect();
    let sum: f64 = weights.iter().sum();
    if sum <= 0.0 {
        return moved;
    }
    let offset: f64 = rng.random_range(0.0..1.0);
    let (mut index, mut reached) = (0, weights[0] / sum);
    let draw = |k: usize| {
        let wanted = (k as f64 + offset) / PARTICLES as f64;
        while reached < wanted && index + 1 < PARTICLES {
            index += 1;
            reached += weights[index] / sum;
        }
        moved[index]
    };
    (0..PARTICLES).map(draw).collect()
}

fn likelihood(chassis: &Chassis, moment: &Moment, level: f64) -> f64 {
    let [ahead_mps, left_mps] = moment.velocity_mps;
    let ahead_m = chassis.cog_ahead_m;
    let felt = [moment.felt[0] - moment.yaw_radps * moment.yaw_radps * ahead_m, moment.felt[1]];
    let state = State {
        at_m: [0.0; 2],
        heading_rad: 0.0,
        velocity: [ahead_mps, left_mps + moment.yaw_radps * ahead_m, moment.yaw_radps],
        specific_mps2: felt,
    };
    let controls = friction::Controls { edge_mps: moment.edge_mps, steering_rad: moment.steering_rad };
    let friction = [Coefficients(level_curve(level).map(Into::into)); 4];
    let surface = Surface { friction, pull_mps2: [0.0; 2], across_mps2: friction::GRAVITY_MPS2 };
    let after = chassis.advance::<0>(&state.values(), &controls, &surface, 1e-3);
    let off = [after[6].value - felt[0], after[7].value - felt[1]].map(|off| off / NOISE_MPS2);
    (-0.5 * (off[0] * off[0] + off[1] * off[1])).exp()
}

const INPUTS: usize = 3 + 2 * STEPS + 8 + 1;
const HIDDEN: usize = 64;
const BATCHES: usize = 1500;
const BATCH: usize = 64;

/// A network that adds to the bicycle's prediction, from the start's velocities, the controls and the picture ahead (as
/// TartanDrive's does, without recurrence).
pub(super) struct Residual {
    layers: Vec<[Var; 2]>,
}

impl Residual {
    pub(super) fn trained(lessons: &[&Lesson], seed: u64) -> candle_core::Result<Self> {
        let mut rng = stream(seed, &[0x4E5]);
        let network = Self::new(&mut rng)?;
        let windows: Vec<(&Lesson, &Window)> =
            lessons.iter().flat_map(|lesson| lesson.windows.iter().map(move |w| (*lesson, w))).collect();
        let inputs: Vec<Vec<f32>> = windows.iter().map(|(lesson, window)| inputs(lesson, window)).collect();
        let targets: Vec<Vec<f32>> =
            windows.iter().map(|(lesson, window)| left_over(lesson, window)).collect();
        let variables = network.layers.iter().flatten().cloned().collect();
        let parameters = ParamsAdamW { lr: 1e-3, weight_decay: 1e-3, ..ParamsAdamW::default() };
        let mut optimiser = AdamW::new(variables, parameters)?;
        for _ in 0..BATCHES {
            let rows: Vec<usize> = (0..BATCH).map(|_| rng.random_range(0..windows.len())).collect();
            let gather = |of: &[Vec<f32>], width: usize| {
                let values = rows.iter().flat_map(|row| of[*row].iter().copied()).collect();
                Tensor::from_vec(values, (BATCH, width), &Device::Cpu)
            };
            let off = (network.forward(&gather(&inputs, INPUTS)?)? - gather(&targets, 3 * STEPS)?)?;
            optimiser.backward_step(&off.sqr()?.affine(1.0, 0.05)?.sqrt()?.mean_all()?)?;
        }
        Ok(network)
    }

    fn new(rng: &mut Xoshiro256PlusPlus) -> candle_core::Result<Self> {
        let layer = |(n_inputs, n_outputs): (usize, usize)| {
            let deviation = (2.0 / n_inputs as f32).sqrt();
            let weights = (0..n_inputs * n_outputs).map(|_| deviation * rng.sample::<f32, _>(StandardNormal));
            let weights = Var::from_vec(weights.collect(), (n_inputs, n_outputs), &Device::Cpu)?;
            Ok([weights, Var::zeros(n_outputs, candle_core::DType::F32, &Device::Cpu)?])
        };
        let shapes = [(INPUTS, HIDDEN), (HIDDEN, HIDDEN), (HIDDEN, 3 * STEPS)];
        Ok(Self { layers: shapes.into_iter().map(layer).collect::<candle_core::Result<_>>()? })
    }

    fn forward(&self, inputs: &Tensor) -> candle_core::Result<Tensor> {
        let mut values = inputs.clone();
        for (index, [weights, biases]) in self.layers.iter().enumerate() {
            let sums = values.matmul(weights)?.broadcast_add(biases)?;
            values = if index + 1 < self.layers.len() { sums.relu()? } else { sums };
        }
        Ok(values)
    }

    pub(super) fn predict(&self, lesson: &Lesson, window: &Window) -> candle_core::Result<Vec<State>> {
        let inputs = Tensor::from_vec(inputs(lesson, window), (1, INPUTS), &Device::Cpu)?;
        let added = self.forward(&inputs)?.flatten_all()?.to_vec1::<f32>()?;
        let (sin, cos) = window.start.heading_rad.sin_cos();
        let add = |(step, state): (usize, State)| {
            let [ahead, left, turn] = [0, 1, 2].map(|i| f64::from(added[3 * step + i]));
            let at_m = [state.at_m[0] + ahead * cos - left * sin, state.at_m[1] + ahead * sin + left * cos];
            State { at_m, heading_rad: state.heading_rad + turn, ..state }
        };
        Ok(bicycle(lesson, window).into_iter().enumerate().map(add).collect())
    }
}

/// What the bicycle leaves: ahead, left of the start's heading [m], turned [rad].
fn left_over(lesson: &Lesson, window: &Window) -> Vec<f32> {
    let (sin, cos) = window.start.heading_rad.sin_cos();
    let states = bicycle(lesson, window);
    let off = states.iter().zip(&window.truth).flat_map(|(state, truth)| {
        let [x, y] = [0, 1].map(|i| truth.at_m[i] - state.at_m[i]);
        [x * cos + y * sin, y * cos - x * sin, truth.heading_rad - state.heading_rad]
    });
    off.map(|value| value as f32).collect()
}

fn inputs(lesson: &Lesson, window: &Window) -> Vec<f32> {
    let mut inputs: Vec<f64> = window.start.velocity.map(|value| 0.2 * value).to_vec();
    for controls in window.controls.iter().skip(SUBSTEPS / 2).step_by(SUBSTEPS) {
        inputs.push(0.2 * lesson.chassis.driven_mps(&controls.edge_mps));
        inputs.push(4.0 * controls.steering_rad);
    }
    inputs.extend(picture_ahead(lesson, window));
    inputs.push(lesson.chassis.wheelbase_m - 2.5);
    inputs.into_iter().map(|value| value as f32).collect()
}

/// Mean and deviation of each channel in the twelve metres ahead.
fn picture_ahead(lesson: &Lesson, window: &Window) -> [f64; 8] {
    let view = &lesson.recording.view;
    let (sin, cos) = window.start.heading_rad.sin_cos();
    let (mut sums, mut squares, mut n) = ([0.0; 4], [0.0; 4], 0.0);
    for k in 0..24 * 8 {
        let (ahead_m, left_m) = (0.5 * f64::from(k / 8), f64::from(k % 8) - 3.5);
        let x_m = window.start.at_m[0] + ahead_m * cos - left_m * sin;
        let y_m = window.start.at_m[1] + ahead_m * sin + left_m * cos;
        let [row, col] = view.pixel([x_m, y_m]);
        n += 1.0;
        for channel in 0..4 {
            let value = f64::from(view.values[(channel * view.n_rows + row) * view.n_cols + col]);
            sums[channel] += value;
            squares[channel] += value * value;
        }
    }
    std::array::from_fn(|i| {
        let mean = sums[i % 4] / n;
        let deviation = (squares[i % 4] / n - mean * mean).max(0.0).sqrt();
        if i < 3 {
            2.0 * (mean - 0.5)
        } else if i == 3 {
            0.0
        } else {
            10.0 * deviation
        }
    })
}
