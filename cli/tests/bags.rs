//! Bags of ROS 2 on the command line.

#![allow(clippy::unwrap_used, reason = "a panic is how a test fails")]

use std::collections::BTreeMap;
use std::fs::File;
use std::io::BufWriter;
use std::path::Path;

use assert_cmd::Command;
use byteorder::LittleEndian;
use mcap::records::MessageHeader;
use ros::bag::type_name;
use ros::message::{
    AckermannDrive, AckermannDriveStamped, Header, Named, Odometry, Point, PointCloud2, PointField, Pose,
    PoseWithCovariance, Time, Twist, TwistWithCovariance, Vector3,
};
use serde::Serialize;
use serde_json::Value;

const BEGAN_NS: u64 = 1_700_000_000_000_000_000;

const ROBOT: &str = "\
format = 1
vehicle = 'rc_car'
ground = { method = 'physics' }
rates = { odometry_hz = 50.0, scan_hz = 5.0 }
[ros]
map_frame = 'odom'
";

/// A bag being written.
struct Writer {
    file: mcap::Writer<BufWriter<File>>,
    channels: BTreeMap<&'static str, u16>,
}

impl Writer {
    fn create(path: &Path) -> Self {
        let options = mcap::WriteOptions::new().profile("ros2").chunk_size(Some(1 << 16)).compression(None);
        let file = options.create(BufWriter::new(File::create(path).unwrap())).unwrap();
        Self { file, channels: BTreeMap::new() }
    }

    fn say<M: Named + Serialize>(&mut self, topic: &'static str, at_ns: u64, message: &M) {
        let file = &mut self.file;
        let channel = *self.channels.entry(topic).or_insert_with(|| {
            let schema = file.add_schema(&type_name::<M>(), "ros2msg", b"").unwrap();
            file.add_channel(schema, topic, "cdr", &BTreeMap::new()).unwrap()
        });
        let content = cdr_encoding::to_vec::<M, LittleEndian>(message).unwrap();
        let data = [&[0, 1, 0, 0][..], &content].concat();
        let header = MessageHeader { channel_id: channel, sequence: 0, log_time: at_ns, publish_time: at_ns };
        self.file.write_to_known_channel(&header, &data).unwrap();
    }
}

fn header(at_ns: u64, frame: &str) -> Header {
    Header { stamp: Time::from_nanoseconds(at_ns as i64), frame_id: frame.to_owned() }
}

/// Level ground around the car, seen from a height of 0.3 m.
fn cloud(at_ns: u64) -> PointCloud2 {
    let side = || (-40..=40).map(|cell: i32| 0.1 * cell as f32);
    let points = side().flat_map(|x| side().map(move |y| [x, y, 0.0]));
    let data: Vec<u8> = points.flatten().flat_map(f32::to_le_bytes).collect();
    let field = |(name, offset): (&str, u32)| PointField { name: name.into(), offset, datatype: 7, count: 1 };
    PointCloud2 {
        header: header(at_ns, "base_link"),
        height: 1,
        width: data.len() as u32 / 12,
        fields: [("x", 0), ("y", 4), ("z", 8)].map(field).to_vec(),
        point_step: 12,
        row_step: data.len() as u32,
        data,
        ..PointCloud2::default()
    }
}

/// Three seconds straight east at 0.5 m/s: odometry 50 times a second, commands 10 times, clouds 5 times.
fn write_bag(path: &Path) {
    let mut bag = Writer::create(path);
    for step in 0..150_u64 {
        let at_ns = BEGAN_NS + step * 20_000_000;
        let position = Point { x: 0.5 * step as f64 * 0.02, ..Point::default() };
        let linear = Vector3 { x: 0.5, ..Vector3::default() };
        let odometry = Odometry {
            header: header(at_ns, "odom"),
            child_frame_id: "base_link".to_owned(),
            pose: PoseWithCovariance { pose: Pose { position, ..Pose::default() }, ..Default::default() },
            twist: TwistWithCovariance { twist: Twist { linear, ..Twist::default() }, ..Default::default() },
        };
        if step % 5 == 0 {
            let drive = AckermannDrive { speed: 0.5, ..AckermannDrive::default() };
            bag.say("/command", at_ns, &AckermannDriveStamped { header: header(at_ns, ""), drive });
        }
        bag.say("/odom", at_ns + 1_000_000, &odometry);
        if step % 10 == 0 {
            bag.say("/points", at_ns + 2_000_000, &cloud(at_ns));
        }
    }
    bag.file.finish().unwrap();
}

fn surefoot(folder: &Path, words: &[&str]) -> (i32, String, String) {
    let mut command = Command::cargo_bin("surefoot").unwrap();
    let output = command.current_dir(folder).args(words).output().unwrap();
    let text = |bytes: Vec<u8>| String::from_utf8(bytes).unwrap();
    (output.status.code().unwrap(), text(output.stdout), text(output.stderr))
}

fn json(folder: &Path, file: &str) -> Value {
    serde_json::from_slice(&std::fs::read(folder.join(file)).unwrap()).unwrap()
}

#[test]
fn a_bag_is_inspected_topic_by_topic() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    write_bag(&here.join("drive.mcap"));
    assert_eq!(surefoot(here, &["inspect", "drive.mcap", "--json", "found.json"]).0, 0);
    let found = json(here, "found.json");
    assert_eq!((&found["kind"], &found["complete"]), (&Value::from("bag"), &Value::from(true)));
    assert_eq!((&found["messages"], &found["metadata"]), (&Value::from(195), &Value::from("none")));
    let odometry = &found["topics"]["/odom"];
    assert_eq!(odometry["type"], "nav_msgs/msg/Odometry");
    assert_eq!(odometry["messages"], 150);
    assert!((odometry["rate_hz"].as_f64().unwrap() - 50.0).abs() < 1e-6, "{odometry}");
    assert!((found["topics"]["/points"]["rate_hz"].as_f64().unwrap() - 5.0).abs() < 1e-6);

    let n_bytes = std::fs::metadata(here.join("drive.mcap")).unwrap().len();
    File::options().write(true).open(here.join("drive.mcap")).unwrap().set_len(n_bytes / 2).unwrap();
    assert_eq!(surefoot(here, &["inspect", "drive.mcap", "--json", "found.json"]).0, 0);
    let found = json(here, "found.json");
    assert_eq!(found["complete"], false);
    assert!(found["ended_early"].as_str().unwrap().contains("in drive.mcap: "), "{found}");
}

#[test]
fn topics_that_a_bag_has_not_are_refused_with_those_that_it_has() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    write_bag(&here.join("drive.mcap"));
    let words = ["gap", "diagnose", "--vehicle", "rc_car", "--real", "drive.mcap", "--out", "out", "--map"];
    let told = |mapping: &str| surefoot(here, &[&words[..], &[mapping]].concat());
    let (code, _, error) = told("odometry=/ekf");
    assert_eq!(code, 2);
    let expected = "drive.mcap: expected messages of nav_msgs/msg/Odometry on /ekf, found only /command \
                    (ackermann_msgs/msg/AckermannDriveStamped), /odom (nav_msgs/msg/Odometry), /points";
    assert!(error.contains(expected) && error.lines().count() == 1, "{error}");
    let (code, _, error) = told("command=/points");
    assert!(code == 2 && error.contains("/points: expected messages of ackermann_msgs"), "{error}");
    let (code, _, error) = told("imu=/a,imu=/b");
    assert!(code == 2 && error.contains("--map: expected each of odometry, command, imu once"), "{error}");
}

#[test]
fn a_bag_is_played_through_the_pipeline() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    write_bag(&here.join("drive.mcap"));
    std::fs::write(here.join("robot.toml"), ROBOT).unwrap();
    let words = ["play", "drive.mcap", "--robot", "robot.toml", "--goal", "6,0", "--out", "out"];
    let (code, told, error) = surefoot(here, &words);
    assert_eq!(code, 0, "{error}");
    assert!(told.contains("150 odometry, 15 clouds, 30 decisions"), "{told}");
    let played = json(here, "out/play.json");
    assert!(played["decided"]["drive"].as_u64().unwrap() >= 25, "{}", played["decided"]);
    assert_eq!(played["left_out"], serde_json::json!({}));
    assert_eq!(played["each"].as_array().unwrap().len(), 30);
    assert_eq!(played["each"][10]["was_speed_mps"], 0.5);
    let drive = formats::read_drive_log_mcap(&here.join("out/play.mcap")).unwrap();
    assert_eq!(drive.log.n_rows(), 30);
    assert!(std::fs::read(here.join("out/play.png")).unwrap().starts_with(b"\x89PNG"));

    // Once more, to the bit.
    let again = ["play", "drive.mcap", "--robot", "robot.toml", "--goal", "6,0", "--out", "again"];
    assert_eq!(surefoot(here, &again).0, 0);
    assert_eq!(json(here, "again/play.json")["each"], played["each"]);
}

#[test]
fn what_cannot_be_played_is_refused_in_one_line() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    write_bag(&here.join("drive.mcap"));
    std::fs::write(here.join("robot.toml"), ROBOT).unwrap();
    std::fs::write(here.join("mute.toml"), "format = 1\nvehicle = 'rc_car'\n").unwrap();
    let lost = ROBOT.replace("map_frame = 'odom'", "map_frame = 'map'");
    std::fs::write(here.join("lost.toml"), lost).unwrap();
    std::fs::write(here.join("hasty.toml"), ROBOT.replace("[ros]", "ages = { command_s = 0.05 }\n[ros]"))
        .unwrap();
    let told = |bag: &str, robot: &str| surefoot(here, &["play", bag, "--robot", robot, "--out", "out"]);
    for (bag, robot, part) in [
        ("absent.mcap", "robot.toml", "absent.mcap: expected a readable bag, found: "),
        ("robot.toml", "robot.toml", "robot.toml: expected a bag of ROS 2"),
        ("drive.mcap", "mute.toml", "mute.toml: expected a robot file with a part [ros]"),
        (
            "drive.mcap",
            "lost.toml",
            "150 messages on /odom left out, the first for frame \"odom\": expected transforms",
        ),
        ("drive.mcap", "hasty.toml", "ages.command_s (--command-age): expected more than 0.120 s"),
    ] {
        let (code, _, error) = told(bag, robot);
        assert!(code == 2 && error.contains(part) && error.lines().count() == 1, "{bag} {robot}: {error}");
    }
    assert!(!here.join("out/play.mcap").exists(), "what is refused leaves no recording");
}
