//! What the two costly parts of a control cycle cost on this machine: one update of the controller, and the risk map
//! of the physics prior. Both are measured through the interface that a drive uses.

pub mod closed_loop;
pub mod collection;
pub mod control;
mod error;
pub mod gap_closed_loop;
pub mod gap_score;
pub mod learned_map;
pub mod learning;
pub mod navigation;
pub mod prior_map;
mod spread;
mod stopwatch;
pub mod traction_map;
mod turns;

pub use error::BenchError;
pub use spread::Spread;
