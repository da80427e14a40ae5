//! Recordings as bags of ROS 2.

#![allow(clippy::unwrap_used, reason = "a panic is how a test fails")]

use std::collections::BTreeMap;
use std::path::Path;

use assert_cmd::Command;
use bicycle::{Column, Command as Told, Decision, DriveRow, HoldReason, Model};
use bus::ages::Periods;
use bus::message::{
    CommandRecord, ImuRecord, LAYOUT_VERSION, OdometryRecord, PointRecord, ScanHeader, Stamp,
};
use formats::{Bag, DriveRecorder, RecordedMessage};
use navigator::Config;
use ros::bag::read;
use ros::message::{AckermannDriveStamped, Imu, Named, OccupancyGrid, Odometry, Path as Way, PointCloud2};
use ros::message::{TfMessage, Vector3};
use runtime::ages::{self, AskedAges};
use runtime::recorder::topic;
use runtime::setup::{ClockAnchor, MachineSetup, RecordedSetup};
use serde::de::DeserializeOwned;
use terrain::{Cell, GridGeometry, Mount, Pose, RangePoint, Scan, TerrainClass};
use traversability::{GroundFlags, Risk, RiskMap};

const SECOND_NS: u64 = 1_000_000_000;
const GEOMETRY: GridGeometry = GridGeometry { resolution_m: 0.5, origin: [-3, 4], n_rows: 3, n_cols: 5 };

fn convert(folder: &Path, words: &[&str]) -> (i32, String) {
    let mut command = Command::cargo_bin("surefoot").unwrap();
    let output = command.current_dir(folder).arg("convert").args(words).output().unwrap();
    (output.status.code().unwrap(), String::from_utf8(output.stderr).unwrap())
}

/// The messages of a topic with their times [ns].
fn said<M: Named + DeserializeOwned>(bag: &Path, topic: &str) -> Vec<(u64, M)> {
    let mut found = Vec::new();
    let ended_early = Bag::open(bag).unwrap().take_all(|message: RecordedMessage| {
        if message.channel.topic == topic {
            found.push((message.log_time_ns, read(&message).map_err(|error| error.to_string())?));
        }
        Ok(())
    });
    assert_eq!(ended_early, None);
    found
}

/// A risk map with an obstacle, a cell that nobody saw and one that leans by six tenths of what a vehicle may.
fn record_risk(recorder: &mut DriveRecorder, at_ns: u64, roll_max_rad: f64) {
    let mut map = RiskMap::constant(GEOMETRY, 4, Risk::NONE);
    map.fill(|risks, ground| {
        let [first, second, third] = [1, 2, 3].map(|col| GEOMETRY.index(Cell { row: 1, col }));
        ground[first].flags = GroundFlags::OBSTACLE;
        ground[second].flags = GroundFlags::UNKNOWN;
        // Of the heading that the vehicle has, and, more, of another one.
        risks[4 * third].roll_rad = 0.6 * roll_max_rad as f32;
        risks[4 * third + 2].roll_rad = roll_max_rad as f32;
    });
    recorder.risk(at_ns, &map.view(), 0.1).unwrap();
}

#[test]
fn a_simulated_drive_becomes_a_bag_of_the_same_numbers() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    let mut recorder = DriveRecorder::create(&here.join("drive.mcap"), BTreeMap::new()).unwrap();
    let at_ns = 3 * SECOND_NS + 7;
    let values = [
        (Column::X, 1.25),
        (Column::Y, -3.5),
        (Column::Z, 0.75),
        (Column::Yaw, 0.6),
        (Column::Vx, 1.5),
        (Column::Vy, -0.25),
        (Column::Wz, 0.4),
    ];
    let row = values.iter().fold(DriveRow::new(3.0), |row, (column, value)| row.with(*column, *value));
    recorder.drive_row(at_ns, "1", &row).unwrap();
    recorder.drive_row(at_ns, "1", &DriveRow::new(3.0)).unwrap();
    let told = Told { speed_mps: 0.1, steering_rad: -0.3 };
    recorder.command(at_ns, &told).unwrap();
    let points = vec![RangePoint { position_m: [1.0, -2.0, 0.1], class: TerrainClass::Obstacle }; 2];
    recorder.scan(at_ns, &Scan { points, ..Scan::default() }).unwrap();
    recorder.rollouts(at_ns, &[vec![[0.0, 0.0, 9.0], [1.0, 1.0, 9.0]], vec![[7.0; 3]]]).unwrap();
    let vehicle = formats::read_vehicle("rc_car").unwrap();
    record_risk(&mut recorder, at_ns, vehicle.limits.roll_max_rad);
    recorder.finish().unwrap();

    let bag = here.join("bag");
    let words = ["drive.mcap", "--ros2", "bag", "--vehicle", "rc_car", "--json", "converted.json"];
    let (code, stderr) = convert(here, &words);
    assert_eq!(code, 0, "{stderr}");
    assert_eq!(
        stderr,
        "surefoot: 1 messages left out: rows of the drive log without a pose and a velocity\n"
    );
    let [(heard_ns, odometry)] = &said::<Odometry>(&bag, "/odom")[..] else { panic!("one row") };
    assert_eq!((*heard_ns, odometry.header.stamp.nanoseconds()), (at_ns, at_ns as i64));
    assert_eq!((odometry.header.frame_id.as_str(), odometry.child_frame_id.as_str()), ("map", "base_link"));
    let place = odometry.pose.pose.position;
    assert_eq!([place.x, place.y, place.z], [1.25, -3.5, 0.75]);
    let turn = odometry.pose.pose.orientation;
    assert!((2.0 * turn.z.atan2(turn.w) - 0.6).abs() < 1e-12);
    let twist = odometry.twist.twist;
    assert_eq!(twist.linear, Vector3 { x: 1.5, y: -0.25, z: 0.0 });
    assert_eq!(twist.angular, Vector3 { x: 0.0, y: 0.0, z: 0.4 });
    let transform = said::<TfMessage>(&bag, "/tf")[0].1.transforms[0].clone();
    assert_eq!((transform.header, transform.child_frame_id.as_str()), (odometry.header.clone(), "base_link"));
    assert_eq!(transform.transform.translation, Vector3 { x: 1.25, y: -3.5, z: 0.75 });
    let drive = said::<AckermannDriveStamped>(&bag, "/command")[0].1.drive;
    assert_eq!((drive.speed, drive.steering_angle), (told.speed_mps, told.steering_rad));
    let cloud = &said::<PointCloud2>(&bag, "/points")[0].1;
    assert_eq!((cloud.width, cloud.point_step, cloud.data.len()), (2, 16, 32));
    let first: Vec<u8> = [1.0_f32, -2.0, 0.1].into_iter().flat_map(f32::to_le_bytes).collect();
    assert_eq!((&cloud.data[..12], cloud.data[12]), (&first[..], 3));
    let way = &said::<Way>(&bag, "/plan")[0].1;
    let turns = way.poses.iter().map(|pose| 2.0 * pose.pose.orientation.z.asin());
    assert!(turns.into_iter().all(|yaw_rad| (yaw_rad - std::f64::consts::FRAC_PI_4).abs() < 1e-12));
    assert_eq!(way.poses.len(), 2);
    let grid = &said::<OccupancyGrid>(&bag, "/risk")[0].1;
    // Nothing is expected to move at the border of a map.
    assert_eq!(grid.data, [[99; 5], [99, 100, -1, 59, 99], [99; 5]].concat());
    assert_eq!((grid.info.width, grid.info.height, grid.info.resolution), (5, 3, 0.5));
}

fn setup(mount: Mount) -> RecordedSetup {
    let vehicle = formats::read_vehicle("rc_car").unwrap();
    let model = Model::of(&vehicle);
    let config = Config { sensors: vec![mount], ..Config::for_vehicle(&vehicle) };
    let guard = config.guard;
    let machine = MachineSetup { vehicle, model, config };
    let [vehicle_toml, model_toml, config_toml] = machine.texts().unwrap();
    // The machine had run for 5 s when the day was 1700000000 s old.
    let clock =
        ClockAnchor { monotonic_ns: "5000000000".to_owned(), utc_ns: "1700000000000000000".to_owned() };
    RecordedSetup {
        format: RecordedSetup::FORMAT,
        clock,
        vehicle_name: "rc_car".to_owned(),
        vehicle_toml,
        model_toml,
        config_toml,
        method: "physics".to_owned(),
        checkpoint_sha256: String::new(),
        corrector_sha256: String::new(),
        alpha: 0.6,
        seed: "1".to_owned(),
        ages: ages::limits(&Periods::default(), &guard, &AskedAges::default()).unwrap(),
        revision: String::new(),
    }
}

fn channel(recorder: &mut DriveRecorder, topic: &'static str, header: &[u8], elements: &[u8]) {
    recorder.raw(topic, String::new, 6 * SECOND_NS, &[header, elements].concat()).unwrap();
}

#[test]
fn a_run_of_processes_becomes_a_bag_by_the_time_of_day() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    let mut recorder = DriveRecorder::create(&here.join("drive-000.mcap"), BTreeMap::new()).unwrap();
    let mount = Mount {
        position_m: [0.5, 0.0, 1.0],
        attitude_rad: [0.0, 0.0, std::f64::consts::FRAC_PI_2],
        ..Mount::default()
    };
    recorder.setup(0, &setup(mount)).unwrap();
    let stamp = Stamp { layout_version: LAYOUT_VERSION, valid_at_ns: 6 * SECOND_NS, ..Stamp::default() };
    let head = bytemuck::bytes_of(&stamp).to_vec();
    let odometry = OdometryRecord {
        position_m: [4.0, 5.0, 6.0],
        attitude_rad: [0.0, 0.0, 0.5],
        velocity_mps: [1.0, 0.125],
        yaw_rate_radps: 0.25,
        steering_rad: 0.2,
        ..OdometryRecord::default()
    };
    channel(&mut recorder, topic::ODOMETRY, &head, bytemuck::bytes_of(&odometry));
    // What a person looks at beside it is the same again.
    recorder.drive_row(6 * SECOND_NS, "1", &DriveRow::new(0.0)).unwrap();
    recorder.pose(6 * SECOND_NS, &Pose::default()).unwrap();
    let sample = |k: u64| ImuRecord {
        valid_at_ns: 6 * SECOND_NS + k * 5_000_000,
        acceleration_mps2: [k as f32, 0.0, 9.81],
        angular_rate_radps: [0.0, 0.0, 0.25],
    };
    channel(&mut recorder, topic::IMU, &head, bytemuck::cast_slice(&[sample(0), sample(1)]));
    let header = ScanHeader { stamp, sensor: 1, ..ScanHeader::default() };
    let point = PointRecord { position_m: [2.0, 0.0, -1.0], class_number: 1 };
    channel(&mut recorder, topic::SCAN, bytemuck::bytes_of(&header), bytemuck::bytes_of(&point));
    let drive = Decision::Drive(Told { speed_mps: 0.75, steering_rad: 0.1 });
    let decided = [CommandRecord::from(&drive), CommandRecord::from(&Decision::Hold(HoldReason::AtGoal))];
    for record in &decided {
        channel(&mut recorder, topic::COMMAND, &head, bytemuck::bytes_of(record));
    }
    recorder.finish().unwrap();

    let bag = here.join("bag");
    let (code, stderr) = convert(here, &["drive-000.mcap", "--ros2", "bag"]);
    assert_eq!((code, stderr.as_str()), (0, ""));
    let of_day_ns = 1_700_000_001_000_000_000;
    let [(heard_ns, odometry)] = &said::<Odometry>(&bag, "/odom")[..] else { panic!("one message") };
    assert_eq!((*heard_ns, odometry.header.stamp.nanoseconds()), (of_day_ns, of_day_ns as i64));
    let [place, twist] = [odometry.pose.pose.position.x, odometry.twist.twist.linear.y];
    assert_eq!([place, twist, odometry.twist.twist.angular.z], [4.0, 0.125, 0.25]);
    let felt = said::<Imu>(&bag, "/imu");
    assert_eq!(felt.iter().map(|(at_ns, _)| at_ns - of_day_ns).collect::<Vec<_>>(), [0, 5_000_000]);
    assert_eq!(felt[1].1.linear_acceleration, Vector3 { x: 1.0, y: 0.0, z: f64::from(9.81_f32) });
    // Two metres ahead of a sensor that looks to the left, and a metre below it.
    let cloud = &said::<PointCloud2>(&bag, "/points")[0].1;
    let place_m = [0, 4, 8].map(|at| f32::from_le_bytes(cloud.data[at..at + 4].try_into().unwrap()));
    assert!(place_m.iter().zip([0.5, 2.0, 0.0]).all(|(a, b)| (a - b).abs() < 1e-6), "{place_m:?}");
    let commands = said::<AckermannDriveStamped>(&bag, "/command");
    let commands: Vec<_> =
        commands.iter().map(|(_, told)| [told.drive.speed, told.drive.steering_angle]).collect();
    assert_eq!(commands, [[0.75, 0.1], [0.0, 0.2]]);
}

#[test]
fn what_cannot_be_converted_is_told_and_leaves_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    std::fs::write(here.join("noise.mcap"), [7; 100]).unwrap();
    let (code, told) = convert(here, &["noise.mcap", "--ros2", "bag"]);
    assert!(code == 2 && told.contains("noise.mcap: expected a recording in MCAP, found: "), "{told}");
    let mut recorder = DriveRecorder::create(&here.join("goals.mcap"), BTreeMap::new()).unwrap();
    recorder.goal(0, &Pose::default()).unwrap();
    recorder.finish().unwrap();
    let (code, told) = convert(here, &["goals.mcap", "--ros2", "bag"]);
    assert!(code == 2 && told.contains("goals.mcap: expected a recording with odometry, scans"), "{told}");
    let mut recorder = DriveRecorder::create(&here.join("old.mcap"), BTreeMap::new()).unwrap();
    let old = Stamp { layout_version: LAYOUT_VERSION - 1, ..Stamp::default() };
    channel(&mut recorder, topic::ODOMETRY, bytemuck::bytes_of(&old), &[]);
    recorder.finish().unwrap();
    let (code, told) = convert(here, &["old.mcap", "--ros2", "bag"]);
    let expected = format!("a message of layout {LAYOUT_VERSION}, found {}", LAYOUT_VERSION - 1);
    assert!(code == 2 && told.contains(&expected) && told.starts_with("surefoot: old.mcap: "), "{told}");
    std::fs::create_dir(here.join("taken")).unwrap();
    let (code, told) = convert(here, &["goals.mcap", "--ros2", "taken"]);
    assert!(code == 2 && told.contains("--ros2: taken: expected a name that is free"), "{told}");
    let names = here.read_dir().unwrap().map(|entry| entry.unwrap().file_name().into_string().unwrap());
    let mut names: Vec<_> = names.collect();
    names.sort();
    assert_eq!(names, ["goals.mcap", "noise.mcap", "old.mcap", "taken"]);
}
