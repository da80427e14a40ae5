//! The part of a robot file that says how it is reached by ROS 2.

use serde::Deserialize;

use crate::{ConfigError, ConfigText};

/// A robot's topics and frames in ROS 2.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct RobotRos {
    /// Namespace of the node; topics without a slash at their beginning are below it.
    pub namespace: String,
    /// Name of the node.
    pub node: String,
    /// Domain, unless `ROS_DOMAIN_ID` says another.
    pub domain_id: u16,
    /// What the frames of this robot begin with, where several share a network; frames with a slash at their beginning are
    /// named without it.
    pub frame_prefix: String,
    /// Frame of the map: x east, y north, z up.
    pub map_frame: String,
    /// Frame of the vehicle: forward, left, up at the rear axle's centre.
    pub vehicle_frame: String,
    /// Which clock stamps are of.
    pub clock: RosClock,
    /// What the vehicle is commanded with.
    pub command: RosCommand,
    /// Commands per second [Hz].
    pub command_hz: f64,
    /// How far in time a moving transform may be from the message that it is used for [s].
    pub transform_age_max_s: f64,
    /// Speed along paths that are to be followed [m/s].
    pub path_speed_mps: f64,
    /// What is told of a goal of the action that has ended.
    pub navigate_result: RosNavigateResult,
    /// Which field of clouds says what points are of; by geometry where there is none.
    pub labels: Option<RosLabels>,
    /// Which field of clouds says when points were measured; all at the cloud's stamp where there is none.
    pub point_time: Option<RosPointTime>,
    /// The names of topics.
    pub topics: RosTopics,
}

impl Default for RobotRos {
    fn default() -> Self {
        Self {
            namespace: "/".to_owned(),
            node: "surefoot".to_owned(),
            domain_id: 0,
            frame_prefix: String::new(),
            map_frame: "map".to_owned(),
            vehicle_frame: "base_link".to_owned(),
            clock: RosClock::TimeOfDay,
            command: RosCommand::Ackermann,
            command_hz: 20.0,
            transform_age_max_s: 1.0,
            path_speed_mps: 1.0,
            navigate_result: RosNavigateResult::Code,
            labels: None,
            point_time: None,
            topics: RosTopics::default(),
        }
    }
}

/// Which clock stamps are of.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum RosClock {
    /// The time of day of this machine, or one kept equal to it.
    TimeOfDay,
    /// The simulator's, told on `/clock`.
    Simulated,
    /// One that nobody else has.
    OfItsOwn,
}

/// What the vehicle is commanded with.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum RosCommand {
    /// `ackermann_msgs/AckermannDriveStamped`.
    Ackermann,
    /// `geometry_msgs/TwistStamped`, of the rear axle's centre.
    Twist,
}

/// What the result of `nav2_msgs/NavigateToPose` consists of, which differs between distributions of ROS 2.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum RosNavigateResult {
    /// A number, as in Iron and Jazzy.
    Code,
    /// A number and a text, as since Kilted.
    CodeAndText,
}

/// What the numbers of a cloud's field mean.
#[derive(Clone, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RosLabels {
    /// Name of the field.
    pub field: String,
    /// Rigid ground.
    #[serde(default)]
    pub open: Vec<i64>,
    /// Loose ground.
    #[serde(default)]
    pub loose: Vec<i64>,
    /// Soft plants.
    #[serde(default)]
    pub vegetation: Vec<i64>,
    /// What must not be touched; numbers of no class count as such, too.
    #[serde(default)]
    pub obstacle: Vec<i64>,
}

/// When the points of a cloud were measured.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RosPointTime {
    /// Name of the field.
    pub field: String,
    /// Of which unit its numbers are [s]: 1 of seconds, 1e-9 of nanoseconds.
    pub unit_s: f64,
    /// What they count from.
    #[serde(default)]
    pub counts_from: RosPointEpoch,
}

/// What the times of points count from.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum RosPointEpoch {
    /// The stamp of the cloud.
    #[default]
    Stamp,
    /// The same as the stamp does.
    Epoch,
}

/// The names of topics, and of the action. An empty one is not spoken, not listened to, or not offered.
#[derive(Clone, Debug, PartialEq, Eq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct RosTopics {
    /// `nav_msgs/Odometry`, in.
    pub odometry: String,
    /// `sensor_msgs/PointCloud2`, in; one or several sensors.
    pub points: Vec<String>,
    /// `sensor_msgs/Imu`, in.
    pub imu: String,
    /// `tf2_msgs/TFMessage` of moving frames, in.
    pub tf: String,
    /// `tf2_msgs/TFMessage` of frames that stay, in.
    pub tf_static: String,
    /// `rosgraph_msgs/Clock`, in.
    pub clock: String,
    /// `geometry_msgs/PoseStamped`, in: a goal.
    pub goal: String,
    /// `geometry_msgs/PoseArray`, in: goals, one after the other.
    pub goals: String,
    /// `geographic_msgs/GeoPoseStamped`, in: a goal in latitude and longitude.
    pub goal_on_globe: String,
    /// `sensor_msgs/NavSatFix`, in: where the vehicle is on the globe.
    pub fix: String,
    /// `nav_msgs/Path`, in: a path to be followed.
    pub path: String,
    /// `nav2_msgs/NavigateToPose`, an action: a goal, and how it ends.
    pub navigate: String,
    /// `std_msgs/Bool`, in: true stops, false after it resets.
    pub emergency_stop: String,
    /// `std_msgs/Bool`, in: true pauses, false goes on.
    pub pause: String,
    /// Commands, out.
    pub command: String,
    /// `nav_msgs/Path`, out: what is meant to be driven.
    pub plan: String,
    /// `nav_msgs/OccupancyGrid`, out: the risk.
    pub risk: String,
    /// `grid_map_msgs/GridMap`, out: heights and risks.
    pub grid_map: String,
    /// `visualization_msgs/MarkerArray`, out: the plan, and what moves.
    pub markers: String,
    /// `diagnostic_msgs/DiagnosticArray`, out.
    pub diagnostics: String,
}

impl Default for RosTopics {
    fn default() -> Self {
        let [odometry, points, imu, tf, tf_static, clock] =
            ["odom", "points", "imu", "/tf", "/tf_static", "/clock"].map(str::to_owned);
        let [goal, goals, path, navigate, emergency_stop, pause] =
            ["goal_pose", "goals", "path", "navigate_to_pose", "emergency_stop", "pause"].map(str::to_owned);
        let [goal_on_globe, fix] = ["goal_on_globe", "fix"].map(str::to_owned);
        let [command, plan, risk, markers, diagnostics] =
            ["command", "plan", "risk", "markers", "/diagnostics"].map(str::to_owned);
        let points = vec![points];
        Self {
            odometry,
            points,
            imu,
            tf,
            tf_static,
            clock,
            goal,
            goals,
            goal_on_globe,
            fix,
            path,
            navigate,
            emergency_stop,
            pause,
            command,
            plan,
            risk,
            // Of some size, and few want it.
            grid_map: String::new(),
            markers,
            diagnostics,
        }
    }
}

/// Largest number of a domain whose ports there are.
const DOMAIN_MAX: u16 = 232;

impl RobotRos {
    /// A frame of this robot as it is called on the network.
    pub fn frame(&self, name: &str) -> String {
        name.strip_prefix('/').map_or_else(|| format!("{}{name}", self.frame_prefix), str::to_owned)
    }

    /// Refuses what no node could be. Errors: [`ConfigError::Field`].
    pub(super) fn check(&self, text: &ConfigText) -> Result<(), ConfigError> {
        let positive = [
            ("ros.command_hz", self.command_hz),
            ("ros.transform_age_max_s", self.transform_age_max_s),
            ("ros.path_speed_mps", self.path_speed_mps),
        ];
        for (field, value) in positive {
            if !(value.is_finite() && value > 0.0) {
                return Err(text.refuse(field, "a finite number > 0", value));
            }
        }
        if !(1.0..=200.0).contains(&self.command_hz) {
            return Err(text.refuse("ros.command_hz", "a number from 1 to 200", self.command_hz));
        }
        if self.domain_id > DOMAIN_MAX {
            return Err(text.refuse("ros.domain_id", format_args!("0 to {DOMAIN_MAX}"), self.domain_id));
        }
        let needed =
            [("ros.topics.odometry", &self.topics.odometry), ("ros.topics.command", &self.topics.command)];
        let frames = [("ros.map_frame", &self.map_frame), ("ros.vehicle_frame", &self.vehicle_frame)];
        for (field, name) in needed.into_iter().chain(frames) {
            if name.is_empty() {
                return Err(text.refuse(field, "a name", "none"));
            }
        }
        let unit_s = self.point_time.as_ref().map_or(1.0, |times| times.unit_s);
        if !(unit_s.is_finite() && unit_s > 0.0) {
            return Err(text.refuse("ros.point_time.unit_s", "a finite number > 0", unit_s));
        }
        if !self.namespace.starts_with('/') {
            let found = format!("{:?}", self.namespace);
            return Err(text.refuse("ros.namespace", "a name that begins with a slash", found));
        }
        Ok(())
    }
}
