//! What is known before the real drives are opened: the calibrated nominal model, its noise, and how much of a gap one
//! nominal drive shows against the others.

use crate::calibration::{calibrated, proportional};
use crate::causes::{Explanation, Trial};
use crate::comparison::{Comparison, Yardstick, root_mean_square};
use crate::conditions::StartRecord;
use crate::drive::{Drive, DriveError};
use crate::explanation::{best_pair, single_explanations};
use crate::findings::ResidualCell;
use crate::least_squares::mean_loss;
use crate::machine::Machine;
use crate::residual_table::residual_cells;
use bicycle::{DriveLog, Effect};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

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
    /// Largest logarithmic gain in loss that each effect brought where there was none.
    pub(crate) gains: BTreeMap<String, f64>,
    /// The largest of them.
    pub(crate) gain_of_one: f64,
    /// The same for a second effect.
    pub(crate) gain_of_two: f64,
    /// Residuals by quantity and horizon; before and after hold the same.
    pub(crate) cells: Vec<ResidualCell>,
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
        let mut left_out = Vec::new();
        for out in 0..drives.len() {
            let rest: Vec<&Drive> = (0..drives.len()).filter(|&i| i != out).map(|i| &drives[i]).collect();
            let (effects, own) = calibrated(wheelbase_m, &rest);
            left_out.push(LeftOut::new(wheelbase_m, &drives[out], &effects, [&own, &yardstick]));
            share(out + 2);
        }
        let proportional = proportional(wheelbase_m, &all, &yardstick);
        Ok(Self { wheelbase_m, effects, proportional, yardstick, null: Null::of(&left_out) })
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

/// One nominal run against a model of the others.
struct LeftOut {
    residuals: Vec<f32>,
    gains: [f64; 2],
    gain_by_id: BTreeMap<String, f64>,
    starts: Vec<StartRecord>,
}

impl LeftOut {
    fn new(wheelbase_m: f64, drive: &Drive, effects: &[Effect], [own, yardstick]: [&Yardstick; 2]) -> Self {
        let trial = Trial { comparison: Comparison::new(wheelbase_m, vec![drive], own), baseline: effects };
        let before = trial.loss(&[]);
        let singles = single_explanations(&trial);
        let pair = best_pair(&trial, &singles);
        let one = singles.first().map_or(before, |single| single.loss);
        let two = pair.map_or(one, |pair| pair.loss);
        let residuals = Comparison::new(wheelbase_m, vec![drive], yardstick).residuals(effects);
        let starts = StartRecord::of(&[drive], &residuals);
        let gain = |single: &Explanation| (single.ids()[0].to_owned(), (before / single.loss).ln());
        let gain_by_id = singles.iter().map(gain).collect();
        Self { residuals, gains: [(before / one).ln(), (one / two).ln()], gain_by_id, starts }
    }
}

fn largest_by_id(left_out: &[LeftOut]) -> BTreeMap<String, f64> {
    let mut largest = BTreeMap::new();
    for (id, &gain) in left_out.iter().flat_map(|one| &one.gain_by_id) {
        let so_far = largest.entry(id.clone()).or_insert(0.0_f64);
        *so_far = so_far.max(gain);
    }
    largest
}

impl Null {
    fn of(left_out: &[LeftOut]) -> Self {
        let residuals: Vec<f32> = left_out.iter().flat_map(|one| one.residuals.iter().copied()).collect();
        // One drive in a regime that the others never saw shall not make the null of all.
        let median = |of: &dyn Fn(&[f32]) -> f64| {
            let mut values: Vec<f64> = left_out.iter().map(|one| of(&one.residuals)).collect();
            values.sort_by(f64::total_cmp);
            0.5 * (values[(values.len() - 1) / 2] + values[values.len() / 2])
        };
        let largest = |i: usize| left_out.iter().map(|one| one.gains[i]).fold(0.0, f64::max);
        Self {
            error: median(&root_mean_square),
            loss: median(&mean_loss),
            gains: largest_by_id(left_out),
            gain_of_one: largest(0),
            gain_of_two: largest(1),
            cells: residual_cells(&residuals, &residuals, None),
            starts: left_out.iter().flat_map(|one| one.starts.clone()).collect(),
        }
    }
}
