//! Every file format: drive logs, elevation, vehicle and model descriptions, recordings, results.
//!
//! What is refused is named by file, line or field, with what was expected and what was found; what is written is
//! written whole or not at all.

mod config;
mod elevation;
mod recording;
mod vehicle;

pub use config::{ConfigError, ConfigText};
pub use elevation::{
    ElevationError, ElevationFile, ElevationLayers, PngScale, read_elevation, read_elevation_png,
};
pub use recording::{DriveRecorder, McapDriveLog, McapReadError, RecordError, read_drive_log_mcap};
pub use vehicle::{parse_vehicle, read_vehicle, shipped_vehicle_names, shipped_vehicle_text};
