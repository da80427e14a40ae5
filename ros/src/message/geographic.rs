//! Places on the globe: `geographic_msgs`, and the fixes of `sensor_msgs`.

use serde::{Deserialize, Serialize};

use super::{Header, Quaternion, named};

/// `sensor_msgs/NavSatStatus`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct NavSatStatus {
    /// Below 0 the receiver does not know where it is.
    pub status: i8,
    /// The systems of satellites that it hears.
    pub service: u16,
}

/// `sensor_msgs/NavSatFix`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct NavSatFix {
    /// Of when, and the antenna's frame.
    pub header: Header,
    /// Whether it is a fix.
    pub status: NavSatStatus,
    /// North of the equator, WGS 84 [deg].
    pub latitude: f64,
    /// East of Greenwich, WGS 84 [deg].
    pub longitude: f64,
    /// Above the ellipsoid of WGS 84 [m].
    pub altitude: f64,
    /// How sure that is: east, north, up [m2].
    pub position_covariance: [f64; 9],
    /// How it is known: 0 not at all.
    pub position_covariance_type: u8,
}

/// `geographic_msgs/GeoPoint`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct GeoPoint {
    /// North of the equator, WGS 84 [deg].
    pub latitude: f64,
    /// East of Greenwich, WGS 84 [deg].
    pub longitude: f64,
    /// Above the ellipsoid of WGS 84 [m].
    pub altitude: f64,
}

/// `geographic_msgs/GeoPose`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct GeoPose {
    /// Where.
    pub position: GeoPoint,
    /// How it is turned against east, north and up.
    pub orientation: Quaternion,
}

/// `geographic_msgs/GeoPoseStamped`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct GeoPoseStamped {
    /// Of when; degrees need no frame.
    pub header: Header,
    /// The pose.
    pub pose: GeoPose,
}

named! {
    NavSatFix = "sensor_msgs" / "NavSatFix";
    GeoPoseStamped = "geographic_msgs" / "GeoPoseStamped";
}
