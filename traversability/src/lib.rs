//! The shared vocabulary of traversability: traction and attitude, their bins and distributions, exact CVaR,
//! and the risk map that the controller drives on.

mod risk_map;

pub use risk_map::{Ground, GroundFlags, Risk, RiskMap, RiskMapView};
pub use terrain::{Cell, GridGeometry, TerrainClass};
