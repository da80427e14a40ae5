//! The ground as the vehicle knows it: grid geometry, the semantic elevation map fused from range
//! points, slope and roughness, wheel contact points and yaw-aligned footprints.
//!
//! Frames: map is x east, y north, z up; body is x forward, y left, z up, at the rear axle's centre.
//! SI units throughout.

mod grid;
mod observation;
mod surface;

pub use grid::{Cell, GridGeometry, GridMap};
pub use observation::{Pose, RangePoint, Scan, TerrainClass};
pub use surface::{Knowledge, SurfaceCell};
