//! A robot in TOML: what it is, which processes of it run here, how often and how late they may speak, where it may be.

mod ros;

use std::ops::RangeInclusive;
use std::path::{Path, PathBuf};

use serde::Deserialize;
use terrain::Mount;

use crate::{ConfigError, ConfigText, shipped_vehicle_text};
pub use ros::{
    RobotRos, RosClock, RosCommand, RosLabels, RosNavigateResult, RosPointEpoch, RosPointTime, RosTopics,
};

/// Version of the robot files that this program reads.
const FORMAT: u32 = 1;

/// What a robot file says; what it leaves out is as without one.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RobotFile {
    /// Version of the file, 1.
    pub format: u32,
    /// Name of the run: its processes find one another by it.
    pub run: Option<String>,
    /// The machine: name of a shipped one, or a TOML file.
    pub vehicle: String,
    /// What the controller believes of it, a TOML file.
    pub model: Option<PathBuf>,
    /// Settings of the pipeline, a TOML file.
    pub config: Option<PathBuf>,
    /// Processes that run here; all but the vehicle's own when left out.
    pub roles: Option<Vec<String>>,
    /// Readers that each channel has room for beside the run's own.
    pub third_parties: Option<usize>,
    /// How the ground is judged.
    #[serde(default)]
    pub ground: RobotGround,
    /// What corrects commands for the ground under the wheels.
    pub correction: Option<RobotCorrection>,
    /// How often its parts speak.
    #[serde(default)]
    pub rates: RobotRates,
    /// How old what they said may be.
    #[serde(default)]
    pub ages: RobotAges,
    /// Range sensors that send in their own frames, numbered from 1 in this order.
    #[serde(default)]
    pub sensors: Vec<RobotSensor>,
    /// What it begins with.
    #[serde(default)]
    pub mission: RobotMission,
    /// Where it may be.
    #[serde(default)]
    pub areas: RobotAreas,
    /// Limits below those of the machine.
    #[serde(default)]
    pub safety: RobotSafety,
    /// Its topics, where it speaks ROS 2.
    pub ros: Option<RobotRos>,
}

/// How the ground is judged.
#[derive(Clone, Debug, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RobotGround {
    /// As `--method` names it.
    pub method: Option<String>,
    /// Folder of the networks.
    pub weights: Option<PathBuf>,
    /// Share of the worst outcomes to plan for, in (0, 1].
    pub alpha: Option<f64>,
}

/// Decisions per second that the parts of a run keep up with [Hz].
pub const CONTROL_RATES_HZ: RangeInclusive<f64> = 1.0..=50.0;
/// Odometries per second that they keep up with [Hz].
pub const ODOMETRY_RATES_HZ: RangeInclusive<f64> = 2.0..=400.0;
/// Scans per second that they keep up with [Hz].
pub const SCAN_RATES_HZ: RangeInclusive<f64> = 0.5..=50.0;
/// Most readers of somebody else's that memory is reserved for.
pub const THIRD_PARTIES_MAX: usize = 16;

/// What corrects commands for the ground under the wheels.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RobotCorrection {
    /// As `--correct` names it.
    pub method: String,
    /// Folder of its networks.
    pub weights: PathBuf,
}

/// Messages per second [Hz].
#[derive(Clone, Copy, Debug, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RobotRates {
    /// Decisions.
    pub control_hz: Option<f64>,
    /// Odometry.
    pub odometry_hz: Option<f64>,
    /// Scans, of all sensors together.
    pub scan_hz: Option<f64>,
    /// Repetitions of the mission.
    pub mission_hz: Option<f64>,
}

/// Ages up to which something counts [s].
#[derive(Clone, Copy, Debug, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RobotAges {
    /// Odometry of a command that the vehicle follows.
    pub command_s: Option<f64>,
    /// Scan of a learned map from which on physics' younger map is preferred.
    pub learned_s: Option<f64>,
    /// Silence of learning after which physics speaks.
    pub learning_silence_s: Option<f64>,
    /// Mission that has not been repeated.
    pub mission_s: Option<f64>,
    /// Order of somebody who directs the vehicle.
    pub order_s: Option<f64>,
}

/// A range sensor.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RobotSensor {
    /// What it is called.
    pub name: String,
    /// Where it sits, and what it sees of the vehicle.
    pub mount: Mount,
}

/// What the robot begins with.
#[derive(Clone, Debug, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RobotMission {
    /// Places to go to, one after the other, east and north [m]; none = it waits for orders.
    #[serde(default)]
    pub goals_m: Vec<[f64; 2]>,
    /// How near to one counts as there [m].
    pub tolerance_m: Option<f64>,
    /// Whether it waits for orders after the last goal instead of ending.
    #[serde(default)]
    pub standby: bool,
}

/// Polygons by their corners, east and north [m].
#[derive(Clone, Debug, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RobotAreas {
    /// Areas that no part of the vehicle may touch.
    #[serde(default)]
    pub keep_out_m: Vec<Vec<[f64; 2]>>,
    /// The area that it may not leave.
    #[serde(default)]
    pub geofence_m: Vec<[f64; 2]>,
}

/// Limits that take the place of the machine's where they are lower.
#[derive(Clone, Copy, Debug, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RobotSafety {
    /// Speed forwards and backwards [m/s].
    pub speed_max_mps: Option<f64>,
    /// Roll to either side [rad].
    pub roll_max_rad: Option<f64>,
    /// Pitch to either side [rad].
    pub pitch_max_rad: Option<f64>,
    /// Lateral acceleration [m/s2].
    pub lateral_acceleration_max_mps2: Option<f64>,
}

/// A robot from its file. Paths in it are relative to its folder.
///
/// # Errors
/// The file cannot be read, is of another version, or holds an unknown, missing or mistyped key, a number that is none,
/// or a sensor twice.
pub fn read_robot(path: &Path) -> Result<RobotFile, ConfigError> {
    let robot = parse_robot(&ConfigText::read(path)?)?;
    Ok(robot.relative_to(path.parent().unwrap_or(Path::new(""))))
}

/// A robot from a text already read; paths stay as they are. Errors as [`read_robot`].
pub fn parse_robot(text: &ConfigText) -> Result<RobotFile, ConfigError> {
    let robot: RobotFile = text.parse()?;
    if robot.format != FORMAT {
        return Err(text.refuse("format", format_args!("version {FORMAT}"), robot.format));
    }
    if let Some((field, range, found)) = robot.first_out_of_range() {
        return Err(text.refuse(
            field,
            format_args!("a number from {} to {}", range.start(), range.end()),
            found,
        ));
    }
    if let Some((field, found)) = robot.first_not_positive() {
        return Err(text.refuse(field, "a finite number > 0", found));
    }
    if let Some(ros) = &robot.ros {
        ros.check(text)?;
    }
    for (place, RobotSensor { name, mount }) in robot.sensors.iter().enumerate() {
        let field = |field: &str| format!("sensors[{place}].{field}");
        if robot.sensors[..place].iter().any(|before| before.name == *name) {
            return Err(text.refuse(
                &field("name"),
                "another name for every sensor",
                format!("{name:?} again"),
            ));
        }
        if let Some((wrong, found)) = mount.first_invalid() {
            return Err(text.refuse(&field(&format!("mount.{wrong}")), "a finite number", found));
        }
    }
    Ok(robot)
}

impl RobotFile {
    /// Rates that no process keeps to, and more readers than memory is reserved for.
    fn first_out_of_range(&self) -> Option<(&'static str, RangeInclusive<f64>, f64)> {
        let rates = &self.rates;
        let numbers = [
            ("rates.control_hz", CONTROL_RATES_HZ, rates.control_hz),
            ("rates.odometry_hz", ODOMETRY_RATES_HZ, rates.odometry_hz),
            ("rates.scan_hz", SCAN_RATES_HZ, rates.scan_hz),
            ("third_parties", 0.0..=THIRD_PARTIES_MAX as f64, self.third_parties.map(|n| n as f64)),
        ];
        let given = numbers.into_iter().filter_map(|(field, range, value)| Some((field, range, value?)));
        given.into_iter().find(|(_, range, value)| !range.contains(value))
    }

    /// Rates, ages and limits are all of one kind.
    fn first_not_positive(&self) -> Option<(&'static str, f64)> {
        let (rates, ages, safety) = (&self.rates, &self.ages, &self.safety);
        let numbers = [
            ("rates.mission_hz", rates.mission_hz),
            ("ages.command_s", ages.command_s),
            ("ages.learned_s", ages.learned_s),
            ("ages.learning_silence_s", ages.learning_silence_s),
            ("ages.mission_s", ages.mission_s),
            ("ages.order_s", ages.order_s),
            ("mission.tolerance_m", self.mission.tolerance_m),
            ("safety.speed_max_mps", safety.speed_max_mps),
            ("safety.roll_max_rad", safety.roll_max_rad),
            ("safety.pitch_max_rad", safety.pitch_max_rad),
            ("safety.lateral_acceleration_max_mps2", safety.lateral_acceleration_max_mps2),
        ];
        let given = numbers.into_iter().filter_map(|(field, value)| Some((field, value?)));
        given.into_iter().find(|(_, value)| !(value.is_finite() && *value > 0.0))
    }

    fn relative_to(mut self, folder: &Path) -> Self {
        if shipped_vehicle_text(&self.vehicle).is_none() {
            self.vehicle = folder.join(&self.vehicle).display().to_string();
        }
        for path in [&mut self.model, &mut self.config, &mut self.ground.weights].into_iter().flatten() {
            *path = folder.join(&path);
        }
        if let Some(correction) = &mut self.correction {
            correction.weights = folder.join(&correction.weights);
        }
        self
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const WHOLE: &str = r#"
format = 1
run = "north"
vehicle = "mine.toml"
config = "settings.toml"
roles = ["mapping", "control"]

[ground]
method = "physics"
alpha = 0.4

[correction]
method = "kinodynamics"
weights = "wheels"

[rates]
odometry_hz = 100.0

[ages]
command_s = 0.4

[[sensors]]
name = "front"
mount = { position_m = [1.0, 0.0, 0.8], attitude_rad = [0.0, 0.1, 0.0] }

[[sensors]]
name = "rear"
[sensors.mount]
position_m = [-0.5, 0.0, 0.8]
attitude_rad = [0.0, 0.1, 3.14]
own_body = [{ min_m = [-0.6, -0.3, 0.0], max_m = [0.0, 0.3, 0.5] }]

[mission]
goals_m = [[10.0, 2.0], [20.0, 4.0]]

[areas]
keep_out_m = [[[3.0, 0.0], [4.0, 0.0], [4.0, 1.0]]]

[safety]
speed_max_mps = 0.8

[ros]
vehicle_frame = "rear_axle"
command = "twist"
labels = { field = "label", open = [1, 40] }
point_time = { field = "t", unit_s = 1e-9 }
topics = { points = ["front/points", "rear/points"], pause = "" }
"#;

    fn told(text: &str) -> String {
        parse_robot(&ConfigText::new("robot.toml", text)).unwrap_err().to_string()
    }

    #[test]
    fn a_robot_is_read_and_its_paths_lie_beside_it() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("robot.toml");
        std::fs::write(&path, WHOLE).unwrap();
        let robot = read_robot(&path).unwrap();
        assert_eq!(robot.vehicle, folder.path().join("mine.toml").display().to_string());
        assert_eq!(robot.config, Some(folder.path().join("settings.toml")));
        assert_eq!(robot.correction.unwrap().weights, folder.path().join("wheels"));
        assert_eq!((robot.ground.alpha, robot.rates.odometry_hz), (Some(0.4), Some(100.0)));
        assert_eq!(robot.sensors[1].mount.own_body[0].max_m, [0.0, 0.3, 0.5]);
        assert_eq!((robot.mission.goals_m.len(), robot.areas.keep_out_m[0].len()), (2, 3));
        assert_eq!(robot.safety, RobotSafety { speed_max_mps: Some(0.8), ..RobotSafety::default() });
        let ros = robot.ros.unwrap();
        assert_eq!((ros.vehicle_frame.as_str(), ros.command), ("rear_axle", RosCommand::Twist));
        assert_eq!((ros.topics.points.len(), ros.topics.odometry.as_str()), (2, "odom"));
        assert_eq!(ros.labels.unwrap().open, [1, 40]);
        let times = RosPointTime { field: "t".into(), unit_s: 1e-9, counts_from: RosPointEpoch::Stamp };
        assert_eq!(ros.point_time, Some(times));
        let shipped = parse_robot(&ConfigText::new("r", "format = 1\nvehicle = \"rc_car\"")).unwrap();
        assert_eq!(shipped.relative_to(folder.path()).vehicle, "rc_car");
    }

    #[test]
    fn the_robot_of_ros_that_comes_along_says_what_is_so_without_a_word() {
        let text = include_str!("../../examples/ros/robot.toml");
        let robot = parse_robot(&ConfigText::new("robot.toml", text)).unwrap();
        assert_eq!(robot.ros, Some(RobotRos::default()));
    }

    #[test]
    fn what_cannot_be_is_refused_by_line_and_field() {
        assert_eq!(
            told(&WHOLE.replace("speed_max_mps = 0.8", "speed_max_mps = -0.8")),
            "robot.toml:40: safety.speed_max_mps: expected a finite number > 0, found -0.8"
        );
        assert!(
            told(&WHOLE.replace("odometry_hz = 100.0", "odometry_hz = nan")).contains("rates.odometry_hz")
        );
        assert!(
            told(&WHOLE.replace("format = 1", "format = 2")).contains("format: expected version 1, found 2")
        );
        let twice = told(&WHOLE.replace("\"rear\"", "\"front\""));
        assert!(twice.contains("sensors[1].name: expected another name for every sensor"), "{twice}");
        let lost = told(&WHOLE.replace("3.14]", "inf]"));
        assert!(
            lost.contains("sensors[1].mount.attitude_rad: expected a finite number, found inf"),
            "{lost}"
        );
        let ros = |from: &str, to: &str| told(&WHOLE.replace(from, to));
        let slow = ros("command = \"twist\"", "command_hz = 0.5");
        assert_eq!(slow, "robot.toml:44: ros.command_hz: expected a number from 1 to 200, found 0.5");
        assert!(ros("command = \"twist\"", "domain_id = 233").contains("ros.domain_id: expected 0 to 232"));
        assert!(ros("\"rear_axle\"", "\"\"").contains("ros.vehicle_frame: expected a name, found none"));
        assert!(ros("command = \"twist\"", "namespace = \"car\"").contains("begins with a slash"));
        assert!(ros("\"twist\"", "\"steering\"").contains("ros.command"));
        assert!(ros("1e-9", "0.0").contains("ros.point_time.unit_s: expected a finite number > 0, found 0"));
        let unknown = told(&WHOLE.replace("speed_max_mps", "top_speed"));
        assert!(unknown.contains("safety.top_speed") && unknown.contains("an unknown key"), "{unknown}");
        assert!(told("format = 1").contains("vehicle"));
    }
}
