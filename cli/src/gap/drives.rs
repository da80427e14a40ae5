//! Drives of a diagnosis, read under the names of their files.

use std::path::PathBuf;

use formats::ColumnNames;
use sim_to_real::Drives;

use crate::UsageError;

/// Reads drives; what their files leave out is told in `doubts`.
pub(super) fn read(
    paths: &[PathBuf],
    names: &ColumnNames,
    doubts: &mut Vec<String>,
) -> Result<Drives, UsageError> {
    let mut read_one = |path: &PathBuf| {
        let drive = formats::read_drive_named(path, names).map_err(UsageError::from_input)?;
        if let Some(problem) = drive.ended_early {
            doubts.push(format!("{}: the recording ends early, {problem}", path.display()));
        }
        Ok(drive.log)
    };
    let logs = paths.iter().map(&mut read_one).collect::<Result<_, _>>()?;
    Ok(Drives { names: paths.iter().map(|path| path.display().to_string()).collect(), logs })
}
