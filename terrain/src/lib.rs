//! The ground as the vehicle knows it: grid geometry, the semantic elevation map fused from range
//! points, slope and roughness, wheel contact points and yaw-aligned footprints.
//!
//! Frames: map is x east, y north, z up; body is x forward, y left, z up, at the rear axle's centre.
//! SI units throughout.

mod elevation;
mod footprint;
mod grid;
mod observation;
mod plane;
mod region;
mod sampling;
mod slope;
mod surface;

pub use elevation::{
    AssumedGround, ElevationConfig, ElevationConfigError, ElevationMap, FuseError, FuseReport,
};
pub use footprint::{Footprint, WheelLayout, YawFootprint};
pub use grid::{Cell, GridGeometry, GridMap};
pub use observation::{Pose, RangePoint, Scan, TerrainClass};
pub use region::CellRegion;
pub use sampling::{PatchSample, PatchShape, bilinear_height, envelope_height, height_at, wheel_heights_m};
pub use slope::{Height, Slope, footprint_unevenness, slope_at, update_slopes};
pub use surface::{Knowledge, SurfaceCell};
