//! What things cost on this machine, and the tables that are published: one update of the controller ([`control`]), a
//! risk map of the physics prior ([`prior_map`]) and of what was learned ([`learned_map`]), how both grow ([`scaling`]), learning ([`learning`],
//! [`traction_map`]), navigation ([`navigation`]), the hall ([`arena`]), risk tolerance ([`risk`]), inverse kinodynamics ([`mod@kinodynamics`]), diagnoses ([`gap_score`], [`gap_closed_loop`], [`ground_cases`]), friction ([`mod@friction`]) and what it brings the planner ([`slippery`]), routes ([`mod@route`]) and the plant itself
//! ([`plant`]). A part of [Surefoot](../cli/index.html).
//!
//! All of it goes through the interfaces that a drive uses. [`closed_loop`] puts plant and planner together;
//! `examples/drive_own_world.rs` drives in a world and with a vehicle of one's own.

pub mod arena;
pub mod closed_loop;
pub mod collection;
pub mod control;
pub mod crossings;
mod error;
pub mod friction;
pub mod gap_closed_loop;
pub mod gap_score;
pub mod ground_cases;
pub mod ground_drives;
pub mod ground_score;
pub mod kinodynamics;
pub mod learned_map;
pub mod learning;
pub mod navigation;
pub mod plant;
pub mod prior_map;
pub mod risk;
pub mod route;
pub mod scaling;
pub mod slippery;
mod spread;
pub mod statistics;
mod stopwatch;
pub mod sweep;
pub mod traction_map;
mod verdict;

pub use error::BenchError;
pub use spread::Spread;
pub use verdict::Verdict;
