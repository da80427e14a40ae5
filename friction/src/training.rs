//! Learning to see friction: the dual loss of AnyNav's section 3.3.1.
//!
//! What the ground's coefficients do to the motion comes from the reasoning's own derivatives; Candle is handed their
//! product with what the network sees, a surrogate whose gradient by the weights is that of the motion's loss.

use candle_core::{DType, Device, Tensor};
use candle_nn::{AdamW, Optimizer, ParamsAdamW};
use rand::seq::SliceRandom;
use rand::{RngExt, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;
use route::FrictionCurve;

use crate::chassis::Chassis;
use crate::network::{Network, NetworkError};
use crate::reasoning::State;
use crate::recording::{Recording, Window};
use crate::roll_out::{CoefficientGradient, Ground, STEPS, loss_gradient, roll_out};
use crate::view::{CHANNELS, Slopes, View};

/// Pixels along a side of the patch around a window's way.
pub(crate) const PATCH: usize = 48;
/// Error from which on the Huber loss is straight [m], and what a velocity error counts over a second of it [s].
const HUBER_M: f64 = 0.5;
const VELOCITY_S: f64 = 0.5;
/// What one counts of each coefficient in the loss by prior knowledge.
pub(crate) const COEFFICIENT_SCALES: [f64; 4] = [1.0, 1.0, 0.02, 8.0];

/// What a network learns from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Losses {
    /// Motion alone.
    Motion,
    /// Published coefficients of the class alone.
    Prior,
    /// Both.
    Both,
}

/// How long and how fast.
#[derive(Clone, Copy, Debug)]
pub struct Settings {
    /// What it learns from.
    pub losses: Losses,
    /// Weight of the prior knowledge over that of the motion [-].
    pub prior_weight: f64,
    /// Batches.
    pub batches: usize,
    /// Windows in a batch.
    pub batch: usize,
    /// Of Adam, falling to a tenth over the training.
    pub learning_rate: f64,
    /// Of weights and order.
    pub seed: u64,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            losses: Losses::Both,
            prior_weight: 0.2,
            batches: 1000,
            batch: 8,
            learning_rate: 3e-3,
            seed: 1,
        }
    }
}

/// By pixel, coefficients that prior knowledge or a drive tells.
pub type Labels = Vec<Option<[f32; 4]>>;

/// A recording with the vehicle that made it.
#[derive(Clone, Debug)]
pub struct Lesson {
    /// As described.
    pub chassis: Chassis,
    /// The drive.
    pub recording: Recording,
    slopes: Slopes,
    /// Its windows.
    pub windows: Vec<Window>,
    /// What the loss by prior knowledge is taken from, where somebody knows anything.
    labels: Option<Labels>,
}

impl Lesson {
    /// Of a validated recording, labelled with the published coefficients of its classes.
    pub fn new(chassis: Chassis, recording: Recording, index: usize) -> Self {
        let windows = recording.windows(&chassis, index);
        let published =
            |classes: &Vec<u8>| classes.iter().map(|class| Some(coefficients_of(*class))).collect();
        let labels = recording.classes.as_ref().map(published);
        Self { slopes: recording.view.slopes(), windows, chassis, recording, labels }
    }

    /// The same with other labels, one for each pixel.
    pub fn labelled(self, labels: Labels) -> Self {
        Self { labels: Some(labels), ..self }
    }

    /// Rise of the ground at a place [-].
    pub fn gradient(&self, at_m: [f64; 2]) -> [f64; 2] {
        self.slopes.at(&self.recording.view, at_m)
    }
}

/// Wheels' contacts of a state in the map [m].
pub fn wheels_m(chassis: &Chassis, state: &State) -> [[f64; 2]; 4] {
    let (sin, cos) = state.heading_rad.sin_cos();
    chassis.contacts_m().map(|[ahead_m, left_m]| {
        [state.at_m[0] + ahead_m * cos - left_m * sin, state.at_m[1] + ahead_m * sin + left_m * cos]
    })
}

/// Where a network sees coefficients, by pixel of a view.
#[derive(Clone, Debug)]
pub struct Seen {
    /// Shape [row, column].
    pub coefficients: Vec<[f32; 4]>,
}

impl Seen {
    /// Under the wheels of a state.
    pub fn under(&self, view: &View, chassis: &Chassis, state: &State) -> [[f64; 4]; 4] {
        wheels_m(chassis, state).map(|at_m| {
            let [row, col] = view.pixel(at_m);
            self.coefficients[row * view.n_cols + col].map(f64::from)
        })
    }
}

/// Where a vehicle goes over seen ground: coefficients are those under the wheels on the way that is predicted.
pub fn predict(lesson: &Lesson, window: &Window, seen: &Seen) -> Vec<State> {
    roll_out(&lesson.chassis, &window.start, &window.controls, |_, state| Ground {
        coefficients: seen.under(&lesson.recording.view, &lesson.chassis, state),
        gradient: lesson.gradient(state.at_m),
    })
}

/// Pseudo-Huber loss and its derivative.
fn huber(error: f64) -> (f64, f64) {
    let root = (1.0 + (error / HUBER_M).powi(2)).sqrt();
    (HUBER_M * HUBER_M * (root - 1.0), error / root)
}

/// Loss of a state against what was measured, a mean over the steps, and its gradient.
pub(crate) fn motion_loss(chassis: &Chassis, window: &Window, step: usize, state: &State) -> (f64, [f64; 6]) {
    let truth = &window.truth[step];
    let turn_m = 0.5 * chassis.wheelbase_m;
    let weights = [1.0, 1.0, turn_m, VELOCITY_S, VELOCITY_S, turn_m * VELOCITY_S];
    let [values, truths] = [state, truth].map(|state| state.values::<0>());
    let mut loss = 0.0;
    let gradient = std::array::from_fn(|i| {
        let (value, slope) = huber(weights[i] * (values[i].value - truths[i].value));
        loss += value / STEPS as f64;
        slope * weights[i] / STEPS as f64
    });
    (loss, gradient)
}

/// A window's patch: its corner, and the pixel under each wheel at each step on the measured way.
pub(crate) struct Patch {
    pub corner: [i64; 2],
    pub pixels: [[usize; 4]; STEPS],
}

impl Patch {
    pub(crate) fn of(lesson: &Lesson, window: &Window) -> Self {
        let view = &lesson.recording.view;
        let [row, col] = view.pixel(window.truth[STEPS / 2 - 1].at_m).map(|place| place as i64);
        let corner = [row, col].map(|place| place - PATCH as i64 / 2);
        let pixels = std::array::from_fn(|step| {
            wheels_m(&lesson.chassis, window.before(step)).map(|at_m| {
                let place = view.pixel(at_m);
                let [row, col] =
                    [0, 1].map(|i| (place[i] as i64 - corner[i]).clamp(0, PATCH as i64 - 1) as usize);
                row * PATCH + col
            })
        });
        Self { corner, pixels }
    }
}

/// Loss of the motion over a window under seen coefficients [pixel][4] of its patch, and its gradient by those under the wheels.
pub(crate) fn window_gradient(
    lesson: &Lesson,
    window: &Window,
    patch: &Patch,
    coefficients: &[f64],
) -> (f64, CoefficientGradient) {
    let grounds: [Ground; STEPS] = std::array::from_fn(|step| Ground {
        coefficients: patch.pixels[step].map(|pixel| std::array::from_fn(|i| coefficients[4 * pixel + i])),
        gradient: lesson.gradient(window.before(step).at_m),
    });
    loss_gradient(&lesson.chassis, &window.start, &window.controls, &grounds, &|step, state| {
        motion_loss(&lesson.chassis, window, step, state)
    })
}

/// A training under way.
struct Run<'a> {
    lessons: &'a [Lesson],
    network: &'a Network,
    settings: Settings,
    rng: Xoshiro256PlusPlus,
}

/// Lets a network learn; `after` hears of each batch's losses by motion and by prior knowledge.
///
/// # Errors
/// Classes that nobody told where prior knowledge is asked for, a loss that is no number.
pub fn train(
    network: &Network,
    lessons: &[Lesson],
    settings: Settings,
    after: &mut dyn FnMut(usize, [f64; 2]),
) -> Result<(), TrainingError> {
    // Threads that share products of this size out wait for one another longer than they compute.
    gemm::set_threading_threshold(usize::MAX);
    let windows: Vec<&Window> = lessons.iter().flat_map(|lesson| &lesson.windows).collect();
    if windows.is_empty() {
        return Err(TrainingError::NoWindow);
    }
    if settings.losses != Losses::Motion && lessons.iter().any(|lesson| lesson.labels.is_none()) {
        return Err(TrainingError::NoClasses);
    }
    let mut run =
        Run { lessons, network, settings, rng: Xoshiro256PlusPlus::seed_from_u64(settings.seed ^ 0x7EAC) };
    let parameters = ParamsAdamW { lr: settings.learning_rate, weight_decay: 0.0, ..ParamsAdamW::default() };
    let mut optimiser = AdamW::new(network.variables(), parameters)?;
    let mut order: Vec<&Window> = Vec::new();
    for batch in 0..settings.batches {
        if order.len() < settings.batch {
            order.extend(&windows);
            order.shuffle(&mut run.rng);
        }
        let taken = order.split_off(order.len().saturating_sub(settings.batch));
        let past = batch as f64 / settings.batches as f64;
        optimiser.set_learning_rate(settings.learning_rate * 0.1_f64.powf(past));
        let (loss, told) = run.loss(&taken)?;
        if !told.iter().all(|loss| loss.is_finite()) {
            return Err(TrainingError::NonFiniteLoss { batch: batch + 1, found: told });
        }
        optimiser.backward_step(&loss)?;
        after(batch, told);
    }
    Ok(())
}

/// Why nothing is learned.
#[derive(Debug, thiserror::Error)]
pub enum TrainingError {
    /// No driving.
    #[error("recordings: expected two seconds of driving forward faster than 2 m/s at least, found none")]
    NoWindow,
    /// Prior knowledge of nothing.
    #[error("recordings: expected a class for every pixel to learn published coefficients by, found none")]
    NoClasses,
    /// It diverged.
    #[error("batch {batch}: expected finite losses by motion and prior, found {found:?}")]
    NonFiniteLoss {
        /// From 1.
        batch: usize,
        /// By motion, by prior knowledge.
        found: [f64; 2],
    },
    /// The network cannot.
    #[error(transparent)]
    Network(#[from] NetworkError),
    /// Arithmetic was refused.
    #[error(transparent)]
    Candle(#[from] candle_core::Error),
}

impl Run<'_> {
    /// The loss to differentiate, and what motion and prior knowledge have in it.
    fn loss(&mut self, windows: &[&Window]) -> Result<(Tensor, [f64; 2]), TrainingError> {
        let patches: Vec<Patch> =
            windows.iter().map(|window| Patch::of(&self.lessons[window.recording], window)).collect();
        let seen = self.network.forward(&self.inputs(windows, &patches)?)?;
        let zero = Tensor::zeros((), DType::F32, &Device::Cpu)?;
        let (mut loss, mut told) = (zero, [0.0; 2]);
        if self.settings.losses != Losses::Prior {
            let (surrogate, motion) = surrogate(self.lessons, windows, &patches, &seen)?;
            (loss, told[0]) = ((loss + surrogate)?, motion);
        }
        if self.settings.losses != Losses::Motion {
            let prior = self.prior_loss(windows, &patches, &seen)?;
            told[1] = f64::from(prior.to_scalar::<f32>()?);
            loss = (loss + (prior * self.settings.prior_weight)?)?;
        }
        Ok((loss, told))
    }

    /// Patches, each under light of its own.
    fn inputs(&mut self, windows: &[&Window], patches: &[Patch]) -> candle_core::Result<Tensor> {
        let mut all = Vec::with_capacity(windows.len() * PATCH * PATCH * CHANNELS);
        for (window, patch) in windows.iter().zip(patches) {
            let view = &self.lessons[window.recording].recording.view;
            let mut input = Network::input(view, patch.corner, [PATCH; 2]);
            let light: f32 = self.rng.random_range(0.85..1.15);
            let tint: [f32; 3] = std::array::from_fn(|_| light * self.rng.random_range(0.94..1.06));
            for pixel in input.chunks_exact_mut(CHANNELS) {
                for (value, tint) in pixel.iter_mut().zip(tint) {
                    *value = (*value + 2.0) * tint - 2.0;
                }
            }
            all.extend(input);
        }
        Tensor::from_vec(all, (windows.len(), PATCH, PATCH, CHANNELS), &Device::Cpu)
    }

    /// Mean over labelled pixels of the absolute difference from their labels (equation 24).
    fn prior_loss(
        &self,
        windows: &[&Window],
        patches: &[Patch],
        seen: &Tensor,
    ) -> candle_core::Result<Tensor> {
        let (mut told, mut weights) = (Vec::with_capacity(4 * windows.len() * PATCH * PATCH), Vec::new());
        for (window, patch) in windows.iter().zip(patches) {
            let Lesson { recording, labels: Some(labels), .. } = &self.lessons[window.recording] else {
                continue;
            };
            for pixel in 0..PATCH * PATCH {
                let place = |offset: usize, corner: i64, n: usize| {
                    (corner + offset as i64).clamp(0, n as i64 - 1) as usize
                };
                let row = place(pixel / PATCH, patch.corner[0], recording.view.n_rows);
                let col = place(pixel % PATCH, patch.corner[1], recording.view.n_cols);
                let label = labels[row * recording.view.n_cols + col];
                told.extend(label.unwrap_or_default());
                weights.extend(COEFFICIENT_SCALES.map(|scale| label.map_or(0.0, |_| 1.0 / scale as f32)));
            }
        }
        let n_told = weights.iter().filter(|weight| **weight > 0.0).count().max(1);
        let [told, weights] =
            [told, weights].map(|values| Tensor::from_vec(values, seen.dims(), &Device::Cpu));
        ((seen - told?)?.abs()? * weights?)?.sum_all()? / n_told as f64
    }
}

/// Published coefficients of a class.
pub fn coefficients_of(class: u8) -> [f32; 4] {
    let (_, curve) = FrictionCurve::PUBLISHED[usize::from(class)];
    [curve.static_friction, curve.sliding_friction, curve.viscous_friction, curve.stribeck_speed_mps]
}

/// Sum of seen coefficients times the motion's gradient by them: its gradient by the weights is that of the mean of the
/// windows' losses, which comes second.
pub(crate) fn surrogate(
    lessons: &[Lesson],
    windows: &[&Window],
    patches: &[Patch],
    seen: &Tensor,
) -> candle_core::Result<(Tensor, f64)> {
    let values = seen.detach().to_dtype(DType::F64)?.flatten_all()?.to_vec1::<f64>()?;
    let size = PATCH * PATCH * 4;
    let mut slopes = vec![0.0; values.len()];
    let mut sum = 0.0;
    for (index, (window, patch)) in windows.iter().zip(patches).enumerate() {
        let part = index * size..(index + 1) * size;
        let (loss, gradient) =
            window_gradient(&lessons[window.recording], window, patch, &values[part.clone()]);
        sum += loss / windows.len() as f64;
        let slopes = &mut slopes[part];
        for (pixels, gradient) in patch.pixels.iter().zip(&gradient) {
            for (pixel, gradient) in pixels.iter().zip(gradient) {
                for (i, slope) in gradient.iter().enumerate() {
                    slopes[4 * pixel + i] += slope / windows.len() as f64;
                }
            }
        }
    }
    let slopes = Tensor::from_vec(slopes, seen.dims(), &Device::Cpu)?.to_dtype(seen.dtype())?;
    Ok(((seen * slopes)?.sum_all()?, sum))
}

#[cfg(test)]
mod tests;
