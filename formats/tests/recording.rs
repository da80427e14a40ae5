//! Recordings, read back with another library.
#![allow(clippy::unwrap_used, reason = "a test stops at the first surprise")]

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use bicycle::{Column, Command, Decision, DriveLog, DriveRow, HoldReason, StopReason};
use formats::{DriveRecorder, read_drive_log_mcap};
use foxglove::Decode;
use foxglove::messages::{FrameTransform, Grid, PointCloud, SceneUpdate};
use terrain::{Cell, GridGeometry, GridMap, Pose, RangePoint, Scan, SurfaceCell, TerrainClass};
use traversability::{Risk, RiskMap};

const GEOMETRY: GridGeometry = GridGeometry { resolution_m: 0.5, origin: [-3, 4], n_rows: 6, n_cols: 9 };

fn about() -> BTreeMap<String, String> {
    BTreeMap::from([("seed".into(), "7".into())])
}

/// A turn with values that only survive when every bit does.
fn row(step: u32) -> DriveRow {
    let time_s = f64::from(step) * 0.1;
    let row =
        DriveRow::new(time_s).with(Column::X, time_s.sin()).with(Column::CmdRight, 1.0 / (1.0 + time_s));
    // Measured at half the rate.
    if step.is_multiple_of(2) { row.with(Column::Yaw, (time_s * 1e-3).exp()) } else { row }
}

fn ns(step: u32) -> u64 {
    u64::from(step) * 100_000_000
}

fn surface() -> GridMap<SurfaceCell> {
    let mut map = GridMap::filled(GEOMETRY, SurfaceCell::UNKNOWN);
    map[Cell { row: 2, col: 5 }] = SurfaceCell::certain(1.25, TerrainClass::Vegetation, 0.4);
    map
}

fn record_everything(path: &Path) {
    let mut recorder = DriveRecorder::create(path, about()).unwrap();
    let pose = Pose { x_m: 1.0, y_m: 2.0, z_m: 3.0, yaw_rad: std::f64::consts::FRAC_PI_2, ..Pose::default() };
    recorder.goal(0, &pose).unwrap();
    recorder.elevation(0, &surface()).unwrap();
    let mut risk = RiskMap::constant(GEOMETRY, 4, Risk::NONE);
    let index = GEOMETRY.index(Cell { row: 2, col: 5 });
    // Yaw bin 1 of 4 is centred at 135 degrees and holds 90 to 180.
    risk.fill(|risks, _| risks[4 * index + 1].linear_traction = 0.25);
    recorder.risk(0, &risk.view(), 2.0).unwrap();
    let point = RangePoint { position_m: [1.0, -2.0, 0.5], class: TerrainClass::Obstacle };
    recorder.scan(0, &Scan { points: vec![point; 3], ..Scan::default() }).unwrap();
    recorder.rollouts(0, &[vec![[0.0; 3], [1.0, 0.0, 0.0]], vec![[0.0; 3]]]).unwrap();
    for step in 0..50 {
        recorder.pose(ns(step), &pose).unwrap();
        recorder.path(ns(step), &[pose, pose]).unwrap();
        recorder.command(ns(step), &Command { speed_mps: 1.0, steering_rad: -0.25 }).unwrap();
        recorder.decision(ns(step), &Decision::Stop(StopReason::StaleScan)).unwrap();
        let diagnostics = serde_json::json!({ "free_energy": 3.5, "terms": { "goal": f64::NAN } });
        recorder.controller(ns(step), &diagnostics).unwrap();
        recorder.drive_row(ns(step), "1", &row(step)).unwrap();
    }
    recorder.decision(ns(50), &Decision::Hold(HoldReason::AtGoal)).unwrap();
    recorder.finish().unwrap();
}

fn recording(folder: &tempfile::TempDir) -> PathBuf {
    folder.path().join("drive.mcap")
}

/// Messages of one topic.
fn messages(bytes: &[u8], topic: &str) -> Vec<mcap::Message<'static>> {
    let all = mcap::MessageStream::new(bytes).unwrap().map(Result::unwrap);
    all.filter(|message| message.channel.topic == topic).collect()
}

#[test]
fn every_topic_has_foxgloves_schema_and_the_file_is_indexed() {
    let folder = tempfile::tempdir().unwrap();
    record_everything(&recording(&folder));
    let bytes = std::fs::read(recording(&folder)).unwrap();
    let summary = mcap::Summary::read(&bytes).unwrap().unwrap();
    let stats = summary.stats.as_ref().unwrap();
    let mut topics: Vec<_> = summary
        .channels
        .values()
        .map(|channel| {
            let schema = channel.schema.as_ref().unwrap();
            let count = stats.channel_message_counts[&channel.id];
            (channel.topic.as_str(), schema.name.as_str(), schema.encoding.as_str(), count)
        })
        .collect();
    topics.sort_unstable();
    let expected = [
        ("/command", "surefoot.command", "jsonschema", 50),
        ("/controller", "surefoot.controller", "jsonschema", 50),
        ("/decision", "surefoot.decision", "jsonschema", 51),
        ("/drive_log", "drivelogrow.DriveLogRow", "protobuf", 50),
        ("/elevation", "foxglove.Grid", "protobuf", 1),
        ("/goal", "foxglove.PoseInFrame", "protobuf", 1),
        ("/path", "foxglove.PosesInFrame", "protobuf", 50),
        ("/pose", "foxglove.PoseInFrame", "protobuf", 50),
        ("/risk", "foxglove.Grid", "protobuf", 1),
        ("/rollouts", "foxglove.SceneUpdate", "protobuf", 1),
        ("/scan", "foxglove.PointCloud", "protobuf", 1),
        ("/tf", "foxglove.FrameTransform", "protobuf", 50),
    ];
    assert_eq!(topics, expected);
    assert_eq!((stats.message_start_time, stats.message_end_time), (0, ns(50)));
    assert!(summary.chunk_indexes.len() >= 5, "a chunk per second of the drive");
    let metadata = mcap::read::metadata(&bytes, &summary.metadata_indexes[0]).unwrap();
    assert_eq!((metadata.name.as_str(), metadata.metadata), ("surefoot", about()));
}

#[test]
fn messages_hold_what_was_recorded() {
    let folder = tempfile::tempdir().unwrap();
    record_everything(&recording(&folder));
    let bytes = std::fs::read(recording(&folder)).unwrap();
    let data = |topic| messages(&bytes, topic)[0].data.to_vec();

    let transform = FrameTransform::decode(&data("/tf")[..]).unwrap();
    let rotation = transform.rotation.unwrap();
    // A quarter turn to the left: w = z = sqrt(1/2).
    assert!((rotation.w - 0.5_f64.sqrt()).abs() < 1e-12 && (rotation.z - 0.5_f64.sqrt()).abs() < 1e-12);
    assert_eq!(transform.translation.map(|t| [t.x, t.y, t.z]), Some([1.0, 2.0, 3.0]));

    // Row 2, column 5 of nine columns of 14 bytes; the corner lies at (-1.5, 2).
    let grid = Grid::decode(&data("/elevation")[..]).unwrap();
    let corner = grid.pose.unwrap().position.unwrap();
    assert_eq!([corner.x, corner.y], [-1.5, 2.0]);
    assert_eq!([grid.column_count, grid.cell_stride, grid.row_stride], [9, 14, 126]);
    let cell = &grid.data[2 * 126 + 5 * 14..][..14];
    assert_eq!(cell[..4], 1.25_f32.to_le_bytes());
    assert_eq!(cell[8..], [0.4_f32.to_le_bytes().as_slice(), &[TerrainClass::Vegetation as u8, 2]].concat());
    assert!(f32::from_le_bytes(grid.data[..4].try_into().unwrap()).is_nan(), "holes stay holes");
    let offsets: Vec<_> = grid.fields.iter().map(|field| (field.name.as_str(), field.offset)).collect();
    assert_eq!(offsets[2..], [("vegetation_height_m", 8), ("class", 12), ("knowledge", 13)]);

    let grid = Grid::decode(&data("/risk")[..]).unwrap();
    assert_eq!([grid.cell_stride, grid.row_stride], [18, 162]);
    assert_eq!(grid.data[2 * 162 + 5 * 18..][..4], 0.25_f32.to_le_bytes());
    assert_eq!(grid.data.len(), 54 * 18);

    let cloud = PointCloud::decode(&data("/scan")[..]).unwrap();
    assert_eq!((cloud.point_stride, cloud.data.len()), (13, 39));
    assert_eq!(cloud.data[17..21], (-2.0_f32).to_le_bytes());
    assert_eq!(cloud.data[38], TerrainClass::Obstacle as u8);

    let scene = SceneUpdate::decode(&data("/rollouts")[..]).unwrap();
    assert_eq!(scene.entities[0].lines.iter().map(|line| line.points.len()).collect::<Vec<_>>(), [2, 1]);
}

#[test]
fn json_topics_describe_themselves() {
    let folder = tempfile::tempdir().unwrap();
    record_everything(&recording(&folder));
    let bytes = std::fs::read(recording(&folder)).unwrap();
    let value = |topic, index: usize| -> serde_json::Value {
        serde_json::from_slice(&messages(&bytes, topic)[index].data).unwrap()
    };
    assert_eq!(value("/command", 49), serde_json::json!({ "speed_mps": 1.0, "steering_rad": -0.25 }));
    assert_eq!(value("/decision", 0), serde_json::json!({ "decision": "stop", "reason": "stale_scan" }));
    assert_eq!(value("/decision", 50), serde_json::json!({ "decision": "hold", "reason": "at_goal" }));
    assert_eq!(value("/controller", 3)["terms"]["goal"], serde_json::Value::Null);
    let schema = messages(&bytes, "/controller")[0].channel.schema.clone().unwrap();
    let schema: serde_json::Value = serde_json::from_slice(&schema.data).unwrap();
    assert_eq!(schema["properties"]["free_energy"]["type"], "number");
    assert_eq!(schema["properties"]["terms"]["type"], "object");
}

/// Equal bit by bit, missing values included.
fn assert_same(found: &DriveLog, expected: &DriveLog) {
    let bits = |log: &DriveLog| -> Vec<(String, u64, Vec<u64>)> {
        let rows = log.runs().flat_map(|run| run.drive_rows().map(move |row| (run.name().to_owned(), row)));
        let values = |row: &DriveRow| Column::ALL.map(|column| row.value(column).to_bits()).to_vec();
        rows.map(|(run, row)| (run, row.time_s.to_bits(), values(&row))).collect()
    };
    assert_eq!(bits(found), bits(expected));
}

fn log_of(rows: std::ops::Range<u32>) -> DriveLog {
    let mut log = DriveLog::default();
    rows.for_each(|step| log.push(if step < 30 { "first" } else { "2" }, &row(step)).unwrap());
    log
}

fn record_rows(path: &Path, rows: std::ops::Range<u32>) -> DriveRecorder {
    let mut recorder = DriveRecorder::create(path, about()).unwrap();
    for step in rows {
        recorder.drive_row(ns(step), if step < 30 { "first" } else { "2" }, &row(step)).unwrap();
    }
    recorder
}

#[test]
fn the_drive_log_comes_back_bit_by_bit() {
    let folder = tempfile::tempdir().unwrap();
    record_rows(&recording(&folder), 0..60).finish().unwrap();
    let read = read_drive_log_mcap(&recording(&folder)).unwrap();
    assert_eq!(read.ended_early, None);
    assert_same(&read.log, &log_of(0..60));
}

#[test]
fn a_dropped_recorder_leaves_a_complete_file() {
    let folder = tempfile::tempdir().unwrap();
    drop(record_rows(&recording(&folder), 0..25));
    let read = read_drive_log_mcap(&recording(&folder)).unwrap();
    assert_eq!(read.ended_early, None);
    assert_same(&read.log, &log_of(0..25));
    assert!(mcap::Summary::read(&std::fs::read(recording(&folder)).unwrap()).unwrap().is_some());
}

#[test]
fn a_killed_recorder_loses_at_most_the_last_second() {
    let folder = tempfile::tempdir().unwrap();
    // Rows at 0.0, 0.1, ... 2.5 s: the flush at 2.0 s took rows 0 to 20 along.
    std::mem::forget(record_rows(&recording(&folder), 0..26));
    let read = read_drive_log_mcap(&recording(&folder)).unwrap();
    assert!(read.ended_early.unwrap().starts_with("after 21 rows: "));
    assert_same(&read.log, &log_of(0..21));
}

#[test]
fn a_truncated_recording_gives_a_beginning_of_the_log_and_says_so() {
    let folder = tempfile::tempdir().unwrap();
    record_rows(&recording(&folder), 0..60).finish().unwrap();
    let whole = std::fs::read(recording(&folder)).unwrap();
    let mut n_before = 0;
    for length in (0..whole.len()).step_by(31) {
        std::fs::write(recording(&folder), &whole[..length]).unwrap();
        let n_rows = match read_drive_log_mcap(&recording(&folder)) {
            Ok(read) => {
                assert!(read.ended_early.is_some(), "{length} of {} bytes", whole.len());
                assert_same(&read.log, &log_of(0..read.log.n_rows() as u32));
                read.log.n_rows()
            }
            Err(error) => {
                assert!(
                    error.to_string().contains("expected messages on topic /drive_log, found "),
                    "{error}"
                );
                0
            }
        };
        assert!(n_rows >= n_before, "more bytes, fewer rows");
        n_before = n_rows;
    }
    assert_eq!(n_before, 60);
}

#[test]
fn damaged_bits_never_panic_nor_invent_rows() {
    let folder = tempfile::tempdir().unwrap();
    record_rows(&recording(&folder), 0..12).finish().unwrap();
    let whole = std::fs::read(recording(&folder)).unwrap();
    let expected = log_of(0..12);
    for place in (0..whole.len()).step_by(11) {
        let mut damaged = whole.clone();
        damaged[place] ^= 1 << (place % 8);
        std::fs::write(recording(&folder), &damaged).unwrap();
        if let Ok(read) = read_drive_log_mcap(&recording(&folder)) {
            assert!(read.log.n_rows() <= expected.n_rows(), "byte {place}");
            assert_same(&read.log, &log_of(0..read.log.n_rows() as u32));
        }
    }
}

#[test]
fn what_is_no_recording_is_refused_in_one_line() {
    let folder = tempfile::tempdir().unwrap();
    let refuse = |bytes: &[u8]| {
        std::fs::write(recording(&folder), bytes).unwrap();
        let message = read_drive_log_mcap(&recording(&folder)).unwrap_err().to_string();
        assert_eq!(message.lines().count(), 1, "{message}");
        message
    };
    refuse(b"");
    refuse(b"t,x,y\n0,1,2\n");
    // A chunk that claims 2^62 bytes.
    let huge = [b"\x89MCAP0\r\n\x06".as_slice(), &(1_u64 << 62).to_le_bytes(), &[0; 64]].concat();
    refuse(&huge);
    let absent = read_drive_log_mcap(&folder.path().join("absent.mcap")).unwrap_err().to_string();
    assert!(absent.contains("absent.mcap: expected a readable file, found: "), "{absent}");
    let mut recorder = DriveRecorder::create(&recording(&folder), about()).unwrap();
    recorder.pose(0, &Pose::default()).unwrap();
    recorder.finish().unwrap();
    let message = read_drive_log_mcap(&recording(&folder)).unwrap_err().to_string();
    assert!(
        message.ends_with("expected messages on topic /drive_log, found only topics: /pose, /tf"),
        "{message}"
    );
}

#[test]
fn an_unwritable_place_is_said_before_the_drive() {
    let folder = tempfile::tempdir().unwrap();
    let message = DriveRecorder::create(folder.path(), about()).err().unwrap().to_string();
    assert!(message.contains("expected a place to record to, found: "), "{message}");
}
