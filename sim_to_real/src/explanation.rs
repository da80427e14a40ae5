//! Which explanations there are, and how much each is to be believed.

use crate::causes::{Explanation, Trial, candidates, tried};
use crate::score_test::Score;
use bicycle::Effect;
use bicycle::effect::Description;

/// Seconds are sought beside this many of the best singles.
const N_FIRSTS: usize = 3;
/// So many of the seconds that promise most are fitted beside each of them.
const N_SECONDS: usize = 8;
/// So many of the best singles, and of the best pairs, are fitted as a whole.
const N_REFINED: usize = 5;

/// Causes that the drives can judge: where the measured speed drives the model, an effect on the speed would stand for one
/// in the sensors.
fn judged(trial: &Trial<'_>) -> impl Iterator<Item = &'static Description> {
    candidates().filter(|description| trial.comparison.judges(description.id))
}

/// Every effect that the drives can judge, at every size that the catalogue tries.
pub(crate) fn judged_sizes(trial: &Trial<'_>) -> Vec<Effect> {
    judged(trial).flat_map(tried).collect()
}

/// Every effect alone, best first.
pub(crate) fn single_explanations(trial: &Trial<'_>) -> Vec<Explanation> {
    let alone = |description| trial.with_one_more(&[], description);
    let mut singles = best_forms(sorted(judged(trial).filter_map(alone).collect()));
    let others = singles.split_off(N_REFINED.min(singles.len()));
    sorted(singles.into_iter().map(|single| trial.refined(single)).chain(others).collect())
}

fn sorted(mut explanations: Vec<Explanation>) -> Vec<Explanation> {
    explanations.sort_by(|a, b| a.loss.total_cmp(&b.loss));
    explanations
}

/// Of several forms of one cause, the best.
fn best_forms(sorted: Vec<Explanation>) -> Vec<Explanation> {
    let mut best: Vec<Explanation> = Vec::with_capacity(sorted.len());
    for explanation in sorted {
        if best.iter().all(|other| other.ids() != explanation.ids()) {
            best.push(explanation);
        }
    }
    best
}

/// The best pair that holds one of the best singles.
pub(crate) fn best_pair(trial: &Trial<'_>, singles: &[Explanation]) -> Option<Explanation> {
    pairs(trial, singles.iter()).into_iter().next()
}

/// Pairs that hold one of the best singles, the best of them fitted together, best first.
pub(crate) fn pairs<'a>(
    trial: &Trial<'_>,
    singles: impl Iterator<Item = &'a Explanation>,
) -> Vec<Explanation> {
    let mut pairs: Vec<Explanation> = Vec::new();
    for first in singles.take(N_FIRSTS) {
        pairs.extend(with_a_second(trial, first));
    }
    pairs = sorted(pairs);
    pairs.dedup_by_key(|pair| {
        let mut ids = pair.ids();
        ids.sort_unstable();
        ids
    });
    pairs.truncate(N_REFINED);
    sorted(pairs.into_iter().map(|pair| trial.refined(pair)).collect())
}

/// An explanation with each of the other effects added that promise most beside it.
pub(crate) fn with_a_second(trial: &Trial<'_>, first: &Explanation) -> Vec<Explanation> {
    let known = first.ids();
    let before = trial.judged_residuals(&first.causes);
    let promise = |description: &Description| {
        let with = |cause| trial.judged_residuals(&[&first.causes[..], &[cause]].concat());
        let gain = |cause| Score::of(&before, &with(cause)).gain();
        tried(description).into_iter().map(gain).fold(0.0, f64::max)
    };
    let others = judged(trial).filter(|description| !known.contains(&description.cause));
    let mut others: Vec<_> = others.map(|description| (promise(description), description)).collect();
    others.sort_by(|a, b| b.0.total_cmp(&a.0));
    others.truncate(N_SECONDS);
    others.into_iter().filter_map(|(_, second)| trial.with_one_more(&first.causes, second)).collect()
}
