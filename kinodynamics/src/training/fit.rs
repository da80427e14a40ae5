//! Passes over the data: several starts, of which the best goes on, and the weights of its best pass.

use std::ops::ControlFlow;

use candle_core::{Device, Tensor, Var};
use candle_nn::{AdamW, Optimizer, ParamsAdamW};
use rand::SeedableRng;
use rand::seq::SliceRandom;
use rand_xoshiro::Xoshiro256PlusPlus;

use super::data::{Data, Half};
use super::network::Network;
use super::{Epoch, STARTS, Settings, TrainError};
use crate::architecture::Architecture;

/// Examples that a validation error is taken of at a time.
const VALIDATION_BATCH: usize = 1024;
/// Training examples that units are woken by.
const WAKING: usize = 512;

/// Passes of all starts until the first tenth, then of the best alone.
pub(super) fn fit(
    data: &Data,
    settings: &Settings,
    on_epoch: &mut dyn FnMut(&Epoch) -> ControlFlow<()>,
) -> Result<(Network, Vec<Epoch>), TrainError> {
    // Threads that share products of this size out wait for one another longer than they compute.
    gemm::set_threading_threshold(usize::MAX);
    let mut best: Option<Start> = None;
    let mut is_over = false;
    for number in 0..STARTS {
        let mut start = Start::new(data, settings, number as u64)?;
        is_over = start.run(settings.n_heat(), data, settings, on_epoch)?.is_break();
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
        let _ended = start.run(settings.epochs, data, settings, on_epoch)?;
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
    fn new(data: &Data, settings: &Settings, number: u64) -> Result<Self, TrainError> {
        let seed = settings.seed.wrapping_add(number << 32);
        let network = Network::new(&settings.architecture, seed)?;
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
        settings: &Settings,
        on_epoch: &mut dyn FnMut(&Epoch) -> ControlFlow<()>,
    ) -> Result<ControlFlow<()>, TrainError> {
        for epoch in self.curves.len() + 1..=n_passes {
            self.optimiser.set_learning_rate(settings.learning_rate_of(epoch));
            let training_loss = self.pass(data, settings)?;
            if !training_loss.is_finite() {
                return Err(TrainError::Diverged { epoch, found: training_loss });
            }
            let validation_rmse_per_m =
                validation_rmse_per_m(&self.network, &data.validation, settings.architecture)?;
            self.best.offer(validation_rmse_per_m)?;
            self.curves.push(Epoch { epoch, training_loss, validation_rmse_per_m });
            if on_epoch(&self.curves[epoch - 1]).is_break() {
                return Ok(ControlFlow::Break(()));
            }
        }
        Ok(ControlFlow::Continue(()))
    }

    fn pass(&mut self, data: &Data, settings: &Settings) -> Result<f64, TrainError> {
        let mut order: Vec<u32> = (0..data.training.n as u32).collect();
        order.shuffle(&mut self.rng);
        let mut sum = 0.0;
        for rows in order.chunks(settings.batch) {
            let indices = Tensor::from_slice(rows, rows.len(), &Device::Cpu)?;
            let [windows, desired, targets] = data.training.rows(&indices)?;
            let loss = (self.network.forward(&windows, &desired)? - targets)?.sqr()?.mean_all()?;
            sum += f64::from(loss.to_scalar::<f32>()?) * rows.len() as f64;
            self.optimiser.backward_step(&loss)?;
        }
        Ok(sum / data.training.n as f64)
    }
}

/// Of the curvature, the first of the answers.
fn validation_rmse_per_m(
    network: &Network,
    half: &Half,
    architecture: Architecture,
) -> Result<f64, TrainError> {
    let mut sum = 0.0;
    for begin in (0..half.n).step_by(VALIDATION_BATCH) {
        let rows: Vec<u32> = (begin..half.n.min(begin + VALIDATION_BATCH)).map(|row| row as u32).collect();
        let indices = Tensor::from_slice(&rows, rows.len(), &Device::Cpu)?;
        let [windows, desired, targets] = half.rows(&indices)?;
        let off = (network.forward(&windows, &desired)? - targets)?.narrow(1, 0, 1)?;
        sum += f64::from(off.sqr()?.sum_all()?.to_scalar::<f32>()?);
    }
    let scale = f64::from(architecture.answer_scales()[0]);
    Ok(scale * (sum / half.n as f64).sqrt())
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
