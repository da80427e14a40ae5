//! Tensors of a checkpoint, by name and shape.

use std::collections::BTreeMap;

use crate::{CheckpointError, Tensor};

/// The tensors of a checkpoint.
pub(crate) struct Tensors<'a>(pub &'a BTreeMap<String, Tensor>);

impl<'a> Tensors<'a> {
    /// Values of a tensor of the given shape.
    pub fn values(&self, name: &str, shape: &[usize]) -> Result<&'a [f32], CheckpointError> {
        let found = self.0.get(name);
        match found {
            Some(tensor) if tensor.shape == shape => Ok(&tensor.values),
            _ => Err(CheckpointError::Mismatch {
                what: format!("{name}, shape"),
                expected: format!("{shape:?}"),
                found: found.map_or("no such array".to_owned(), |tensor| format!("{:?}", tensor.shape)),
            }),
        }
    }

    /// Weights [outputs, inputs] and biases of a layer.
    pub fn layer(
        &self,
        name: &str,
        n_outputs: usize,
        n_inputs: usize,
    ) -> Result<(Vec<f32>, Vec<f32>), CheckpointError> {
        let weights = self.values(&format!("{name}.weight"), &[n_outputs, n_inputs])?;
        let biases = self.values(&format!("{name}.bias"), &[n_outputs])?;
        Ok((weights.to_vec(), biases.to_vec()))
    }
}
