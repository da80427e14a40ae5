//! Checkpoints as bytes: safetensors and their sidecar in JSON.

use std::collections::BTreeMap;

use traversability::Bins;

use super::{Checkpoint, Sidecar};
use crate::FeatureLayout;
use crate::weights::{self, CheckpointError, Tensor, WeightsDigest, require};

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
        weights::check(sidecar.architecture.tensor_shapes(), &tensors)?;
        let mut checkpoint = Self { sidecar, tensors };
        checkpoint.sidecar.weights_sha256 = checkpoint.digest()?.hexadecimal();
        Ok(checkpoint)
    }

    /// The weights as safetensors. The same weights give the same bytes.
    ///
    /// # Errors
    /// A tensor whose shape contradicts its number of values.
    pub fn weights_bytes(&self) -> Result<Vec<u8>, CheckpointError> {
        weights::to_bytes(&self.tensors)
    }

    /// What the weights are known by.
    ///
    /// # Errors
    /// A tensor whose shape contradicts its number of values.
    pub fn digest(&self) -> Result<WeightsDigest, CheckpointError> {
        Ok(WeightsDigest::of(&self.weights_bytes()?))
    }

    /// The sidecar as indented JSON.
    ///
    /// # Errors
    /// Numbers that JSON cannot hold.
    pub fn sidecar_bytes(&self) -> Result<Vec<u8>, CheckpointError> {
        weights::sidecar_bytes(&self.sidecar)
    }

    /// A checkpoint from the bytes of its two files.
    ///
    /// # Errors
    /// Truncated or other bytes, another format, weights of another hash than the sidecar's, other bins, shapes or
    /// lengths than the sidecar's architecture and layout demand, numbers that are not finite.
    pub fn from_bytes(weights: &[u8], sidecar: &[u8]) -> Result<Self, CheckpointError> {
        let sidecar: Sidecar = weights::read_sidecar(sidecar, Sidecar::FORMAT)?;
        sidecar.validate()?;
        let tensors = weights::from_bytes(weights, &sidecar.weights_sha256)?;
        weights::check(sidecar.architecture.tensor_shapes(), &tensors)?;
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

#[cfg(test)]
mod tests;
