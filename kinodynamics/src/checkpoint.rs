//! A trained model as two files: weights in safetensors, and a sidecar that says what they mean.

use std::collections::BTreeMap;

use evidential::RadialFlow;
use evidential::weights::{self, CheckpointError, Tensor, WeightsDigest, require};
use serde::{Deserialize, Serialize};

use crate::architecture::{AXES, Architecture, LayerShape};
use crate::dense::Dense;
use crate::familiarity::{Fade, Familiarity, LAYERS, n_features};
use crate::recording::VehicleSummary;
use crate::{LabelConfig, Latency, Teacher};

/// The version that this program writes and reads.
const FORMAT: u32 = 3;

/// What the unit's components are standardised by: angular rate x, y, z, then specific force x, y, z.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Standardisation {
    /// Means [rad/s, m/s2].
    pub mean: [f32; AXES],
    /// Standard deviations [rad/s, m/s2].
    pub deviation: [f32; AXES],
}

/// What weights mean.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Sidecar {
    /// Version of the layout of both files.
    pub format: u32,
    /// Revision of the program that trained.
    pub revision: String,
    /// The vehicle that taught.
    pub vehicle: VehicleSummary,
    /// Which networks.
    pub architecture: Architecture,
    /// What the unit's components are standardised by.
    pub standardisation: Standardisation,
    /// Where trust fades.
    pub fade: Fade,
    /// Latency that the drives showed.
    pub latency: Latency,
    /// How the examples were made.
    pub labels: LabelConfig,
    /// Who judged the answers.
    pub teacher: Teacher,
    /// Names of the grounds that were driven on, as far as they were told.
    pub grounds: Vec<String>,
    /// Hash of the weights' file.
    pub weights_sha256: String,
}

/// Weights and what they mean.
#[derive(Clone, Debug, PartialEq)]
pub struct Checkpoint {
    sidecar: Sidecar,
    tensors: BTreeMap<String, Tensor>,
}

impl Checkpoint {
    /// Weights with what they mean; hash and format of the sidecar are set.
    ///
    /// # Errors
    /// What [`Checkpoint::from_bytes`] refuses, but for the hash.
    pub fn new(sidecar: Sidecar, tensors: BTreeMap<String, Tensor>) -> Result<Self, CheckpointError> {
        let mut checkpoint = Self { sidecar: Sidecar { format: FORMAT, ..sidecar }, tensors };
        checkpoint.validate()?;
        checkpoint.sidecar.weights_sha256 = WeightsDigest::of(&checkpoint.weights_bytes()?).hexadecimal();
        Ok(checkpoint)
    }

    /// What the weights mean.
    pub fn sidecar(&self) -> &Sidecar {
        &self.sidecar
    }

    #[cfg(test)]
    pub(crate) fn tensors(&self) -> &BTreeMap<String, Tensor> {
        &self.tensors
    }

    /// A checkpoint from the bytes of its two files.
    ///
    /// # Errors
    /// Other bytes, another format or hash, weights that are missing, not finite or of another shape than the architecture's.
    pub fn from_bytes(weights: &[u8], sidecar: &[u8]) -> Result<Self, CheckpointError> {
        let sidecar: Sidecar = weights::read_sidecar(sidecar, FORMAT)?;
        let tensors = weights::from_bytes(weights, &sidecar.weights_sha256)?;
        let checkpoint = Self { sidecar, tensors };
        checkpoint.validate()?;
        Ok(checkpoint)
    }

    /// The weights as safetensors; the same weights give the same bytes.
    ///
    /// # Errors
    /// A tensor whose shape contradicts its number of values.
    pub fn weights_bytes(&self) -> Result<Vec<u8>, CheckpointError> {
        weights::to_bytes(&self.tensors)
    }

    /// The sidecar as indented JSON.
    ///
    /// # Errors
    /// Numbers that JSON cannot hold.
    pub fn sidecar_bytes(&self) -> Result<Vec<u8>, CheckpointError> {
        weights::sidecar_bytes(&self.sidecar)
    }

    /// Refuses weights of another vehicle: steering angles mean other curvatures there.
    ///
    /// # Errors
    /// Name, wheelbase or steering differ.
    pub fn require_vehicle(&self, vehicle: &VehicleSummary) -> Result<(), CheckpointError> {
        require("vehicle of the inverse model", vehicle, &self.sidecar.vehicle)
    }

    fn validate(&self) -> Result<(), CheckpointError> {
        weights::check(self.tensor_shapes(), &self.tensors)?;
        let Standardisation { mean, deviation } = self.sidecar.standardisation;
        let is_sound = mean.iter().all(|mean| mean.is_finite())
            && deviation.iter().all(|deviation| deviation.is_finite() && *deviation > 0.0);
        require("standardisation with finite means and deviations > 0", &true, &is_sound)?;
        let Fade { none, whole } = self.sidecar.fade;
        require("fade with none below whole", &true, &(none.is_finite() && whole.is_finite() && none < whole))
    }

    fn tensor_shapes(&self) -> Vec<(String, Vec<usize>)> {
        let architecture = self.sidecar.architecture;
        let n = n_features(architecture.senses());
        let mut shapes: Vec<(String, Vec<usize>)> = Vec::new();
        for LayerShape { name, n_inputs, n_outputs, .. } in
            architecture.encoder().into_iter().chain(architecture.command())
        {
            shapes.push((format!("{name}.bias"), vec![n_outputs]));
            shapes.push((format!("{name}.weight"), vec![n_outputs, n_inputs]));
        }
        let flow = [
            ("flow.centre", vec![LAYERS, n]),
            ("flow.shape", vec![2, LAYERS]),
            ("flow.mean", vec![n]),
            ("flow.deviation", vec![n]),
        ];
        shapes.extend(flow.map(|(name, shape)| (name.to_owned(), shape)));
        shapes
    }

    fn values(&self, name: &str) -> Result<&[f32], CheckpointError> {
        match self.tensors.get(name) {
            Some(tensor) => Ok(&tensor.values),
            None => Err(CheckpointError::Mismatch {
                what: name.to_owned(),
                expected: "weights of that name".to_owned(),
                found: "none".to_owned(),
            }),
        }
    }

    pub(crate) fn layer(&self, shape: &LayerShape) -> Result<Dense, CheckpointError> {
        let (weights, biases) =
            (self.values(&format!("{}.weight", shape.name))?, self.values(&format!("{}.bias", shape.name))?);
        Ok(Dense::new(weights, biases, shape.activation))
    }

    pub(crate) fn familiarity(&self) -> Result<Familiarity, CheckpointError> {
        let (alpha, beta) = self.values("flow.shape")?.split_at(LAYERS);
        let flow = RadialFlow::new(self.values("flow.centre")?, alpha, beta);
        let (means, deviations) =
            (self.values("flow.mean")?.to_vec(), self.values("flow.deviation")?.to_vec());
        Ok(Familiarity::new(means, deviations, flow, self.sidecar.fade))
    }
}
