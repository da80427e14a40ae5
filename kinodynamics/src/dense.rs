//! A fully connected layer for one input vector, its weights packed once in the order in which they are read.
//!
//! Sixteen outputs lie side by side and the inputs are gone through one after the other, so that every output adds up its
//! products in the same order on every instruction set: the result does not depend on it.

use bicycle::lanes::{Instructions, Lanes, OnLanes, SPAN};

use crate::architecture::Activation;

/// Spans of outputs that are added up at a time.
const SPANS: usize = 4;
/// Outputs of a tile.
const TILE: usize = SPANS * SPAN;

type Tile = [[f32; SPAN]; SPANS];

/// A layer's weights.
#[derive(Clone, Debug)]
pub(crate) struct Dense {
    n_inputs: usize,
    n_outputs: usize,
    /// Shape [tile, input], filled up with zeros.
    weights: Vec<Tile>,
    /// Shape [tile].
    biases: Vec<Tile>,
    activation: Activation,
}

impl Dense {
    /// From weights [output, input], row-major, and biases [output].
    pub(crate) fn new(weights: &[f32], biases: &[f32], activation: Activation) -> Self {
        let (n_outputs, n_inputs) = (biases.len(), weights.len() / biases.len());
        let tile = |tile: usize, value: &dyn Fn(usize) -> f32| -> Tile {
            std::array::from_fn(|span| {
                std::array::from_fn(|lane| {
                    let output = tile * TILE + span * SPAN + lane;
                    if output < n_outputs { value(output) } else { 0.0 }
                })
            })
        };
        let n_tiles = n_outputs.div_ceil(TILE);
        let mut packed = Vec::with_capacity(n_tiles * n_inputs);
        for index in 0..n_tiles {
            packed
                .extend((0..n_inputs).map(|input| tile(index, &|output| weights[output * n_inputs + input])));
        }
        let biases = (0..n_tiles).map(|index| tile(index, &|output| biases[output])).collect();
        Self { n_inputs, n_outputs, weights: packed, biases, activation }
    }

    /// Numbers that an output buffer must hold: whole tiles.
    pub(crate) fn n_padded(&self) -> usize {
        self.biases.len() * TILE
    }

    /// Writes the outputs of `inputs` to the front of `outputs`, which holds [`Dense::n_padded`] numbers or more.
    pub(crate) fn apply(&self, instructions: Instructions, inputs: &[f32], outputs: &mut [f32]) {
        instructions.run_on_lanes(Sums { layer: self, inputs: &inputs[..self.n_inputs], outputs });
        for output in &mut outputs[..self.n_outputs] {
            *output = match self.activation {
                Activation::Relu => output.max(0.0),
                Activation::Tanh => libm::tanhf(*output),
            };
        }
    }
}

struct Sums<'a> {
    layer: &'a Dense,
    inputs: &'a [f32],
    outputs: &'a mut [f32],
}

impl OnLanes for Sums<'_> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self, lanes: L) {
        let tiles = self.layer.weights.chunks_exact(self.layer.n_inputs).zip(&self.layer.biases);
        for ((weights, biases), outputs) in tiles.zip(self.outputs.chunks_exact_mut(TILE)) {
            for offset in (0..SPAN).step_by(L::WIDTH) {
                let mut sums = [lanes.of_span(&biases[0], offset); SPANS];
                for (sum, bias) in sums.iter_mut().zip(biases) {
                    *sum = lanes.of_span(bias, offset);
                }
                for (weights, &input) in weights.iter().zip(self.inputs) {
                    let input = lanes.single(input);
                    for k in 0..SPANS {
                        // Rounded twice, so that sets with and without a fused product agree.
                        sums[k] = lanes.add(sums[k], lanes.mul(input, lanes.of_span(&weights[k], offset)));
                    }
                }
                let (spans, _) = outputs.as_chunks_mut::<SPAN>();
                for (span, sum) in spans.iter_mut().zip(sums) {
                    lanes.to_span(sum, span, offset);
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn wave(n: usize, key: f32) -> Vec<f32> {
        (0..n).map(|k| ((k as f32 + key) * 1.7).sin()).collect()
    }

    #[test]
    fn sums_are_the_plain_ones_on_every_instruction_set() {
        for (n_inputs, n_outputs) in [(1, 1), (5, 32), (7, 64), (600, 65), (3, 256)] {
            let (weights, biases, inputs) =
                (wave(n_inputs * n_outputs, 0.2), wave(n_outputs, 0.7), wave(n_inputs, 0.4));
            let layer = Dense::new(&weights, &biases, Activation::Relu);
            for instructions in Instructions::all() {
                let mut found = vec![f32::NAN; layer.n_padded()];
                layer.apply(instructions, &inputs, &mut found);
                for output in 0..n_outputs {
                    let mut sum = biases[output];
                    for input in 0..n_inputs {
                        sum += inputs[input] * weights[output * n_inputs + input];
                    }
                    assert_eq!(found[output].to_bits(), sum.max(0.0).to_bits(), "{instructions:?} {output}");
                }
            }
        }
    }

    #[test]
    fn hyperbolic_tangent_follows_the_last_sums() {
        let layer = Dense::new(&[2.0, -1.0], &[0.5], Activation::Tanh);
        let mut found = vec![0.0; layer.n_padded()];
        layer.apply(Instructions::widest(), &[0.25, 0.5], &mut found);
        // 0.5 + 2 x 0.25 - 0.5 = 0.5
        assert!((f64::from(found[0]) - 0.5_f64.tanh()).abs() < 1e-7);
    }
}
