//! Fully connected layers over blocks of footprints.
//!
//! The networks are so small that a block of footprints stays in the first-level cache from the features to the
//! result; the weights, packed once in the order in which they are read, stream past it. That leaves no work for a
//! general matrix product, whose packing would cost as much as these products do.

use pulp::{Simd, bytemuck};

use super::lanes::{Lanes, N_LANES};

/// Outputs that are accumulated in registers at a time.
const ROWS: usize = 12;

/// What follows a layer's sums.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Activation {
    /// Nothing.
    Linear,
    /// Negative sums are scaled by a slope.
    Leaky(f32),
}

/// A layer's weights, packed.
#[derive(Clone, Debug)]
pub(crate) struct Dense {
    n_outputs: usize,
    /// [`ROWS`] outputs at a time, the last ones filled up with zeros: shape [tile, input].
    weights: Vec<[f32; ROWS]>,
    /// Shape [tile].
    biases: Vec<[f32; ROWS]>,
    activation: Activation,
}

impl Dense {
    /// From weights of shape [output, input].
    pub fn new(weights: &[f32], biases: &[f32], activation: Activation) -> Self {
        let (n_outputs, n_inputs) = (biases.len(), weights.len() / biases.len());
        let tiles = 0..n_outputs.div_ceil(ROWS);
        let weight = |output: usize, input: usize| match output < n_outputs {
            true => weights[output * n_inputs + input],
            false => 0.0,
        };
        let tile_weights = |tile: usize| {
            (0..n_inputs).map(move |input| std::array::from_fn(|row| weight(tile * ROWS + row, input)))
        };
        let bias = |output: usize| biases.get(output).copied().unwrap_or(0.0);
        Self {
            n_outputs,
            weights: tiles.clone().flat_map(tile_weights).collect(),
            biases: tiles.map(|tile| std::array::from_fn(|row| bias(tile * ROWS + row))).collect(),
            activation,
        }
    }

    /// Number of outputs.
    pub fn n_outputs(&self) -> usize {
        self.n_outputs
    }

    /// Bytes of the packed weights.
    pub fn n_bytes(&self) -> usize {
        size_of_val(&*self.weights) + size_of_val(&*self.biases)
    }

    /// The outputs of a block of footprints, one [`Lanes`] per output.
    #[inline(always)]
    pub fn apply<S: Simd>(&self, simd: S, input: &[Lanes], output: &mut [Lanes]) {
        let tiles = self.weights.chunks_exact(input.len()).zip(&self.biases);
        for ((weights, biases), output) in tiles.zip(output[..self.n_outputs].chunks_mut(ROWS)) {
            // As many sums as there are registers for; a short last tile needs fewer.
            match (S::REGISTER_COUNT >= 32, output.len()) {
                (true, 9..) => tile::<S, 12, 2>(simd, weights, biases, input, output),
                (true, 5..=8) => tile::<S, 8, 2>(simd, weights, biases, input, output),
                (true, _) => tile::<S, 4, 2>(simd, weights, biases, input, output),
                (false, 9..) => tile::<S, 12, 1>(simd, weights, biases, input, output),
                (false, 5..=8) => tile::<S, 8, 1>(simd, weights, biases, input, output),
                (false, _) => tile::<S, 4, 1>(simd, weights, biases, input, output),
            }
            if let Activation::Leaky(slope) = self.activation {
                for lanes in output {
                    *lanes = lanes.map(|sum| if sum > 0.0 { sum } else { slope * sum });
                }
            }
        }
    }
}

/// `N` outputs of one tile, `V` registers of lanes at a time.
#[inline(always)]
fn tile<S: Simd, const N: usize, const V: usize>(
    simd: S,
    weights: &[[f32; ROWS]],
    biases: &[f32; ROWS],
    input: &[Lanes],
    output: &mut [Lanes],
) {
    for start in (0..N_LANES / S::F32_LANES).step_by(V) {
        let mut sums: [[S::f32s; V]; N] = std::array::from_fn(|row| [simd.splat_f32s(biases[row]); V]);
        for (weights, lanes) in weights.iter().zip(input) {
            let lanes: &[S::f32s] = bytemuck::cast_slice(&lanes.0);
            let lanes: [S::f32s; V] = std::array::from_fn(|v| lanes[start + v]);
            for row in 0..N {
                let weight = simd.splat_f32s(weights[row]);
                for v in 0..V {
                    sums[row][v] = simd.mul_add_f32s(weight, lanes[v], sums[row][v]);
                }
            }
        }
        for (sums, lanes) in sums.iter().zip(output.iter_mut()) {
            let lanes: &mut [S::f32s] = bytemuck::cast_slice_mut(&mut lanes.0);
            lanes[start..start + V].copy_from_slice(sums);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    struct Apply<'a>(&'a Dense, &'a [Lanes], &'a mut [Lanes]);

    impl pulp::WithSimd for Apply<'_> {
        type Output = ();

        fn with_simd<S: Simd>(self, simd: S) {
            self.0.apply(simd, self.1, self.2);
        }
    }

    /// Small integers: sums are exact in any order.
    fn number(index: usize) -> f32 {
        ((index * 37 + 11) % 23) as f32 - 11.0
    }

    #[test]
    fn outputs_of_every_number_are_the_sums_of_their_inputs() {
        for n_outputs in [1, 4, 5, 8, 9, 12, 13, 17, 21, 36] {
            let n_inputs = 7;
            let weights: Vec<f32> = (0..n_outputs * n_inputs).map(number).collect();
            let biases: Vec<f32> = (0..n_outputs).map(|k| number(k + 5)).collect();
            let input: Vec<Lanes> =
                (0..n_inputs).map(|k| Lanes(std::array::from_fn(|lane| number(k * 3 + lane)))).collect();
            for (activation, slope) in [(Activation::Linear, 1.0), (Activation::Leaky(0.25), 0.25)] {
                let layer = Dense::new(&weights, &biases, activation);
                let (mut widest, mut plain) = (vec![Lanes::ZERO; n_outputs], vec![Lanes::ZERO; n_outputs]);
                pulp::Arch::new().dispatch(Apply(&layer, &input, &mut widest));
                pulp::WithSimd::with_simd(Apply(&layer, &input, &mut plain), pulp::Scalar);
                assert_eq!(widest, plain);
                for (output, lanes) in widest.iter().enumerate() {
                    for lane in 0..N_LANES {
                        let products =
                            (0..n_inputs).map(|k| weights[output * n_inputs + k] * input[k].0[lane]);
                        let sum = biases[output] + products.sum::<f32>();
                        assert_eq!(lanes.0[lane], if sum > 0.0 { sum } else { slope * sum });
                    }
                }
            }
        }
    }
}
