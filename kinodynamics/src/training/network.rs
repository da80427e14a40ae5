//! The networks in Candle.

use std::collections::BTreeMap;

use candle_core::{DType, Device, Result, Tensor, Var};
use rand::{RngExt, SeedableRng};
use rand_distr::StandardNormal;
use rand_xoshiro::Xoshiro256PlusPlus;

use super::keep;
use crate::architecture::{Activation, Architecture, LayerShape};

/// Share of the inputs that a unit must answer to.
const AWAKE_MIN: f32 = 0.05;

/// Size of what all other units add to the answer at first, over what they would.
const OTHERS: f64 = 0.1;

struct Layer {
    name: String,
    /// [outputs, inputs].
    weights: Var,
    biases: Var,
    activation: Activation,
}

impl Layer {
    /// Normal weights whose sums keep the size of their inputs behind a ReLU (He and others 2015), or before a hyperbolic
    /// tangent; no biases.
    fn new(shape: LayerShape, rng: &mut Xoshiro256PlusPlus) -> Result<Self> {
        let LayerShape { name, n_inputs, n_outputs, activation } = shape;
        let gain = match activation {
            Activation::Relu => 2.0,
            Activation::Tanh => 1.0,
        };
        let deviation = (gain / n_inputs as f32).sqrt();
        let weights = (0..n_outputs * n_inputs).map(|_| deviation * rng.sample::<f32, _>(StandardNormal));
        Ok(Self {
            name,
            weights: Var::from_vec(weights.collect(), (n_outputs, n_inputs), &Device::Cpu)?,
            biases: Var::zeros(n_outputs, DType::F32, &Device::Cpu)?,
            activation,
        })
    }

    /// Makes a unit the multiple of one of its inputs.
    fn carry(&self, unit: usize, input: usize, factor: f32) -> Result<()> {
        let mut weights = self.weights.to_vec2::<f32>()?;
        weights[unit].fill(0.0);
        weights[unit][input] = factor;
        self.weights.set(&Tensor::new(weights, &Device::Cpu)?)
    }

    /// Turns units round that hardly any of these inputs [rows, inputs] gets an answer out of: they would not learn, and
    /// turned round nearly all do. Returns the outputs.
    fn wake(&self, inputs: &Tensor) -> Result<Tensor> {
        if self.activation == Activation::Relu {
            let answers = self.shares_awake(inputs)?;
            let signs: Vec<f32> =
                answers.iter().map(|share| if *share < AWAKE_MIN { -1.0 } else { 1.0 }).collect();
            let signs = Tensor::from_vec(signs, answers.len(), &Device::Cpu)?;
            self.weights.set(&self.weights.broadcast_mul(&signs.unsqueeze(1)?)?)?;
            self.biases.set(&self.biases.mul(&signs)?)?;
        }
        self.forward(inputs)
    }

    /// Share of these inputs that each unit answers to.
    fn shares_awake(&self, inputs: &Tensor) -> Result<Vec<f32>> {
        self.forward(inputs)?.gt(0.0)?.to_dtype(DType::F32)?.mean(0)?.to_vec1()
    }

    fn forward(&self, inputs: &Tensor) -> Result<Tensor> {
        let sums = inputs.matmul(&self.weights.t()?)?.broadcast_add(&self.biases)?;
        match self.activation {
            Activation::Relu => sums.relu(),
            Activation::Tanh => sums.tanh(),
        }
    }
}

/// Encoder and command network.
pub(super) struct Network {
    encoder: Vec<Layer>,
    command: Vec<Layer>,
}

impl Network {
    /// An inverse model.
    pub(super) fn inverse(architecture: &Architecture, seed: u64) -> Result<Self> {
        let network = Self::new([architecture.encoder(), architecture.command()], seed)?;
        network.embed_how_much_is_felt()?;
        Ok(network)
    }

    /// The forward model that teaches an inverse one.
    pub(super) fn forward_model(architecture: &Architecture, seed: u64) -> Result<Self> {
        Self::new(architecture.forward(), seed)
    }

    fn new(shapes: [Vec<LayerShape>; 2], seed: u64) -> Result<Self> {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
        let mut layers = |shapes: Vec<LayerShape>| -> Result<Vec<Layer>> {
            shapes.into_iter().map(|shape| Layer::new(shape, &mut rng)).collect()
        };
        let [encoder, command] = shapes;
        let network = Self { encoder: layers(encoder)?, command: layers(command)? };
        network.command_what_is_desired()?;
        Ok(network)
    }

    /// Lets the embedding begin as means of what the units before it answer, all of one sign: how much the unit shakes.
    /// With signs drawn at random, the noise of shaking is as large as what it tells.
    fn embed_how_much_is_felt(&self) -> Result<()> {
        let Some(embedding) = self.encoder.last() else { return Ok(()) };
        let (_, n_inputs) = embedding.weights.dims2()?;
        // The weights' deviation is the root of two over the number of inputs.
        let factor = (2.0 / n_inputs as f64).sqrt();
        embedding.weights.set(&(embedding.weights.abs()? * factor)?)
    }

    /// Lets the command network begin as the nominal model: it answers nearly what is desired, whatever the ground, and
    /// learns the difference. Its first units carry the desired curvature to either side and the desired speed.
    fn command_what_is_desired(&self) -> Result<()> {
        const SPEED: usize = 0;
        const CURVATURE: usize = 1;
        let [first, second, last] = &self.command[..] else { return Ok(()) };
        first.carry(0, CURVATURE, 1.0)?;
        first.carry(1, CURVATURE, -1.0)?;
        first.carry(2, SPEED, 1.0)?;
        (0..3).try_for_each(|unit| second.carry(unit, unit, 1.0))?;
        let mut weights = (last.weights.as_tensor() * OTHERS)?.to_vec2::<f32>()?;
        (weights[0][0], weights[0][1], weights[0][2]) = (1.0, -1.0, 0.0);
        if let Some(speed) = weights.get_mut(1) {
            (speed[0], speed[1], speed[2]) = (0.0, 0.0, 1.0);
        }
        last.weights.set(&Tensor::new(weights, &Device::Cpu)?)
    }

    /// Makes every unit answer to some of these windows [rows, 600] and wishes [rows, 2] at least.
    pub(super) fn wake(&self, windows: &Tensor, desired: &Tensor) -> Result<()> {
        let embedding = through(&self.encoder, windows.clone(), Layer::wake)?;
        through(&self.command, told(&embedding, desired)?, Layer::wake).map(drop)
    }

    /// Answers over their scales [rows, answers] for standardised windows [rows, 600] and wishes [rows, 2].
    pub(super) fn forward(&self, windows: &Tensor, desired: &Tensor) -> Result<Tensor> {
        self.answer(&self.embed(windows)?, desired)
    }

    /// Embedding [rows, numbers] of standardised windows [rows, 600].
    pub(super) fn embed(&self, windows: &Tensor) -> Result<Tensor> {
        through(&self.encoder, windows.clone(), Layer::forward)
    }

    /// Answers over their scales [rows, answers] for embeddings [rows, numbers] and wishes [rows, 2].
    pub(super) fn answer(&self, embedding: &Tensor, desired: &Tensor) -> Result<Tensor> {
        through(&self.command, told(embedding, desired)?, Layer::forward)
    }

    /// Share of these inputs that every unit behind a ReLU answers to, layer after layer.
    #[cfg(test)]
    pub(super) fn shares_awake(&self, windows: &Tensor, desired: &Tensor) -> Result<Vec<f32>> {
        let mut values = windows.clone();
        let mut shares = Vec::new();
        let mut note = |layer: &Layer, inputs: &Tensor| -> Result<Tensor> {
            if layer.activation == Activation::Relu {
                shares.extend(layer.shares_awake(inputs)?);
            }
            layer.forward(inputs)
        };
        for layer in &self.encoder {
            values = note(layer, &values)?;
        }
        let mut values = Tensor::cat(&[desired, &values], 1)?;
        for layer in &self.command {
            values = note(layer, &values)?;
        }
        Ok(shares)
    }

    fn layers(&self) -> impl Iterator<Item = &Layer> {
        self.encoder.iter().chain(&self.command)
    }

    pub(super) fn variables(&self) -> Vec<Var> {
        self.layers().flat_map(|layer| [layer.weights.clone(), layer.biases.clone()]).collect()
    }

    pub(super) fn tensors(&self) -> Result<BTreeMap<String, crate::Tensor>> {
        let mut tensors = BTreeMap::new();
        for layer in self.layers() {
            keep(&mut tensors, format!("{}.weight", layer.name), &layer.weights)?;
            keep(&mut tensors, format!("{}.bias", layer.name), &layer.biases)?;
        }
        Ok(tensors)
    }
}

fn through(layers: &[Layer], inputs: Tensor, pass: fn(&Layer, &Tensor) -> Result<Tensor>) -> Result<Tensor> {
    layers.iter().try_fold(inputs, |values, layer| pass(layer, &values))
}

/// What the command network is told: the wish, and the embedding if there is one.
fn told(embedding: &Tensor, desired: &Tensor) -> Result<Tensor> {
    if embedding.dim(1)? == 0 { Ok(desired.clone()) } else { Tensor::cat(&[desired, embedding], 1) }
}
