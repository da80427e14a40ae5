//! `geometry_msgs` and `tf2_msgs`.

use serde::{Deserialize, Serialize};

use super::{Header, named};

/// `geometry_msgs/Point` [m].
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Point {
    /// Forward or east [m].
    pub x: f64,
    /// Left or north [m].
    pub y: f64,
    /// Up [m].
    pub z: f64,
}

/// `geometry_msgs/Vector3`, in the unit of what it belongs to.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Vector3 {
    /// Forward or east.
    pub x: f64,
    /// Left or north.
    pub y: f64,
    /// Up.
    pub z: f64,
}

impl Vector3 {
    /// Its three numbers.
    pub fn numbers(self) -> [f64; 3] {
        [self.x, self.y, self.z]
    }
}

/// `geometry_msgs/Quaternion`, of norm 1.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Quaternion {
    /// Of the axis.
    pub x: f64,
    /// Of the axis.
    pub y: f64,
    /// Of the axis.
    pub z: f64,
    /// Of the angle.
    pub w: f64,
}

impl Default for Quaternion {
    /// No rotation.
    fn default() -> Self {
        Self { x: 0.0, y: 0.0, z: 0.0, w: 1.0 }
    }
}

/// `geometry_msgs/Pose`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Pose {
    /// Where.
    pub position: Point,
    /// How turned.
    pub orientation: Quaternion,
}

/// `geometry_msgs/PoseStamped`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct PoseStamped {
    /// Of when and which frame.
    pub header: Header,
    /// The pose.
    pub pose: Pose,
}

/// `geometry_msgs/PoseArray`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct PoseArray {
    /// Of when and which frame.
    pub header: Header,
    /// The poses.
    pub poses: Vec<Pose>,
}

/// `geometry_msgs/Twist`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Twist {
    /// Velocity [m/s].
    pub linear: Vector3,
    /// Angular rate [rad/s].
    pub angular: Vector3,
}

/// `geometry_msgs/TwistStamped`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct TwistStamped {
    /// Of when and which frame.
    pub header: Header,
    /// The twist.
    pub twist: Twist,
}

/// A covariance matrix of six numbers: position or velocity, then rotation or angular rate, row by row.
pub type Covariance = [[f64; 6]; 6];

/// `geometry_msgs/PoseWithCovariance`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct PoseWithCovariance {
    /// The pose.
    pub pose: Pose,
    /// How sure that is.
    pub covariance: Covariance,
}

/// `geometry_msgs/TwistWithCovariance`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct TwistWithCovariance {
    /// The twist.
    pub twist: Twist,
    /// How sure that is.
    pub covariance: Covariance,
}

/// `geometry_msgs/Transform`: takes points of the child frame to the frame of the header.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Transform {
    /// Where the child's origin lies [m].
    pub translation: Vector3,
    /// How it is turned.
    pub rotation: Quaternion,
}

/// `geometry_msgs/TransformStamped`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct TransformStamped {
    /// Of when, and the parent frame.
    pub header: Header,
    /// The frame that is told of.
    pub child_frame_id: String,
    /// Where it lies.
    pub transform: Transform,
}

/// `tf2_msgs/TFMessage`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct TfMessage {
    /// Frame by frame.
    pub transforms: Vec<TransformStamped>,
}

named! {
    PoseStamped = "geometry_msgs" / "PoseStamped";
    PoseArray = "geometry_msgs" / "PoseArray";
    Twist = "geometry_msgs" / "Twist";
    TwistStamped = "geometry_msgs" / "TwistStamped";
    TfMessage = "tf2_msgs" / "TFMessage";
}
