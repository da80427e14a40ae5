//! The machine whose simulator is on trial: what is known of it before any drive.

use serde::{Deserialize, Serialize};

/// Standard deviations of the measurements' noise.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SensorNoise {
    /// Position east and north [m].
    pub position_m: f64,
    /// Yaw [rad].
    pub yaw_rad: f64,
    /// Forward velocity [m/s].
    pub speed_mps: f64,
    /// Yaw rate [rad/s].
    pub yaw_rate_radps: f64,
}

/// Heights and classes of the ground at nodes of a grid.
#[derive(Clone, Debug, PartialEq)]
pub struct GroundMap {
    /// Position of node (0, 0): east, north [m].
    pub origin_m: [f64; 2],
    /// Between nodes [m].
    pub resolution_m: f64,
    /// Number of nodes east and north.
    pub n_nodes: [usize; 2],
    /// Heights, north index fastest: node (i east, j north) at `i * n_nodes[1] + j` [m].
    pub height_m: Vec<f32>,
    /// Classes in the same order: 0 open, 1 loose, 2 vegetation.
    pub class: Vec<u8>,
}

/// A vehicle as its simulator's owner describes it.
#[derive(Clone, Debug, PartialEq)]
pub struct Machine {
    /// Name, for reports.
    pub name: String,
    /// Between the axles [m].
    pub wheelbase_m: f64,
    /// Largest steering angle that is ever commanded [rad].
    pub steering_max_rad: f64,
    /// Fastest speed that is ever commanded [m/s].
    pub speed_max_mps: f64,
    /// Noise of its measurements, where known.
    pub noise: Option<SensorNoise>,
    /// The ground that it drives on, where known.
    pub ground: Option<GroundMap>,
}
