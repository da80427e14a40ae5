//! The pipeline as one pure object: observation to map to risk map to decision. No clock, no file, no process.
//!
//! [`Navigator::observe`] takes in what was measured and keeps the maps; [`Navigator::decide`] asks the controller.
//! They are apart because a robot maps and controls at different rates; a closed loop calls one after the other.

mod author;
mod config;
mod guard;
mod navigator;
mod risk;

pub use config::{Config, RiskMapConfig};
pub use guard::{Guard, GuardConfig, Jump};
pub use navigator::{Navigator, NavigatorError, Setup, Surface};
pub use risk::{Belief, RiskOracle};
