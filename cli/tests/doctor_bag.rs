//! `surefoot doctor` on bags of ROS 2.

#![allow(clippy::unwrap_used, reason = "a panic is how a test fails")]

mod field;

use std::path::Path;

use assert_cmd::Command;
use ros::bag::MessageWriter;
use ros::message::{Imu, Vector3};
use ros::telling;
use terrain::Pose;

use field::{BEGAN_NS, header};

/// Height of the rear axle of the car [m].
const AXLE_M: f64 = 0.075;

const ROBOT: &str = "\
format = 1
vehicle = 'rc_car'
ground = { method = 'physics' }
rates = { odometry_hz = 50.0, scan_hz = 5.0 }
sensors = [{ name = 'lidar', mount = { position_m = [0.05, 0.0, 0.35], attitude_rad = [0.0, 0.0, 0.0] } }]
[ros]
";

/// Ten seconds at half a metre a second, straight on, with a lidar that is turned to the left by an angle.
fn write(folder: &Path, turned_rad: f64, stamps_behind_ns: u64) {
    let mut bag = MessageWriter::create(folder).unwrap();
    let mount = Pose { x_m: 0.05, z_m: 0.35, yaw_rad: turned_rad, ..Pose::default() };
    for step in 0..500_u64 {
        let at_ns = step * 20_000_000;
        let heard_ns = BEGAN_NS + at_ns + stamps_behind_ns + 2_000_000;
        let vehicle = Pose { x_m: 0.01 * step as f64, ..Pose::default() };
        let odometry = telling::odometry(header(at_ns, "map"), "base_link", &vehicle, [0.5, 0.0], 0.0);
        bag.write("/odom", heard_ns, &odometry).unwrap();
        let linear_acceleration = Vector3 { x: 0.0, y: 0.0, z: 9.81 };
        let felt = Imu { header: header(at_ns, "base_link"), linear_acceleration, ..Imu::default() };
        bag.write("/imu", heard_ns, &felt).unwrap();
        if step % 10 == 5 {
            let cloud = field::cloud(at_ns, &vehicle, &mount, AXLE_M);
            bag.write("/points", heard_ns, &cloud).unwrap();
        }
    }
    bag.finish().unwrap();
}

fn doctor(folder: &Path, words: &[&str]) -> (i32, String, String) {
    let mut command = Command::cargo_bin("surefoot").unwrap();
    let output = command.current_dir(folder).arg("doctor").args(words).output().unwrap();
    let text = |bytes: Vec<u8>| String::from_utf8(bytes).unwrap();
    (output.status.code().unwrap(), text(output.stdout), text(output.stderr))
}

/// The line of a check, from its verdict on.
fn line<'a>(shown: &'a str, what: &str) -> &'a str {
    let line = shown.lines().find(|line| line.contains(what));
    line.unwrap_or_else(|| panic!("{what} is missing in {shown}")).trim()
}

#[test]
fn a_bag_of_a_robot_as_its_file_says_is_fine() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("robot.toml"), ROBOT).unwrap();
    write(&folder.path().join("bag"), 0.0, 0);
    let words = ["bag", "--robot", "robot.toml", "--json", "found.json"];
    let (code, shown, told) = doctor(folder.path(), &words);
    assert_eq!(code, 0, "{shown}{told}");
    for what in
        ["odometry ", "velocity ", "sensor 1: points", "sensor 1: mount", "sensor 1: yaw", "imu: gravity"]
    {
        assert!(line(&shown, what).starts_with("fine"), "{shown}");
    }
    assert!(line(&shown, "odometry ").contains("50.0 Hz, expected 50.0 Hz"), "{shown}");
    assert!(!shown.contains("refused") && !shown.contains("processor"), "{shown}");
    let found = std::fs::read_to_string(folder.path().join("found.json")).unwrap();
    assert!(found.contains("\"what\": \"imu: gravity\""), "{found}");
}

#[test]
fn a_lidar_that_is_turned_by_five_degrees_is_found_in_a_bag() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("robot.toml"), ROBOT).unwrap();
    write(&folder.path().join("bag"), -5.0_f64.to_radians(), 0);
    let (code, shown, told) = doctor(folder.path(), &["bag", "--robot", "robot.toml"]);
    assert_eq!(code, 1, "{shown}");
    let yaw = line(&shown, "sensor 1: yaw");
    let words: Vec<&str> = yaw.split_whitespace().collect();
    let place = words.iter().position(|word| *word == "looks").unwrap();
    let degrees: f64 = words[place + 1].parse().unwrap();
    assert!(yaw.starts_with("WRONG") && (degrees - 5.0).abs() < 0.7 && yaw.contains("to the right"), "{yaw}");
    assert!(told.starts_with("surefoot: scans of sensor 1: yaw: looks "), "{told}");
    assert!(line(&shown, "sensor 1: mount").starts_with("fine"), "{shown}");
}

#[test]
fn stamps_that_lag_and_topics_that_are_not_there_are_told() {
    let folder = tempfile::tempdir().unwrap();
    let elsewhere = ROBOT.to_owned() + "topics = { points = ['lidar/points'] }\n";
    std::fs::write(folder.path().join("robot.toml"), elsewhere).unwrap();
    write(&folder.path().join("bag"), 0.0, 300_000_000);
    let (code, shown, _) = doctor(folder.path(), &["bag", "--robot", "robot.toml"]);
    assert_eq!(code, 1, "{shown}");
    assert!(
        line(&shown, "odometry ").contains("it comes late, or its stamps are of another clock"),
        "{shown}"
    );
    assert!(line(&shown, "scans of sensor 1 ").starts_with("WRONG"), "{shown}");
    // Two hours behind is another clock.
    write(&folder.path().join("old"), 0.0, 7_200_000_000_000);
    let (code, shown, _) = doctor(folder.path(), &["old", "--robot", "robot.toml"]);
    assert_eq!(code, 1);
    let refused = line(&shown, "odometry refused");
    assert!(
        refused.starts_with("WRONG") && refused.contains("500 of 500, the first on /odom for stamp: "),
        "{shown}"
    );
}

#[test]
fn a_bag_without_a_robot_or_without_ros_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("mute.toml"), "format = 1\nvehicle = 'rc_car'\n").unwrap();
    let (code, _, told) = doctor(folder.path(), &["bag"]);
    assert!(code == 2 && told.contains("--robot"), "{told}");
    let (code, _, told) = doctor(folder.path(), &["bag", "--robot", "mute.toml"]);
    assert!(
        code == 2 && told.contains("mute.toml: expected a robot file with a part [ros], found none"),
        "{told}"
    );
    std::fs::write(folder.path().join("robot.toml"), ROBOT).unwrap();
    let (code, _, told) = doctor(folder.path(), &["bag", "--robot", "robot.toml"]);
    assert!(code == 2 && told.contains("bag: expected a readable bag"), "{told}");
}
