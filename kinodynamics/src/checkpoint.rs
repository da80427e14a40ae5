//! A trained model as two files: weights in safetensors, and a sidecar that says what they mean.

use std::collections::BTreeMap;

use evidential::RadialFlow;
use safetensors::SafeTensors;
use safetensors::tensor::{Dtype, SafeTensorError, TensorView};
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};

use crate::architecture::{AXES, Architecture, LayerShape};
use crate::dense::Dense;
use crate::familiarity::{Fade, Familiarity, LAYERS, n_features};
use crate::recording::VehicleSummary;
use crate::{LabelConfig, Latency};

/// The version that this program writes and reads.
const FORMAT: u32 = 1;

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
    /// Names of the grounds that were driven on, as far as they were told.
    pub grounds: Vec<String>,
    /// Hash of the weights' file.
    pub weights_sha256: String,
}

/// Weights with their shape, row-major.
#[derive(Clone, Debug, PartialEq)]
pub struct Tensor {
    /// Lengths.
    pub shape: Vec<usize>,
    /// Values.
    pub values: Vec<f32>,
}

/// Weights and what they mean.
#[derive(Clone, Debug, PartialEq)]
pub struct Checkpoint {
    sidecar: Sidecar,
    tensors: BTreeMap<String, Tensor>,
}

/// Why there is no checkpoint.
#[derive(Debug, thiserror::Error)]
pub enum CheckpointError {
    /// The sidecar is not what it should be.
    #[error("sidecar: expected that of an inverse model, found: {0}")]
    Json(#[source] serde_json::Error),
    /// The weights are truncated or something else.
    #[error("weights: expected safetensors, found: {0}")]
    Container(#[from] SafeTensorError),
    /// Something does not fit.
    #[error("{what}: expected {expected}, found {found}")]
    Mismatch {
        /// What.
        what: String,
        /// What would do.
        expected: String,
        /// What is there.
        found: String,
    },
}

fn require<T: PartialEq + std::fmt::Debug>(
    what: &str,
    expected: &T,
    found: &T,
) -> Result<(), CheckpointError> {
    if expected == found {
        return Ok(());
    }
    Err(CheckpointError::Mismatch {
        what: what.to_owned(),
        expected: format!("{expected:?}"),
        found: format!("{found:?}"),
    })
}

impl Checkpoint {
    /// Weights with what they mean; hash and format of the sidecar are set.
    ///
    /// # Errors
    /// What [`Checkpoint::from_bytes`] refuses, but for the hash.
    pub fn new(sidecar: Sidecar, tensors: BTreeMap<String, Tensor>) -> Result<Self, CheckpointError> {
        let mut checkpoint = Self { sidecar: Sidecar { format: FORMAT, ..sidecar }, tensors };
        checkpoint.validate()?;
        checkpoint.sidecar.weights_sha256 = sha256(&checkpoint.weights_bytes()?);
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
        #[derive(Deserialize)]
        struct Version {
            format: u32,
        }
        let Version { format } = serde_json::from_slice(sidecar).map_err(CheckpointError::Json)?;
        require("format", &FORMAT, &format)?;
        let sidecar: Sidecar = serde_json::from_slice(sidecar).map_err(CheckpointError::Json)?;
        require("SHA-256 of the weights", &sidecar.weights_sha256, &sha256(weights))?;
        let mut tensors = BTreeMap::new();
        for (name, view) in SafeTensors::deserialize(weights)?.tensors() {
            require(&format!("type of {name}"), &Dtype::F32, &view.dtype())?;
            let values =
                view.data().as_chunks::<4>().0.iter().map(|&bytes| f32::from_le_bytes(bytes)).collect();
            tensors.insert(name, Tensor { shape: view.shape().to_vec(), values });
        }
        let checkpoint = Self { sidecar, tensors };
        checkpoint.validate()?;
        Ok(checkpoint)
    }

    /// The weights as safetensors; the same weights give the same bytes.
    ///
    /// # Errors
    /// A tensor whose shape contradicts its number of values.
    pub fn weights_bytes(&self) -> Result<Vec<u8>, CheckpointError> {
        let bytes = |tensor: &Tensor| tensor.values.iter().flat_map(|value| value.to_le_bytes()).collect();
        let data: Vec<Vec<u8>> = self.tensors.values().map(bytes).collect();
        let mut views = Vec::with_capacity(data.len());
        for ((name, tensor), data) in self.tensors.iter().zip(&data) {
            views.push((name.as_str(), TensorView::new(Dtype::F32, tensor.shape.clone(), data)?));
        }
        Ok(safetensors::serialize(views, None)?)
    }

    /// The sidecar as indented JSON.
    ///
    /// # Errors
    /// Numbers that JSON cannot hold.
    pub fn sidecar_bytes(&self) -> Result<Vec<u8>, CheckpointError> {
        let mut text = serde_json::to_vec_pretty(&self.sidecar).map_err(CheckpointError::Json)?;
        text.push(b'\n');
        Ok(text)
    }

    /// Refuses weights of another vehicle: steering angles mean other curvatures there.
    ///
    /// # Errors
    /// Name, wheelbase or steering differ.
    pub fn require_vehicle(&self, vehicle: &VehicleSummary) -> Result<(), CheckpointError> {
        require("vehicle of the inverse model", vehicle, &self.sidecar.vehicle)
    }

    fn validate(&self) -> Result<(), CheckpointError> {
        let mut expected = self.tensor_shapes();
        expected.sort();
        let names: Vec<&String> = expected.iter().map(|(name, _)| name).collect();
        require("names of the weights", &names, &self.tensors.keys().collect())?;
        for ((name, shape), tensor) in expected.iter().zip(self.tensors.values()) {
            require(&format!("shape of {name}"), shape, &tensor.shape)?;
            require(&format!("number of values of {name}"), &shape.iter().product(), &tensor.values.len())?;
            require(
                &format!("finite values of {name}"),
                &true,
                &tensor.values.iter().all(|v| v.is_finite()),
            )?;
        }
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

fn sha256(bytes: &[u8]) -> String {
    Sha256::digest(bytes).iter().map(|byte| format!("{byte:02x}")).collect()
}
