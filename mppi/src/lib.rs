//! See Cargo.toml.

mod cost_to_go;

pub use cost_to_go::{CostToGo, CostToGoConfig, CostToGoError, CostToGoView, Neighbourhood};
