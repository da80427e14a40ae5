//! Whether what separates the drives is the same throughout: early and late in them, to the left and to the right.

use crate::baseline::Baseline;
use crate::cross_validation::CrossValidation;
use crate::drive::Drive;
use bicycle::Effect;

/// Causes that foretell other drives better by this in the logarithm of the loss than anything constant does, once their
/// parameters may differ from one half to the other, are not the same throughout.
const NOT_THE_SAME: f64 = 0.04;
/// Rollouts that each drive must have in each half.
const FEWEST: usize = 15;
/// The steering counts over this many steps from a rollout's start.
const LOOK_AHEAD: usize = 50;

/// What may differ from one half of the rollouts to the other.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Halves {
    /// The first half of every drive and the second.
    EarlyAndLate,
    /// Steering to the left and to the right.
    LeftAndRight,
}

impl Halves {
    const ALL: [Self; 2] = [Self::EarlyAndLate, Self::LeftAndRight];

    fn is_in_first(self, drive: &Drive, place: usize) -> bool {
        match self {
            Self::EarlyAndLate => 2 * place < drive.starts.len(),
            Self::LeftAndRight => {
                let start = drive.starts[place];
                let ahead = &drive.commands[start..start + LOOK_AHEAD];
                ahead.iter().map(|command| command.steering_rad).sum::<f32>() > 0.0
            }
        }
    }

    fn of(self, drives: &[Drive]) -> Option<[Vec<Drive>; 2]> {
        let part = |is_first: bool| {
            drives.iter().map(move |drive| {
                let places = (0..drive.starts.len()).filter(|&i| self.is_in_first(drive, i) == is_first);
                Drive { starts: places.map(|i| drive.starts[i]).collect(), ..drive.clone() }
            })
        };
        let parts = [true, false].map(|is_first| part(is_first).collect::<Vec<_>>());
        parts.iter().flatten().all(|drive| drive.starts.len() >= FEWEST).then_some(parts)
    }
}

/// Causes that are not the same throughout.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Changing {
    pub(crate) causes: Vec<Effect>,
    /// Between which they differ.
    pub(crate) halves: Halves,
}

impl Changing {
    /// In words.
    pub(crate) fn told(&self) -> String {
        let names: Vec<&str> = self.causes.iter().map(|cause| cause.description().cause).collect();
        let how = match self.halves {
            Halves::EarlyAndLate => "not the same early and late in the drives",
            Halves::LeftAndRight => "not the same to the left and to the right",
        };
        format!(
            "{} foretells the drives better than anything constant once it is {how}",
            names.join(" with ")
        )
    }
}

/// Of explanations that come into question, the one that foretells the drives best once its parameters may differ from one
/// half to the other, if it does better so than all of them do as they are.
pub(crate) fn changing(
    baseline: &Baseline,
    drives: &[Drive],
    explanations: &[Vec<Effect>],
) -> Option<Changing> {
    let with_none: Vec<Vec<Effect>> = explanations.iter().cloned().chain([Vec::new()]).collect();
    let constant = foretold_losses(baseline, &[drives.to_vec()], &with_none);
    let least = constant.into_iter().fold(f64::INFINITY, f64::min);
    let mut best: Option<(f64, Changing)> = None;
    for halves in Halves::ALL {
        let Some(parts) = halves.of(drives) else { continue };
        for (loss, causes) in foretold_losses(baseline, &parts, explanations).into_iter().zip(explanations) {
            if best.as_ref().is_none_or(|(least, _)| loss < *least) {
                best = Some((loss, Changing { causes: causes.clone(), halves }));
            }
        }
    }
    best.filter(|(loss, _)| (least / loss).ln() > NOT_THE_SAME).map(|(_, changing)| changing)
}

/// Of every explanation the mean loss of the drives, each foretold by the others, where its parameters are fitted to every
/// part of them apart. The calibration is held: what it could be to blame for would differ from part to part as well.
fn foretold_losses(baseline: &Baseline, parts: &[Vec<Drive>], explanations: &[Vec<Effect>]) -> Vec<f64> {
    let mut sums = vec![0.0; explanations.len()];
    let mut n = 0.0;
    for part in parts {
        let validation = CrossValidation::of(part);
        for split in validation.splits(|drives| baseline.held_trial(drives)) {
            let n_starts = split.own.comparison.n_starts() as f64;
            for (sum, causes) in sums.iter_mut().zip(explanations) {
                *sum += split.own.loss(&split.refitted(causes)) * n_starts;
            }
            n += n_starts;
        }
    }
    sums.into_iter().map(|sum| sum / n).collect()
}
