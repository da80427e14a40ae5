//! The robot file.

use std::collections::BTreeSet;
use std::fmt::Write as _;
use std::ops::RangeInclusive;

use formats::{ODOMETRY_RATES_HZ, RosClock, SCAN_RATES_HZ, UrdfVehicle};
use terrain::Pose;

use super::survey::{Kind, Survey, Topic};
use super::vehicle::{Drafted, rounded};

/// How far a frame may lie from the rear axle's centre to be that [m, rad].
const SAME: f64 = 0.02;
/// What the box of the own body is wider than the collision bodies [m].
const MARGIN_M: f64 = 0.05;

/// Lines of the file, and what they ask for.
struct Draft {
    text: String,
    asked: Vec<String>,
}

/// The file of a robot with this vehicle's file beside it.
pub(super) fn drafted(urdf: &UrdfVehicle, survey: &Survey, vehicle_file: &str) -> Drafted {
    let mut draft = Draft { text: String::new(), asked: Vec::new() };
    draft.line("# A robot out of a URDF and a bag of ROS 2; examples/robot.toml goes through what else may stand here.");
    draft.line("format = 1");
    draft.line(&format!("vehicle = {vehicle_file:?}"));
    draft.line("\n[ground]\nmethod = \"physics\"");
    draft.rates(survey);
    draft.sensors(urdf, survey);
    draft.line("\n# Where it goes; without goals it waits for `surefoot goal`.");
    draft.line("# [mission]\n# goals_m = [[10.0, 0.0]]  # expected: places in the map, east and north [m]");
    draft.ros(urdf, survey);
    Drafted { text: draft.text, asked: draft.asked }
}

impl Draft {
    fn line(&mut self, line: &str) {
        // Writing into a text cannot fail.
        let _written = writeln!(self.text, "{line}");
    }

    /// A line that somebody has to fill in.
    fn ask(&mut self, line: &str, field: &str, expected: &str, found: &str) {
        self.line(&format!("# {line}  # expected: {expected}; found {found}"));
        self.asked.push(format!("{field}: expected {expected}, found {found}"));
    }

    fn rates(&mut self, survey: &Survey) {
        let rates_hz = |kind| {
            let topics = survey.of_kind(kind);
            topics.into_iter().filter_map(|(_, topic)| topic.rate_hz()).collect::<Vec<f64>>()
        };
        self.line("\n[rates]\ncontrol_hz = 10.0");
        // Of several odometries one is to be chosen; scans are those of all sensors.
        let odometry_hz = rates_hz(Kind::Odometry).into_iter().reduce(f64::max);
        self.rate("odometry_hz", odometry_hz, ODOMETRY_RATES_HZ, "nav_msgs/msg/Odometry");
        let scan_hz = rates_hz(Kind::Points).into_iter().reduce(|sum_hz, hz| sum_hz + hz);
        self.rate("scan_hz", scan_hz, SCAN_RATES_HZ, "sensor_msgs/msg/PointCloud2, all topics together");
    }

    fn rate(&mut self, key: &str, found_hz: Option<f64>, range: RangeInclusive<f64>, of: &str) {
        match found_hz.map(|hz| (10.0 * hz).round() / 10.0) {
            Some(hz) if range.contains(&hz) => self.line(&format!("{key} = {hz:?}  # bag")),
            found => {
                let expected = format!("{} to {} a second of {of}", range.start(), range.end());
                let found = found.map_or_else(|| "none".to_owned(), |hz| hz.to_string());
                self.ask(&format!("{key} = "), &format!("rates.{key}"), &expected, &found);
            }
        }
    }

    /// Sensors whose frames the URDF mounts, and the box of the body that they see.
    fn sensors(&mut self, urdf: &UrdfVehicle, survey: &Survey) {
        let [least_m, greatest_m] = urdf.extent_m;
        let min_m = least_m.map(|axis_m| rounded(axis_m - MARGIN_M));
        let max_m = greatest_m.map(|axis_m| rounded(axis_m + MARGIN_M));
        let points = survey.of_kind(Kind::Points);
        let frames: BTreeSet<&String> = points.iter().flat_map(|(_, topic)| &topic.frames).collect();
        for frame in frames {
            let Some(mount) = urdf.links.get(frame) else {
                let expected =
                    format!("a link {frame:?} of the URDF, or transforms on /tf_static of that frame");
                self.ask(
                    &format!("[[sensors]] name = {frame:?}"),
                    "sensors",
                    &expected,
                    "neither in the URDF",
                );
                continue;
            };
            let Pose { x_m, y_m, z_m, roll_rad, pitch_rad, yaw_rad } = *mount;
            let [position_m, attitude_rad] = [[x_m, y_m, z_m], [roll_rad, pitch_rad, yaw_rad]];
            self.line(&format!("\n[[sensors]]\nname = {frame:?}  # bag: frame of clouds"));
            self.line("[sensors.mount]");
            self.line(&format!("position_m = {:?}  # URDF", position_m.map(rounded)));
            self.line(&format!("attitude_rad = {:?}  # URDF", attitude_rad.map(rounded)));
            self.line(&format!("own_body = [{{ min_m = {min_m:?}, max_m = {max_m:?} }}]  # URDF: collision bodies, {MARGIN_M} m wider"));
            if urdf.n_meshes > 0 {
                let found = format!("{} that are meshes", urdf.n_meshes);
                self.asked.push(format!(
                    "sensors.{frame}.own_body: expected boxes around all bodies, found {found}"
                ));
            }
        }
    }

    fn ros(&mut self, urdf: &UrdfVehicle, survey: &Survey) {
        self.line("\n[ros]");
        self.map_frame(survey);
        self.vehicle_frame(urdf, survey);
        let clock = match survey.clock() {
            RosClock::TimeOfDay => "time_of_day",
            RosClock::Simulated => "simulated",
            RosClock::OfItsOwn => "of_its_own",
        };
        self.line(&format!("clock = {clock:?}  # bag: stamps beside the times of recording"));
        let ackermann = survey.of_kind(Kind::Ackermann);
        let twist = survey.of_kind(Kind::Twist);
        let is_twist = ackermann.is_empty() && !twist.is_empty();
        let command = if is_twist { "twist" } else { "ackermann" };
        self.line(&format!("command = {command:?}"));
        self.line("\n[ros.topics]");
        self.topic("odometry", "nav_msgs/msg/Odometry", &survey.of_kind(Kind::Odometry));
        let points = survey.of_kind(Kind::Points);
        if points.is_empty() {
            let expected = "topics of sensor_msgs/msg/PointCloud2";
            self.ask("points = [\"\"]", "ros.topics.points", expected, "none in the bag");
        } else {
            let names: Vec<&str> = points.iter().map(|(name, _)| *name).collect();
            self.line(&format!("points = {names:?}  # bag"));
        }
        self.topic("imu", "sensor_msgs/msg/Imu", &survey.of_kind(Kind::Imu));
        let kind = if is_twist {
            "geometry_msgs/msg/TwistStamped"
        } else {
            "ackermann_msgs/msg/AckermannDriveStamped"
        };
        self.topic("command", kind, if is_twist { &twist } else { &ackermann });
    }

    /// The only topic of a type; of several somebody has to choose.
    fn topic(&mut self, key: &str, kind: &str, topics: &[(&str, &Topic)]) {
        match topics {
            [(name, _)] => self.line(&format!("{key} = {name:?}  # bag")),
            [] => self.ask(
                &format!("{key} = \"\""),
                &format!("ros.topics.{key}"),
                &format!("a topic of {kind}"),
                "none in the bag",
            ),
            several => {
                let names: Vec<&str> = several.iter().map(|(name, _)| *name).collect();
                let expected = format!("one topic of {kind}");
                self.ask(
                    &format!("{key} = \"\""),
                    &format!("ros.topics.{key}"),
                    &expected,
                    &names.join(", "),
                );
            }
        }
    }

    /// The map where a transform tells of it, else the frame that the odometry is told in.
    fn map_frame(&mut self, survey: &Survey) {
        let odometry = survey.of_kind(Kind::Odometry);
        let told: BTreeSet<&String> = odometry.iter().flat_map(|(_, topic)| &topic.frames).collect();
        let names: Vec<&str> = told.into_iter().map(String::as_str).collect();
        match names[..] {
            _ if survey.frames.contains("map") => self.line("map_frame = \"map\"  # bag: transforms"),
            [frame] => self.line(&format!("map_frame = {frame:?}  # bag: frame of the odometry")),
            [] => self.ask("map_frame = \"\"", "ros.map_frame", "the frame of the map", "none in the bag"),
            _ => self.ask("map_frame = \"\"", "ros.map_frame", "the frame of the map", &names.join(", ")),
        }
    }

    /// The frame at the centre of the rear axle: the odometry's child where it is one, else another link that lies there.
    fn vehicle_frame(&mut self, urdf: &UrdfVehicle, survey: &Survey) {
        let is_there = |pose: &Pose| {
            let Pose { x_m, y_m, z_m, roll_rad, pitch_rad, yaw_rad } = *pose;
            [x_m, y_m, z_m, roll_rad, pitch_rad, yaw_rad].iter().all(|number| number.abs() <= SAME)
        };
        let child = survey.child_frame.clone().unwrap_or_default();
        let of_child = urdf.links.get(&child);
        if of_child.is_some_and(is_there) {
            return self.line(&format!(
                "vehicle_frame = {child:?}  # bag: child frame of the odometry; URDF: at the rear axle"
            ));
        }
        let is_known = |frame: &String| survey.frames.contains(frame);
        let mut others = urdf.links.iter().filter(|(frame, pose)| is_there(pose) && is_known(frame));
        match others.next() {
            Some((frame, _)) => {
                self.line(&format!("vehicle_frame = {frame:?}  # URDF: at the rear axle; bag: transforms"))
            }
            None => {
                let found = of_child.map_or_else(
                    || format!("the odometry's {child:?}, which is no link of the URDF"),
                    |Pose { x_m, y_m, z_m, .. }| {
                        format!("the odometry's {child:?}, {x_m:.3} m ahead, {y_m:.3} m left and {z_m:.3} m above it")
                    },
                );
                let expected = "a frame on /tf_static at the centre of the rear axle, forward, left, up";
                self.ask("vehicle_frame = \"\"", "ros.vehicle_frame", expected, &found);
            }
        }
    }
}
