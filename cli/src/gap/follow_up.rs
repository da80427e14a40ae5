//! What follows the naming, where it is asked for: the drive to make next, whose commands go to a file, and what a learned
//! model would close.

use std::path::PathBuf;

use bicycle::DriveLog;
use formats::{DriveLogFile, write_drive_log_csv};
use sim_to_real::{Answer, Diagnosed};

use super::outputs::Outputs;
use crate::arguments::GapDiagnoseArguments;
use crate::{UsageError, WorkFailed};

/// Adds to the answer what the real drives could not show and what to drive next.
pub(super) fn advise(
    diagnosed: &Diagnosed<'_>,
    answer: &mut Answer,
    (arguments, outputs): (&GapDiagnoseArguments, &Outputs),
) -> anyhow::Result<()> {
    let file: Option<PathBuf> = arguments.manoeuvre.clone().or_else(|| outputs.in_folder("manoeuvre.csv"));
    let Some(file) = file else { return Ok(()) };
    let name = file.file_name().unwrap_or(file.as_os_str()).to_string_lossy();
    let designed = diagnosed.advise(answer, &name).map_err(UsageError::from_input)?;
    // One of an earlier case must not pass for one of this.
    if file.is_file() {
        std::fs::remove_file(&file)?;
    }
    if let Some(manoeuvre) = designed {
        let commands = DriveLogFile { log: manoeuvre.commands_log(), ..DriveLogFile::default() };
        write_drive_log_csv(&file, &commands)?;
    }
    Ok(())
}

/// Adds to the answer what a flexible learned correction closes.
pub(super) fn bound(
    diagnosed: &Diagnosed<'_>,
    answer: &mut Answer,
    (arguments, outputs): (&GapDiagnoseArguments, &Outputs),
    heldout: &[DriveLog],
) -> anyhow::Result<()> {
    if arguments.learned_bound || outputs.folder.is_some() {
        diagnosed.bound(answer, heldout).map_err(|error| WorkFailed(error.to_string()))?;
    }
    Ok(())
}
