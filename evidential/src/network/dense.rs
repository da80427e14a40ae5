//! A fully connected layer as one differentiable operation.

use candle_core::backend::BackendStorage;
use candle_core::{CpuStorage, CustomOp2, CustomOp3, Layout, Result, Shape, Tensor, bail};

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
        let transposed = weights_layout.transpose(0, 1)?;
        let sizes = (1, n_rows, n_outputs, n_inputs);
        let CpuStorage::F32(mut sums) = inputs.matmul(weights, sizes, inputs_layout, &transposed)? else {
            bail!("expected f32");
        };
        let biases = contiguous(biases, biases_layout)?;
        for row in sums.chunks_exact_mut(n_outputs) {
            for (sum, bias) in row.iter_mut().zip(biases) {
                *sum += bias;
            }
        }
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
        let by_sums = match self.0 {
            Activation::LeakyRelu => {
                outputs.apply_op2_no_bwd(&by_outputs.contiguous()?, &LeakyReluBackward)?
            }
            Activation::Linear => by_outputs.contiguous()?,
        };
        let by_inputs = if inputs.track_op() { Some(by_sums.matmul(weights)?) } else { None };
        let by_weights = by_sums.t()?.matmul(inputs)?;
        Ok((by_inputs, Some(by_weights), Some(by_sums.sum(0)?)))
    }
}

/// Slope of LeakyReLU; its result has the sign of its argument, so either may be asked.
fn slope_at(value: f32) -> f32 {
    if value > 0.0 { 1.0 } else { Architecture::LEAK }
}

/// Gradient by the arguments of LeakyReLU from (its results, gradient by them).
struct LeakyReluBackward;

impl CustomOp2 for LeakyReluBackward {
    fn name(&self) -> &'static str {
        "leaky-relu-backward"
    }

    fn cpu_fwd(
        &self,
        outputs: &CpuStorage,
        outputs_layout: &Layout,
        by_outputs: &CpuStorage,
        by_outputs_layout: &Layout,
    ) -> Result<(CpuStorage, Shape)> {
        let outputs = contiguous(outputs, outputs_layout)?;
        let by_outputs = contiguous(by_outputs, by_outputs_layout)?;
        let by_sums = outputs.iter().zip(by_outputs).map(|(&output, slope)| slope_at(output) * slope);
        Ok((CpuStorage::F32(by_sums.collect()), outputs_layout.shape().clone()))
    }
}
