//! How much of the rest any model could still explain: a small network is fitted to what the best model so far leaves
//! on the real drives, and judged on held-out ones.
//!
//! The network corrects the body rates of a rollout: from the commands of the last second, the speed and turn foretold,
//! the heading and the ground it gives, ten times a second, what is to be added to the velocity ahead and to the left
//! and to the yaw rate, and apart from that to what the sensors say of speed and yaw rate. The corrections are summed
//! over the rollout, so that whatever acts on the motion has its shape built in and few drives suffice. It is a bound in
//! the sense of a reference: what a flexible model with the same inputs learns from the same drives.

mod features;
mod network;

use crate::baseline::{Baseline, GapError, drives_of};
use crate::causes::composed;
use crate::comparison::rollout_error;
use crate::diagnosis::Diagnosis;
use crate::drive::Drive;
use crate::machine::Machine;
use bicycle::{DriveLog, Effect};
use features::{Examples, Scaling};
use network::{Network, Pace, Trained, fitted};

/// Slow, so that the little that a small rest tells is not overrun by what is learned by heart, and fast, for a large
/// rest; the drives themselves say which.
const PACES: [Pace; 2] = [
    Pace { learning_rate: 5e-4, batch: 96, n_passes: 60 },
    Pace { learning_rate: 2e-3, batch: 16, n_passes: 40 },
];
/// A correction must lower the error on drives it was not fitted to by this share, else there is none.
const WORTH_LEARNING: f64 = 0.02;

/// Why there is no bound.
#[derive(Debug, thiserror::Error)]
pub enum LearnedBoundError {
    /// The drives.
    #[error(transparent)]
    Gap(#[from] GapError),
    /// The network's arithmetic.
    #[error("the learned bound: {0}")]
    Network(#[from] candle_core::Error),
}

/// What a flexible model closes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LearnedBound {
    /// Error on the held-out drives with the learned correction, in standard deviations.
    pub error: f64,
    /// Closed part of the gap; absent where there is no gap.
    pub closed: Option<f64>,
    /// Passes over the drives that served best on the other half; 0: nothing could be learned.
    pub n_passes: usize,
}

/// Fits the correction to the real drives, on top of the announced effects, and judges it on held-out drives. The same
/// inputs give the same bytes.
///
/// # Errors
/// Drives that could not be diagnosed or verified either.
pub fn learned_bound(
    baseline: &Baseline,
    machine: &Machine,
    diagnosis: &Diagnosis,
    (real, heldout): (&[DriveLog], &[DriveLog]),
) -> Result<LearnedBound, LearnedBoundError> {
    let (real, heldout) = (drives_of("real", machine, real)?, drives_of("held-out", machine, heldout)?);
    if heldout.is_empty() {
        return Err(GapError::Few { set: "held-out", needed: 1, found: 0 }.into());
    }
    let effects = composed(&baseline.effects, diagnosis.effects());
    let examples = |drives: &[Drive]| Examples::of(baseline, &effects, drives, machine);
    let chosen = best_training(&halves(&real).each_ref().map(|half| examples(half)))?;
    let held = examples(&heldout);
    let after = match chosen {
        None => held.residuals.clone(),
        Some(training) => {
            let all = examples(&real);
            let scaling = Scaling::of(&all);
            let network = fitted(&all, &scaling, training, &mut |_, _| Ok(()))?;
            Trained { network: &network, scaling: &scaling }.corrected(&held)?
        }
    };
    let before = rollout_error(&nominal_residuals(baseline, &heldout));
    let error = rollout_error(&after);
    let n_passes = chosen.map_or(0, |(_, n_passes)| n_passes);
    Ok(LearnedBound { error, closed: baseline.closed(before, error), n_passes })
}

fn nominal_residuals(baseline: &Baseline, drives: &[Drive]) -> Vec<f32> {
    let all: Vec<&Drive> = drives.iter().collect();
    let none: [Effect; 0] = [];
    baseline.trial(&all).residuals(&none)
}

/// Every second drive, and the others; of a single drive its earlier and its later half.
fn halves(drives: &[Drive]) -> [Vec<Drive>; 2] {
    let parts: Vec<Drive> = if drives.len() == 1 { drives[0].halves() } else { drives.to_vec() };
    let every_second = |first: usize| parts.iter().skip(first).step_by(2).cloned().collect();
    [every_second(0), every_second(1)]
}

/// Each half is learned at every pace, pass by pass, and tried on the other: the pace and the number of passes after
/// which both together are foretold best; `None` where nothing helps.
fn best_training(halves: &[Examples; 2]) -> Result<Option<(Pace, usize)>, LearnedBoundError> {
    let square = |residuals: &[f32]| residuals.iter().map(|r| f64::from(*r).powi(2)).sum::<f64>();
    let unlearned: f64 = halves.iter().map(|half| square(&half.residuals)).sum();
    let mut best = (unlearned, None);
    for pace in PACES {
        let mut squares = vec![0.0; pace.n_passes];
        for (learned, other) in [(0, 1), (1, 0)] {
            let scaling = Scaling::of(&halves[learned]);
            let mut after_pass = |pass: usize, network: &Network| {
                let trained = Trained { network, scaling: &scaling };
                squares[pass - 1] += square(&trained.corrected(&halves[other])?);
                Ok(())
            };
            fitted(&halves[learned], &scaling, (pace, pace.n_passes), &mut after_pass)?;
        }
        for (place, &square) in squares.iter().enumerate() {
            if square < best.0 {
                best = (square, Some((pace, place + 1)));
            }
        }
    }
    let improved = 1.0 - (best.0 / unlearned).sqrt();
    Ok(best.1.filter(|_| improved > WORTH_LEARNING))
}

#[cfg(test)]
mod tests;
