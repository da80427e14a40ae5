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
use crate::comparison::root_mean_square;
use crate::diagnosis::Diagnosis;
use crate::drive::Drive;
use crate::machine::Machine;
use bicycle::{DriveLog, Effect};
use features::{Examples, Scaling};
use network::{Network, Trained, fitted};

/// Passes over the examples, at most.
#[allow(dead_code)]
const N_PASSES: usize = 60;
pub(crate) fn n_passes_max() -> usize { network::tuned("PASSES", 60.0) as usize }
/// A correction must lower the error on drives it was not fitted to by this share, else there is none.
const WORTH_LEARNING: f64 = 0.02;
/// Steps between the starts of rollouts that the network learns from.
const STRIDE: usize = 5;

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
    let halves = halves(&real);
    let n_passes = best_number_of_passes(&halves.each_ref().map(|half| examples(&half.iter().map(denser).collect::<Vec<_>>())))?;
    let held = examples(&heldout);
    let after = if n_passes == 0 {
        held.residuals.clone()
    } else {
        let denser: Vec<Drive> = real.iter().map(denser).collect();
        let all = examples(&denser);
        let scaling = Scaling::of(&all);
        let network = fitted(&all, &scaling, n_passes, &mut |_, _| Ok(()))?;
        Trained { network: &network, scaling: &scaling }.corrected(&held)?
    };
    let before = root_mean_square(&nominal_residuals(baseline, &heldout));
    let error = root_mean_square(&after);
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

/// The same drive with more starts.
fn denser(drive: &Drive) -> Drive {
    let starts = match drive.starts[..] {
        [first, .., last] => (first..=last).step_by(STRIDE).collect(),
        _ => drive.starts.clone(),
    };
    Drive { starts, ..drive.clone() }
}

/// Each half is learned, pass by pass, and tried on the other: the number of passes after which both together are
/// foretold best.
fn best_number_of_passes(halves: &[Examples; 2]) -> Result<usize, LearnedBoundError> {
    let mut squares = vec![0.0; n_passes_max() + 1];
    for (learned, other) in [(0, 1), (1, 0)] {
        let other = &halves[other];
        let mut note = |pass: usize, residuals: &[f32]| {
            squares[pass] += residuals.iter().map(|r| f64::from(*r).powi(2)).sum::<f64>();
        };
        note(0, &other.residuals);
        let scaling = Scaling::of(&halves[learned]);
        let mut after_pass = |pass: usize, trained: &Network| {
            note(pass, &Trained { network: trained, scaling: &scaling }.corrected(other)?);
            if pass % 10 == 0 { eprint!(" {:.3}", root_mean_square(&Trained { network: trained, scaling: &scaling }.corrected(&halves[learned])?)); }
            Ok(())
        };
        fitted(&halves[learned], &scaling, n_passes_max(), &mut after_pass)?;
    }
    eprintln!(" || {:?}", squares.iter().step_by(6).map(|s| ((s / (halves[0].residuals.len()+halves[1].residuals.len()) as f64).sqrt() * 1e3).round() / 1e3).collect::<Vec<_>>());
    let best = (0..=n_passes_max()).min_by(|a, b| squares[*a].total_cmp(&squares[*b])).unwrap_or(0);
    let improved = 1.0 - (squares[best] / squares[0]).sqrt();
    Ok(if improved > WORTH_LEARNING { best } else { 0 })
}

