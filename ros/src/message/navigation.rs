//! `nav_msgs` and `ackermann_msgs`.

use serde::{Deserialize, Serialize};

use super::{Header, Pose, PoseStamped, PoseWithCovariance, Time, TwistWithCovariance, named};

/// `nav_msgs/Odometry`: the pose in the frame of the header, the twist in the child frame.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Odometry {
    /// Of when, and the frame of the pose.
    pub header: Header,
    /// The frame whose pose it is, and that the twist is told in.
    pub child_frame_id: String,
    /// Where that frame lies.
    pub pose: PoseWithCovariance,
    /// How it moves.
    pub twist: TwistWithCovariance,
}

/// `nav_msgs/Path`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Path {
    /// Of when and which frame.
    pub header: Header,
    /// The way, pose by pose.
    pub poses: Vec<PoseStamped>,
}

/// `nav_msgs/MapMetaData`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct MapMetaData {
    /// When it was made.
    pub map_load_time: Time,
    /// Edge of a cell [m].
    pub resolution: f32,
    /// Cells east.
    pub width: u32,
    /// Cells north.
    pub height: u32,
    /// The south-western corner of the first cell.
    pub origin: Pose,
}

/// `nav_msgs/OccupancyGrid`: row by row from the south-west, 0 to 100, -1 where nothing is known.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct OccupancyGrid {
    /// Of when and which frame.
    pub header: Header,
    /// Where the cells lie.
    pub info: MapMetaData,
    /// The cells.
    pub data: Vec<i8>,
}

/// `ackermann_msgs/AckermannDrive`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct AckermannDrive {
    /// Angle of a virtual front wheel in the middle, left positive [rad].
    pub steering_angle: f32,
    /// How fast to turn it [rad/s]; 0 = as fast as can be.
    pub steering_angle_velocity: f32,
    /// Forward speed [m/s].
    pub speed: f32,
    /// How fast to change it [m/s2]; 0 = as fast as can be.
    pub acceleration: f32,
    /// How fast to change that [m/s3]; 0 = as fast as can be.
    pub jerk: f32,
}

/// `ackermann_msgs/AckermannDriveStamped`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct AckermannDriveStamped {
    /// Of when and which frame.
    pub header: Header,
    /// What to do.
    pub drive: AckermannDrive,
}

named! {
    Odometry = "nav_msgs" / "Odometry";
    Path = "nav_msgs" / "Path";
    OccupancyGrid = "nav_msgs" / "OccupancyGrid";
    AckermannDriveStamped = "ackermann_msgs" / "AckermannDriveStamped";
}
