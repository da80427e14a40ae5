//! Which effects of the whole catalogue foretell drives better, one after the other.

use super::Folds;
use crate::answer::Ranked;
use crate::baseline::Baseline;
use crate::calibration::is_limit;
use crate::causes::{Explanation, Trial};
use crate::comparison::{Comparison, Yardstick, rollout_error};
use crate::evidence::SpeedInput;
use crate::machine::Machine;
use bicycle::Effect;
use bicycle::effect::{CATALOGUE, Description, Parameter};
use std::collections::BTreeSet;

/// Logarithmic gain in loss that an effect must bring on the drives themselves,
const PRICE: f64 = 0.05;
/// and on those left out.
const PRICE_ELSEWHERE: f64 = 0.02;
/// Explanations this near in logarithmic loss are not told apart.
const TOLD_APART: f64 = 0.03;
/// Effects this near to the best of their turn are tried in its place later.
const NEAR: f64 = 0.3;
/// What pushes or brakes the body, and what a speed loop does beside closing its distance.
const FORCES: [&str; 12] = [
    "rolling_drag",
    "quad_drag",
    "veg_drag",
    "loose_drag",
    "cornering_drag",
    "slope_gravity",
    "hill_compensation",
    "compensation_loss",
    "wind",
    "feed_forward",
    "speed_integral",
    "drive_lag",
];
/// Shapes that tell a calibrated machine more finely than effects that are sought anyway: few drives without a simulator
/// do not tell the one from the other.
const FINER: [&str; 10] = [
    "steer_servo",
    "limited_servo",
    "steer_swing",
    "yaw_load",
    "rear_steer",
    "tyre_slip",
    "tyre_slide",
    "speed_ramp",
    "wheel_slip",
    "felt_slope",
];
/// Additions that are fitted together with all that is known, best first, and how often the next few get their turn.
const N_REFINED: usize = 3;
const N_BATCHES: usize = 2;

/// The effects that were selected, and what else was tried.
pub(crate) struct Selection {
    pub(crate) explanation: Explanation,
    /// What each effect of the catalogue that can be judged brings beside the others.
    pub(crate) gains: Vec<(&'static str, f64)>,
    /// For each selected effect the others that do its work as well.
    pub(crate) alternatives: Vec<(&'static str, Vec<&'static str>)>,
    /// Selected effects with the parameters found without each group of drives.
    elsewhere: Vec<Vec<Effect>>,
}

/// Drives in groups with what they are measured by, to leave out one group after the other.
pub(crate) struct LeftOut<'a> {
    pub(crate) folds: &'a Folds<'a>,
    pub(crate) machine: &'a Machine,
    pub(crate) yardstick: &'a Yardstick,
}

impl LeftOut<'_> {
    /// Mean loss of each group under parameters that the other groups give, and these parameters.
    fn judge(&self, causes: &[Effect]) -> (f64, Vec<Vec<Effect>>) {
        let length = self.machine.wheelbase_m;
        let trial = |drives| Trial::fixed(Comparison::new(length, drives, self.yardstick), &[]);
        let mut sum = 0.0;
        let mut elsewhere = Vec::new();
        for (out, own) in self.folds.groups.iter().enumerate() {
            let others = self.folds.groups.iter().enumerate().filter(|(group, _)| *group != out);
            let rest = trial(others.flat_map(|(_, drives)| drives.iter().copied()).collect());
            let start = Explanation::new(causes.to_vec(), rest.loss(causes));
            let found = if causes.is_empty() { start } else { rest.refined(start) };
            let n_starts: usize = own.iter().map(|drive| drive.starts.len()).sum();
            sum += trial(own.clone()).loss(&found.causes) * n_starts as f64;
            elsewhere.push(found.causes);
        }
        let n_starts: usize = self.folds.all.iter().map(|drive| drive.starts.len()).sum();
        (sum / n_starts as f64, elsewhere)
    }
}

/// Effects with the parameters that all drives give and those that each group's others give.
pub(crate) struct Grown {
    pub(crate) explanation: Explanation,
    /// For each effect the others that came near to it when it was added.
    rivals: Vec<(&'static str, Vec<&'static Description>)>,
    last_turn: Vec<(&'static Description, Explanation)>,
}

/// Adds effects as long as they are worth their price, at most `n_most`.
pub(crate) fn grown(trial: &Trial<'_>, left_out: Option<&LeftOut<'_>>, n_most: usize) -> Grown {
    let mut best = Explanation::new(Vec::new(), trial.loss(&[]));
    let mut elsewhere = left_out.map(|left_out| left_out.judge(&[]).0);
    let mut rivals = Vec::new();
    let last_turn = loop {
        let turn = additions(trial, &best);
        let worth_it = |next: &Explanation| (best.loss / next.loss).ln() > PRICE && is_within_bounds(next);
        let next = turn.chunks(N_REFINED).take(N_BATCHES).find_map(|batch| {
            let refined = batch.iter().map(|(_, explanation)| trial.refined(explanation.clone()));
            let mut nexts: Vec<Explanation> = refined.filter(worth_it).collect();
            nexts.sort_by(|a, b| a.loss.total_cmp(&b.loss));
            nexts.into_iter().find_map(|next| {
                let now = left_out.map(|left_out| left_out.judge(&next.causes).0);
                let helps =
                    elsewhere.zip(now).is_none_or(|(before, after)| (before / after).ln() > PRICE_ELSEWHERE);
                helps.then_some((next, now))
            })
        });
        match next {
            Some((next, now)) if best.causes.len() < n_most => {
                rivals.push((added(&next), near(&turn)));
                (best, elsewhere) = (next, now);
            }
            _ => break turn,
        }
    };
    Grown { explanation: best, rivals, last_turn }
}

impl Selection {
    pub(crate) fn of(trial: &Trial<'_>, grown: Grown, left_out: &LeftOut<'_>) -> Self {
        let Grown { explanation, rivals, last_turn } = grown;
        Self {
            gains: gains(trial, &explanation, &last_turn),
            alternatives: rivals
                .into_iter()
                .map(|(id, others)| (id, alternatives(trial, &explanation, id, &others)))
                .collect(),
            elsewhere: left_out.judge(&explanation.causes).1,
            explanation,
        }
    }
}

fn is_within_bounds(explanation: &Explanation) -> bool {
    explanation.causes.iter().all(is_clear_of_bounds)
}

/// Whether every parameter stays clear of the end of what it may be: an effect that is pushed there explains nothing.
fn is_clear_of_bounds(cause: &Effect) -> bool {
    let is_clear = |parameter: &Parameter, value: f64| {
        if is_limit(parameter) {
            return value > 1.5 * parameter.low;
        }
        let end = if value > parameter.neutral { parameter.high } else { parameter.low };
        (value - parameter.neutral).abs() <= 0.95 * (end - parameter.neutral).abs()
    };
    let parameters = cause.description().parameters;
    parameters.iter().zip(cause.values()).all(|(parameter, value)| is_clear(parameter, value))
}

/// Whether every drive gives forces on the speed a lasting effect: by a commanded acceleration, or by a speed loop for
/// them to work against.
fn may_push(trial: &Trial<'_>, ids: &[&str]) -> bool {
    ids.contains(&"speed_loop")
        || trial.comparison.drives().all(|drive| drive.evidence.speed_input != SpeedInput::Commanded)
}

/// Every effect that is not known yet beside the known ones, best first.
fn additions(trial: &Trial<'_>, known: &Explanation) -> Vec<(&'static Description, Explanation)> {
    let ids = known.ids();
    let may_push = may_push(trial, &ids);
    let may_act = |id: &str| may_push || !FORCES.contains(&id);
    let candidates = CATALOGUE.iter().filter(|description| {
        let id = description.id;
        !ids.contains(&description.cause)
            && !FINER.contains(&id)
            && may_act(id)
            && trial.comparison.judges(id)
    });
    let mut turn: Vec<_> = candidates
        .filter_map(|description| Some((description, trial.with_one_more(&known.causes, description)?)))
        .collect();
    turn.sort_by(|a, b| a.1.loss.total_cmp(&b.1.loss));
    turn
}

fn added(explanation: &Explanation) -> &'static str {
    explanation.ids().last().copied().unwrap_or_default()
}

/// Effects that came near to the best of their turn.
fn near(turn: &[(&'static Description, Explanation)]) -> Vec<&'static Description> {
    let Some((_, first)) = turn.first() else { return Vec::new() };
    let is_near = |(_, other): &&(&'static Description, Explanation)| (other.loss / first.loss).ln() < NEAR;
    turn.iter().take_while(is_near).map(|(description, _)| *description).collect()
}

/// Which of the others do the work of a selected effect as well, everything fitted anew.
fn alternatives(
    trial: &Trial<'_>,
    best: &Explanation,
    id: &str,
    others: &[&'static Description],
) -> Vec<&'static str> {
    let rest = without(best, id);
    let ids = best.ids();
    let unused = others.iter().filter(|description| !ids.contains(&description.cause));
    let does_as_well = |description: &&&'static Description| {
        let swapped = trial.with_one_more(&rest, description).map(|swapped| trial.refined(swapped));
        swapped
            .is_some_and(|swapped| is_within_bounds(&swapped) && (swapped.loss / best.loss).ln() < TOLD_APART)
    };
    let mut names: Vec<&str> = unused.filter(does_as_well).map(|description| description.cause).collect();
    names.dedup();
    names
}

fn without(explanation: &Explanation, id: &str) -> Vec<Effect> {
    let others = explanation.causes.iter().filter(|cause| cause.description().cause != id);
    others.copied().collect()
}

/// Logarithmic gain of every effect beside the others: of a selected one by leaving it out, of another by adding it.
fn gains(
    trial: &Trial<'_>,
    best: &Explanation,
    last_turn: &[(&'static Description, Explanation)],
) -> Vec<(&'static str, f64)> {
    let of_selected = best.ids().into_iter().map(|id| {
        let causes = without(best, id);
        let loss = trial.loss(&causes);
        let start = Explanation::new(causes, loss);
        let rest = if start.causes.is_empty() { start } else { trial.refined(start) };
        (id, (rest.loss / best.loss).ln())
    });
    let unselected =
        last_turn.iter().map(|(description, with)| (description.cause, (best.loss / with.loss).ln()));
    let mut gains: Vec<_> = of_selected.chain(unselected).collect();
    gains.sort_by(|a, b| b.1.total_cmp(&a.1));
    // Of several forms of one cause, the best.
    let mut named = BTreeSet::new();
    gains.retain(|(id, _)| named.insert(*id));
    gains
}

impl Selection {
    /// Fits the selected effects to other drives; what is pushed to its bounds there is given up.
    pub(crate) fn refit(&mut self, trial: &Trial<'_>) {
        loop {
            let n_before = self.explanation.causes.len();
            if n_before == 0 {
                return;
            }
            let causes = self.explanation.causes.clone();
            let loss = trial.loss(&causes);
            self.explanation = trial.refined(Explanation::new(causes, loss));
            self.explanation.causes.retain(is_clear_of_bounds);
            let may_push = may_push(trial, &self.explanation.ids());
            self.explanation.causes.retain(|cause| may_push || !FORCES.contains(&cause.description().id));
            if self.explanation.causes.len() == n_before {
                break;
            }
        }
        let ids = self.explanation.ids();
        self.alternatives.retain(|(id, _)| ids.contains(id));
        for causes in &mut self.elsewhere {
            causes.retain(|cause| ids.contains(&cause.description().cause));
        }
    }

    /// Every effect that can be judged; a half where the gain is the price.
    pub(crate) fn ranking(&self) -> Vec<Ranked> {
        let score = |gain: f64| 1.0 / (1.0 + (-(gain - PRICE) / (0.25 * PRICE)).exp());
        self.gains
            .iter()
            .map(|(id, gain)| Ranked { id: (*id).to_owned(), score: score(*gain), support: None })
            .collect()
    }

    /// Error without and with the selected effects on each group, by parameters from the others.
    pub(crate) fn left_out_errors(&self, folds: &Folds<'_>, baseline: &Baseline) -> [f64; 2] {
        let mut residuals: [Vec<f32>; 2] = [Vec::new(), Vec::new()];
        for (own, causes) in folds.groups.iter().zip(&self.elsewhere) {
            let trial = baseline.trial(own);
            residuals[0].extend(trial.residuals(&[]));
            residuals[1].extend(trial.residuals(causes));
        }
        residuals.map(|residuals| rollout_error(&residuals))
    }
}
