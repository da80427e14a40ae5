//! The ROS 2 messages that are spoken, field by field in the order of their definitions, which is that of their bytes.
//!
//! Definitions are those of ROS 2 Jazzy; the ones here have not changed since Humble. A message's name on the wire is its
//! package and type, [`Named`].

mod definition;
mod diagnostic;
mod geographic;
mod geometry;
mod grid_map;
mod navigate;
mod navigation;
mod sensor;
mod visualization;

use serde::{Deserialize, Serialize};

pub use definition::Defined;
pub use diagnostic::{DiagnosticArray, DiagnosticStatus, KeyValue};
pub use geographic::{GeoPoint, GeoPose, GeoPoseStamped, NavSatFix, NavSatStatus};
pub use geometry::{
    Point, Pose, PoseArray, PoseStamped, PoseWithCovariance, Quaternion, TfMessage, Transform,
    TransformStamped, Twist, TwistStamped, TwistWithCovariance, Vector3,
};
pub use grid_map::{Float32MultiArray, GridMap, GridMapInfo, MultiArrayDimension, MultiArrayLayout};
pub use navigate::{NavigateToPoseFeedback, NavigateToPoseGoal, NavigateToPoseResult};
pub use navigation::{AckermannDrive, AckermannDriveStamped, MapMetaData, OccupancyGrid, Odometry, Path};
pub use sensor::{Imu, PointCloud2, PointField};
pub use visualization::{ColorRgba, CompressedImage, Duration, Marker, MarkerArray, MeshFile, UvCoordinate};

/// A message by its name in ROS.
pub trait Named {
    /// The package that defines it.
    const PACKAGE: &'static str;
    /// Its name there.
    const TYPE: &'static str;
}

/// Says a message's package and type.
macro_rules! named {
    ($($kind:ty = $package:literal / $name:literal;)*) => { $(
        impl $crate::message::Named for $kind {
            const PACKAGE: &'static str = $package;
            const TYPE: &'static str = $name;
        }
    )* };
}
use named;

/// `builtin_interfaces/Time`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Time {
    /// Whole seconds [s].
    pub sec: i32,
    /// The rest [ns].
    pub nanosec: u32,
}

impl Time {
    /// Nanoseconds since the clock's beginning.
    pub fn nanoseconds(self) -> i64 {
        i64::from(self.sec) * 1_000_000_000 + i64::from(self.nanosec)
    }

    /// The time so many nanoseconds after the clock's beginning; the nearest that can be told, beyond.
    pub fn from_nanoseconds(at_ns: i64) -> Self {
        let sec = at_ns.div_euclid(1_000_000_000).clamp(i64::from(i32::MIN), i64::from(i32::MAX)) as i32;
        Self { sec, nanosec: at_ns.rem_euclid(1_000_000_000) as u32 }
    }
}

/// `std_msgs/Header`.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Header {
    /// When it was true.
    pub stamp: Time,
    /// The frame that its numbers are of.
    pub frame_id: String,
}

/// `std_msgs/Bool`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Bool {
    /// What is said.
    pub data: bool,
}

/// `rosgraph_msgs/Clock`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Clock {
    /// The time now.
    pub clock: Time,
}

named! {
    Bool = "std_msgs" / "Bool";
    Clock = "rosgraph_msgs" / "Clock";
    ros2_client::parameters::raw::ParameterEvent = "rcl_interfaces" / "ParameterEvent";
}

#[cfg(test)]
mod tests;
