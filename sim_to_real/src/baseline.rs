//! What is known before the real drives are opened: the calibrated nominal model, its noise, and how much of a gap one
//! nominal drive shows against the others.

use crate::attitude::{AttitudeEvidence, AttitudeModel};
use crate::calibration::{calibrated, proportional, recalibrated};
use crate::causes::Trial;
use crate::comparison::{Comparison, Yardstick, rollout_error};
use crate::conditions::StartRecord;
use crate::drive::{Drive, DriveError};
use crate::explanation::{Screened, judged_sizes};
use crate::familiarity::Familiarity;
use crate::findings::ResidualCell;
use crate::least_squares::mean_loss;
use crate::limits_shown::LimitsShown;
use crate::machine::Machine;
use crate::nuisance::Information;
use crate::periodic::YawResponse;
use crate::residual_table::residual_cells;
use crate::score_test::{Chance, TriedScores, tried_scores};
use crate::whitening::Whitening;
use bicycle::{DriveLog, Effect};
use serde::{Deserialize, Serialize};

/// Why a diagnosis cannot begin.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum GapError {
    /// A drive cannot be used.
    #[error("{set} drive {number}: {source}")]
    Drive {
        /// Nominal, real or held-out.
        set: &'static str,
        /// Number of the drive in its set, from 1.
        number: usize,
        /// What is wrong with it.
        source: DriveError,
    },
    /// A null needs one drive against the others.
    #[error("expected at least {needed} {set} runs, found {found}")]
    Few {
        /// Nominal, real or held-out.
        set: &'static str,
        /// Least number.
        needed: usize,
        /// Found.
        found: usize,
    },
}

/// The calibrated nominal model of a vehicle and its null. Costs seconds, depends on the nominal drives alone, and is
/// kept in files.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Baseline {
    pub(crate) wheelbase_m: f64,
    pub(crate) effects: Vec<Effect>,
    /// The same with a proportional speed loop.
    pub(crate) proportional: Vec<Effect>,
    pub(crate) yardstick: Yardstick,
    pub(crate) whitening: Whitening,
    pub(crate) experience: Experience,
    /// Where the drives tell it.
    pub(crate) attitude: Option<AttitudeModel>,
    /// Where the drives tell it.
    pub(crate) yaw_response: Option<YawResponse>,
    pub(crate) null: Null,
}

/// What nominal drives look like to a model that was calibrated on the others.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Null {
    /// Root mean square of the residuals, in standard deviations.
    pub(crate) error: f64,
    /// Mean robust loss.
    pub(crate) loss: f64,
    /// How strongly effects are asked for where there is none.
    pub(crate) chance: Chance,
    /// Logarithmic gain in loss that the best second effect brings by chance.
    pub(crate) gain_of_two: f64,
    /// Residuals by quantity and horizon; before and after hold the same.
    pub(crate) cells: Vec<ResidualCell>,
    /// Limits that would have shown.
    pub(crate) limits_shown: LimitsShown,
    /// Every rollout with its conditions.
    pub(crate) starts: Vec<StartRecord>,
}

impl Baseline {
    /// Calibrates the nominal model on nominal drives and finds its null by leaving out one run after the other.
    /// `progress` is told the share that is done.
    ///
    /// # Errors
    /// Fewer than two runs, or a run without the needed columns or shorter than the settling time and one rollout.
    pub fn calibrate(machine: &Machine, sim: &[DriveLog], progress: &dyn Fn(f64)) -> Result<Self, GapError> {
        let drives = drives_of("nominal", machine, sim)?;
        if drives.len() < 2 {
            return Err(GapError::Few { set: "nominal", needed: 2, found: drives.len() });
        }
        let wheelbase_m = machine.wheelbase_m;
        let all: Vec<&Drive> = drives.iter().collect();
        let (effects, yardstick) = calibrated(wheelbase_m, &all);
        let share = |done: usize| progress(done as f64 / (drives.len() + 1) as f64);
        share(1);
        let mut folds = Vec::new();
        for out in 0..drives.len() {
            folds.push(Fold::of(wheelbase_m, (&all, out), (&effects, &yardstick)));
            share(out + 2);
        }
        let whitening =
            Whitening::of(&folds.iter().flat_map(|fold| fold.residuals.clone()).collect::<Vec<_>>());
        let nominal = Comparison::new(wheelbase_m, all.clone(), &yardstick);
        let nominal = nominal.judged_by(&whitening, &Familiarity::unlimited());
        let experience = Experience::of(&nominal, &effects);
        let nominal = Trial::fixed(nominal, &effects);
        let tried = judged_sizes(&nominal);
        let judged = |fold: Fold<'_>| fold.judged(wheelbase_m, (&yardstick, &whitening), &tried);
        let left_out: Vec<LeftOut> = folds.into_iter().map(judged).collect();
        let null = Null::of(&left_out, LimitsShown::of(&nominal));
        let proportional = proportional(wheelbase_m, &all, &yardstick);
        Ok(Self {
            wheelbase_m,
            effects,
            proportional,
            yardstick,
            whitening,
            experience,
            attitude: AttitudeModel::of(&all),
            yaw_response: YawResponse::of(wheelbase_m, &all),
            null,
        })
    }

    /// Other drives against the calibrated model, which gives way to them as far as nominal drives let it.
    pub(crate) fn trial<'a>(&'a self, drives: &[&'a Drive]) -> Trial<'a> {
        Trial::given_way(self.comparison(drives), &self.effects, &self.experience.information)
    }

    /// Other drives against the calibrated model as it is.
    pub(crate) fn held_trial<'a>(&'a self, drives: &[&'a Drive]) -> Trial<'a> {
        Trial::fixed(self.comparison(drives), &self.effects)
    }

    /// What roll and pitch of other drives say of forces.
    pub(crate) fn attitude_evidence(&self, drives: &[&Drive]) -> AttitudeEvidence {
        self.attitude.as_ref().map_or_else(AttitudeEvidence::default, |model| model.evidence(drives))
    }

    fn comparison<'a>(&'a self, drives: &[&'a Drive]) -> Comparison<'a> {
        let comparison = Comparison::new(self.wheelbase_m, drives.to_vec(), &self.yardstick);
        comparison.judged_by(&self.whitening, &self.experience.familiarity)
    }

    /// The ordinary physics of this machine, calibrated for a controller's model, which needs it beside what is announced.
    /// Its speed loop is proportional: sampled plans foretell drives worse, and drive worse, with a ramp and a
    /// feed-forward of their own commands in the model, although these foretell recorded commands better.
    pub fn effects_for_control(&self) -> &[Effect] {
        &self.proportional
    }
}

/// Every run of every log, made ready.
pub(crate) fn drives_of(
    set: &'static str,
    machine: &Machine,
    logs: &[DriveLog],
) -> Result<Vec<Drive>, GapError> {
    let runs = logs.iter().flat_map(DriveLog::runs).enumerate();
    runs.map(|(i, run)| {
        Drive::of(&run, machine).map_err(|source| GapError::Drive { set, number: i + 1, source })
    })
    .collect()
}

/// What nominal drives tell of the model that was calibrated on them: where it was tried, and how well its parameters are
/// known.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Experience {
    familiarity: Familiarity,
    information: Information,
}

impl Experience {
    /// Of a model that nothing was calibrated in.
    pub(crate) fn none() -> Self {
        Self { familiarity: Familiarity::unlimited(), information: Information::none() }
    }

    fn of(nominal: &Comparison<'_>, effects: &[Effect]) -> Self {
        let drives: Vec<&Drive> = nominal.drives().collect();
        Self { familiarity: Familiarity::with(&drives), information: Information::of(nominal, effects) }
    }
}

/// A nominal run, the others, and the model that was fitted to these.
struct Fold<'a> {
    own: &'a Drive,
    others: Vec<&'a Drive>,
    effects: Vec<Effect>,
    /// Of that model on the run.
    residuals: Vec<f32>,
}

impl<'a> Fold<'a> {
    fn of(
        wheelbase_m: f64,
        (drives, out): (&[&'a Drive], usize),
        (effects, yardstick): (&[Effect], &Yardstick),
    ) -> Self {
        let mut others = drives.to_vec();
        let own = others.remove(out);
        let effects = recalibrated(wheelbase_m, &others, (effects, yardstick));
        let residuals = Comparison::new(wheelbase_m, vec![own], yardstick).residuals(&effects);
        Self { own, others, effects, residuals }
    }

    fn judged(
        self,
        wheelbase_m: f64,
        (yardstick, whitening): (&Yardstick, &Whitening),
        tried: &[Effect],
    ) -> LeftOut {
        let of = |drives| Comparison::new(wheelbase_m, drives, yardstick);
        let others = of(self.others).judged_by(whitening, &Familiarity::unlimited());
        let experience = Experience::of(&others, &self.effects);
        let own = of(vec![self.own]).judged_by(whitening, &experience.familiarity);
        let trial = Trial::given_way(own, &self.effects, &experience.information);
        LeftOut::new(&trial, tried, self.residuals)
    }
}

/// One nominal run against a model of the others.
struct LeftOut {
    residuals: Vec<f32>,
    loss: f64,
    gain_of_two: f64,
    scores: TriedScores,
    starts: Vec<StartRecord>,
}

impl LeftOut {
    fn new(trial: &Trial<'_>, tried: &[Effect], residuals: Vec<f32>) -> Self {
        let screened = Screened::of(trial);
        let before = mean_loss(screened.nothing());
        let singles = screened.singles();
        let pair = screened.best_pair(&singles);
        let one = singles.first().map_or(before, |single| single.loss);
        let two = pair.map_or(one, |pair| pair.loss);
        let starts = StartRecord::of(&trial.comparison.drives().collect::<Vec<_>>(), &residuals);
        let scores = tried_scores(trial, tried);
        Self {
            residuals,
            loss: before,
            gain_of_two: trial.comparison.numbers_ratio() * (one / two).ln(),
            scores,
            starts,
        }
    }
}

/// A gain by chance is so much of the second largest of all runs.
const CHANCE_MARGIN: f64 = 0.75;

/// The largest gain is left aside: that run may be the only one to show what the effect does, and the model that knows all
/// runs knows it. Of two runs the larger counts.
fn chance_gain(gains: impl Iterator<Item = f64>) -> f64 {
    let mut gains: Vec<f64> = gains.map(|gain| gain.max(0.0)).collect();
    gains.sort_by(|a, b| b.total_cmp(a));
    if gains.len() > 2 { CHANCE_MARGIN * gains[1] } else { gains.first().copied().unwrap_or(0.0) }
}

impl Null {
    fn of(left_out: &[LeftOut], limits_shown: LimitsShown) -> Self {
        let residuals: Vec<f32> = left_out.iter().flat_map(|one| one.residuals.iter().copied()).collect();
        // One drive in a regime that the others never saw shall not make the null of all.
        let median = |of: &dyn Fn(&LeftOut) -> f64| {
            let mut values: Vec<f64> = left_out.iter().map(of).collect();
            values.sort_by(f64::total_cmp);
            0.5 * (values[(values.len() - 1) / 2] + values[values.len() / 2])
        };
        Self {
            error: median(&|one| rollout_error(&one.residuals)),
            loss: median(&|one| one.loss),
            chance: Chance::of(&left_out.iter().map(|one| &one.scores).collect::<Vec<_>>()),
            limits_shown,
            gain_of_two: chance_gain(left_out.iter().map(|one| one.gain_of_two)),
            cells: residual_cells(&residuals, &residuals, None),
            starts: left_out.iter().flat_map(|one| one.starts.clone()).collect(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::chance_gain;

    /// 0.75 times 0.02; of two runs the larger.
    #[test]
    fn one_run_that_stands_out_is_no_measure_of_chance() {
        assert!((chance_gain([0.02, 0.3, -0.1, 0.01].into_iter()) - 0.015).abs() < 1e-12);
        assert!((chance_gain([0.02, 0.3].into_iter()) - 0.3).abs() < 1e-12);
    }
}
