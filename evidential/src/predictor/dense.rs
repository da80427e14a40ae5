//! Fully connected layers over blocks of footprints.
//!
//! The networks are so small that a block of footprints stays in the first-level cache from the features to the
//! result; the weights, packed once in the order in which they are read, stream past it. That leaves no work for a
//! general matrix product, whose packing would cost as much as these products do.
#![allow(clippy::needless_range_loop, reason = "arithmetic in registers: one index over several arrays")]

use bicycle::lanes::Block;
use pulp::Simd;

use super::lanes::mul_add;

/// Outputs that are accumulated in registers at a time.
const ROWS: usize = 8;

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

    /// The outputs of a block of footprints, one [`Block`] per output.
    #[inline(always)]
    pub fn apply<S: Simd>(&self, simd: S, input: &[Block], output: &mut [Block]) {
        let slope = match self.activation {
            Activation::Linear => simd.splat_f32s(1.0),
            Activation::Leaky(slope) => simd.splat_f32s(slope),
        };
        let tiles = self.weights.chunks_exact(input.len()).zip(&self.biases);
        for ((weights, biases), output) in tiles.zip(output[..self.n_outputs].chunks_mut(ROWS)) {
            let tile = Tile { weights, biases, slope };
            // As many sums as there are registers for; every weight that is read serves several.
            match (registers::<S>(), output.len()) {
                (Registers::Many, 5..) => tile.apply::<8, 3>(simd, 0, input, output),
                (Registers::Many, _) => tile.apply::<4, 3>(simd, 0, input, output),
                (Registers::Few, _) => tile.apply_in_halves::<2>(simd, input, output),
                (Registers::OfOne, _) => tile.apply_in_halves::<8>(simd, input, output),
            }
        }
    }
}

/// What an instruction set has to add up in.
enum Registers {
    Many,
    Few,
    /// Of one number each: the compiler makes four of them one of the machine's.
    OfOne,
}

#[inline(always)]
const fn registers<S: Simd>() -> Registers {
    match (S::F32_LANES, S::REGISTER_COUNT) {
        (1, _) => Registers::OfOne,
        (_, 32..) => Registers::Many,
        _ => Registers::Few,
    }
}

/// Up to [`ROWS`] outputs of a layer.
struct Tile<'a, S: Simd> {
    /// Shape [input].
    weights: &'a [[f32; ROWS]],
    biases: &'a [f32; ROWS],
    /// Of the outputs below zero.
    slope: S::f32s,
}

impl<S: Simd> Tile<'_, S> {
    /// The outputs by fours, `V` registers of footprints at a time.
    #[inline(always)]
    fn apply_in_halves<const V: usize>(&self, simd: S, input: &[Block], output: &mut [Block]) {
        for (half, output) in output.chunks_mut(ROWS / 2).enumerate() {
            self.apply::<{ ROWS / 2 }, V>(simd, half * ROWS / 2, input, output);
        }
    }

    /// `N` of the outputs from the first on, `V` registers of footprints at a time.
    #[inline(always)]
    fn apply<const N: usize, const V: usize>(
        &self,
        simd: S,
        first: usize,
        input: &[Block],
        output: &mut [Block],
    ) {
        for start in (0..Block::n_registers::<S>()).step_by(V) {
            let mut sums = [[simd.splat_f32s(0.0); V]; N];
            for row in 0..N {
                sums[row] = [simd.splat_f32s(self.biases[first + row]); V];
            }
            for (weights, lanes) in self.weights.iter().zip(input) {
                let mut values = [simd.splat_f32s(0.0); V];
                for v in 0..V {
                    values[v] = lanes.get::<S>(start + v);
                }
                for row in 0..N {
                    let weight = simd.splat_f32s(weights[first + row]);
                    for v in 0..V {
                        sums[row][v] = mul_add(simd, weight, values[v], sums[row][v]);
                    }
                }
            }
            // By index, so that the sums stay in registers to the end.
            for row in 0..N {
                let Some(lanes) = output.get_mut(row) else { break };
                for v in 0..V {
                    let sum = sums[row][v];
                    let is_positive = simd.greater_than_f32s(sum, simd.splat_f32s(0.0));
                    let below = simd.mul_f32s(self.slope, sum);
                    lanes.set::<S>(start + v, simd.select_f32s(is_positive, sum, below));
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use bicycle::lanes::BLOCK;

    use super::*;

    struct Apply<'a>(&'a Dense, &'a [Block], &'a mut [Block]);

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
            let input: Vec<Block> =
                (0..n_inputs).map(|k| Block(std::array::from_fn(|lane| number(k * 3 + lane)))).collect();
            for (activation, slope) in [(Activation::Linear, 1.0), (Activation::Leaky(0.25), 0.25)] {
                let layer = Dense::new(&weights, &biases, activation);
                let mut plain = vec![Block::ZERO; n_outputs];
                pulp::WithSimd::with_simd(Apply(&layer, &input, &mut plain), pulp::Scalar);
                for instructions in bicycle::lanes::Instructions::all() {
                    let mut found = vec![Block::ZERO; n_outputs];
                    instructions.run(Apply(&layer, &input, &mut found));
                    assert_eq!(found, plain, "{instructions:?}");
                }
                for (output, lanes) in plain.iter().enumerate() {
                    for lane in 0..BLOCK {
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
