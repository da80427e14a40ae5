//! Trained networks and everything that must fit for them to mean anything.

mod file;

use std::collections::BTreeMap;

use physics_prior::PriorConfig;
use serde::{Deserialize, Serialize};

use crate::weights::Tensor;
use crate::{Architecture, FeatureLayout, Method, Standardisation};

/// Logarithms of the flow's density over the training data, for normalising and for judging what is unlike it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct DensityRange {
    /// Smallest; what lies below is out of distribution.
    pub min: f64,
    /// Largest.
    pub max: f64,
    /// Logarithm of the certainty budget N of equation 10. Training uses that of a normal distribution
    /// ([`Architecture::log_budget`]); afterwards it is set so that evidence equals the prior's at the least likely
    /// [`DensityRange::EDGE_SHARE`] of the validation footprints: one scale for every method, seed and dataset.
    pub log_budget: f64,
}

impl DensityRange {
    /// Share of the validation footprints, all in distribution, that shall weigh less than the prior.
    pub const EDGE_SHARE: f64 = 0.005;

    /// EVORA's normalised density: 0 at the least likely training footprint, 1 at the likeliest.
    pub fn normalised(&self, log_density: f64) -> f64 {
        (log_density - self.min) / (self.max - self.min)
    }
}

/// What a checkpoint says of itself beside its weights, written as JSON.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Sidecar {
    /// Version of this layout.
    pub format: u32,
    /// How it was trained.
    pub method: Method,
    /// Name of the vehicle that drove.
    pub vehicle: String,
    /// Sizes of the networks.
    pub architecture: Architecture,
    /// How footprints become features.
    pub layout: FeatureLayout,
    /// How features become inputs.
    pub standardisation: Standardisation,
    /// Values of the traction bins.
    pub traction_bins: Vec<f32>,
    /// Values of the attitude bins [rad].
    pub attitude_bins_rad: Vec<f32>,
    /// The physics prior of training; its evidence is what learned evidence is weighed against.
    pub prior: PriorConfig,
    /// Log densities of the training data; `None` without a flow.
    pub density: Option<DensityRange>,
    /// Settings of the training run, for people and for repeating it.
    pub training: serde_json::Value,
    /// Revision of the program that trained it.
    pub git_revision: String,
    /// SHA-256 of the file of weights, hexadecimal.
    pub weights_sha256: String,
}

/// Trained networks.
#[derive(Clone, Debug, PartialEq)]
pub struct Checkpoint {
    /// What the weights mean.
    pub sidecar: Sidecar,
    /// The weights by the names of [`Architecture`].
    pub tensors: BTreeMap<String, Tensor>,
}

impl Sidecar {
    /// The version that this program writes and reads.
    pub const FORMAT: u32 = 1;
}
