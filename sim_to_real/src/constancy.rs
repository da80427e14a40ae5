//! Whether what was found is the same throughout: early and late in the drives, to the left and to the right.

use crate::baseline::Baseline;
use crate::cross_validation::CrossValidation;
use crate::drive::Drive;
use bicycle::Effect;

/// Causes that foretell other drives better by this in the logarithm of the loss, once their parameters may differ from
/// one half to the other, are not the same throughout.
const NOT_THE_SAME: f64 = 0.055;
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

    /// What an announced effect that differs between the halves is told to be.
    pub(crate) fn told(self) -> &'static str {
        match self {
            Self::EarlyAndLate => "what was found changes during the drives",
            Self::LeftAndRight => "what was found is not the same to the left and to the right",
        }
    }

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

/// The halves between which the causes differ most, if they do.
pub(crate) fn differing_halves(baseline: &Baseline, drives: &[Drive], causes: &[Effect]) -> Option<Halves> {
    if causes.is_empty() {
        return None;
    }
    let whole = foretold_loss(baseline, &[drives.to_vec()], causes);
    let gain = |halves: Halves| {
        let parts = halves.of(drives)?;
        Some((halves, (whole / foretold_loss(baseline, &parts, causes)).ln()))
    };
    let most = Halves::ALL.into_iter().filter_map(gain).max_by(|a, b| a.1.total_cmp(&b.1))?;
    (most.1 > NOT_THE_SAME).then_some(most.0)
}

/// Mean loss of the drives, each foretold by the others, where the causes are fitted to every part of them apart. The
/// calibration is held: what it could be to blame for would differ from part to part as well.
fn foretold_loss(baseline: &Baseline, parts: &[Vec<Drive>], causes: &[Effect]) -> f64 {
    let (mut sum, mut n) = (0.0, 0.0);
    for part in parts {
        let validation = CrossValidation::of(part);
        for split in validation.splits(|drives| baseline.held_trial(drives)) {
            let n_starts = split.own.comparison.n_starts() as f64;
            sum += split.own.loss(&split.refitted(causes)) * n_starts;
            n += n_starts;
        }
    }
    sum / n
}
