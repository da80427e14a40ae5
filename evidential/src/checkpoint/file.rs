//! Checkpoints as bytes: safetensors and their sidecar in JSON.

use std::collections::BTreeMap;

use safetensors::tensor::{Dtype, SafeTensorError, SafeTensors, TensorView};
use serde::Deserialize;
use sha2::{Digest, Sha256};
use traversability::Bins;

use super::{Checkpoint, Sidecar, Tensor};
use crate::FeatureLayout;

/// Why bytes are no checkpoint, or one that does not fit.
#[derive(Debug, thiserror::Error)]
pub enum CheckpointError {
    /// The sidecar is no JSON of a sidecar.
    #[error("sidecar: expected JSON of format {format}, found: {0}", format = Sidecar::FORMAT)]
    Json(serde_json::Error),
    /// The sidecar cannot be written.
    #[error("sidecar: expected values that JSON can hold: {0}")]
    Unwritable(serde_json::Error),
    /// The weights are no safetensors.
    #[error("weights: expected safetensors, found: {0}")]
    Safetensors(#[from] SafeTensorError),
    /// The two do not belong together, or to this program, vehicle or layout.
    #[error("{what}: expected {expected}, found {found}")]
    Mismatch {
        /// What differs.
        what: String,
        /// What would fit.
        expected: String,
        /// What is there.
        found: String,
    },
    /// A weight that is no number.
    #[error("{tensor}, value {index}: expected a finite number, found {found}")]
    NonFinite {
        /// Name of the array.
        tensor: String,
        /// Which of its values, from 0.
        index: usize,
        /// The value.
        found: f32,
    },
}

/// Refuses unless both are the same.
fn require<T: PartialEq + std::fmt::Debug>(
    what: &str,
    expected: &T,
    found: &T,
) -> Result<(), CheckpointError> {
    if expected == found {
        return Ok(());
    }
    let (expected, found) = (format!("{expected:?}"), format!("{found:?}"));
    Err(CheckpointError::Mismatch { what: what.to_owned(), expected, found })
}

fn require_positive(what: &str, values: &[f32]) -> Result<(), CheckpointError> {
    match values.iter().find(|value| !(value.is_finite() && **value > 0.0)) {
        Some(found) => Err(CheckpointError::Mismatch {
            what: what.to_owned(),
            expected: "finite numbers > 0".to_owned(),
            found: found.to_string(),
        }),
        None => Ok(()),
    }
}

impl Sidecar {
    /// Reads the version first: what else stands in one of another version means something else, if anything.
    fn read(json: &[u8]) -> Result<Self, CheckpointError> {
        #[derive(Deserialize)]
        struct Version {
            format: u32,
        }
        let Version { format } = serde_json::from_slice(json).map_err(CheckpointError::Json)?;
        require("format", &Self::FORMAT, &format)?;
        serde_json::from_slice(json).map_err(CheckpointError::Json)
    }

    /// Refuses what this program cannot use: another format or bins, lengths that contradict one another, numbers out
    /// of range.
    fn validate(&self) -> Result<(), CheckpointError> {
        require("format", &Self::FORMAT, &self.format)?;
        require("traction_bins", &Bins::TRACTION.values().to_vec(), &self.traction_bins)?;
        require("attitude_bins_rad", &Bins::ATTITUDE.values().to_vec(), &self.attitude_bins_rad)?;
        if let Some((name, expected, found)) = self.layout.first_huge_patch() {
            return Err(CheckpointError::Mismatch { what: format!("layout, {name} patch"), expected, found });
        }
        require_positive("layout, height_scale_m", &[self.layout.height_scale_m as f32])?;
        let n_features = self.layout.n_features();
        require("architecture, n_inputs", &n_features, &self.architecture.n_inputs)?;
        require("standardisation, number of means", &n_features, &self.standardisation.mean.len())?;
        require("standardisation, number of deviations", &n_features, &self.standardisation.deviation.len())?;
        require_positive("standardisation, deviation", &self.standardisation.deviation)?;
        let finite = self.standardisation.mean.iter().all(|mean| mean.is_finite());
        require("standardisation, all means finite", &true, &finite)?;
        let is_evidential = self.method.is_evidential();
        let name = self.method.name();
        require(&format!("flow of method {name}"), &is_evidential, &(self.architecture.n_flow_layers > 0))?;
        require(&format!("density of method {name}"), &is_evidential, &self.density.is_some())?;
        self.prior.validate().map_err(|error| CheckpointError::Mismatch {
            what: format!("prior, {}", error.field),
            expected: error.expected.to_owned(),
            found: error.found.to_string(),
        })
    }
}

impl Checkpoint {
    /// Weights with what they mean; the sidecar's hash is set to theirs.
    ///
    /// # Errors
    /// What [`Checkpoint::from_bytes`] refuses, but for the hash.
    pub fn new(sidecar: Sidecar, tensors: BTreeMap<String, Tensor>) -> Result<Self, CheckpointError> {
        sidecar.validate()?;
        check_tensors(&sidecar, &tensors)?;
        let mut checkpoint = Self { sidecar, tensors };
        checkpoint.sidecar.weights_sha256 = sha256(&checkpoint.weights_bytes()?);
        Ok(checkpoint)
    }

    /// The weights as safetensors. The same weights give the same bytes.
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
        let mut text = serde_json::to_vec_pretty(&self.sidecar).map_err(CheckpointError::Unwritable)?;
        text.push(b'\n');
        Ok(text)
    }

    /// A checkpoint from the bytes of its two files.
    ///
    /// # Errors
    /// Truncated or other bytes, another format, weights of another hash than the sidecar's, other bins, shapes or
    /// lengths than the sidecar's architecture and layout demand, numbers that are not finite.
    pub fn from_bytes(weights: &[u8], sidecar: &[u8]) -> Result<Self, CheckpointError> {
        let sidecar = Sidecar::read(sidecar)?;
        sidecar.validate()?;
        require("SHA-256 of the weights", &sidecar.weights_sha256, &sha256(weights))?;
        let mut tensors = BTreeMap::new();
        for (name, view) in SafeTensors::deserialize(weights)?.tensors() {
            require(&format!("type of {name}"), &Dtype::F32, &view.dtype())?;
            let values =
                view.data().as_chunks::<4>().0.iter().map(|&bytes| f32::from_le_bytes(bytes)).collect();
            tensors.insert(name, Tensor { shape: view.shape().to_vec(), values });
        }
        check_tensors(&sidecar, &tensors)?;
        Ok(Self { sidecar, tensors })
    }

    /// Refuses weights of another vehicle.
    pub fn require_vehicle(&self, vehicle: &str) -> Result<(), CheckpointError> {
        require("vehicle of the weights", &vehicle, &self.sidecar.vehicle.as_str())
    }

    /// Refuses weights that were trained on other patches.
    pub fn require_layout(&self, layout: &FeatureLayout) -> Result<(), CheckpointError> {
        require("layout of the weights", layout, &self.sidecar.layout)
    }

    /// Refuses weights whose evidence is weighed against another physics prior.
    pub fn require_prior(&self, prior: &physics_prior::PriorConfig) -> Result<(), CheckpointError> {
        require("physics prior of the weights", prior, &self.sidecar.prior)
    }
}

fn check_tensors(sidecar: &Sidecar, tensors: &BTreeMap<String, Tensor>) -> Result<(), CheckpointError> {
    let mut expected = sidecar.architecture.tensor_shapes();
    expected.sort();
    let names: Vec<&String> = expected.iter().map(|(name, _)| name).collect();
    require("names of the weights", &names, &tensors.keys().collect())?;
    for ((name, shape), tensor) in expected.iter().zip(tensors.values()) {
        require(&format!("shape of {name}"), shape, &tensor.shape)?;
        // The shape is the architecture's, whose product cannot be told from a huge one by itself.
        let n = shape.iter().fold(1usize, |n, &length| n.saturating_mul(length));
        require(&format!("number of values of {name}"), &n, &tensor.values.len())?;
        if let Some(index) = tensor.values.iter().position(|value| !value.is_finite()) {
            let found = tensor.values[index];
            return Err(CheckpointError::NonFinite { tensor: name.clone(), index, found });
        }
    }
    Ok(())
}

fn sha256(bytes: &[u8]) -> String {
    Sha256::digest(bytes).iter().map(|byte| format!("{byte:02x}")).collect()
}

#[cfg(test)]
mod tests;
