//! The held-out drives in the simulator itself, as it is and with what was found.

use super::trial::Trial;
use super::types::{InSimulator, RunSimulator};
use super::{InSimulatorDiagnosis, InSimulatorError, driven};
use crate::answer::BeforeAfter;
use crate::baseline::GapError;
use crate::comparison::rollout_error;
use crate::diagnosis::closed;
use crate::machine::Machine;
use crate::verification::{closed_interval, position_error};
use bicycle::DriveLog;

impl InSimulatorDiagnosis {
    /// The answer with what the held-out drives show, once they have been through the simulator.
    ///
    /// # Errors
    /// No held-out run, one that cannot be used, or a failure of the simulator.
    pub fn verify<E>(
        &self,
        machine: &Machine,
        heldout: &[DriveLog],
        run: &RunSimulator<'_, E>,
    ) -> Result<InSimulator, InSimulatorError<E>> {
        let drives = driven("held-out", machine, heldout)?;
        if drives.is_empty() {
            return Err(GapError::Few { set: "held-out", needed: 1, found: 0 }.into());
        }
        let trial = Trial::new(&self.simulator, &self.reference, &drives, run);
        let settings = [Vec::new(), self.setting.clone()];
        let residuals = trial.residuals(&settings).map_err(InSimulatorError::Run)?;
        let [before, after] = [0, 1].map(|setting| residuals[setting].concat());
        let [error_before, error_after] = [&before, &after].map(|residuals| rollout_error(residuals));
        let mut answer = self.answer.clone();
        let (floor, yardstick) = (self.reference.error, &self.reference.yardstick);
        let shrink = &mut answer.shrink;
        (shrink.before, shrink.after) = (Some(error_before), Some(error_after));
        shrink.closed = closed(floor, error_before, error_after);
        if let Some(closed) = shrink.closed {
            let [low, high] = closed_interval(floor, &before, &after);
            (shrink.closed_low, shrink.closed_high) = (Some(low.min(closed)), Some(high.max(closed)));
        }
        let distances = position_error(yardstick, &before).zip(position_error(yardstick, &after));
        shrink.position_error_2s_m = distances.map(|(before, after)| BeforeAfter { before, after });
        Ok(answer)
    }
}
