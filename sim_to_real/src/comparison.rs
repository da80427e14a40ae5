//! Drives, what a model foretells on them, and the difference in standard deviations.

use crate::drive::{Drive, HORIZONS, N_QUANTITIES, VY};
use crate::familiarity::Familiarity;
use crate::least_squares::mean_loss;
use crate::rollout::{PER_START, Simulator};
use crate::whitening::Whitening;
use bicycle::Effect;
use serde::{Deserialize, Serialize};

/// Standard deviation of each quantity at each horizon on nominal drives, horizon by horizon; [m], [rad], [m/s], [rad/s];
/// 0 where nothing was measured, which is not compared then.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Yardstick(pub(crate) Vec<f64>);

/// Drives with what was measured after every start.
#[derive(Clone, Debug)]
pub(crate) struct Comparison<'a> {
    wheelbase_m: f64,
    drives: Vec<&'a Drive>,
    measured: Vec<f32>,
    per_sigma: Vec<f32>,
    judge: Option<Judge<'a>>,
}

/// How residuals are judged.
#[derive(Clone, Debug)]
struct Judge<'a> {
    whitening: &'a Whitening,
    /// One over the standard deviation of every start's residuals, their mean square 1.
    weights: Vec<f32>,
}

impl<'a> Comparison<'a> {
    pub(crate) fn new(wheelbase_m: f64, drives: Vec<&'a Drive>, yardstick: &Yardstick) -> Self {
        let measured = drives.iter().flat_map(|drive| outcomes(drive)).collect();
        Self { wheelbase_m, drives, measured, per_sigma: yardstick.per_sigma(), judge: None }
    }

    /// The same with residuals judged by what belongs together in them, and by how familiar the driving is.
    pub(crate) fn judged_by(self, whitening: &'a Whitening, familiarity: &Familiarity) -> Self {
        let squares: Vec<f32> = self.drives.iter().flat_map(|drive| familiarity.weights(drive)).collect();
        let mean = (squares.iter().sum::<f32>() / squares.len().max(1) as f32).max(f32::MIN_POSITIVE);
        let weights = squares.iter().map(|square| (square / mean).sqrt()).collect();
        Self { judge: Some(Judge { whitening, weights }), ..self }
    }

    /// Foretold less measured, in standard deviations: drive by drive, start by start, [`PER_START`] numbers each;
    /// exactly 0 where nothing was measured.
    pub(crate) fn residuals(&self, effects: &[Effect]) -> Vec<f32> {
        let predicted = Simulator::new(self.wheelbase_m, effects).predict(&self.drives);
        let both = predicted.iter().zip(&self.measured).zip(self.per_sigma.iter().cycle());
        let residual = |((predicted, measured), per_sigma): ((&f32, &f32), &f32)| {
            if measured.is_nan() { 0.0 } else { (predicted - measured) * per_sigma }
        };
        both.map(residual).collect()
    }

    pub(crate) fn drives(&self) -> impl Iterator<Item = &Drive> {
        self.drives.iter().copied()
    }

    /// How many numbers of a rollout are compared, over those without the speed to the left. An effect that this does not see
    /// takes as much off the sum of the losses as without it, and that much less off their mean.
    pub(crate) fn numbers_ratio(&self) -> f64 {
        if !self.drives().any(|drive| drive.evidence.side_speed) {
            return 1.0;
        }
        let n = |per_sigma: &[f32]| per_sigma.iter().filter(|own| **own > 0.0).count().max(1) as f64;
        n(&self.per_sigma) / n(&of_the_error(&self.per_sigma))
    }

    pub(crate) fn n_starts(&self) -> usize {
        self.drives.iter().map(|drive| drive.starts.len()).sum()
    }

    /// Whether every drive can judge this effect.
    pub(crate) fn judges(&self, id: &str) -> bool {
        self.drives.iter().all(|drive| drive.evidence.judges(id))
    }

    /// What the noise of the measurements alone makes of the residuals: the smoothed outcome less the measured one.
    pub(crate) fn noise(&self) -> Vec<f32> {
        let of_drive = |drive: &&Drive| {
            let smooth = Drive { measured: drive.smooth.clone(), ..(*drive).clone() };
            outcomes(&smooth).into_iter().zip(outcomes(drive)).collect::<Vec<_>>()
        };
        let both = self.drives.iter().flat_map(of_drive).zip(self.per_sigma.iter().cycle());
        let noise = |((smooth, measured), per_sigma): ((f32, f32), &f32)| {
            if measured.is_nan() { 0.0 } else { (smooth - measured) * per_sigma }
        };
        both.map(noise).collect()
    }

    /// The residuals as they are judged.
    pub(crate) fn judged_residuals(&self, effects: &[Effect]) -> Vec<f32> {
        let residuals = self.residuals(effects);
        let Some(Judge { whitening, weights }) = &self.judge else { return residuals };
        let mut judged = whitening.applied(&residuals);
        for (start, weight) in judged.chunks_mut(PER_START).zip(weights) {
            start.iter_mut().for_each(|residual| *residual *= weight);
        }
        judged
    }

    /// Mean robust loss of a model.
    pub(crate) fn loss(&self, effects: &[Effect]) -> f64 {
        mean_loss(&self.judged_residuals(effects))
    }
}

/// Root mean square of what was measured: a residual of exactly 0 stands for nothing measured. Without any, 0.
pub(crate) fn root_mean_square(residuals: &[f32]) -> f64 {
    let sum: f64 = residuals.iter().map(|r| f64::from(*r) * f64::from(*r)).sum();
    (sum / n_measured(residuals).max(1) as f64).sqrt()
}

/// The residuals that the error of a model is made of: of all quantities but the speed to the left, which few robots measure.
pub(crate) fn of_the_error(residuals: &[f32]) -> Vec<f32> {
    residuals.chunks(N_QUANTITIES).flat_map(|own| &own[..VY]).copied().collect()
}

/// Root mean square of what was measured of them: the error by which a shrunk gap is told.
pub(crate) fn rollout_error(residuals: &[f32]) -> f64 {
    root_mean_square(&of_the_error(residuals))
}

/// Number of residuals that something was measured for.
pub(crate) fn n_measured(residuals: &[f32]) -> usize {
    residuals.iter().filter(|residual| **residual != 0.0).count()
}

/// What was measured after every start, [`PER_START`] numbers each; NaN what was not.
fn outcomes(drive: &Drive) -> Vec<f32> {
    let at = |&start: &usize| HORIZONS.iter().flat_map(move |&steps| drive.outcome(start, steps));
    drive.starts.iter().flat_map(at).map(|value| value as f32).collect()
}

impl Yardstick {
    /// Before anything is known: a few per cent of what a vehicle of this size does.
    pub(crate) fn rough() -> Self {
        Self([0.05, 0.05, 0.02, 0.1, 0.05, 0.05].repeat(HORIZONS.len()))
    }

    /// The spread of residuals that were measured in units of `unit`; outliers count with the loss's weight.
    pub(crate) fn of(residuals: &[f32], unit: &Self) -> Self {
        let spread = |place: usize| {
            let values: Vec<f32> = residuals.chunks(PER_START).map(|start| start[place]).collect();
            let size = if n_measured(&values) == 0 { 0.0 } else { root_mean_square(&values).max(1e-6) };
            unit.0[place] * size
        };
        Self((0..PER_START).map(spread).collect())
    }

    /// What a difference is multiplied by to be in standard deviations.
    pub(crate) fn per_sigma(&self) -> Vec<f32> {
        self.0.iter().map(|sigma| if *sigma > 0.0 { (1.0 / sigma) as f32 } else { 0.0 }).collect()
    }
}

const _: () = assert!(PER_START == HORIZONS.len() * N_QUANTITIES);
