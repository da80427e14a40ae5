//! A dataset as bytes: safetensors with the origin as JSON in the header.

use std::collections::HashMap;

use safetensors::tensor::{Dtype, SafeTensorError, TensorView};
use safetensors::{SafeTensors, serialize};
use serde::{Deserialize, Serialize};
use traversability::N_BINS;

use super::{Dataset, DatasetError, DatasetOrigin, Example};

/// Entry of the header that holds the origin.
const HEADER_KEY: &str = "surefoot";
/// The version that this program writes and reads.
const FORMAT: u32 = 1;

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Header {
    /// Version of the layout of dataset files.
    dataset_format: u32,
    origin: DatasetOrigin,
}

/// Bytes that hold no dataset.
#[derive(Debug, thiserror::Error)]
pub enum DatasetFileError {
    /// The bytes are truncated or something else.
    #[error("dataset: expected safetensors of {n_bytes} bytes that fit their header, found: {source}")]
    Container {
        /// Bytes there.
        n_bytes: usize,
        /// What does not fit.
        source: SafeTensorError,
    },
    /// A part of the file is wrong.
    #[error("dataset, {part}: expected {expected}, found {found}")]
    Part {
        /// Tensor or header entry.
        part: &'static str,
        /// What would do.
        expected: String,
        /// What is there.
        found: String,
    },
    /// The examples are none.
    #[error(transparent)]
    Examples(#[from] DatasetError),
}

impl Dataset {
    /// The dataset as safetensors, to be read back bit by bit.
    ///
    /// For N examples of F features: `features` [N, F], `measured` [N, 4], `prior` [N, 4, 12], `unevenness` [N], all
    /// f32; `drive` [N] u32; `pose` [N, 3] f64. The header holds format and origin as JSON under `surefoot`.
    ///
    /// # Errors
    /// The dataset does not validate.
    pub fn to_bytes(&self) -> Result<Vec<u8>, DatasetFileError> {
        self.validate()?;
        let (n, n_features) = (self.examples.len(), self.origin.layout.n_features());
        let all =
            |values: fn(&Example) -> Vec<u8>| self.examples.iter().flat_map(values).collect::<Vec<u8>>();
        let columns = [
            ("features", Dtype::F32, vec![n, n_features], all(|example| bytes_f32(&example.features))),
            ("measured", Dtype::F32, vec![n, 4], all(|example| bytes_f32(&example.measured))),
            ("prior", Dtype::F32, vec![n, 4, N_BINS], all(|example| bytes_f32(example.prior.as_flattened()))),
            ("unevenness", Dtype::F32, vec![n], all(|example| bytes_f32(&[example.unevenness_m]))),
            ("drive", Dtype::U32, vec![n], all(|example| example.drive.to_le_bytes().to_vec())),
            ("pose", Dtype::F64, vec![n, 3], all(|example| bytes_f64(&example.pose))),
        ];
        let views = columns
            .iter()
            .map(|(name, dtype, shape, bytes)| Ok((*name, TensorView::new(*dtype, shape.clone(), bytes)?)));
        let container = |source| DatasetFileError::Container { n_bytes: 0, source };
        let views: Vec<_> = views.collect::<Result<_, SafeTensorError>>().map_err(container)?;
        let header = Header { dataset_format: FORMAT, origin: self.origin.clone() };
        let told = serde_json::to_string(&header)
            .map_err(|error| part("header", "values that JSON can hold", error))?;
        serialize(views, Some(HashMap::from([(HEADER_KEY.to_owned(), told)]))).map_err(container)
    }

    /// Reads what [`Dataset::to_bytes`] wrote.
    ///
    /// # Errors
    /// Truncated or other bytes, another format, tensors that are missing, of another type or shape than the origin's
    /// layout, numbers that are not finite.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self, DatasetFileError> {
        let container = |source| DatasetFileError::Container { n_bytes: bytes.len(), source };
        let (_, metadata) = SafeTensors::read_metadata(bytes).map_err(container)?;
        let told = metadata.metadata().as_ref().and_then(|entries| entries.get(HEADER_KEY));
        let told = told.ok_or_else(|| part("header", "an entry 'surefoot'", "none"))?;
        let version = version(told)?;
        if version != u64::from(FORMAT) {
            return Err(part("header, dataset_format", FORMAT, version));
        }
        let Header { origin, .. } = serde_json::from_str(told)
            .map_err(|error| part("header, origin", "the origin of a dataset", error))?;
        if let Some((name, expected, found)) = origin.layout.first_huge_patch() {
            return Err(part("header, origin", format!("{name} patch: {expected}"), found));
        }
        let tensors = SafeTensors::deserialize(bytes).map_err(container)?;
        let n = match tensors.tensor("features") {
            Ok(features) => features.shape().first().copied().unwrap_or(0),
            Err(_) => return Err(part("features", "a tensor", "none")),
        };
        let dataset = Self { examples: examples(&tensors, n, origin.layout.n_features())?, origin };
        dataset.validate()?;
        Ok(dataset)
    }
}

fn version(told: &str) -> Result<u64, DatasetFileError> {
    let value: serde_json::Value =
        serde_json::from_str(told).map_err(|error| part("header", "JSON", error))?;
    let version = value.get("dataset_format").and_then(serde_json::Value::as_u64);
    version.ok_or_else(|| part("header, dataset_format", FORMAT, "no number"))
}

fn examples(
    tensors: &SafeTensors<'_>,
    n: usize,
    n_features: usize,
) -> Result<Vec<Example>, DatasetFileError> {
    let features = f32_rows(column(tensors, "features", Dtype::F32, &[n, n_features])?);
    let measured = f32_rows(column(tensors, "measured", Dtype::F32, &[n, 4])?);
    let prior = f32_rows(column(tensors, "prior", Dtype::F32, &[n, 4, N_BINS])?);
    let unevenness_m = f32_rows(column(tensors, "unevenness", Dtype::F32, &[n])?);
    let drive = column(tensors, "drive", Dtype::U32, &[n])?;
    let pose = column(tensors, "pose", Dtype::F64, &[n, 3])?;
    let drive: Vec<u32> = drive.as_chunks().0.iter().map(|bytes| u32::from_le_bytes(*bytes)).collect();
    let pose: Vec<f64> = pose.as_chunks().0.iter().map(|bytes| f64::from_le_bytes(*bytes)).collect();
    let example = |index: usize| Example {
        features: features[index * n_features..(index + 1) * n_features].to_vec(),
        measured: std::array::from_fn(|k| measured[4 * index + k]),
        prior: std::array::from_fn(|k| std::array::from_fn(|bin| prior[(4 * index + k) * N_BINS + bin])),
        unevenness_m: unevenness_m[index],
        drive: drive[index],
        pose: std::array::from_fn(|k| pose[3 * index + k]),
    };
    Ok((0..n).map(example).collect())
}

/// The bytes of a tensor of the given type and shape.
fn column<'a>(
    tensors: &SafeTensors<'a>,
    name: &'static str,
    dtype: Dtype,
    shape: &[usize],
) -> Result<&'a [u8], DatasetFileError> {
    let expected = || format!("{dtype:?} {shape:?}");
    let tensor = tensors.tensor(name).map_err(|_| part(name, expected(), "no such tensor"))?;
    if tensor.dtype() != dtype || tensor.shape() != shape {
        return Err(part(name, expected(), format!("{:?} {:?}", tensor.dtype(), tensor.shape())));
    }
    Ok(tensor.data())
}

fn part(part: &'static str, expected: impl ToString, found: impl ToString) -> DatasetFileError {
    DatasetFileError::Part { part, expected: expected.to_string(), found: found.to_string() }
}

fn f32_rows(bytes: &[u8]) -> Vec<f32> {
    bytes.as_chunks().0.iter().map(|bytes| f32::from_le_bytes(*bytes)).collect()
}

fn bytes_f32(values: &[f32]) -> Vec<u8> {
    values.iter().flat_map(|value| value.to_le_bytes()).collect()
}

fn bytes_f64(values: &[f64]) -> Vec<u8> {
    values.iter().flat_map(|value| value.to_le_bytes()).collect()
}
