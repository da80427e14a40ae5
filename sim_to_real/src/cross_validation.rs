//! How well an explanation foretells drives that it was not fitted to.

use crate::causes::{Explanation, Trial};
use crate::drive::Drive;
use bicycle::Effect;

/// Explanations are tried on other drives when the logarithm of their loss is so near to the best one's: more than what
/// foretelling badly could turn around does not matter.
const WITHIN: f64 = 0.3;

/// Real drives, each left out in turn; of a single drive, each half.
pub(crate) struct CrossValidation {
    drives: Vec<Drive>,
}

/// One drive left out: what learns, and what is foretold.
pub(crate) struct Split<'a> {
    learned: Trial<'a>,
    pub(crate) own: Trial<'a>,
}

impl CrossValidation {
    pub(crate) fn of(drives: &[Drive]) -> Self {
        Self { drives: if let [drive] = drives { drive.halves() } else { drives.to_vec() } }
    }

    /// For every drive the others, and it.
    pub(crate) fn folds(&self) -> Vec<(Vec<&Drive>, &Drive)> {
        let others = |out: usize| {
            self.drives.iter().enumerate().filter(move |(i, _)| *i != out).map(|(_, drive)| drive).collect()
        };
        self.drives.iter().enumerate().map(|(out, own)| (others(out), own)).collect()
    }

    /// Every split with both of its sides on trial.
    pub(crate) fn splits<'a>(&'a self, on_trial: impl Fn(&[&'a Drive]) -> Trial<'a>) -> Vec<Split<'a>> {
        let folds = self.folds().into_iter();
        folds.map(|(rest, own)| Split { learned: on_trial(&rest), own: on_trial(&[own]) }).collect()
    }
}

impl Split<'_> {
    /// The causes with the parameters that the other drives give.
    pub(crate) fn refitted(&self, causes: &[Effect]) -> Vec<Effect> {
        if causes.is_empty() {
            return Vec::new();
        }
        let start = Explanation::new(causes.to_vec(), self.learned.loss(causes));
        self.learned.refined(start).causes
    }
}

/// Explanations with what the best of them lose on drives that they were not fitted to; the lowest energy first.
pub(crate) fn foretold(splits: &[Split<'_>], mut explanations: Vec<Explanation>) -> Vec<Explanation> {
    let Some(least) = explanations.first().map(|best| best.loss) else { return explanations };
    for explanation in explanations.iter_mut().filter(|other| (other.loss / least).ln() < WITHIN) {
        let loss = |split: &Split<'_>| split.own.loss(&split.refitted(&explanation.causes));
        explanation.foretold_loss = splits.iter().map(loss).sum::<f64>() / splits.len() as f64;
    }
    explanations.sort_by(|a, b| a.energy().total_cmp(&b.energy()));
    explanations
}
