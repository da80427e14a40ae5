//! The user's own simulator decides what the surrogate has screened.
//!
//! A simulator is a function from commands to motion, whoever runs it. Every drive goes through it from its first row
//! with all that was commanded since, so that whatever it hides inside has the history that the robot had. What is
//! compared is what moves within 0.3 to 2.0 s, seen from where each of the two then is: a simulator that drifts off its
//! place over a minute is not blamed for it.
//!
//! Causes are effects of the catalogue that act on commands or sensors, wrapped around the simulator, and the simulator's
//! own knobs. Each is fitted alone, by few runs, and judged on drives that it was not fitted to.

mod intervals;
mod judgement;
mod lever;
mod memory;
mod reference;
mod replay;
mod search;
mod trial;
mod types;
mod verification;

use crate::answer::{Answer, Ranked};
use crate::baseline::{GapError, drives_of};
use crate::drive::Drive;
use crate::evidence::{SpeedInput, TurnInput};
use crate::machine::Machine;
use bicycle::DriveLog;
use judgement::Judged;
use lever::{Lever, levers};
pub use memory::RunMemory;
use reference::Reference;
use trial::Trial;
pub use types::{
    CauseKind, InSimulator, Knob, KnobError, Motion, RunSimulator, SimulatorCandidate, SimulatorCause,
    SimulatorDescription, SimulatorRun, StartState,
};

/// Effects that the surrogate names for the simulator to decide about; the others are tried where none of these explains
/// the gap.
const N_CAUSES: usize = 5;

/// Why a simulator could not decide.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum InSimulatorError<E> {
    /// Drives cannot be used.
    #[error(transparent)]
    Drives(#[from] GapError),
    /// A drive does not hold what a simulator is driven by.
    #[error(
        "{set} run '{run}': expected the columns cmd_speed and cmd_steer, which drive a simulator, found others"
    )]
    Input {
        /// Nominal, real or held-out.
        set: &'static str,
        /// Run.
        run: String,
    },
    /// The simulator failed.
    #[error("{0}")]
    Run(E),
}

/// What the simulator says of the real drives before the held-out ones are opened.
#[derive(Clone, Debug)]
pub struct InSimulatorDiagnosis {
    /// The answer so far.
    pub answer: InSimulator,
    simulator: SimulatorDescription,
    reference: Reference,
    setting: Vec<(Lever, f64)>,
}

/// Fits the knobs of a simulator and the likeliest wrapped causes to real drives in it, and judges them.
///
/// `screened` is the surrogate's ranking, best first; of its effects the first five that can be wrapped around a simulator
/// are tried, and where neither one of them nor a knob explains the gap, the others that can. `sim` are the simulator's own
/// recorded drives, which show how well it repeats itself.
///
/// # Errors
/// No nominal or real run, a run that cannot be used, or a failure of the simulator.
pub fn judge_in_simulator<E>(
    simulator: &SimulatorDescription,
    machine: &Machine,
    screened: &[Ranked],
    (sim, real): (&[DriveLog], &[DriveLog]),
    run: &RunSimulator<'_, E>,
) -> Result<InSimulatorDiagnosis, InSimulatorError<E>> {
    let nominal = driven("nominal", machine, sim)?;
    let drives = driven("real", machine, real)?;
    for (set, drives) in [("nominal", &nominal), ("real", &drives)] {
        if drives.is_empty() {
            return Err(GapError::Few { set, needed: 1, found: 0 }.into());
        }
    }
    let reference = Reference::of(simulator, (&nominal, &drives), run).map_err(InSimulatorError::Run)?;
    let trial = Trial::new(simulator, &reference, &drives, run);
    let (likeliest, others) = levers(simulator, screened, N_CAUSES);
    let judged = Judged::of(&trial, &likeliest, &others).map_err(InSimulatorError::Run)?;
    Ok(judged.diagnosis(simulator, reference))
}

/// From here on a simulator does not drive its own recorded drives again, in their measurements' noise [-].
const OTHER_DRIVES: f64 = 5.0;

/// [`judge_in_simulator`] of an answer's ranking; what the simulator says goes into the answer.
///
/// # Errors
/// Those of [`judge_in_simulator`].
pub fn decide_in_simulator<E>(
    simulator: &SimulatorDescription,
    machine: &Machine,
    answer: &mut Answer,
    drives: (&[DriveLog], &[DriveLog]),
    run: &RunSimulator<'_, E>,
) -> Result<InSimulatorDiagnosis, InSimulatorError<E>> {
    let diagnosis = judge_in_simulator(simulator, machine, &answer.ranking, drives, run)?;
    let error = diagnosis.answer.own_drives_error;
    if error > OTHER_DRIVES {
        answer.advice.push(format!(
            "record the nominal drives again: {} misses those that were given by {error:.1} times their noise",
            diagnosis.answer.simulator
        ));
    }
    answer.in_simulator = Some(diagnosis.answer.clone());
    Ok(diagnosis)
}

/// The simulator's own recorded drives for the simulator as it is: what it is asked first.
///
/// # Errors
/// A run that cannot be used.
pub fn own_runs<E>(
    simulator: &SimulatorDescription,
    machine: &Machine,
    sim: &[DriveLog],
) -> Result<Vec<SimulatorRun>, InSimulatorError<E>> {
    let drives = driven("nominal", machine, sim)?;
    Ok(drives.iter().map(|drive| replay::as_it_is(simulator, drive)).collect())
}

/// Drives that a simulator can be sent through.
fn driven<E>(
    set: &'static str,
    machine: &Machine,
    logs: &[DriveLog],
) -> Result<Vec<Drive>, InSimulatorError<E>> {
    let drives = drives_of(set, machine, logs)?;
    let is_driven = |drive: &&Drive| {
        drive.evidence.speed_input == SpeedInput::Commanded
            && drive.evidence.turn_input == TurnInput::CommandedAngle
    };
    match drives.iter().find(|drive| !is_driven(drive)) {
        Some(other) => Err(InSimulatorError::Input { set, run: other.name.clone() }),
        None => Ok(drives.into_iter().map(replay::settled).collect()),
    }
}
