//! Every file format: drive logs, elevation, vehicle and model descriptions, recordings, results. A part of
//! [Surefoot](../cli/index.html).
//!
//! What is refused is named by file, line or field, with what was expected and what was found; what is written is
//! written whole or not at all. `examples/own_files.rs` brings a vehicle and a drive log of one's own.
//!
//! ```
//! use formats::{ConfigText, parse_vehicle, read_vehicle, shipped_vehicle_text};
//!
//! let car = read_vehicle("rc_car")?; // or the path of a file
//! assert!(car.geometry.wheelbase_m > 0.0);
//!
//! let text = shipped_vehicle_text("rc_car").expect("it ships").replace("wheelbase_m = 0.18", "wheelbase_m = 0");
//! let refusal = parse_vehicle(&ConfigText::new("mine.toml", text)).unwrap_err().to_string();
//! assert!(refusal.contains("geometry.wheelbase_m: expected a finite number > 0, found 0"), "{refusal}");
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod bag;
mod cells;
mod column_names;
mod config;
mod drive_log_csv;
mod elevation;
mod gap_case;
mod gap_case_write;
mod geojson;
mod journal;
mod model_text;
mod numpy;
mod overlay;
mod recording;
mod refusal;
mod results;
mod robot;
mod scan;
mod skid_steer;
mod traction_map;
mod urdf;
mod vehicle;

pub use bag::{Bag, BagError, BagMetadata, BagTopic, BagWriteError, BagWriter};
pub use column_names::{ColumnNames, ColumnNamesError};
pub use config::{ConfigError, ConfigText};
pub use drive_log_csv::{
    DriveLogFile, DriveLogFileError, OtherColumn, read_drive_log_csv, read_drive_log_csv_named,
    write_drive_log_csv,
};
pub use elevation::{
    ElevationError, ElevationFile, ElevationLayers, PngScale, read_elevation, read_elevation_png,
};
pub use gap_case::{
    DescribedVehicle, DriveFileError, GapCase, GapGround, GapKind, GapLabel, GapNoise, GapVehicle,
    GapVehicleError, ReadDrive, drive_parts, parse_gap_labels, parse_gap_vehicle, read_described_vehicle,
    read_drive, read_drive_named, read_gap_case, read_gap_labels, read_gap_vehicle,
};
pub use gap_case_write::{
    GapSeal, GapSealError, read_sealed_labels, write_gap_case, write_gap_labels, write_gap_seal,
    write_gap_vehicle,
};
pub use geojson::{GeoJsonError, GeoLine, MapReference, geojson};
pub use journal::{Journal, JournalContent, JournalError, read_journal};
pub use model_text::{model_text, toml_text};
pub use overlay::overlay;
pub use recording::{
    DriveLogFields, DriveRecorder, DriveTopics, McapDriveLog, McapReadError, RecordError, RecordedCell,
    RecordedChannel, RecordedColumn, RecordedMessage, RecordedRisk, RecordedTable, RecordingError,
    RecordingMessages, json_row, open_recording, read_drive_log_mcap, read_recorded_maps,
    read_recorded_table, recorded_best_rollout, recorded_elevation, recorded_risk, recorded_scan,
};
pub use refusal::ArrayFileError;
pub use results::{OutputError, config_hash, prepare_out_dir, write_bytes_atomic, write_json_atomic};
pub use robot::{
    CONTROL_RATES_HZ, ODOMETRY_RATES_HZ, RobotAges, RobotAreas, RobotCorrection, RobotFile, RobotGround,
    RobotMission, RobotRates, RobotRos, RobotSafety, RobotSensor, RosClock, RosCommand, RosLabels,
    RosNavigateResult, RosPointEpoch, RosPointTime, RosTopics, SCAN_RATES_HZ, THIRD_PARTIES_MAX, parse_robot,
    read_robot,
};
pub use scan::{parse_scan_points, read_scan_points};
pub use skid_steer::{parse_skid_steer_vehicle, read_skid_steer_vehicle};
pub use traction_map::{TractionMap, TractionPmfs, parse_traction_map, read_traction_map};
pub use urdf::{UrdfError, UrdfVehicle};
pub use vehicle::{
    parse_model, parse_vehicle, read_model, read_vehicle, shipped_vehicle_names, shipped_vehicle_text,
};
