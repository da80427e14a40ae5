//! A diagnosis without nominal drives: the kinematic bicycle, of which the wheelbase alone is known, is the simulator.
//!
//! Everything that a machine does and the bicycle does not is then a gap, the ordinary as well as the faulty. Effects of
//! the whole catalogue are added one at a time as long as left-out stretches of the drives are foretold better; all
//! parameters are fitted together. The result repairs the model. Which of it is ordinary, only drives of a machine in
//! order can tell: that, and which effects do each other's work, is said in the notes.

mod notes;
mod selection;

use crate::answer::Verdict;
use crate::baseline::{Baseline, Experience, GapError, Null, drives_of};
use crate::causes::Trial;
use crate::comparison::{Comparison, Yardstick, rollout_error};
use crate::conditions::{StartRecord, condition_tables, ground_residuals};
use crate::diagnosis::Diagnosis;
use crate::drive::Drive;
use crate::findings::Findings;
use crate::intervals::named_effects;
use crate::least_squares::mean_loss;
use crate::limits_shown::LimitsShown;
use crate::machine::Machine;
use crate::parts::by_part;
use crate::residual_table::residual_cells;
use crate::score_test::Chance;
use crate::whitening::Whitening;
use bicycle::DriveLog;
pub(crate) use notes::of_evidence;
use selection::{LeftOut, Selection, grown};

/// Rollouts by which effects are selected, and by which the selected ones are fitted; of longer drives, stretches evenly
/// spread.
const N_STARTS_TO_SELECT: usize = 200;
const N_STARTS: usize = 1500;
/// Starts of a stretch: five seconds.
const STRETCH: usize = 25;
/// Parts of the drives of which one after the other is left out.
const N_FOLDS: usize = 4;
/// Effects that the yardstick's own model holds.
const N_FOR_YARDSTICK: usize = 6;

/// The bare model with its yardstick, and what separates the drives from it.
#[derive(Clone, Debug)]
pub struct WithoutSimulator {
    /// The kinematic bicycle without any effect. Its floor is the noise of the measurements, which no model foretells.
    pub baseline: Baseline,
    /// The effects of the repaired model.
    pub diagnosis: Diagnosis,
}

/// Finds what separates real drives from the kinematic bicycle.
///
/// # Errors
/// No run, or a run without input or motion, too short or full of holes.
pub fn diagnose_without_simulator(
    machine: &Machine,
    real: &[DriveLog],
) -> Result<WithoutSimulator, GapError> {
    let drives = drives_of("real", machine, real)?;
    if drives.is_empty() {
        return Err(GapError::Few { set: "real", needed: 1, found: 0 });
    }
    let few = stretches(&drives, N_STARTS_TO_SELECT);
    let folds = Folds::of(&few);
    let rough = Trial::fixed(folds.comparison(machine, &Yardstick::rough()), &[]);
    let known = grown(&rough, None, N_FOR_YARDSTICK);
    let yardstick = Yardstick::of(&rough.residuals(&known.explanation.causes), &Yardstick::rough());
    let left_out = LeftOut { folds: &folds, machine, yardstick: &yardstick };
    let trial = Trial::fixed(folds.comparison(machine, &yardstick), &[]);
    let grown = grown(&trial, Some(&left_out), usize::MAX);
    let mut selection = Selection::of(&trial, grown, &left_out);
    let many = stretches(&drives, N_STARTS);
    let all: Vec<&Drive> = many.iter().collect();
    let baseline = bare_baseline(machine, &all, yardstick.clone());
    selection.refit(&baseline.trial(&all));
    let diagnosis = diagnosis(&baseline, &all, &folds, &selection);
    Ok(WithoutSimulator { baseline, diagnosis })
}

/// The bicycle alone, and the measurements' noise for its null.
fn bare_baseline(machine: &Machine, drives: &[&Drive], yardstick: Yardstick) -> Baseline {
    let noise = Comparison::new(machine.wheelbase_m, drives.to_vec(), &yardstick).noise();
    let null = Null {
        error: rollout_error(&noise),
        loss: mean_loss(&noise),
        chance: Chance::default(),
        limits_shown: LimitsShown::default(),
        gain_of_two: 0.0,
        cells: residual_cells(&noise, &noise, None),
        starts: StartRecord::of(drives, &noise),
    };
    Baseline {
        wheelbase_m: machine.wheelbase_m,
        effects: Vec::new(),
        proportional: Vec::new(),
        yardstick,
        whitening: Whitening::none(),
        experience: Experience::none(),
        attitude: None,
        yaw_response: None,
        null,
    }
}

fn diagnosis(baseline: &Baseline, all: &[&Drive], folds: &Folds<'_>, selection: &Selection) -> Diagnosis {
    let trial = baseline.trial(all);
    let causes = selection.explanation.causes.clone();
    let (before, after) = (trial.residuals(&[]), trial.residuals(&causes));
    let [own, repaired] = [&before, &after].map(|residuals| StartRecord::of(all, residuals));
    let errors = [rollout_error(&before), rollout_error(&after)];
    let [left_out_before, left_out_after] = selection.left_out_errors(folds, baseline);
    let mut credible_set: Vec<String> = Vec::new();
    let rivals = selection.alternatives.iter().flat_map(|(_, ids)| ids.iter().copied());
    for id in selection.explanation.ids().into_iter().chain(rivals) {
        if credible_set.iter().all(|known| known != id) {
            credible_set.push(id.to_owned());
        }
    }
    Diagnosis {
        named: named_effects(&trial, &causes),
        by_part: by_part(&trial, &causes),
        // Of what is left nobody knows whether nominal drives would leave it too.
        left: Vec::new(),
        swing: None,
        leaning: None,
        findings: Findings {
            conditions: condition_tables(&own, &baseline.null.starts),
            residuals: residual_cells(&before, &after, Some(&baseline.null.cells)),
            map: ground_residuals(&own, &repaired),
            spectrum: None,
        },
        errors,
        predicted_closed: baseline.closed(left_out_before, left_out_after),
        verdict: if causes.is_empty() { Verdict::None } else { Verdict::Effects },
        effects: causes,
        steering: all[0].evidence.steering(),
        ranking: selection.ranking(),
        credible_set,
        floor: baseline.null.error,
        notes: notes::notes(all, selection, errors),
    }
}

/// Stretches of drives, evenly spread where there are more than a diagnosis looks at.
fn stretches(drives: &[Drive], n_most: usize) -> Vec<Drive> {
    let all: Vec<(&Drive, &[usize])> = drives
        .iter()
        .flat_map(|drive| drive.starts.chunks(STRETCH).map(move |starts| (drive, starts)))
        .collect();
    let n_starts: usize = all.iter().map(|(_, starts)| starts.len()).sum();
    let n_kept = (all.len() * n_most / n_starts).clamp(1, all.len());
    let kept = (0..n_kept).map(|k| all[k * all.len() / n_kept]);
    let stretches: Vec<Drive> = kept.map(|(drive, starts)| drive.stretch(starts)).collect();
    if let [alone] = &stretches[..] { alone.halves() } else { stretches }
}

/// Stretches in as many groups as are left out in turn, each a part of the drives in their order.
pub(crate) struct Folds<'a> {
    all: Vec<&'a Drive>,
    groups: Vec<Vec<&'a Drive>>,
}

impl<'a> Folds<'a> {
    fn of(stretches: &'a [Drive]) -> Self {
        let all: Vec<&Drive> = stretches.iter().collect();
        let per_group = all.len().div_ceil(N_FOLDS);
        Self { groups: all.chunks(per_group).map(<[_]>::to_vec).collect(), all }
    }

    fn comparison(&self, machine: &Machine, yardstick: &Yardstick) -> Comparison<'a> {
        Comparison::new(machine.wheelbase_m, self.all.clone(), yardstick)
    }
}
