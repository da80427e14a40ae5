//! Recorded drives: the files that hold them and the ground below.

use std::path::Path;

use bench::closed_loop::layers_of;
use bench::collection::{Collection, Recorded, collect_recorded};
use bicycle::{Column, DriveLog, Vehicle};
use formats::{read_drive_log_csv, read_drive_log_mcap, read_elevation};

use super::told;
use crate::UsageError;
use crate::arguments::{CollectArguments, Goal};

/// Reads both files and labels what was driven.
pub(super) fn gather(
    arguments: &CollectArguments,
    vehicle: &Vehicle,
    log: &Path,
    elevation: &Path,
) -> anyhow::Result<Collection> {
    let source = Recorded { log: log.display().to_string(), ground: elevation.display().to_string() };
    let mut log = read_log(log)?;
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

fn read_log(path: &Path) -> Result<DriveLog, UsageError> {
    let extension = path.extension().unwrap_or_default().to_string_lossy().to_lowercase();
    match extension.as_str() {
        "csv" => Ok(read_drive_log_csv(path).map_err(UsageError::from_input)?.log),
        "mcap" => {
            let read = read_drive_log_mcap(path).map_err(UsageError::from_input)?;
            if let Some(problem) = read.ended_early {
                eprintln!("surefoot: {}: the recording ends early, {problem}", path.display());
            }
            Ok(read.log)
        }
        _ => Err(UsageError(format!(
            "--log: expected a file ending in .csv or .mcap, found {}",
            path.display()
        ))),
    }
}
