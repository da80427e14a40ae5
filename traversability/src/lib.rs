//! The shared vocabulary of traversability: traction and attitude, their bins and distributions, exact CVaR,
//! and the risk map that the controller drives on.
//!
//! The four traversability parameters (PIETRA, equations 2 and 6) are linear traction, angular traction, |roll|
//! and |pitch|. Low traction is bad, a large angle is bad: their risk is the left-tail CVaR of the one kind and
//! the right-tail CVaR of the other, at one [`CvarLevel`].

mod bins;
mod cvar;
mod parameters;
mod partial_moments;
mod pmf;
mod quad;
mod risk_map;

pub use bins::{Bins, N_BINS};
pub use cvar::{CvarLevel, CvarLevelError, lower_tail_cvar, upper_tail_cvar};
pub use parameters::{Attitude, Traction, Traversability};
pub use partial_moments::PartialMoments;
pub use pmf::{Pmf, PmfError};
pub use quad::PmfQuad;
pub use risk_map::{Ground, GroundFlags, Risk, RiskMap, RiskMapView};
pub use terrain::{Cell, GridGeometry, TerrainClass};
