//! Passes over the data: several starts, of which the best goes on, and the weights of its best pass.

use std::ops::ControlFlow;

use candle_core::{Device, Tensor, Var};
use candle_nn::{AdamW, Optimizer, ParamsAdamW};
use rand::seq::SliceRandom;
use rand::{RngExt, SeedableRng};
use rand_distr::StandardNormal;
use rand_xoshiro::Xoshiro256PlusPlus;

use super::data::{Data, Half, in_pieces};
use super::network::Network;
use super::{Epoch, STARTS, Settings, Teacher, TrainError};
use crate::architecture::{Architecture, CURVATURE_MAX_PER_M};

/// Examples that a validation error is taken of at a time.
const VALIDATION_BATCH: usize = 1024;
/// Training examples that units are woken by.
const WAKING: usize = 512;

/// Deviation of what is added to every standardised sample while an inverse model learns from a forward model: its encoder
/// learns the noise of so many samples by heart otherwise.
const FELT_NOISE: f32 = 0.3;
/// Deviation of what is added to the wishes, over their scale: a driver wishes what the vehicle nearly does, and a planner
/// more.
const WISH_NOISE: f32 = 0.1;

/// What is off in an answer.
enum Judge<'a> {
    /// The answer less the target.
    Targets,
    /// The yaw rate that a forward model foretells of the answer, less the wished one, over the root mean square of the
    /// speeds: curvatures that count by speed. Yaw rates are as noisy at every speed, and curvatures are not.
    Foretold {
        forward: &'a Network,
        /// Over its scale.
        speed_rms: f64,
    },
}

impl Judge<'_> {
    /// [rows, answers], over their scales; the network may feel other windows than there were.
    fn off(
        &self,
        network: &Network,
        felt: &Tensor,
        [windows, desired, targets]: &[Tensor; 3],
    ) -> candle_core::Result<Tensor> {
        let answer = network.forward(felt, desired)?;
        match self {
            Self::Targets => answer - targets,
            Self::Foretold { forward, speed_rms } => {
                let embedding = forward.embed(&in_pieces(windows)?)?.detach();
                let speed = desired.narrow(1, 0, 1)?;
                let commanded = Tensor::cat(&[&speed, &(&speed * answer)?], 1)?;
                let off = (forward.answer(&embedding, &commanded)? - (speed * desired.narrow(1, 1, 1)?)?)?;
                off / *speed_rms
            }
        }
    }
}

/// Fits a network; where a forward model judges it, that one beforehand, over the same passes.
pub(super) fn fit(
    data: &Data,
    settings: &Settings,
    on_epoch: &mut dyn FnMut(&Epoch) -> ControlFlow<()>,
) -> Result<(Network, Vec<Epoch>), TrainError> {
    let inverse = |judge: &Judge<'_>, on_epoch: &mut dyn FnMut(&Epoch) -> ControlFlow<()>| {
        best_start(data, (settings, Network::inverse, judge), on_epoch)
    };
    match settings.teacher {
        Teacher::Examples => inverse(&Judge::Targets, on_epoch),
        Teacher::ForwardModel => {
            let task: Task<'_> = (settings, Network::forward_model, &Judge::Targets);
            let (forward, _) = best_start(&data.of_forward_model()?, task, on_epoch)?;
            let square = data.training.desired.narrow(1, 0, 1)?.sqr()?.mean_all()?.to_scalar::<f32>()?;
            inverse(&Judge::Foretold { forward: &forward, speed_rms: f64::from(square).sqrt() }, on_epoch)
        }
    }
}

/// Settings, how a network begins, and who judges it.
type Task<'a> = (&'a Settings, fn(&Architecture, u64) -> candle_core::Result<Network>, &'a Judge<'a>);

/// Passes of all starts until the first tenth, then of the best alone.
fn best_start(
    data: &Data,
    task: Task<'_>,
    on_epoch: &mut dyn FnMut(&Epoch) -> ControlFlow<()>,
) -> Result<(Network, Vec<Epoch>), TrainError> {
    let settings = task.0;
    // Threads that share products of this size out wait for one another longer than they compute.
    gemm::set_threading_threshold(usize::MAX);
    let mut best: Option<Start> = None;
    let mut is_over = false;
    for number in 0..STARTS {
        let mut start = Start::new(data, task, number as u64)?;
        is_over = start.run(settings.n_heat(), data, task, on_epoch)?.is_break();
        if best.as_ref().is_none_or(|best| start.best.error < best.best.error) {
            best = Some(start);
        }
        if is_over {
            break;
        }
    }
    // There is one whose error is a number: a loss that is none was refused.
    let mut start = best.ok_or(TrainError::Diverged { epoch: settings.n_heat(), found: f64::NAN })?;
    if !is_over {
        // Whoever breaks it off keeps what is best so far.
        let _ended = start.run(settings.epochs, data, task, on_epoch)?;
    }
    start.best.restore()?;
    Ok((start.network, start.curves))
}

/// A network on its way from where it began.
struct Start {
    network: Network,
    optimiser: AdamW,
    rng: Xoshiro256PlusPlus,
    best: Best,
    curves: Vec<Epoch>,
}

impl Start {
    fn new(data: &Data, (settings, begin, _): Task<'_>, number: u64) -> Result<Self, TrainError> {
        let seed = settings.seed.wrapping_add(number << 32);
        let network = begin(&settings.architecture, seed)?;
        let n = data.training.n.min(WAKING);
        network.wake(&data.training.windows.narrow(0, 0, n)?, &data.training.desired.narrow(0, 0, n)?)?;
        let Settings { learning_rate: lr, weight_decay, .. } = *settings;
        let parameters = ParamsAdamW { lr, weight_decay, ..ParamsAdamW::default() };
        Ok(Self {
            optimiser: AdamW::new(network.variables(), parameters)?,
            rng: Xoshiro256PlusPlus::seed_from_u64(seed.wrapping_add(1)),
            best: Best { variables: network.variables(), kept: Vec::new(), error: f64::INFINITY },
            network,
            curves: Vec::with_capacity(settings.epochs),
        })
    }

    /// Goes on until so many passes are made.
    fn run(
        &mut self,
        n_passes: usize,
        data: &Data,
        (settings, _, judge): Task<'_>,
        on_epoch: &mut dyn FnMut(&Epoch) -> ControlFlow<()>,
    ) -> Result<ControlFlow<()>, TrainError> {
        for epoch in self.curves.len() + 1..=n_passes {
            self.optimiser.set_learning_rate(settings.learning_rate_of(epoch));
            let training_loss = self.pass(data, settings, judge)?;
            if !training_loss.is_finite() {
                return Err(TrainError::Diverged { epoch, found: training_loss });
            }
            let validation_rmse_per_m = validation_rmse_per_m(&self.network, &data.validation, judge)?;
            self.best.offer(validation_rmse_per_m)?;
            self.curves.push(Epoch { epoch, training_loss, validation_rmse_per_m });
            if on_epoch(&self.curves[epoch - 1]).is_break() {
                return Ok(ControlFlow::Break(()));
            }
        }
        Ok(ControlFlow::Continue(()))
    }

    fn pass(&mut self, data: &Data, settings: &Settings, judge: &Judge<'_>) -> Result<f64, TrainError> {
        let mut order: Vec<u32> = (0..data.training.n as u32).collect();
        order.shuffle(&mut self.rng);
        let mut sum = 0.0;
        for rows in order.chunks(settings.batch) {
            let indices = Tensor::from_slice(rows, rows.len(), &Device::Cpu)?;
            let [windows, desired, targets] = data.training.rows(&indices)?;
            let [felt, desired] = match judge {
                Judge::Targets => [windows.clone(), desired],
                Judge::Foretold { .. } => self.jitter(&windows, &desired)?,
            };
            let loss = judge.off(&self.network, &felt, &[windows, desired, targets])?.sqr()?.mean_all()?;
            sum += f64::from(loss.to_scalar::<f32>()?) * rows.len() as f64;
            self.optimiser.backward_step(&loss)?;
        }
        Ok(sum / data.training.n as f64)
    }

    /// Histories as an encoder might have felt them, and wishes as a planner might have had them.
    fn jitter(&mut self, windows: &Tensor, desired: &Tensor) -> candle_core::Result<[Tensor; 2]> {
        let rng = &mut self.rng;
        let mut noise = |deviation: f32, (rows, columns)| {
            let numbers = (0..rows * columns).map(|_| deviation * rng.sample::<f32, _>(StandardNormal));
            Tensor::from_vec(numbers.collect(), (rows, columns), &Device::Cpu)
        };
        let speed = desired.narrow(1, 0, 1)?;
        let wish = (desired.narrow(1, 1, 1)? + noise(WISH_NOISE, (desired.dim(0)?, 1))?)?;
        let felt = (windows + noise(FELT_NOISE, windows.dims2()?)?)?;
        Ok([felt, Tensor::cat(&[&speed, &wish], 1)?])
    }
}

/// Of the curvature, the first of the answers.
fn validation_rmse_per_m(network: &Network, half: &Half, judge: &Judge<'_>) -> Result<f64, TrainError> {
    let mut sum = 0.0;
    for begin in (0..half.n).step_by(VALIDATION_BATCH) {
        let rows: Vec<u32> = (begin..half.n.min(begin + VALIDATION_BATCH)).map(|row| row as u32).collect();
        let indices = Tensor::from_slice(&rows, rows.len(), &Device::Cpu)?;
        let rows = half.rows(&indices)?;
        let off = judge.off(network, &rows[0], &rows)?.narrow(1, 0, 1)?;
        sum += f64::from(off.sqr()?.sum_all()?.to_scalar::<f32>()?);
    }
    Ok(f64::from(CURVATURE_MAX_PER_M) * (sum / half.n as f64).sqrt())
}

/// The weights of the best pass so far.
struct Best {
    variables: Vec<Var>,
    kept: Vec<Tensor>,
    error: f64,
}

impl Best {
    fn offer(&mut self, error: f64) -> candle_core::Result<()> {
        if error < self.error {
            self.kept = self.variables.iter().map(|variable| variable.copy()).collect::<Result<_, _>>()?;
            self.error = error;
        }
        Ok(())
    }

    fn restore(&self) -> candle_core::Result<()> {
        self.variables.iter().zip(&self.kept).try_for_each(|(variable, kept)| variable.set(&kept.detach()))
    }
}
