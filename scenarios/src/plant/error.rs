//! Why there is no plant, and which commands are none.

use bicycle::VehicleError;

use crate::DeviationError;

/// Why there is no plant.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum PlantError {
    /// No vehicle can be like this.
    #[error("vehicle: {0}")]
    Vehicle(#[from] VehicleError),
    /// No machine departs from it like this.
    #[error(transparent)]
    Deviation(#[from] DeviationError),
    /// A tyre that its own vehicle squeezes flat.
    #[error(
        "tyre.radial_stiffness_n_per_m: expected a static deflection below {most_m:.3} m (a third of the \
         radius), found {found_m:.3} m"
    )]
    FlatTyre {
        /// A third of the wheel's radius [m].
        most_m: f64,
        /// Deflection under a quarter of the weight [m].
        found_m: f64,
    },
    /// The start is no pose.
    #[error("start: expected finite x, y, yaw, found {0:?}")]
    NonFiniteStart([f64; 3]),
    /// A wheel would stand outside the world.
    #[error(
        "start: expected every wheel between ({:.1}, {:.1}) and ({:.1}, {:.1}) m, found one at ({:.1}, {:.1}) m",
        extent_m[0][0], extent_m[0][1], extent_m[1][0], extent_m[1][1], found_m[0], found_m[1]
    )]
    StartOutside {
        /// South-west and north-east end of the world's surface [m].
        extent_m: [[f64; 2]; 2],
        /// The wheel [m].
        found_m: [f64; 2],
    },
    /// This build has no MuJoCo.
    #[error(
        "this build has no plant in MuJoCo: build it by `scripts/mujoco cargo build --features mujoco`, which fetches \
         the library from the Python package index (docs/plant.md)"
    )]
    NoMujoco,
    /// MuJoCo simulates the machine as described only.
    #[error("the plant in MuJoCo: expected a machine without deviations, found {n_found}")]
    DeviationsInMujoco {
        /// How many there are.
        n_found: usize,
    },
    /// MuJoCo refuses the model.
    #[error("MuJoCo: {told}")]
    Mujoco {
        /// What it says.
        told: String,
    },
}

/// A command that is no number.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[error("command: expected finite speed and steering, found {speed_mps} m/s and {steering_rad} rad")]
pub struct CommandError {
    /// The speed given [m/s].
    pub speed_mps: f32,
    /// The steering angle given [rad].
    pub steering_rad: f32,
}
