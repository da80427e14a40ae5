//! Drives of a diagnosis, read under the names of their files.

use std::path::PathBuf;

use sim_to_real::Drives;

use crate::UsageError;
use crate::drive_file::{self, Mapping};

/// Reads drives; what their files leave out is told in `doubts`.
pub(super) fn read(
    paths: &[PathBuf],
    mapping: &Mapping,
    doubts: &mut Vec<String>,
) -> Result<Drives, UsageError> {
    let mut read_one = |path: &PathBuf| drive_file::read(path, mapping, doubts);
    let logs = paths.iter().map(&mut read_one).collect::<Result<_, _>>()?;
    Ok(Drives { names: paths.iter().map(|path| path.display().to_string()).collect(), logs })
}
