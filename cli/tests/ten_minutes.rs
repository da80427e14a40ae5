//! docs/ten_minutes.md, followed by the letter.

#![allow(clippy::unwrap_used, reason = "a panic is how a test fails")]

mod field;

use std::path::Path;
use std::process::{Command, Output};

use ros::bag::MessageWriter;
use ros::message::{Imu, TfMessage, Transform, TransformStamped, Vector3};
use ros::{rigid, telling};
use terrain::Pose;

use field::{BEGAN_NS, header};

const PAGE: &str = include_str!("../../docs/ten_minutes.md");
const URDF: &str = include_str!("../../examples/ros/car.urdf");
/// Where links of the car lie in its base.
const REAR_AXLE: Pose =
    Pose { x_m: -0.25, y_m: 0.0, z_m: -0.02, roll_rad: 0.0, pitch_rad: 0.0, yaw_rad: 0.0 };
const LIDAR: Pose =
    Pose { x_m: 0.15, y_m: 0.0, z_m: 0.48, roll_rad: std::f64::consts::PI, pitch_rad: 0.0, yaw_rad: 0.0 };

/// The commands of the page that are this program's.
fn commands() -> Vec<Vec<&'static str>> {
    let blocks = PAGE.split("```bash\n").skip(1).filter_map(|rest| rest.split("```").next());
    let lines = blocks.flat_map(str::lines).filter(|line| line.starts_with("surefoot "));
    lines
        .map(|line| line.split('#').next().unwrap_or_default().split_whitespace().skip(1).collect())
        .collect()
}

fn fixed(child: &str, place: &Pose) -> TransformStamped {
    let isometry = place.isometry();
    let [x, y, z] = isometry.translation.vector.into();
    let rotation = rigid::quaternion_of(&isometry.rotation);
    let transform = Transform { translation: Vector3 { x, y, z }, rotation };
    TransformStamped { header: header(0, "base_link"), child_frame_id: child.to_owned(), transform }
}

/// Ten seconds at half a metre a second, straight on, as the car of the description records them.
fn record(folder: &Path) {
    let mut bag = MessageWriter::create(folder).unwrap();
    let frames = TfMessage { transforms: vec![fixed("rear_axle", &REAR_AXLE), fixed("lidar", &LIDAR)] };
    bag.write("/tf_static", BEGAN_NS, &frames).unwrap();
    let in_axle = Pose { x_m: LIDAR.x_m - REAR_AXLE.x_m, z_m: LIDAR.z_m - REAR_AXLE.z_m, ..LIDAR };
    for step in 0..500_u64 {
        let at_ns = step * 20_000_000;
        let heard_ns = BEGAN_NS + at_ns + 2_000_000;
        let axle = Pose { x_m: 0.01 * step as f64, ..Pose::default() };
        let base = Pose { x_m: axle.x_m - REAR_AXLE.x_m, z_m: -REAR_AXLE.z_m, ..axle };
        let odometry = telling::odometry(header(at_ns, "odom"), "base_link", &base, [0.5, 0.0], 0.0);
        bag.write("/ekf/odom", heard_ns, &odometry).unwrap();
        let linear_acceleration = Vector3 { x: 0.0, y: 0.0, z: 9.81 };
        let felt = Imu { header: header(at_ns, "base_link"), linear_acceleration, ..Imu::default() };
        bag.write("/imu/data", heard_ns, &felt).unwrap();
        if step % 10 == 5 {
            bag.write("/lidar/points", heard_ns, &field::cloud(at_ns, &axle, &in_axle, 0.1)).unwrap();
        }
    }
    bag.finish().unwrap();
}

fn run(folder: &Path, words: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_surefoot")).current_dir(folder).args(words).output().unwrap()
}

fn followed(folder: &Path, words: &[&str]) -> String {
    let output = run(folder, words);
    let [shown, told] =
        [&output.stdout, &output.stderr].map(|text| String::from_utf8_lossy(text).into_owned());
    assert!(output.status.success(), "{words:?}: {told}{shown}");
    shown
}

#[test]
fn the_page_is_followed_from_a_description_and_a_bag_to_what_would_be_decided() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    std::fs::write(here.join("car.urdf"), URDF).unwrap();
    record(&here.join("field_1"));
    let commands = commands();
    let names: Vec<&str> = commands.iter().map(|words| words[0]).collect();
    assert_eq!(names, ["robot", "doctor", "play", "doctor", "up"]);
    for words in &commands {
        match words[..] {
            // The robot itself is not there, and nothing speaks on the network here: a robot that is, `ros/test` drives.
            ["up", ..] => assert_eq!(words[1..], ["--robot", "robot.toml"]),
            ["doctor", "--robot", file] => {
                // What this machine is fit for is not the page's.
                let output = run(here, &["doctor", "--robot", file, "--recordings", "."]);
                assert!(String::from_utf8_lossy(&output.stdout).starts_with("this machine:"));
            }
            _ => drop(followed(here, words)),
        }
    }
    let robot = std::fs::read_to_string(here.join("robot.toml")).unwrap();
    let vehicle = std::fs::read_to_string(here.join("robot_vehicle.toml")).unwrap();
    for line in PAGE.split("```toml\n").nth(1).unwrap().split("```").next().unwrap().lines() {
        assert!(
            robot.lines().chain(vehicle.lines()).any(|found| found == line),
            "{line}\n{robot}\n{vehicle}"
        );
    }
    let played: serde_json::Value =
        serde_json::from_slice(&std::fs::read(here.join("played/play.json")).unwrap()).unwrap();
    assert_eq!(played["left_out"], serde_json::json!({}));
    assert!(played["decided"]["drive"].as_u64().unwrap() > 50, "{}", played["decided"]);
}

#[test]
fn what_neither_tells_is_asked_for() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    // A car without a frame at its rear axle, and a bag with odometry alone, of two topics.
    std::fs::write(
        here.join("car.urdf"),
        URDF.replace(
            "-0.25 0 -0.02\"/><parent link=\"base_link\"/><child link=\"rear_axle\"",
            "0 0 0\"/><parent link=\"base_link\"/><child link=\"rear_axle\"",
        ),
    )
    .unwrap();
    let mut bag = MessageWriter::create(&here.join("bag")).unwrap();
    for (topic, k) in [("/odom", 0), ("/gps", 1), ("/odom", 2), ("/gps", 3)] {
        let odometry =
            telling::odometry(header(k * 100_000_000, "odom"), "base_link", &Pose::default(), [0.0; 2], 0.0);
        bag.write(topic, BEGAN_NS + k * 100_000_000, &odometry).unwrap();
    }
    bag.finish().unwrap();
    let words = ["robot", "--urdf", "car.urdf", "--bag", "bag", "--out", "mine.toml"];
    let shown = followed(here, &words);
    for line in [
        "ros.topics.points: expected topics of sensor_msgs/msg/PointCloud2, found none in the bag",
        "ros.topics.odometry: expected one topic of nav_msgs/msg/Odometry, found /gps, /odom",
        "ros.topics.command: expected a topic of ackermann_msgs/msg/AckermannDriveStamped, found none in the bag",
        "rates.scan_hz: expected 0.5 to 50 a second of sensor_msgs/msg/PointCloud2, all topics together, found none",
        "ros.vehicle_frame: expected a frame on /tf_static at the centre of the rear axle, forward, left, up, found the \
         odometry's \"base_link\", 0.250 m ahead, 0.000 m left and 0.020 m above it",
        "limits.roll_max_rad: expected the greatest roll that it may stand at, found ",
    ] {
        assert!(shown.contains(line), "{line}\n{shown}");
    }
    let robot = std::fs::read_to_string(here.join("mine.toml")).unwrap();
    assert!(
        robot
            .contains("# odometry = \"\"  # expected: one topic of nav_msgs/msg/Odometry; found /gps, /odom"),
        "{robot}"
    );
    assert!(robot.contains("map_frame = \"odom\"  # bag: frame of the odometry"), "{robot}");
    // What somebody has gone through is not written over.
    let again = run(here, &words);
    let told = String::from_utf8_lossy(&again.stderr).into_owned();
    assert_eq!(again.status.code(), Some(2));
    assert!(told.contains("--out: mine.toml: expected a name that is free"), "{told}");
}
