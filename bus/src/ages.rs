//! How often the parts of a run speak, and how long what they said counts.
//!
//! All processes of a run are given the same [`Periods`] and [`AgeLimits`]; nothing else in this crate knows how long is
//! too long.

use serde::{Deserialize, Serialize};

/// Time between two messages, part by part.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Periods {
    /// Between two decisions [s].
    pub control_s: f64,
    /// Between two odometry messages [s].
    pub odometry_s: f64,
    /// Between two scans, and so between two maps [s].
    pub scan_s: f64,
    /// Between two repetitions of the mission [s].
    pub mission_s: f64,
}

impl Default for Periods {
    fn default() -> Self {
        Self { control_s: 0.1, odometry_s: 0.02, scan_s: 0.2, mission_s: 1.0 }
    }
}

/// How old what is driven on may be [ns]. Every age counts from when something was true, not from when it was sent.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct AgeLimits {
    /// Odometry of a command that the vehicle follows.
    pub command_ns: u64,
    /// Scan of a command that the vehicle follows.
    pub scan_ns: u64,
    /// Scan of a learned map from which on physics' younger map is preferred.
    pub learned_ns: u64,
    /// Silence of learning after which physics speaks.
    pub learning_silence_ns: u64,
    /// Mission that has not been repeated.
    pub mission_ns: u64,
    /// Order of somebody who directs the vehicle.
    pub order_ns: u64,
}
