//! A route over kilometres that knows how slippery the ground is, and how fast to drive it; a part of
//! [Surefoot](../cli/index.html).
//!
//! The planner of AnyNav (Fu et al. 2025, section 4). A map of [`GroundCell`]s, each a height, a [`FrictionCurve`], a
//! roughness and whether an obstacle stands there, makes a [`Planner`]. [`Planner::route`] searches the cheapest way by
//! A* over cells, eight headings and the last motion (costs of equations 37 to 42), lays the least bent B-spline near it,
//! and finds the fastest speeds that friction, traction, brakes and roughness allow (equations 43 to 51, in two sweeps);
//! [`Planner::alternatives`] finds other ways. A [`RouteError`] says what blocks the way, and where.
//!
//! Where the paper leaves something open: the costs per step are multiplied with its length, so that a diagonal metre
//! costs what a straight one does; slopes count whether up or down; ground too slippery for its slope, steeper than the
//! vehicle may lean, or nearer to an obstacle than half the clear width is not driven on at all.
//!
//! [`TileMap`] keeps a map that outgrows memory in files, and merges what several robots and sources
//! measured, what a vehicle's rolling window saw among it ([`MapKeeper`]); [`far_route`] searches it.
//! [`GroundLayers`] makes the map of measured elevation.
//!
//! A [`Guide`] follows a vehicle along a route and tells what to head for.
//!
//! `examples/around_ice.rs` goes around a frozen pond.
//!
//! Frames: map, x east, y north, z up. SI units.
//!
//! ```
//! use route::{FrictionCurve, GroundCell, Planner, RouteConfig, SpeedLimits};
//! use terrain::{GridGeometry, GridMap};
//!
//! let geometry = GridGeometry { resolution_m: 1.0, origin: [0, 0], n_rows: 40, n_cols: 60 };
//! let ground = GridMap::filled(geometry, GroundCell::level(FrictionCurve::GRASS));
//! let planner = Planner::new(ground, RouteConfig::default())?;
//! let route = planner.route(([5.5, 20.5], 0.0), [50.5, 20.5], &SpeedLimits::default())?;
//! assert_eq!(route.cells.len(), 46);
//! assert!(route.line.duration_s > 45.0 / 5.0);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod along;
mod alternatives;
mod config;
mod edges;
mod far;
mod friction;
mod ground;
mod guide;
mod layers;
mod line;
mod planner;
mod programme;
mod search;
mod smooth;
mod speed;
mod tiles;

pub use along::LaidLine;
pub use config::RouteConfig;
pub use edges::Barrier;
pub use far::{FarRoute, FarRouteError, far_route};
pub use friction::FrictionCurve;
pub use ground::{GroundCell, GroundError};
pub use guide::Guide;
pub use layers::GroundLayers;
pub use line::{RouteLine, RoutePoint};
pub use planner::{Planner, PlannerError, Route, RouteError};
pub use speed::{Bend, SpeedError, SpeedLimits, duration_s, fastest_speeds};
pub use tiles::{
    ClassFriction, LEVEL_MAX, MapKeeper, MeasuredCell, MergeReport, TILE_EDGE, TileError, TileMap,
};
