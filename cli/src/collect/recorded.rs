//! Recorded drives: the files that hold them and the ground below.

use std::path::Path;

use bench::closed_loop::layers_of;
use bench::collection::{Collection, Recorded, collect_recorded};
use bicycle::{Column, DriveLog, Vehicle};
use formats::read_elevation;

use super::told;
use crate::UsageError;
use crate::arguments::{CollectArguments, Goal};
use crate::drive_file::{self, Mapping};

/// Reads both files and labels what was driven.
pub(super) fn gather(
    arguments: &CollectArguments,
    vehicle: &Vehicle,
    log: &Path,
    elevation: &Path,
) -> anyhow::Result<Collection> {
    let source = Recorded { log: log.display().to_string(), ground: elevation.display().to_string() };
    let mut log = read_log(arguments, log)?;
    if let Some(Goal { x_m, y_m }) = arguments.elevation_origin {
        log = moved(&log, [-x_m, -y_m])?;
    }
    let layers = layers_of(read_elevation(elevation).map_err(UsageError::from_input)?);
    collect_recorded(vehicle, log, &layers, &source).map_err(told)
}

/// The log in a frame whose origin lies elsewhere.
fn moved(log: &DriveLog, [east_m, north_m]: [f64; 2]) -> Result<DriveLog, UsageError> {
    let mut moved = DriveLog::default();
    for run in log.runs() {
        for row in run.drive_rows() {
            let [x_m, y_m] = [row.value(Column::X) + east_m, row.value(Column::Y) + north_m];
            let row = row.with(Column::X, x_m).with(Column::Y, y_m);
            moved.push(run.name(), &row).map_err(UsageError::from_input)?;
        }
    }
    Ok(moved)
}

fn read_log(arguments: &CollectArguments, path: &Path) -> Result<DriveLog, UsageError> {
    let mapping = Mapping::of("--topics", &arguments.topics, arguments.robot.as_deref())?;
    let mut doubts = Vec::new();
    let log = drive_file::read(path, &mapping, &mut doubts)
        .map_err(|UsageError(problem)| UsageError(format!("--log: {problem}")))?;
    doubts.iter().for_each(|doubt| eprintln!("surefoot: {doubt}"));
    Ok(log)
}
