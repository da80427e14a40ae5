//! What follows the naming: what the drives could not show, what to drive next, and what a learned model would close.

use std::path::PathBuf;

use bicycle::DriveLog;
use formats::{DriveLogFile, write_drive_log_csv};
use sim_to_real::{Answer, Baseline, Diagnosis, Machine, design_manoeuvre, learned_bound, unseen_effects};

use super::outputs::Outputs;
use crate::arguments::GapDiagnoseArguments;
use crate::{UsageError, WorkFailed};

/// A diagnosis with all that it was made from.
pub(super) struct Diagnosed<'a> {
    pub baseline: &'a Baseline,
    pub machine: &'a Machine,
    pub diagnosis: &'a Diagnosis,
    pub sim: &'a [DriveLog],
    pub real: &'a [DriveLog],
}

impl Diagnosed<'_> {
    /// Adds to the answer what the real drives could not show and what to drive next, whose commands go to a file.
    pub(super) fn advise(
        &self,
        answer: &mut Answer,
        (arguments, outputs): (&GapDiagnoseArguments, &Outputs),
    ) -> anyhow::Result<()> {
        let file: Option<PathBuf> =
            arguments.manoeuvre.clone().or_else(|| outputs.in_folder("manoeuvre.csv"));
        let Some(file) = file else { return Ok(()) };
        let &Self { baseline, machine, diagnosis, sim, real } = self;
        let unseen = unseen_effects(baseline, machine, diagnosis, real).map_err(UsageError::from_input)?;
        answer.advice.extend(unseen);
        let designed =
            design_manoeuvre(baseline, machine, diagnosis, (sim, real)).map_err(UsageError::from_input)?;
        // One of an earlier case must not pass for one of this.
        if file.is_file() {
            std::fs::remove_file(&file)?;
        }
        if let Some(manoeuvre) = designed {
            let commands = DriveLogFile { log: manoeuvre.commands_log(), ..DriveLogFile::default() };
            write_drive_log_csv(&file, &commands)?;
            let name = file.file_name().unwrap_or(file.as_os_str()).to_string_lossy();
            answer.advice.push(manoeuvre.advice(&name));
        }
        Ok(())
    }

    /// Adds to the answer what a flexible learned correction closes.
    pub(super) fn bound(
        &self,
        answer: &mut Answer,
        (arguments, outputs): (&GapDiagnoseArguments, &Outputs),
        heldout: &[DriveLog],
    ) -> anyhow::Result<()> {
        let is_asked = arguments.learned_bound || outputs.folder.is_some();
        if !is_asked || heldout.is_empty() || answer.shrink.closed.is_none() {
            return Ok(());
        }
        let drives = (self.real, heldout);
        let bound = learned_bound(self.baseline, self.machine, self.diagnosis, drives)
            .map_err(|error| WorkFailed(error.to_string()))?;
        answer.shrink.learned_bound_closed = bound.closed;
        Ok(())
    }
}
