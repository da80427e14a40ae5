//! Checkpoints of random weights.

use bicycle::Geometry;
use evidential::{
    Architecture, Checkpoint, CheckpointError, DensityRange, FeatureLayout, Method, Sidecar, Standardisation,
    Tensor,
};
use physics_prior::PriorConfig;
use rand::{RngExt, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;
use serde::Serialize;
use traversability::Bins;

/// Widths and numbers of layers; see [`Architecture`].
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Sizes {
    /// Widths of the encoder's hidden layers.
    pub encoder_hidden: Vec<usize>,
    /// Width of the latent.
    pub n_latent: usize,
    /// Width of the hidden layer of every head.
    pub head_hidden: usize,
    /// Width of the evidence head's hidden layer.
    pub evidence_hidden: usize,
    /// Layers of the radial flow.
    pub n_flow_layers: usize,
}

impl Default for Sizes {
    /// About 25 thousand multiplications and additions for the features of a footprint.
    fn default() -> Self {
        Self {
            encoder_hidden: vec![96, 64],
            n_latent: 16,
            head_hidden: 32,
            evidence_hidden: 16,
            n_flow_layers: 8,
        }
    }
}

/// A checkpoint of PIETRA's for a vehicle, of random weights that keep the spread of the features about as it is.
///
/// # Errors
/// A width is zero or another size makes no sense.
pub fn untrained(
    geometry: &Geometry,
    vehicle: &str,
    sizes: &Sizes,
    seed: u64,
) -> Result<Checkpoint, CheckpointError> {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
    let layout = FeatureLayout::for_vehicle(geometry);
    let n_inputs = layout.n_features();
    let architecture = Architecture {
        n_inputs,
        encoder_hidden: sizes.encoder_hidden.clone(),
        n_latent: sizes.n_latent,
        head_hidden: sizes.head_hidden,
        evidence_hidden: sizes.evidence_hidden,
        n_flow_layers: sizes.n_flow_layers,
    };
    let mut random = |(name, shape): (String, Vec<usize>)| {
        let reach = (3.0 / shape.last().copied().unwrap_or(1).max(1) as f32).sqrt();
        let values = (0..shape.iter().product()).map(|_| rng.random_range(-reach..reach)).collect();
        (name, Tensor { shape, values })
    };
    let tensors = architecture.tensor_shapes().into_iter().map(&mut random).collect();
    let density = DensityRange { min: -20.0, max: 0.0, log_budget: architecture.log_budget() };
    let sidecar = Sidecar {
        format: Sidecar::FORMAT,
        method: Method::Pietra,
        vehicle: vehicle.to_owned(),
        architecture,
        layout,
        standardisation: Standardisation { mean: vec![0.0; n_inputs], deviation: vec![1.0; n_inputs] },
        traction_bins: Bins::TRACTION.values().to_vec(),
        attitude_bins_rad: Bins::ATTITUDE.values().to_vec(),
        prior: PriorConfig::for_vehicle(geometry),
        density: Some(density),
        training: Default::default(),
        git_revision: "untrained".to_owned(),
        weights_sha256: String::new(),
    };
    Checkpoint::new(sidecar, tensors)
}
