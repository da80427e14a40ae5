//! A checkpoint made ready for the control computer: the arithmetic of the networks without autograd.
//!
//! Blocks of footprints go through all layers at once, one vector lane each, without leaving the first-level cache.
//! What a footprint gets does not depend on its neighbours in the block, so a map that is brought up to date in part
//! equals one that is made whole.

mod dense;
mod lanes;
mod network;
mod radial_flow;
mod tensors;
#[cfg(test)]
mod tests;

use bicycle::lanes::{BLOCK, Instructions};
use pulp::Simd;
use traversability::{N_BINS, Pmf};

pub(crate) use network::{BlockPrediction, Workspace};

use crate::{Architecture, Checkpoint, CheckpointError, Prior};
use network::Network;

/// Features beyond this count as this, which keeps every sum finite: no ground is a thousand wheel radii high.
pub(crate) const FEATURE_MAX: f32 = 1e3;

/// Bound on every number on the way through the networks: its square, times a few dozen, stays finite in f32.
const ACTIVATION_MAX: f64 = 1e15;

/// Why a checkpoint or its input cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum PredictorError {
    /// Sizes, arrays or standardisation do not fit together, or hold something that is no number.
    #[error(transparent)]
    Checkpoint(#[from] CheckpointError),
    /// Weights so large that sums could overflow.
    #[error("layer {layer}: expected weights that keep its outputs below {max:e}, found that they can reach {found:e}", max = ACTIVATION_MAX)]
    Magnitude {
        /// Name of the layer.
        layer: String,
        /// What the outputs can reach.
        found: f64,
    },
    /// A footprint with too many or too few features.
    #[error("footprint {footprint}: expected {expected} features, found {found}")]
    FootprintLength {
        /// Which footprint.
        footprint: usize,
        /// Features of the layout.
        expected: usize,
        /// Features of the footprint.
        found: usize,
    },
    /// A feature that is no number.
    #[error("footprint {footprint}, feature {feature}: expected a finite number, found {found}")]
    Feature {
        /// Which footprint.
        footprint: usize,
        /// Which feature.
        feature: usize,
        /// What stands there.
        found: f32,
    },
}

/// What the networks say of one footprint.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Prediction {
    /// Distributions of linear traction, angular traction, |roll|, |pitch|.
    pub pmfs: [Pmf; 4],
    /// What speaks for them; `None` for methods without a flow.
    pub evidence: Option<Evidence>,
}

/// How much of the training data was like a footprint.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Evidence {
    /// Logarithm of the flow's density of the latent.
    pub log_density: f32,
    /// Pseudo-count of observations per parameter: s n with n = N p(z) (PIETRA, equation 10).
    pub counts: [f32; 4],
}

impl Prediction {
    /// Share of the networks in the posterior of every parameter, against a prior of so much evidence (PIETRA, equation
    /// 11); all of it without a flow or without a prior.
    pub(crate) fn learned_share(&self, prior: Prior, prior_evidence: f32) -> [f32; 4] {
        match (&self.evidence, prior) {
            (Some(evidence), Prior::Physics | Prior::Uniform) => {
                evidence.counts.map(|count| count / (prior_evidence + count))
            }
            _ => [1.0; 4],
        }
    }
}

/// The networks of a checkpoint.
#[derive(Clone, Debug)]
pub struct Predictor {
    network: Network,
    n_features: usize,
    instructions: Instructions,
}

impl Predictor {
    /// Packs the networks of a checkpoint, to be run with these instructions.
    ///
    /// # Errors
    /// What [`Checkpoint::new`] refuses, and weights so large that sums could overflow.
    pub fn new(checkpoint: &Checkpoint, instructions: Instructions) -> Result<Self, PredictorError> {
        // The fields of a checkpoint are open, so it may have changed since it was made.
        Checkpoint::new(checkpoint.sidecar.clone(), checkpoint.tensors.clone())?;
        let network = Network::new(checkpoint)?;
        check_magnitude(checkpoint)?;
        Ok(Self { network, n_features: checkpoint.sidecar.layout.n_features(), instructions })
    }

    /// Number of features of a footprint.
    pub fn n_features(&self) -> usize {
        self.n_features
    }

    /// Predictions for footprints given by [`crate::FeatureLayout::features`], in their order.
    ///
    /// # Errors
    /// A footprint has another number of features or one that is not finite.
    pub fn predict(&self, footprints: &[impl AsRef<[f32]>]) -> Result<Vec<Prediction>, PredictorError> {
        let mut workspace = self.workspace();
        let mut predictions = Vec::with_capacity(footprints.len());
        for (index, block) in footprints.chunks(BLOCK).enumerate() {
            for (lane, features) in block.iter().enumerate() {
                self.load(features.as_ref(), lane, &mut workspace)
                    .map_err(|wrong| wrong.of_footprint(index * BLOCK + lane))?;
            }
            self.apply(&mut workspace);
            predictions.extend((0..block.len()).map(|lane| self.prediction(&workspace.prediction, lane)));
        }
        Ok(predictions)
    }

    /// Bytes of the packed weights.
    pub(crate) fn n_bytes(&self) -> usize {
        self.network.n_bytes()
    }

    /// Buffers for blocks.
    pub(crate) fn workspace(&self) -> Workspace {
        self.network.workspace(self.n_features)
    }

    /// Predicts a block.
    pub(crate) fn apply(&self, workspace: &mut Workspace) {
        self.instructions.run(Apply { network: &self.network, workspace });
    }

    fn load(&self, features: &[f32], lane: usize, workspace: &mut Workspace) -> Result<(), WrongFeatures> {
        if features.len() != self.n_features {
            return Err(WrongFeatures::Length { expected: self.n_features, found: features.len() });
        }
        for (feature, (value, lanes)) in features.iter().zip(&mut workspace.input).enumerate() {
            if !value.is_finite() {
                return Err(WrongFeatures::Value { feature, found: *value });
            }
            lanes.0[lane] = value.clamp(-FEATURE_MAX, FEATURE_MAX);
        }
        Ok(())
    }

    fn prediction(&self, block: &BlockPrediction, lane: usize) -> Prediction {
        let probabilities = |parameter: usize| -> [f32; N_BINS] {
            std::array::from_fn(|bin| block.probabilities[parameter][bin].0[lane])
        };
        let evidence = Evidence {
            log_density: block.log_density.0[lane],
            counts: std::array::from_fn(|parameter| block.evidence[parameter].0[lane]),
        };
        Prediction {
            pmfs: std::array::from_fn(|parameter| Pmf::normalised(probabilities(parameter))),
            evidence: self.network.is_evidential().then_some(evidence),
        }
    }
}

/// A block's way through the networks.
struct Apply<'a> {
    network: &'a Network,
    workspace: &'a mut Workspace,
}

impl pulp::WithSimd for Apply<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        self.network.apply(simd, self.workspace);
    }
}

/// What is wrong with the features of a footprint, wherever it stands.
enum WrongFeatures {
    Length { expected: usize, found: usize },
    Value { feature: usize, found: f32 },
}

impl WrongFeatures {
    fn of_footprint(self, footprint: usize) -> PredictorError {
        match self {
            Self::Length { expected, found } => {
                PredictorError::FootprintLength { footprint, expected, found }
            }
            Self::Value { feature, found } => PredictorError::Feature { footprint, feature, found },
        }
    }
}

/// Follows the largest possible output from layer to layer.
fn check_magnitude(checkpoint: &Checkpoint) -> Result<(), PredictorError> {
    let sidecar = &checkpoint.sidecar;
    let standardised = sidecar.standardisation.mean.iter().zip(&sidecar.standardisation.deviation);
    let largest = |(mean, deviation): (&f32, &f32)| {
        (f64::from(FEATURE_MAX) + f64::from(mean.abs())) / f64::from(*deviation)
    };
    let mut inputs: Vec<f64> = standardised.map(largest).collect();
    for k in 0..=sidecar.architecture.encoder_hidden.len() {
        inputs = vec![reached(checkpoint, &format!("encoder.{k}"), &inputs)?];
    }
    let mut branches: Vec<String> = (0..Architecture::N_HEADS).map(|head| format!("heads.{head}")).collect();
    if sidecar.method.is_evidential() {
        branches.push("evidence".to_owned());
    }
    for branch in branches {
        let hidden = reached(checkpoint, &format!("{branch}.0"), &inputs)?;
        reached(checkpoint, &format!("{branch}.1"), &[hidden])?;
    }
    let flow = checkpoint.tensors.iter().filter(|(name, _)| name.starts_with("flow."));
    let largest = flow.flat_map(|(_, tensor)| &tensor.values).fold(0f32, |most, value| most.max(value.abs()));
    bounded("flow", f64::from(largest)).map(drop)
}

/// Largest output that a layer can give for inputs of these magnitudes; one magnitude stands for all.
fn reached(checkpoint: &Checkpoint, layer: &str, inputs: &[f64]) -> Result<f64, PredictorError> {
    let values = |part: &str| checkpoint.tensors[&format!("{layer}.{part}")].values.as_slice();
    let (weights, biases) = (values("weight"), values("bias"));
    let sums = weights.chunks(weights.len() / biases.len()).zip(biases).map(|(weights, bias)| {
        let products = weights.iter().zip(inputs.iter().cycle());
        f64::from(bias.abs()) + products.map(|(weight, input)| f64::from(weight.abs()) * input).sum::<f64>()
    });
    bounded(layer, sums.fold(0.0, f64::max))
}

fn bounded(layer: &str, found: f64) -> Result<f64, PredictorError> {
    match found <= ACTIVATION_MAX {
        true => Ok(found),
        false => Err(PredictorError::Magnitude { layer: layer.to_owned(), found }),
    }
}
