//! A UNet (Ronneberger and others 2015) that sees friction: four channels in, four Stribeck coefficients a pixel out (AnyNav,
//! section 3.1.2), the same for every wheel.

use std::collections::BTreeMap;

use candle_core::{Device, Result, Tensor, Var};
use rand::{RngExt, SeedableRng};
use rand_distr::StandardNormal;
use rand_xoshiro::Xoshiro256PlusPlus;

use crate::neighbours::Neighbours;
use crate::view::{CHANNELS, View, ViewError};

/// Channels at full, half and quarter resolution.
const WIDTHS: [usize; 3] = [8, 16, 24];
/// Sides of a picture have to be multiples of this.
pub(crate) const STRIDE: usize = 4;
/// So many pixels around one have a say in what is seen there: 2 convolutions and a halving down, 2 and a halving more, 2 at
/// the bottom, and 2 and 2 and 1 on the way up reach 25; the next multiple of the stride.
const REACH: usize = 28;
/// Side of the parts in which large pictures are seen, so that memory does not grow with them.
const TILE: usize = 200;
/// Least and largest coefficients: static, sliding, viscous [s/m], Stribeck speed [m/s].
pub(crate) const COEFFICIENTS: [[f64; 2]; 4] = [[0.02, 1.3], [0.02, 1.1], [0.0, 0.04], [0.2, 10.0]];
/// What the mean of each colour is made to be: whatever the light and its tint, a large view holds much the same mixture
/// (the grey-world assumption, Buchsbaum 1980).
const MEAN_COLOUR: f32 = 0.45;
/// Height over which the height channel is divided [m].
const HEIGHT_SCALE_M: f32 = 0.05;

/// Three by three pixels to one.
struct Layer {
    name: &'static str,
    /// [9 inputs and a bias, outputs].
    weights: Var,
}

impl Layer {
    /// Normal weights whose sums keep the size of their inputs behind a ReLU (He and others 2015); no biases.
    fn new(
        (name, n_inputs, n_outputs): (&'static str, usize, usize),
        rng: &mut Xoshiro256PlusPlus,
    ) -> Result<Self> {
        let n_inputs = 9 * n_inputs;
        let deviation = (2.0 / n_inputs as f32).sqrt();
        let weights = (0..n_outputs * n_inputs).map(|_| deviation * rng.sample::<f32, _>(StandardNormal));
        let weights = weights.chain(std::iter::repeat_n(0.0, n_outputs)).collect();
        Ok(Self { name, weights: Var::from_vec(weights, (n_inputs + 1, n_outputs), &Device::Cpu)? })
    }
}

/// Shapes [batch, row, column, inputs] to the same with outputs.
fn convolved(input: &Tensor, weights: &Tensor) -> Result<Tensor> {
    let (n, n_rows, n_cols, _) = input.dims4()?;
    input.apply_op1(Neighbours)?.matmul(weights)?.reshape((n, n_rows, n_cols, ()))
}

/// Means of squares of two by two: Candle's own pooling scales gradients wrongly.
fn halved(input: &Tensor) -> Result<Tensor> {
    let (n, n_rows, n_cols, n_channels) = input.dims4()?;
    let rows = input.reshape((n, n_rows / 2, 2, n_cols * n_channels))?;
    let rows = (rows.narrow(2, 0, 1)? + rows.narrow(2, 1, 1)?)?;
    let pairs = rows.reshape((n, n_rows / 2, n_cols / 2, 2 * n_channels))?;
    (pairs.narrow(3, 0, n_channels)? + pairs.narrow(3, n_channels, n_channels)?)? * 0.25
}

/// Each pixel twice along and across: Candle's own overwrites gradients of what is used elsewhere, too.
fn doubled(input: &Tensor) -> Result<Tensor> {
    let (n, n_rows, n_cols, n_channels) = input.dims4()?;
    let along = Tensor::cat(&[input, input], 3)?.reshape((n, n_rows, 2 * n_cols, n_channels))?;
    Tensor::cat(&[&along, &along], 2)?.reshape((n, 2 * n_rows, 2 * n_cols, n_channels))
}

/// The network.
pub struct Network {
    layers: Vec<Layer>,
    /// Edge of the pixels it knows [m].
    pub resolution_m: f64,
}

/// Weights that make no network.
#[derive(Debug, thiserror::Error)]
pub enum NetworkError {
    /// The bytes are none of safetensors.
    #[error("weights: {0}")]
    Bytes(#[from] safetensors::SafeTensorError),
    /// A part is missing or of another shape.
    #[error("weights: {part}: expected {expected}, found {found}")]
    Part {
        /// Which.
        part: String,
        /// What would do.
        expected: String,
        /// What stands there.
        found: String,
    },
    /// The picture is none.
    #[error(transparent)]
    View(#[from] ViewError),
    /// Arithmetic was refused.
    #[error(transparent)]
    Candle(#[from] candle_core::Error),
}

/// Names, inputs and outputs of the layers in the order of their use.
fn shapes() -> [(&'static str, usize, usize); 11] {
    let [a, b, c] = WIDTHS;
    [
        ("down.0.0", CHANNELS, a),
        ("down.0.1", a, a),
        ("down.1.0", a, b),
        ("down.1.1", b, b),
        ("down.2.0", b, c),
        ("down.2.1", c, c),
        ("up.1.0", c + b, b),
        ("up.1.1", b, b),
        ("up.0.0", b + a, a),
        ("up.0.1", a, a),
        ("out", a, 4),
    ]
}

impl Network {
    /// One that has learned nothing.
    ///
    /// # Errors
    /// Memory.
    pub fn new(resolution_m: f64, seed: u64) -> Result<Self> {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
        let layers = shapes().into_iter().map(|shape| Layer::new(shape, &mut rng));
        Ok(Self { layers: layers.collect::<Result<_>>()?, resolution_m })
    }

    /// Coefficients [batch, row, column, 4] of pictures [batch, row, column, 4] whose channels are [`Network::input`]'s.
    pub(crate) fn forward(&self, input: &Tensor) -> Result<Tensor> {
        let weights: Vec<Tensor> =
            self.layers.iter().map(|layer| layer.weights.as_tensor().clone()).collect();
        Self::apply(&weights, input)
    }

    pub(crate) fn apply(weights: &[Tensor], input: &Tensor) -> Result<Tensor> {
        let run = |range: std::ops::Range<usize>, from: &Tensor| {
            weights[range]
                .iter()
                .try_fold(from.clone(), |values, weights| convolved(&values, weights)?.relu())
        };
        let full = run(0..2, input)?;
        let half = run(2..4, &halved(&full)?)?;
        let quarter = run(4..6, &halved(&half)?)?;
        let half = run(6..8, &Tensor::cat(&[doubled(&quarter)?, half], 3)?)?;
        let full = run(8..10, &Tensor::cat(&[doubled(&half)?, full], 3)?)?;
        let shares = candle_nn::ops::sigmoid(&convolved(&full, &weights[10])?)?;
        let row = |which: fn(&[f64; 2]) -> f64| {
            Tensor::from_vec(COEFFICIENTS.iter().map(which).collect(), 4, &Device::Cpu)?
                .to_dtype(input.dtype())
        };
        let (low, width) = (row(|ends| ends[0])?, row(|ends| ends[1] - ends[0])?);
        shares.broadcast_mul(&width)?.broadcast_add(&low)
    }

    /// Pixels from a corner on as the network takes them, [row, column, channel]: colours over the view's mean, about zero,
    /// heights less the mean of the five by five pixels around, pixels beyond the edges repeated.
    pub(crate) fn input(view: &View, [row, col]: [i64; 2], [n_rows, n_cols]: [usize; 2]) -> Vec<f32> {
        let at = |channel: usize, row: i64, col: i64| {
            let row = row.clamp(0, view.n_rows as i64 - 1) as usize;
            let col = col.clamp(0, view.n_cols as i64 - 1) as usize;
            view.values[(channel * view.n_rows + row) * view.n_cols + col]
        };
        let scales = view.mean_colour().map(|mean| MEAN_COLOUR / mean.max(1e-3));
        let mut values = Vec::with_capacity(n_rows * n_cols * CHANNELS);
        for i in row..row + n_rows as i64 {
            for j in col..col + n_cols as i64 {
                values.extend((0..3).map(|channel| 4.0 * (scales[channel] * at(channel, i, j) - 0.5)));
                let around = (0..25).map(|k| at(3, i + k / 5 - 2, j + k % 5 - 2)).sum::<f32>() / 25.0;
                values.push((at(3, i, j) - around) / HEIGHT_SCALE_M);
            }
        }
        values
    }

    /// Coefficients of every pixel of a view, shape [row, column].
    ///
    /// # Errors
    /// A view that is none, or of another resolution.
    pub fn see(&self, view: &View) -> std::result::Result<Vec<[f32; 4]>, NetworkError> {
        let [n_rows, n_cols] = [view.n_rows, view.n_cols];
        let mut all = vec![[0.0; 4]; n_rows * n_cols];
        for row in (0..n_rows).step_by(TILE) {
            for col in (0..n_cols).step_by(TILE) {
                let size = [TILE.min(n_rows - row), TILE.min(n_cols - col)];
                let tile = self.see_part(view, [row, col], size)?;
                for (i, pixels) in tile.chunks(size[1]).enumerate() {
                    all[(row + i) * n_cols + col..][..size[1]].copy_from_slice(pixels);
                }
            }
        }
        Ok(all)
    }

    /// Coefficients of some rows and columns from a first one on: the same as of the whole view, pixels beyond whose edges are
    /// those of the edges.
    ///
    /// # Errors
    /// A view that is none, or of another resolution.
    pub fn see_part(
        &self,
        view: &View,
        [row, col]: [usize; 2],
        size: [usize; 2],
    ) -> std::result::Result<Vec<[f32; 4]>, NetworkError> {
        view.validate()?;
        let (expected_m, found_m) = (self.resolution_m, view.resolution_m);
        if (found_m / expected_m - 1.0).abs() > 1e-6 {
            return Err(ViewError::Resolution { expected_m, found_m }.into());
        }
        let [n_rows, n_cols] = size.map(|n| n.next_multiple_of(STRIDE) + 2 * REACH);
        // Halves begin at the same pixels wherever the part begins.
        let lead = [row % STRIDE, col % STRIDE];
        let corner = [row, col].map(|place| (place / STRIDE * STRIDE) as i64 - REACH as i64);
        let [n_rows, n_cols] = [n_rows + STRIDE, n_cols + STRIDE];
        let input = Self::input(view, corner, [n_rows, n_cols]);
        let input = Tensor::from_vec(input, (1, n_rows, n_cols, CHANNELS), &Device::Cpu)?;
        // Detached: what nobody differentiates is not kept.
        let weights: Vec<Tensor> =
            self.layers.iter().map(|layer| layer.weights.as_detached_tensor()).collect();
        let seen = Self::apply(&weights, &input)?.flatten_all()?.to_vec1::<f32>()?;
        let pixel = |i: usize, j: usize| {
            let first = 4 * ((REACH + lead[0] + i) * n_cols + REACH + lead[1] + j);
            std::array::from_fn(|k| seen[first + k])
        };
        Ok((0..size[0]).flat_map(|i| (0..size[1]).map(move |j| pixel(i, j))).collect())
    }

    pub(crate) fn variables(&self) -> Vec<Var> {
        self.layers.iter().map(|layer| layer.weights.clone()).collect()
    }

    /// A network of its own with the same weights.
    ///
    /// # Errors
    /// Memory.
    pub fn copied(&self) -> Result<Self> {
        let copy = Self::new(self.resolution_m, 0)?;
        for (to, from) in copy.variables().iter().zip(self.variables()) {
            to.set(&from.copy()?)?;
        }
        Ok(copy)
    }

    /// As safetensors, the size of the pixels in its header.
    ///
    /// # Errors
    /// None but of memory.
    pub fn to_bytes(&self) -> std::result::Result<Vec<u8>, NetworkError> {
        let mut tensors = BTreeMap::new();
        for layer in &self.layers {
            tensors.insert(format!("{}.weight", layer.name), layer.weights.as_tensor().clone());
        }
        let header = [("resolution_m".to_owned(), self.resolution_m.to_string())];
        Ok(safetensors::serialize(tensors, Some(header.into_iter().collect()))?)
    }

    /// From the same bytes.
    ///
    /// # Errors
    /// No safetensors, or not these.
    pub fn from_bytes(bytes: &[u8]) -> std::result::Result<Self, NetworkError> {
        let (_, header) = safetensors::SafeTensors::read_metadata(bytes)?;
        let told = header.metadata().as_ref().and_then(|all| all.get("resolution_m").cloned());
        let part = |part: &str, expected: &str, found: String| NetworkError::Part {
            part: part.to_owned(),
            expected: expected.to_owned(),
            found,
        };
        let resolution_m = told.as_ref().and_then(|word| word.parse().ok()).filter(|edge_m| *edge_m > 0.0);
        let absent = || part("resolution_m", "a number of metres", format!("{told:?}"));
        let network = Self::new(resolution_m.ok_or_else(absent)?, 0)?;
        let tensors = candle_core::safetensors::load_buffer(bytes, &Device::Cpu)?;
        for layer in &network.layers {
            let (name, variable) = (format!("{}.weight", layer.name), &layer.weights);
            let expected = format!("{:?}", variable.dims());
            let found = tensors.get(&name).ok_or_else(|| part(&name, &expected, "none".to_owned()))?;
            if found.dims() != variable.dims() {
                return Err(part(&name, &expected, format!("{:?}", found.dims())));
            }
            variable.set(found)?;
        }
        Ok(network)
    }
}

#[cfg(test)]
mod tests;
