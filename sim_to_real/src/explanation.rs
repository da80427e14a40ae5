//! Which explanations there are, and how much each is to be believed.

use crate::causes::{Explanation, Trial, candidates, tried};
use crate::least_squares::mean_loss;
use crate::score_test::Score;
use bicycle::Effect;
use bicycle::effect::Description;

/// So many of the effects that promise most alone get their best size; the others stay at the best of those that are tried.
const N_SEARCHED: usize = 14;
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

/// What an effect makes of the judged residuals at every size that the catalogue tries.
struct Tried {
    description: &'static Description,
    sizes: Vec<(Effect, Vec<f32>)>,
}

impl Tried {
    /// The best of the sizes that are tried, alone.
    fn best(&self) -> Option<Explanation> {
        let alone =
            |(effect, residuals): &(Effect, Vec<f32>)| Explanation::new(vec![*effect], mean_loss(residuals));
        self.sizes.iter().map(alone).min_by(|a, b| a.loss.total_cmp(&b.loss))
    }

    /// What the best size would take off the sum of squares of other residuals, were every change of residuals there the same
    /// as it is of `nothing` and in proportion to the size.
    fn promise(&self, nothing: &[f32], before: &[f32]) -> f64 {
        let gain = |(_, alone): &(Effect, Vec<f32>)| {
            let changed = before.iter().zip(alone.iter().zip(nothing));
            let after: Vec<f32> =
                changed.map(|(before, (alone, nothing))| before + (alone - nothing)).collect();
            Score::of(before, &after).gain()
        };
        self.sizes.iter().map(gain).fold(0.0, f64::max)
    }
}

/// Every effect that some drives can judge, tried on them.
pub(crate) struct Screened<'a, 'b> {
    trial: &'b Trial<'a>,
    /// Judged residuals without any.
    nothing: Vec<f32>,
    effects: Vec<Tried>,
}

impl<'a, 'b> Screened<'a, 'b> {
    pub(crate) fn of(trial: &'b Trial<'a>) -> Self {
        let with = |effect: Effect| (effect, trial.judged_residuals(&[effect]));
        let tried = |description: &'static Description| Tried {
            description,
            sizes: tried(description).into_iter().map(with).collect(),
        };
        Self { trial, nothing: trial.judged_residuals(&[]), effects: judged(trial).map(tried).collect() }
    }

    /// Judged residuals without any effect.
    pub(crate) fn nothing(&self) -> &[f32] {
        &self.nothing
    }

    /// What promises most beside residuals, first.
    fn by_promise(&self, before: &[f32]) -> Vec<&Tried> {
        let promise = |own| (Tried::promise(own, &self.nothing, before), own);
        let mut all: Vec<(f64, &Tried)> = self.effects.iter().map(promise).collect();
        all.sort_by(|a, b| b.0.total_cmp(&a.0));
        all.into_iter().map(|(_, own)| own).collect()
    }

    /// Every effect alone, best first.
    pub(crate) fn singles(&self) -> Vec<Explanation> {
        let tried = self.by_promise(&self.nothing).into_iter().filter_map(Tried::best).enumerate();
        let sized = |(rank, best)| if rank < N_SEARCHED { self.trial.sized(best) } else { best };
        let mut singles = best_forms(sorted(tried.map(sized).collect()));
        let others = singles.split_off(N_REFINED.min(singles.len()));
        sorted(singles.into_iter().map(|single| self.trial.refined(single)).chain(others).collect())
    }

    /// The best pair that holds one of the best singles.
    pub(crate) fn best_pair(&self, singles: &[Explanation]) -> Option<Explanation> {
        self.pairs(singles.iter(), &[]).into_iter().next()
    }

    /// Pairs that hold one of the best singles, the best of them fitted together, best first; causes that are `told` are
    /// sought as seconds whatever they promise.
    pub(crate) fn pairs<'s>(
        &self,
        singles: impl Iterator<Item = &'s Explanation>,
        told: &[&str],
    ) -> Vec<Explanation> {
        let firsts = singles.take(N_FIRSTS);
        let mut pairs = sorted(firsts.flat_map(|first| self.with_a_second(first, told)).collect());
        pairs.dedup_by_key(|pair| {
            let mut ids = pair.ids();
            ids.sort_unstable();
            ids
        });
        let is_told = |pair: &Explanation| pair.ids().last().is_some_and(|second| told.contains(second));
        let kept = pairs.into_iter().enumerate().filter(|(rank, pair)| *rank < N_REFINED || is_told(pair));
        sorted(kept.map(|(_, pair)| self.trial.refined(pair)).collect())
    }

    /// An explanation with each of the other effects added that are told, or promise most beside it.
    fn with_a_second(&self, first: &Explanation, told: &[&str]) -> Vec<Explanation> {
        let known = first.ids();
        let promising = self.by_promise(&self.trial.judged_residuals(&first.causes)).into_iter();
        let others = promising.filter(|own| !known.contains(&own.description.cause)).enumerate();
        let sought = others.filter(|(rank, own)| *rank < N_SECONDS || told.contains(&own.description.cause));
        sought.filter_map(|(_, own)| self.trial.with_one_more(&first.causes, own.description)).collect()
    }
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
