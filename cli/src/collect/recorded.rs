//! Recorded drives: the files that hold them and the ground below.

use std::path::Path;

use bench::collection::{Collection, Recorded, collect_recorded};
use bicycle::{DriveLog, Vehicle};
use formats::{ElevationFile, read_drive_log_csv, read_drive_log_mcap, read_elevation};
use scenarios::WorldLayers;

use super::told;
use crate::UsageError;

/// Reads both files and labels what was driven.
pub(super) fn gather(vehicle: &Vehicle, log: &Path, elevation: &Path) -> anyhow::Result<Collection> {
    let source = Recorded { log: log.display().to_string(), ground: elevation.display().to_string() };
    let log = read_log(log)?;
    let layers = layers(read_elevation(elevation).map_err(UsageError::from_input)?);
    collect_recorded(vehicle, log, &layers, &source).map_err(told)
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

fn layers(file: ElevationFile) -> WorldLayers {
    WorldLayers {
        elevation_m: file.elevation,
        canopy_height_m: file.layers.canopy_height_m,
        low_vegetation_fraction: file.layers.low_vegetation_fraction,
        water: file.layers.water,
        ground_gap_m: file.layers.ground_gap_m,
    }
}
