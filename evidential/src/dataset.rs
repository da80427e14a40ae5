//! Footprints and what was measured on them.

use serde::{Deserialize, Serialize};
use traversability::N_BINS;

use crate::FeatureLayout;

/// One footprint and what was measured there.
#[derive(Clone, Debug, PartialEq)]
pub struct Example {
    /// [`FeatureLayout::features`] of the footprint.
    pub features: Vec<f32>,
    /// Linear traction, angular traction, |roll| [rad], |pitch| [rad]; NaN where the measurement means nothing.
    pub measured: [f32; 4],
    /// The physics prior's distributions of the four parameters, bins ascending.
    pub prior: [[f32; N_BINS]; 4],
    /// Standard deviation of elevation under the footprint [m], PIETRA's measure of how uneven the ground is.
    pub unevenness_m: f32,
    /// Which drive it belongs to: neighbours in time must not be split between training and validation.
    pub drive: u32,
    /// Pose: x [m], y [m], yaw [rad].
    pub pose: [f64; 3],
}

/// What every example of a dataset has in common.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct DatasetOrigin {
    /// Name of the vehicle that drove.
    pub vehicle: String,
    /// How footprints became features.
    pub layout: FeatureLayout,
    /// Parameters of the physics prior that the examples hold.
    pub prior: physics_prior::PriorConfig,
    /// Name of each drive, by [`Example::drive`].
    pub drives: Vec<String>,
    /// How the data came to be, for people.
    pub provenance: String,
}

/// Examples of one vehicle, all alike in layout and finite but for measurements that mean nothing.
#[derive(Clone, Debug, PartialEq)]
pub struct Dataset {
    /// What all have in common.
    pub origin: DatasetOrigin,
    /// The examples, drive by drive in time order.
    pub examples: Vec<Example>,
}
