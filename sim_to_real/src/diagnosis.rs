//! The diagnosis: which effects separate the real drives from the calibrated nominal model.

use crate::answer::{Answer, NamedEffect, PartEstimate, Ranked, SCHEMA_VERSION, Shrink, Support, Verdict};
use crate::attitude::AttitudeEvidence;
use crate::baseline::{Baseline, GapError, drives_of};
use crate::causes::{Explanation, Trial};
use crate::comparison::rollout_error;
use crate::conditions::{StartRecord, condition_tables, ground_residuals, places, with_announced};
use crate::constancy::changing;
use crate::cross_validation::{CrossValidation, Split, foretold};
use crate::drive::Drive;
use crate::explanation::Screened;
use crate::findings::{Findings, Leaning, LeftOver, Swing};
use crate::intervals::named_effects;
use crate::judgement::{Single, Weighed};
use crate::least_squares::mean_loss;
use crate::left_over::left_over;
use crate::machine::Machine;
use crate::parts::by_part;
use crate::residual_table::residual_cells;
use crate::steering::Steering;
use crate::without_simulator::of_evidence;
use bicycle::{DriveLog, Effect};

/// What the real drives alone have shown.
#[derive(Clone, Debug)]
pub struct Diagnosis {
    /// Announced effects with their parameters, strongest first.
    pub named: Vec<NamedEffect>,
    /// The numbers behind a report.
    pub findings: Findings,
    /// Error of the calibrated nominal model and of the repaired one on the real drives, in standard deviations.
    pub errors: [f64; 2],
    pub(crate) effects: Vec<Effect>,
    pub(crate) by_part: Vec<PartEstimate>,
    pub(crate) left: Vec<LeftOver>,
    pub(crate) swing: Option<Swing>,
    pub(crate) leaning: Option<Leaning>,
    pub(crate) steering: Steering,
    pub(crate) verdict: Verdict,
    pub(crate) ranking: Vec<Ranked>,
    pub(crate) credible_set: Vec<String>,
    pub(crate) predicted_closed: Option<f64>,
    pub(crate) floor: f64,
    pub(crate) notes: Vec<String>,
}

/// Metric of [`Shrink`].
pub(crate) const METRIC: &str = "normalised held-out rollout error";
/// So many of the best single effects may turn out not to be constant.
const N_IN_QUESTION: usize = 5;
/// Below this many floors there is no gap to close.
pub(crate) const GAP_IN_FLOORS: f64 = 1.2;

/// Finds what separates real drives from the calibrated nominal model.
///
/// # Errors
/// No run, or a run without the needed columns or too short.
pub fn diagnose(baseline: &Baseline, machine: &Machine, real: &[DriveLog]) -> Result<Diagnosis, GapError> {
    let drives = drives_of("real", machine, real)?;
    if drives.is_empty() {
        return Err(GapError::Few { set: "real", needed: 1, found: 0 });
    }
    let all: Vec<&Drive> = drives.iter().collect();
    let trial = baseline.trial(&all);
    let before = trial.residuals(&[]);
    let cross_validation = CrossValidation::of(&drives);
    let splits = cross_validation.splits(|drives| baseline.trial(drives));
    let attitude = baseline.attitude_evidence(&all);
    let weighed = weighed(baseline, &trial, &splits, attitude);
    let mut judgement = weighed.judge(&baseline.null);
    let causes = judgement.announced.clone();
    let mut notes = of_evidence(&all);
    if drives.len() > 1
        && let Some(changing) = changing(baseline, &drives, &in_question(&weighed, &causes))
    {
        judgement.verdict = judgement.verdict.with_unknown();
        notes.push(changing.told());
    }
    let leaning = weighed.attitude.leaning(&causes);
    let (swing, spectrum) = baseline.yaw_response.as_ref().and_then(|response| response.swing(&all)).unzip();
    if leaning.is_some() || swing.is_some() {
        judgement.verdict = judgement.verdict.with_unknown();
    }
    let after = trial.residuals(&causes);
    let (own, repaired) = (StartRecord::of(&all, &before), StartRecord::of(&all, &after));
    let mut conditions = condition_tables(&own, &baseline.null.starts);
    if judgement.verdict == Verdict::Effects {
        let taken_off: Vec<f32> = before.iter().zip(&after).map(|(before, after)| before - after).collect();
        conditions = with_announced(&conditions, (&own, &StartRecord::of(&all, &taken_off)));
    }
    let left_over = || left_over((&all, &repaired), &baseline.null.starts, &baseline.yardstick);
    let left = judgement.verdict.holds_unknown().then(left_over).unwrap_or_default();
    let findings = Findings {
        conditions,
        residuals: residual_cells(&before, &after, Some(&baseline.null.cells)),
        map: ground_residuals(&own, &repaired),
        spectrum,
    };
    Ok(Diagnosis {
        named: named_effects(&trial, &causes),
        by_part: by_part(&baseline.held_trial(&all), &causes),
        left,
        swing,
        leaning,
        findings,
        errors: [rollout_error(&before), rollout_error(&after)],
        predicted_closed: predicted_closed(baseline, &splits, &causes),
        effects: causes,
        steering: drives[0].evidence.steering(),
        verdict: judgement.verdict,
        ranking: judgement.ranking,
        credible_set: judgement.credible_set,
        floor: baseline.null.error,
        notes,
    })
}

impl Baseline {
    /// [`closed`] with the null's error for a floor.
    pub(crate) fn closed(&self, before: f64, after: f64) -> Option<f64> {
        closed(self.null.error, before, after)
    }
}

/// (before - after) / (before - floor), where there is a gap.
pub(crate) fn closed(floor: f64, before: f64, after: f64) -> Option<f64> {
    (before >= GAP_IN_FLOORS * floor).then(|| (before - after) / (before - floor))
}

fn weighed(
    baseline: &Baseline,
    trial: &Trial<'_>,
    splits: &[Split<'_>],
    attitude: AttitudeEvidence,
) -> Weighed {
    let screened = Screened::of(trial);
    let before = screened.nothing();
    let none = Explanation::new(Vec::new(), mean_loss(before));
    let supported = |explanation: Explanation| {
        let support = baseline.null.chance.support((trial, before), &explanation, none.loss);
        let support = Support { attitude: attitude.support(&explanation.causes), ..support };
        Single { explanation, support }
    };
    let singles = foretold(splits, screened.singles()).into_iter().map(supported).collect();
    let numbers_ratio = trial.comparison.numbers_ratio();
    let mut weighed = Weighed { none, pairs: Vec::new(), singles, numbers_ratio, attitude };
    if weighed.may_hold_pairs(&baseline.null) {
        let explanations = weighed.singles.iter().map(|single| &single.explanation);
        weighed.pairs = foretold(splits, screened.pairs(explanations, &weighed.told_by_attitude()));
    }
    weighed
}

/// Explanations that may turn out not to be constant: the best single effects, and what is announced.
fn in_question(weighed: &Weighed, announced: &[Effect]) -> Vec<Vec<Effect>> {
    let singles = weighed.singles.iter().take(N_IN_QUESTION);
    let mut explanations: Vec<Vec<Effect>> =
        singles.map(|single| single.explanation.causes.clone()).collect();
    if announced.len() > 1 {
        explanations.push(announced.to_vec());
    }
    explanations
}

/// What is closed on each real drive by the parameters that the others give.
fn predicted_closed(baseline: &Baseline, splits: &[Split<'_>], causes: &[Effect]) -> Option<f64> {
    let mut squares = [0.0_f64; 2];
    for split in splits {
        for (sum, causes) in squares.iter_mut().zip([Vec::new(), split.refitted(causes)]) {
            *sum += rollout_error(&split.own.residuals(&causes)).powi(2);
        }
    }
    let [before, after] = squares.map(|sum| (sum / splits.len() as f64).sqrt());
    baseline.closed(before, after)
}

impl Diagnosis {
    /// The announced effects with their best parameters, to be added to a model.
    pub fn effects(&self) -> &[Effect] {
        &self.effects
    }

    /// The answer before the held-out drives are opened.
    pub fn answer(&self, case: &str) -> Answer {
        Answer {
            schema_version: SCHEMA_VERSION,
            case: case.to_owned(),
            steering: self.steering,
            verdict: self.verdict,
            effects: self.named.clone(),
            by_part: self.by_part.clone(),
            ranking: self.ranking.clone(),
            credible_set: self.credible_set.clone(),
            places: places(&self.findings.conditions),
            left: self.left.clone(),
            swing: self.swing,
            leaning: self.leaning,
            shrink: Shrink {
                metric: METRIC.to_owned(),
                floor: self.floor,
                predicted_closed: self.predicted_closed,
                ..Shrink::default()
            },
            errors_by_quantity: Vec::new(),
            pose_sensor: None,
            controller_model: None,
            in_simulator: None,
            advice: self.notes.clone(),
        }
    }
}
