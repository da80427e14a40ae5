//! Every reader of files and messages against inputs that are nearly right: none may panic, and none may hold more
//! memory than a stated multiple of what it is given.
//!
//! An ordinary run tries some ten thousand inputs of each in seconds. `SUREFOOT_FUZZ_INPUTS` sets how many are tried on
//! all targets together, `SUREFOOT_FUZZ_FIRST` how many of these are passed over; see docs/robustness.md.

#![allow(clippy::unwrap_used, reason = "a panic is how a test fails")]
#![allow(clippy::disallowed_methods, reason = "a long run tells how fast it is")]

mod archive;
mod files;
mod found;
mod harness;
mod image;
mod machine;
mod messages;
mod mutate;
mod networks;
mod recording;
mod runs;
mod words;

use harness::{Bound, Target, run};

const KB: u64 = 1 << 10;
const MB: u64 = 1 << 20;

/// The table of targets, and a test of each: name, inputs of an ordinary run, memory that may be held for every byte of
/// an input and always, what draws an input, and who reads it.
///
/// Where the input is TOML, every part of a dotted key, two bytes, is a table of its own; no such file may be longer than
/// a configuration is.
macro_rules! targets {
    ($($name:ident: $n_inputs:literal, $per_byte:expr, $always:expr, $input:path, $reader:path;)*) => {
        const TARGETS: &[Target] = &[$(Target {
            name: stringify!($name),
            n_inputs: $n_inputs,
            bound: Bound { per_byte: $per_byte, always: $always },
            input: $input,
            reader: $reader,
        }),*];

        $(
            #[test]
            fn $name() {
                let target = TARGETS.iter().find(|target| target.name == stringify!($name)).unwrap();
                run(target, TARGETS.iter().map(|target| target.n_inputs).sum());
            }
        )*
    };
}

targets! {
    drive_log_csv: 8192, 64, 64 * KB, files::drive_log_csv, files::read_drive_log_csv;
    drive_recording: 8192, KB, 256 * KB, files::drive_recording, files::read_drive_recording;
    elevation_npz: 8192, 8 * KB, 64 * KB, files::elevation_npz, files::read_elevation_npz;
    elevation_geotiff: 8192, 1536, 24 * MB, files::elevation_geotiff, files::read_elevation_geotiff;
    elevation_png: 8192, 8 * KB, 3 * MB, files::elevation_png, files::read_elevation_png;
    png_scale: 8192, KB, 64 * KB, files::png_scale, files::read_png_scale;
    traction_map: 4096, 8 * KB, 64 * KB, files::traction_map, files::read_traction_map;
    scan_points: 8192, 8 * KB, 64 * KB, files::scan_points, files::read_scan_points;
    vehicle: 4096, KB, 64 * KB, files::vehicle, files::read_vehicle;
    model: 4096, KB, 64 * KB, files::model, files::read_model;
    robot: 4096, KB, 64 * KB, files::robot, files::read_robot;
    settings: 2048, KB, 64 * KB, files::settings, files::read_settings;
    gap_case: 8192, KB, 64 * KB, files::gap_case, files::read_gap_case;
    gap_vehicle: 4096, KB, 64 * KB, files::gap_vehicle, files::read_gap_vehicle;
    gap_grid: 8192, 64, 64 * KB, files::gap_grid, files::read_gap_grid;
    gap_labels: 8192, 64, 64 * KB, files::gap_labels, files::read_gap_labels;
    gap_seal: 8192, 64, 64 * KB, files::gap_seal, files::read_gap_seal;
    answer: 8192, 64, 64 * KB, files::answer, files::read_answer;
    checkpoint: 4096, 64, 64 * KB, networks::checkpoint, networks::read_checkpoint;
    dataset: 8192, 64, 64 * KB, networks::dataset, networks::read_dataset;
    command_line: 2048, 64, 64 * KB, words::command_line, words::read_command_line;
    recorded_run: 512, 64, 8 * MB, runs::recorded_run, runs::read_recorded_run;
    pipeline: 4096, 64, 64 * MB, runs::pipeline, runs::read_pipeline;
    odometry: 1024, 0, MB, messages::odometry, messages::read_odometry;
    imu: 8192, 64, 64 * KB, messages::imu, messages::read_imu;
    scan: 4096, 64, 2 * MB, messages::scan, messages::read_scan;
    surface: 256, 64, 4 * MB, messages::surface, messages::read_surface;
    tracks: 512, 64, 2 * MB, messages::tracks, messages::read_tracks;
    risk: 1024, 64, MB, messages::risk, messages::read_risk;
    command: 8192, 0, 64 * KB, messages::command, messages::read_command;
    decision: 8192, 0, 64 * KB, messages::decision, messages::read_decision;
    mission: 512, 0, 4 * MB, messages::mission, messages::read_mission;
    order: 4096, 64, 64 * KB, messages::order, messages::read_order;
    stuck: 512, 0, 4 * MB, messages::stuck, messages::read_stuck;
    plan: 512, 0, 4 * MB, messages::plan, messages::read_plan;
    status: 8192, 0, 64 * KB, messages::status, messages::read_status;
    learned: 4096, 64, 64 * KB, messages::learned, messages::read_learned;
}
