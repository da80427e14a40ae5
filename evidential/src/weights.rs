//! What a checkpoint of any networks consists of: weights in a file of safetensors, a sidecar in JSON that says what they
//! mean and holds their digest, and what is refused of both.

use std::collections::BTreeMap;

use data_encoding::HEXLOWER;
use safetensors::tensor::{Dtype, SafeTensorError, SafeTensors, TensorView};
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};

/// An array of a checkpoint.
#[derive(Clone, Debug, PartialEq)]
pub struct Tensor {
    /// Lengths of its axes.
    pub shape: Vec<usize>,
    /// Row-major values.
    pub values: Vec<f32>,
}

/// SHA-256 of a file of weights: what they are known by.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct WeightsDigest([u8; 32]);

impl WeightsDigest {
    /// That of a file's bytes.
    pub fn of(weights: &[u8]) -> Self {
        Self(Sha256::digest(weights).into())
    }

    /// As 64 hexadecimal digits.
    pub fn hexadecimal(&self) -> String {
        HEXLOWER.encode(&self.0)
    }

    /// Its first 8 bytes, for messages.
    pub fn short(&self) -> u64 {
        self.0.iter().take(8).fold(0, |word, byte| word << 8 | u64::from(*byte))
    }
}

/// Why bytes are no checkpoint, or one that does not fit.
#[derive(Debug, thiserror::Error)]
pub enum CheckpointError {
    /// The sidecar is no JSON of a sidecar.
    #[error("sidecar: expected JSON of format {format}, found: {source}")]
    Json {
        /// The format that this program reads.
        format: u32,
        /// What is wrong.
        source: serde_json::Error,
    },
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
///
/// # Errors
/// What was expected and what was found of `what`.
pub fn require<T: PartialEq + std::fmt::Debug>(
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

/// Weights as safetensors. The same weights give the same bytes.
///
/// # Errors
/// A tensor whose shape contradicts its number of values.
pub fn to_bytes(tensors: &BTreeMap<String, Tensor>) -> Result<Vec<u8>, CheckpointError> {
    let bytes = |tensor: &Tensor| tensor.values.iter().flat_map(|value| value.to_le_bytes()).collect();
    let data: Vec<Vec<u8>> = tensors.values().map(bytes).collect();
    let mut views = Vec::with_capacity(data.len());
    for ((name, tensor), data) in tensors.iter().zip(&data) {
        views.push((name.as_str(), TensorView::new(Dtype::F32, tensor.shape.clone(), data)?));
    }
    Ok(safetensors::serialize(views, None)?)
}

/// Weights from the bytes of their file, of the digest that their sidecar states.
///
/// # Errors
/// Another digest, truncated or other bytes, arrays of another type than f32.
pub fn from_bytes(bytes: &[u8], digest: &str) -> Result<BTreeMap<String, Tensor>, CheckpointError> {
    require("SHA-256 of the weights", &digest, &WeightsDigest::of(bytes).hexadecimal().as_str())?;
    let mut tensors = BTreeMap::new();
    for (name, view) in SafeTensors::deserialize(bytes)?.tensors() {
        require(&format!("type of {name}"), &Dtype::F32, &view.dtype())?;
        let values = view.data().as_chunks::<4>().0.iter().map(|&bytes| f32::from_le_bytes(bytes)).collect();
        tensors.insert(name, Tensor { shape: view.shape().to_vec(), values });
    }
    Ok(tensors)
}

/// Refuses weights of other names or shapes than an architecture's, and such that are no finite numbers.
///
/// # Errors
/// The first that does not fit.
pub fn check(
    mut expected: Vec<(String, Vec<usize>)>,
    tensors: &BTreeMap<String, Tensor>,
) -> Result<(), CheckpointError> {
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

/// A sidecar as indented JSON.
///
/// # Errors
/// Numbers that JSON cannot hold.
pub fn sidecar_bytes(sidecar: &impl Serialize) -> Result<Vec<u8>, CheckpointError> {
    let mut text = serde_json::to_vec_pretty(sidecar).map_err(CheckpointError::Unwritable)?;
    text.push(b'\n');
    Ok(text)
}

/// A sidecar of this format. The format is read first: what else stands in one of another means something else, if
/// anything.
///
/// # Errors
/// Another format, or JSON of something else.
pub fn read_sidecar<T: DeserializeOwned>(json: &[u8], format: u32) -> Result<T, CheckpointError> {
    #[derive(Deserialize)]
    struct Version {
        format: u32,
    }
    let refused = |source| CheckpointError::Json { format, source };
    let Version { format: found } = serde_json::from_slice(json).map_err(refused)?;
    require("format", &format, &found)?;
    serde_json::from_slice(json).map_err(refused)
}
