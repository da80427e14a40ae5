//! A fully connected layer as one differentiable operation.
//!
//! Candle's own product of matrices asks the system for its number of cores every time, which costs more than products
//! of this size, and spreads over threads. ndarray's runs where it is called.

use candle_core::{CpuStorage, CustomOp3, Layout, Result, Shape, Storage, Tensor, bail};
use ndarray::linalg::general_mat_mul;
use ndarray::{ArrayView2, ArrayViewMut2};

use crate::Architecture;
use crate::loss::contiguous;

/// What follows the weighted sums of a layer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Activation {
    /// LeakyReLU with slope [`Architecture::LEAK`].
    LeakyRelu,
    /// Nothing.
    Linear,
}

/// activation(x W^T + b) of inputs [rows, inputs], weights [outputs, inputs] and biases [outputs]. One operation
/// instead of four, and no gradient by inputs that are data.
pub(super) struct Dense(pub Activation);

impl CustomOp3 for Dense {
    fn name(&self) -> &'static str {
        "dense"
    }

    fn cpu_fwd(
        &self,
        inputs: &CpuStorage,
        inputs_layout: &Layout,
        weights: &CpuStorage,
        weights_layout: &Layout,
        biases: &CpuStorage,
        biases_layout: &Layout,
    ) -> Result<(CpuStorage, Shape)> {
        let (n_rows, n_inputs) = inputs_layout.shape().dims2()?;
        let (n_outputs, _) = weights_layout.shape().dims2()?;
        let weights = matrix(contiguous(weights, weights_layout)?, [n_outputs, n_inputs])?;
        let inputs = matrix(contiguous(inputs, inputs_layout)?, [n_rows, n_inputs])?;
        let biases = contiguous(biases, biases_layout)?;
        let mut sums = Vec::with_capacity(n_rows * n_outputs);
        (0..n_rows).for_each(|_| sums.extend_from_slice(biases));
        general_mat_mul(1.0, &inputs, &weights.t(), 1.0, &mut matrix_mut(&mut sums, [n_rows, n_outputs])?);
        if self.0 == Activation::LeakyRelu {
            sums.iter_mut().for_each(|sum| *sum *= slope_at(*sum));
        }
        Ok((CpuStorage::F32(sums), Shape::from((n_rows, n_outputs))))
    }

    fn bwd(
        &self,
        inputs: &Tensor,
        weights: &Tensor,
        _biases: &Tensor,
        outputs: &Tensor,
        by_outputs: &Tensor,
    ) -> Result<(Option<Tensor>, Option<Tensor>, Option<Tensor>)> {
        let (n_rows, n_inputs) = inputs.dims2()?;
        let n_outputs = outputs.dim(1)?;
        let by_sums = self.by_sums(outputs, &by_outputs.contiguous()?)?;
        let by_sums_matrix = matrix(&by_sums, [n_rows, n_outputs])?;
        let mut by_weights = vec![0.0; n_outputs * n_inputs];
        with_numbers(inputs, |inputs| {
            let mut product = matrix_mut(&mut by_weights, [n_outputs, n_inputs])?;
            general_mat_mul(
                1.0,
                &by_sums_matrix.t(),
                &matrix(inputs, [n_rows, n_inputs])?,
                0.0,
                &mut product,
            );
            Ok(())
        })?;
        let mut by_biases = vec![0.0; n_outputs];
        for row in by_sums.chunks_exact(n_outputs) {
            by_biases.iter_mut().zip(row).for_each(|(sum, slope)| *sum += slope);
        }
        let by_inputs = if inputs.track_op() {
            let mut by_inputs = vec![0.0; n_rows * n_inputs];
            with_numbers(weights, |weights| {
                let mut product = matrix_mut(&mut by_inputs, [n_rows, n_inputs])?;
                general_mat_mul(
                    1.0,
                    &by_sums_matrix,
                    &matrix(weights, [n_outputs, n_inputs])?,
                    0.0,
                    &mut product,
                );
                Ok(())
            })?;
            Some(Tensor::from_vec(by_inputs, (n_rows, n_inputs), inputs.device())?)
        } else {
            None
        };
        let by_weights = Tensor::from_vec(by_weights, (n_outputs, n_inputs), inputs.device())?;
        Ok((by_inputs, Some(by_weights), Some(Tensor::from_vec(by_biases, n_outputs, inputs.device())?)))
    }
}

impl Dense {
    /// Gradient by the weighted sums from that by the outputs. LeakyReLU keeps the sign, so its slope shows in the
    /// outputs too.
    fn by_sums(&self, outputs: &Tensor, by_outputs: &Tensor) -> Result<Vec<f32>> {
        with_numbers(outputs, |outputs| {
            with_numbers(by_outputs, |by_outputs| {
                Ok(match self.0 {
                    Activation::Linear => by_outputs.to_vec(),
                    Activation::LeakyRelu => outputs
                        .iter()
                        .zip(by_outputs)
                        .map(|(&output, slope)| slope_at(output) * slope)
                        .collect(),
                })
            })
        })
    }
}

fn slope_at(value: f32) -> f32 {
    if value > 0.0 { 1.0 } else { Architecture::LEAK }
}

/// Row-major numbers as a matrix.
fn matrix(numbers: &[f32], shape: [usize; 2]) -> Result<ArrayView2<'_, f32>> {
    ArrayView2::from_shape(shape, numbers).map_err(candle_core::Error::wrap)
}

fn matrix_mut(numbers: &mut [f32], shape: [usize; 2]) -> Result<ArrayViewMut2<'_, f32>> {
    ArrayViewMut2::from_shape(shape, numbers).map_err(candle_core::Error::wrap)
}

/// Lends the numbers of a contiguous tensor.
fn with_numbers<T>(tensor: &Tensor, task: impl FnOnce(&[f32]) -> Result<T>) -> Result<T> {
    let (storage, layout) = tensor.storage_and_layout();
    match &*storage {
        Storage::Cpu(numbers) => task(contiguous(numbers, layout)?),
        _ => bail!("expected a tensor in main memory"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use candle_core::{Device, Var};

    fn variable(shape: [usize; 2], key: f32) -> Var {
        let n = shape[0] * shape[1];
        let values: Vec<f32> = (0..n).map(|k| ((k as f32 + key) * 1.7).sin()).collect();
        Var::from_vec(values, (shape[0], shape[1]), &Device::Cpu).unwrap()
    }

    #[test]
    fn layer_and_gradients_are_those_of_the_plain_operations() {
        for activation in [Activation::LeakyRelu, Activation::Linear] {
            let (inputs, weights) = (variable([5, 3], 0.1), variable([4, 3], 0.7));
            let biases = Var::from_vec(vec![0.1f32, -0.2, 0.3, 0.0], 4, &Device::Cpu).unwrap();
            let one = inputs.apply_op3(&weights, &biases, Dense(activation)).unwrap();
            let sums = inputs.matmul(&weights.t().unwrap()).unwrap().broadcast_add(&biases).unwrap();
            let plain = match activation {
                Activation::Linear => sums,
                Activation::LeakyRelu => {
                    sums.maximum(&(&sums * f64::from(Architecture::LEAK)).unwrap()).unwrap()
                }
            };
            let weighted = variable([5, 4], 0.4);
            let gradients = [&one, &plain].map(|outputs| {
                (outputs * weighted.as_tensor()).unwrap().sum_all().unwrap().backward().unwrap()
            });
            let gap = |left: &Tensor, right: &Tensor| {
                let gap = (left - right).unwrap().abs().unwrap().flatten_all().unwrap();
                gap.max(0).unwrap().to_scalar::<f32>().unwrap()
            };
            assert!(gap(&one, &plain) < 1e-6);
            for input in [&inputs, &weights, &biases] {
                let [found, expected] = [0, 1].map(|which| gradients[which].get(input).unwrap());
                assert!(gap(found, expected) < 1e-5, "{activation:?}");
            }
        }
    }

    #[test]
    fn data_gets_no_gradient() {
        let (weights, biases) =
            (variable([4, 3], 0.7), Var::zeros(4, candle_core::DType::F32, &Device::Cpu).unwrap());
        let data = variable([5, 3], 0.1).as_detached_tensor();
        let outputs = data.apply_op3(&weights, &biases, Dense(Activation::Linear)).unwrap();
        let gradients = outputs.sum_all().unwrap().backward().unwrap();
        assert!(gradients.get(&data).is_none() && gradients.get(&weights).is_some());
    }
}
