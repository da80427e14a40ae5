//! The ground as the vehicle knows it; a part of [Surefoot](../cli/index.html).
//!
//! # The flow
//!
//! A [`Scan`] (points with classes, body frame) and the [`Pose`] it was taken at go into
//! [`ElevationMap::fuse`]:
//!
//! 1. The window rolls by whole cells until the vehicle is in its middle; what was seen grows uncertain with
//!    the time that passed.
//! 2. The points are turned into the map frame and sorted by cell. Those that are no numbers, lie on the
//!    vehicle itself or outside the window are dropped and counted.
//! 3. The ray to the lowest point of each cell tells of the cells it passes: nothing there reaches above it.
//!    Heights that two scans contradict are forgotten, obstacles wear off, unseen cells get a ceiling.
//! 4. Each cell that was hit takes in its points: classes are counted, rigid points are fused into the ground's
//!    height and variance, plants give a top, faces too high for a cell count as obstacles, branches high
//!    above the ground count for nothing.
//! 5. The surface is drawn. Ground that was hit is [`Knowledge::Measured`]. Ground below plants and obstacles is
//!    inferred from the ground around them, deep in a stand from its plants, which are taken to be as tall as those
//!    between which ground was seen, and small gaps are filled when something was seen in all four
//!    quadrants around and no ray passed below the height they would get; both are
//!    [`Knowledge::Interpolated`], with the variance of the inference. All else stays [`Knowledge::Unknown`]: what
//!    lies behind an edge is a hole until it is seen.
//!
//! Consumers read [`ElevationMap::surface`] and ask [`ElevationMap::take_changed`] for the rectangle of cells
//! that changed. From a surface they get [`slope_at`] and [`update_slopes`] (gradient and roughness),
//! [`height_at`], [`wheel_heights_m`], [`envelope_height`] and [`PatchShape::sample`] (ground under a vehicle),
//! [`footprint_unevenness`], and, for loops over many poses, [`YawFootprint`].
//!
//! [`ElevationMap::assume_ground`] seeds the ground below a vehicle that has seen nothing yet, and
//! [`ElevationMap::reanchor`] moves the map with a correction of the localisation.
//!
//! A map that comes from elsewhere is a [`GridMap`] of [`SurfaceCell`]s; `examples/own_map.rs` makes one.
//!
//! # Frames and units
//!
//! Map: x east, y north, z up. Body: x forward, y left, z up, at the rear axle's centre. SI units throughout.
//! Cells lie on a lattice fixed to the map's origin ([`GridGeometry`]), so a rolling window never resamples.
//!
//! ```
//! use terrain::{ElevationConfig, ElevationMap, Pose, RangePoint, Scan, TerrainClass};
//!
//! let mut map = ElevationMap::new(ElevationConfig::default())?;
//! let point = RangePoint { position_m: [4.1, 0.1, -0.3], class: TerrainClass::Open };
//! let scan = Scan { valid_at_ns: 0, origin_m: [1.0, 0.0, 1.2], points: vec![point] };
//! let report = map.fuse(&scan, &Pose { z_m: 0.4, ..Pose::default() })?;
//! assert_eq!(report.n_rejected_non_finite, 0);
//! let seen = map.surface().at(4.1, 0.1).expect("inside the window");
//! assert!((seen.height_m - 0.1).abs() < 1e-6);
//! assert!(!map.surface().at(8.0, 0.1).expect("inside the window").is_known());
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod body;
mod elevation;
mod footprint;
mod grid;
mod ground_filter;
mod mount;
mod observation;
mod plane;
mod region;
mod sampling;
mod setting;
mod slope;
mod surface;

pub use body::BodyBox;
pub use elevation::{AssumedGround, ElevationConfig, ElevationMap, FuseError, FuseReport};
pub use footprint::{Footprint, WheelLayout, YawFootprint};
pub use grid::{Cell, DistantPosition, GridGeometry, GridMap, LATTICE_MAX};
pub use ground_filter::{FilteredGround, GroundFilter, filter_ground, height_step_m};
pub use mount::Mount;
pub use observation::{Pose, RangePoint, Scan, TerrainClass};
pub use region::CellRegion;
pub use sampling::{PatchSample, PatchShape, bilinear_height, envelope_height, height_at, wheel_heights_m};
pub use setting::SettingError;
pub use slope::{Height, Slope, footprint_unevenness, slope_at, update_slopes};
pub use surface::{Knowledge, SurfaceCell};
