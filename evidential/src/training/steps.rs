//! Passes over the data: the order of the examples, Adam's steps, their running mean, and the best weights so far.

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

/// Share of the running mean that a pass leaves as it was: it looks back over about five passes.
const MEAN_KEPT: f64 = 0.8;

/// The running mean of the weights over the passes (Polyak and Ruppert). The weights that Adam leaves after a pass are
/// scattered around what they should be by the noise of its last steps; which of them the validation data like best is
/// partly luck, and their mean is better than any.
pub(super) struct RunningMean {
    variables: Vec<Var>,
    means: Vec<Tensor>,
}

impl RunningMean {
    /// Of variables that it does not touch, beginning with their values.
    pub(super) fn new(variables: Vec<Var>) -> candle_core::Result<Self> {
        let means = variables.iter().map(|variable| variable.copy()).collect::<Result<_, _>>()?;
        Ok(Self { variables, means })
    }

    /// Takes in the weights as they are after a pass.
    pub(super) fn take_in(&mut self, epoch: usize) -> candle_core::Result<()> {
        // At first the mean over all passes: the initial weights are no pass.
        let kept = MEAN_KEPT.min((epoch as f64 - 1.0) / epoch as f64);
        for (mean, variable) in self.means.iter_mut().zip(&self.variables) {
            *mean = (mean.affine(kept, 0.0)? + variable.detach().affine(1.0 - kept, 0.0)?)?;
        }
        Ok(())
    }

    /// Exchanges the weights and their mean; twice is nothing.
    pub(super) fn exchange(&mut self) -> candle_core::Result<()> {
        for (mean, variable) in self.means.iter_mut().zip(&self.variables) {
            let weights = variable.copy()?;
            variable.set(&mean.detach())?;
            *mean = weights;
        }
        Ok(())
    }
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

#[cfg(test)]
mod tests {
    use candle_core::Device;

    use super::*;

    #[test]
    fn running_mean_starts_as_the_plain_mean_and_forgets_what_is_long_ago() {
        let weight = Var::new(&[9f32], &Device::Cpu).unwrap();
        let mut mean = RunningMean::new(vec![weight.clone()]).unwrap();
        let value = |weight: &Var| weight.to_vec1::<f32>().unwrap()[0];
        let mut expected = 0.0;
        for (epoch, found) in [4f32, 2.0, 6.0, 0.0, 1.0, 3.0, 8.0].into_iter().enumerate() {
            weight.set(&Tensor::new(&[found], &Device::Cpu).unwrap()).unwrap();
            mean.take_in(epoch + 1).unwrap();
            // The plain mean over the first five passes, a fifth of the newest after that.
            expected += (found - expected) / (epoch + 1).min(5) as f32;
            mean.exchange().unwrap();
            assert!((value(&weight) - expected).abs() < 1e-5, "{} {expected}", value(&weight));
            mean.exchange().unwrap();
            assert_eq!(value(&weight), found, "training goes on from where it was");
        }
    }
}
