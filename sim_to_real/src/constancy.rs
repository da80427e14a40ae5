//! Whether what separates the drives is the same throughout: early and late in them, to the left and to the right.

use crate::answer::Division;
use crate::baseline::Baseline;
use crate::causes::Explanation;
use crate::cross_validation::CrossValidation;
use crate::drive::Drive;
use crate::parts::Parts;
use bicycle::Effect;

/// Causes that foretell other drives better by this in the logarithm of the loss than anything constant does, once their
/// parameters may differ from one half to the other, are not the same throughout.
const NOT_THE_SAME: f64 = 0.04;

/// Causes that are not the same throughout.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Changing {
    /// As they are in each of two parts of the drives.
    pub(crate) causes: [Vec<Effect>; 2],
    /// What the parts are.
    pub(crate) division: Division,
}

impl Changing {
    /// In words, with the parameters in both parts.
    pub(crate) fn told(&self) -> String {
        let [one, other] = &self.causes;
        let names: Vec<&str> = one.iter().map(|cause| cause.description().cause).collect();
        let how = match self.division {
            Division::Steering => ["to the right", "to the left"],
            _ => ["early in the drives", "late"],
        };
        let parameters = one.iter().zip(other).flat_map(|(one, other)| {
            let values = one.values().into_iter().zip(other.values());
            one.description().parameters.iter().zip(values)
        });
        let told = parameters.map(|(parameter, (one, other))| {
            format!("{} {one:.3} {}, {other:.3} {}", parameter.name, how[0], how[1])
        });
        format!(
            "{} foretells the drives better than anything constant once it is not the same {} and {}: {}",
            names.join(" with "),
            how[0],
            how[1],
            told.collect::<Vec<_>>().join("; ")
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
    let halves = [Parts::early_and_late(), Parts::right_and_left()];
    let split: Vec<(Division, [Vec<Drive>; 2])> =
        halves.iter().filter_map(|parts| Some((parts.division, parts.split(drives)?))).collect();
    let tried = split.iter().flat_map(|half| {
        let losses = foretold_losses(baseline, &half.1, explanations).into_iter().zip(explanations);
        losses.map(move |(loss, causes)| (loss, half, causes))
    });
    let (loss, (division, parts), causes) = tried.min_by(|a, b| a.0.total_cmp(&b.0))?;
    let fitted = |part: &Vec<Drive>| fitted(baseline, part, causes);
    let numbers_ratio = baseline.held_trial(&drives.iter().collect::<Vec<_>>()).comparison.numbers_ratio();
    (numbers_ratio * (least / loss).ln() > NOT_THE_SAME)
        .then(|| Changing { causes: parts.each_ref().map(fitted), division: *division })
}

/// Causes fitted to all that a part has of the drives.
fn fitted(baseline: &Baseline, part: &[Drive], causes: &[Effect]) -> Vec<Effect> {
    let trial = baseline.held_trial(&part.iter().collect::<Vec<_>>());
    let start = Explanation::new(causes.to_vec(), trial.loss(causes));
    trial.refined(start).causes
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
