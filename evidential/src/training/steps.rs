//! Passes over the data: the order of the examples, Adam's steps, and the best weights so far.

use candle_core::{Tensor, Var};
use candle_nn::{AdamW, Optimizer, ParamsAdamW};
use rand::seq::SliceRandom;

use super::{Phase, TrainError, scalar};
use crate::random::stream;

/// Where a training stands.
#[derive(Clone, Copy)]
pub(super) struct Place {
    pub phase: Phase,
    pub epoch: usize,
}

pub(super) fn adam(variables: Vec<Var>, learning_rate: f64) -> candle_core::Result<AdamW> {
    AdamW::new(variables, ParamsAdamW { lr: learning_rate, weight_decay: 0.0, ..ParamsAdamW::default() })
}

/// The order of examples in one pass.
pub(super) fn order(seed: u64, key: u64, epoch: usize, n: usize) -> Vec<u32> {
    let mut order: Vec<u32> = (0..n as u32).collect();
    order.shuffle(&mut stream(seed, &[key, epoch as u64]));
    order
}

/// Steps once per batch; the mean loss.
pub(super) fn pass(
    order: &[u32],
    batch: usize,
    place: Place,
    optimiser: &mut AdamW,
    loss_of: impl Fn(&[u32]) -> candle_core::Result<Tensor>,
) -> Result<f64, TrainError> {
    let mut sum = 0.0;
    for (step, indices) in order.chunks(batch).enumerate() {
        let loss = loss_of(indices)?;
        let found = scalar(&loss)?;
        if !found.is_finite() {
            let Place { phase, epoch } = place;
            return Err(TrainError::NonFiniteLoss { phase, epoch, step: step + 1, found });
        }
        optimiser.backward_step(&loss)?;
        sum += found * indices.len() as f64;
    }
    Ok(sum / order.len() as f64)
}

/// The best weights so far.
pub(super) struct Best {
    variables: Vec<Var>,
    kept: Vec<Tensor>,
    error: f64,
    pub epoch: usize,
}

impl Best {
    pub(super) fn new(variables: Vec<Var>) -> Self {
        Self { variables, kept: Vec::new(), error: f64::INFINITY, epoch: 0 }
    }

    /// Copies the weights if their error is the smallest.
    pub(super) fn offer(&mut self, epoch: usize, error: f64) -> candle_core::Result<bool> {
        let is_best = error < self.error;
        if is_best {
            self.kept = self.variables.iter().map(|variable| variable.copy()).collect::<Result<_, _>>()?;
            (self.error, self.epoch) = (error, epoch);
        }
        Ok(is_best)
    }

    /// Puts the best weights back.
    pub(super) fn restore(self) -> candle_core::Result<()> {
        self.variables.iter().zip(&self.kept).try_for_each(|(variable, kept)| variable.set(&kept.detach()))
    }
}
