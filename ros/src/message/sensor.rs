//! `sensor_msgs`.

use serde::{Deserialize, Serialize};

use super::{Header, Quaternion, Vector3, named};

/// `sensor_msgs/Imu`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Imu {
    /// Of when, and the unit's frame.
    pub header: Header,
    /// How it is turned against the world.
    pub orientation: Quaternion,
    /// How sure that is.
    pub orientation_covariance: [f64; 9],
    /// Angular rate [rad/s].
    pub angular_velocity: Vector3,
    /// How sure that is.
    pub angular_velocity_covariance: [f64; 9],
    /// Specific force [m/s2].
    pub linear_acceleration: Vector3,
    /// How sure that is.
    pub linear_acceleration_covariance: [f64; 9],
}

/// `sensor_msgs/PointField`: where a number of every point lies.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct PointField {
    /// What it is called.
    pub name: String,
    /// Bytes before it in a point.
    pub offset: u32,
    /// What kind of number: 1 i8, 2 u8, 3 i16, 4 u16, 5 i32, 6 u32, 7 f32, 8 f64.
    pub datatype: u8,
    /// How many of them.
    pub count: u32,
}

/// `sensor_msgs/PointCloud2`.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct PointCloud2 {
    /// Of when, and the sensor's frame.
    pub header: Header,
    /// Rows.
    pub height: u32,
    /// Points of a row.
    pub width: u32,
    /// What a point holds.
    pub fields: Vec<PointField>,
    /// Whether numbers begin with their greatest byte.
    pub is_bigendian: bool,
    /// Bytes of a point.
    pub point_step: u32,
    /// Bytes of a row.
    pub row_step: u32,
    /// The points.
    #[serde(with = "serde_bytes")]
    pub data: Vec<u8>,
    /// Whether all points are numbers.
    pub is_dense: bool,
}

named! {
    Imu = "sensor_msgs" / "Imu";
    PointCloud2 = "sensor_msgs" / "PointCloud2";
}
