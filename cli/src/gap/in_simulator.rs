//! The last word of a diagnosis: the user's own simulator, before and after the held-out drives are opened.

use bicycle::DriveLog;
use sim_to_real::{Answer, InSimulatorDiagnosis, InSimulatorError, Machine, decide_in_simulator, own_runs};

use super::simulator::Simulators;
use crate::UsageError;
use crate::arguments::GapSimulatorArguments;

/// The simulator that decides, if one was asked for.
pub(super) struct Decider {
    simulators: Option<Simulators>,
    diagnosis: Option<InSimulatorDiagnosis>,
}

impl Decider {
    /// Starts the simulator and sends its own drives through it, so that one that does not run is told before anything is
    /// calibrated.
    pub(super) fn start(
        arguments: &GapSimulatorArguments,
        machine: &Machine,
        sim: &[DriveLog],
    ) -> anyhow::Result<Self> {
        let Some(command) = arguments.simulator.as_deref() else {
            return Ok(Self { simulators: None, diagnosis: None });
        };
        if sim.is_empty() {
            let told =
                "--simulator: expected nominal drives, which tell how well it repeats itself, found none";
            return Err(UsageError(told.to_owned()).into());
        }
        let simulators = Simulators::start((command, arguments), machine)?;
        let runs = own_runs(&simulators.description, machine, sim).map_err(told)?;
        simulators.run(&runs)?;
        Ok(Self { simulators: Some(simulators), diagnosis: None })
    }

    /// Lets the simulator decide about the answer's ranking and its own knobs.
    pub(super) fn decide(
        &mut self,
        answer: &mut Answer,
        machine: &Machine,
        drives: (&[DriveLog], &[DriveLog]),
    ) -> anyhow::Result<()> {
        let Some(simulators) = &self.simulators else { return Ok(()) };
        let run = |runs: &[_]| simulators.run(runs);
        let decided = decide_in_simulator(&simulators.description, machine, answer, drives, &run);
        self.diagnosis = Some(decided.map_err(told)?);
        Ok(())
    }

    /// Sends the held-out drives through the simulator, as it is and with what was found.
    pub(super) fn verify(
        &self,
        answer: &mut Answer,
        machine: &Machine,
        heldout: &[DriveLog],
    ) -> anyhow::Result<()> {
        let (Some(simulators), Some(diagnosis)) = (&self.simulators, &self.diagnosis) else { return Ok(()) };
        if !heldout.is_empty() {
            let run = |runs: &[_]| simulators.run(runs);
            answer.in_simulator = Some(diagnosis.verify(machine, heldout, &run).map_err(told)?);
        }
        Ok(())
    }

    /// Ends the simulator, and says how many drives it was sent through.
    pub(super) fn finish(self) -> Option<usize> {
        self.simulators.map(Simulators::finish)
    }
}

fn told(error: InSimulatorError<anyhow::Error>) -> anyhow::Error {
    match error {
        InSimulatorError::Run(error) => error,
        other => UsageError(other.to_string()).into(),
    }
}
