//! Each pixel with the eight around it in one row, so that a convolution is a product of matrices: Candle's own is slow to
//! differentiate on a processor.

use candle_core::{CpuStorage, CustomOp1, DType, Device, Layout, Result, Shape, Tensor, WithDType};

/// From [batch, row, column, channel] to [pixel, 9 channels and a one], zeros beyond the edges; of either precision.
pub(crate) struct Neighbours;

/// Calls with the first number of each neighbour in the picture, and its place among the nine.
fn for_each([n, n_rows, n_cols]: [usize; 3], mut visit: impl FnMut(usize, usize, usize)) {
    for index in 0..n * n_rows * n_cols {
        let (row, col) = (index / n_cols % n_rows, index % n_cols);
        for k in 0..9 {
            let (i, j) = (row + k / 3, col + k % 3);
            if (1..=n_rows).contains(&i) && (1..=n_cols).contains(&j) {
                visit(index, k, index + (k / 3) * n_cols + k % 3 - n_cols - 1);
            }
        }
    }
}

fn gathered<T: WithDType>(values: &[T], [n, n_rows, n_cols, n_channels]: [usize; 4]) -> Vec<T> {
    let width = 9 * n_channels + 1;
    let mut all = vec![T::zero(); n * n_rows * n_cols * width];
    all.chunks_exact_mut(width).for_each(|row| row[width - 1] = T::one());
    for_each([n, n_rows, n_cols], |index, k, other| {
        let to = index * width + k * n_channels;
        all[to..to + n_channels].copy_from_slice(&values[other * n_channels..(other + 1) * n_channels]);
    });
    all
}

/// The transpose: every pixel is sent the sum of what stands where it was copied to.
fn scattered<T: WithDType>(gradient: &Tensor, shape: [usize; 4]) -> Result<Tensor> {
    let [n, n_rows, n_cols, n_channels] = shape;
    let width = 9 * n_channels + 1;
    let gradient = gradient.flatten_all()?.to_vec1::<T>()?;
    let mut sums = vec![T::zero(); n * n_rows * n_cols * n_channels];
    for_each([n, n_rows, n_cols], |index, k, other| {
        let from = &gradient[index * width + k * n_channels..][..n_channels];
        for (sum, from) in sums[other * n_channels..].iter_mut().zip(from) {
            *sum += *from;
        }
    });
    Tensor::from_vec(sums, shape.as_slice(), &Device::Cpu)
}

impl CustomOp1 for Neighbours {
    fn name(&self) -> &'static str {
        "neighbours"
    }

    fn cpu_fwd(&self, storage: &CpuStorage, layout: &Layout) -> Result<(CpuStorage, Shape)> {
        let (n, n_rows, n_cols, n_channels) = layout.shape().dims4()?;
        let Some((start, end)) = layout.contiguous_offsets() else {
            candle_core::bail!("neighbours: expected a contiguous tensor, found {layout:?}")
        };
        let shape = [n, n_rows, n_cols, n_channels];
        let all = match storage {
            CpuStorage::F32(values) => CpuStorage::F32(gathered(&values[start..end], shape)),
            CpuStorage::F64(values) => CpuStorage::F64(gathered(&values[start..end], shape)),
            _ => candle_core::bail!("neighbours: expected numbers of 32 or 64 bit, found others"),
        };
        Ok((all, (n * n_rows * n_cols, 9 * n_channels + 1).into()))
    }

    fn bwd(&self, input: &Tensor, _output: &Tensor, gradient: &Tensor) -> Result<Option<Tensor>> {
        let (n, n_rows, n_cols, n_channels) = input.dims4()?;
        let shape = [n, n_rows, n_cols, n_channels];
        let sums = match gradient.dtype() {
            DType::F64 => scattered::<f64>(gradient, shape),
            _ => scattered::<f32>(gradient, shape),
        };
        sums.map(Some)
    }
}
