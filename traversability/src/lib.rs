//! The shared vocabulary of traversability: traction and attitude, their bins and distributions, exact CVaR,
//! and the risk map that the controller drives on. A part of [Surefoot](../cli/index.html).
//!
//! The four traversability parameters (PIETRA, equations 2 and 6) are linear traction, angular traction, |roll|
//! and |pitch|. Low traction is bad, a large angle is bad: their risk is the left-tail CVaR of the one kind and
//! the right-tail CVaR of the other, at one [`CvarLevel`].
//!
//! Beliefs are [`Pmf`]s over [`Bins`]; a [`RiskMap`] holds the [`Risk`] of every cell and heading and the [`Ground`] of
//! every cell; whoever drives reads a [`RiskMapView`]. `examples/own_risk_map.rs` makes a map of one's own.
//!
//! ```
//! use traversability::{Bins, CvarLevel, GridGeometry, Pmf, Risk, RiskMap};
//!
//! // Traction is 0.45 or 0.95, equally likely: the worst half is 0.45.
//! let mut probabilities = [0.0; 12];
//! (probabilities[5], probabilities[10]) = (0.5, 0.5);
//! let traction = Pmf::new(probabilities)?;
//! let worst = traction.lower_tail_cvar(&Bins::TRACTION, CvarLevel::new(0.5)?);
//! assert!((worst - 0.45).abs() < 1e-6);
//!
//! // 10 x 10 m around the origin in cells of 0.1 m, 16 headings.
//! let geometry = GridGeometry::centred(0.1, 100, 100, 0.0, 0.0);
//! let map = RiskMap::constant(geometry, 16, Risk { linear_traction: worst, ..Risk::NONE });
//! assert_eq!(map.view().risk_at(1.0, -2.0, 0.3).linear_traction, worst);
//! assert_eq!(map.view().risk_at(7.0, 0.0, 0.0), Risk::OUTSIDE);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod bins;
mod cvar;
mod encounter;
mod parameters;
mod partial_moments;
mod pmf;
mod quad;
mod risk_map;
mod speed_limit;

pub use bins::{Bins, N_BINS};
pub use cvar::{CvarLevel, CvarLevelError, lower_tail_cvar, upper_tail_cvar};
pub use encounter::{Encounter, Foretold, GroundShown};
pub use parameters::{Attitude, Traction, Traversability};
pub use partial_moments::PartialMoments;
pub use pmf::{Pmf, PmfError};
pub use quad::PmfQuad;
pub use risk_map::{
    FrictionLimit, Ground, GroundFlags, Risk, RiskMap, RiskMapError, RiskMapParts, RiskMapView,
};
pub use speed_limit::{SpeedLaw, SpeedLimit};
pub use terrain::{Cell, GridGeometry, TerrainClass};
