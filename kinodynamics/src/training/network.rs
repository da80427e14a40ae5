//! The networks in Candle.

use std::collections::BTreeMap;

use candle_core::{Device, Result, Tensor, Var};
use rand::{RngExt, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;

use super::keep;
use crate::architecture::{Activation, Architecture, LayerShape};
use crate::checkpoint;

struct Layer {
    name: String,
    /// [outputs, inputs].
    weights: Var,
    biases: Var,
    activation: Activation,
}

impl Layer {
    /// Weights and biases uniform within one over the root of the number of inputs, as PyTorch begins.
    fn new(shape: LayerShape, rng: &mut Xoshiro256PlusPlus) -> Result<Self> {
        let LayerShape { name, n_inputs, n_outputs, activation } = shape;
        let bound = 1.0 / (n_inputs as f32).sqrt();
        let mut uniform =
            |n: usize| -> Vec<f32> { (0..n).map(|_| rng.random_range(-bound..bound)).collect() };
        let weights = Var::from_vec(uniform(n_outputs * n_inputs), (n_outputs, n_inputs), &Device::Cpu)?;
        Ok(Self {
            name,
            weights,
            biases: Var::from_vec(uniform(n_outputs), n_outputs, &Device::Cpu)?,
            activation,
        })
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
    pub(super) fn new(architecture: &Architecture, seed: u64) -> Result<Self> {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
        let mut layers = |shapes: Vec<LayerShape>| -> Result<Vec<Layer>> {
            shapes.into_iter().map(|shape| Layer::new(shape, &mut rng)).collect()
        };
        Ok(Self { encoder: layers(architecture.encoder())?, command: layers(architecture.command())? })
    }

    /// Answers over their scales [rows, answers] for standardised windows [rows, 600] and wishes [rows, 2].
    pub(super) fn forward(&self, windows: &Tensor, desired: &Tensor) -> Result<Tensor> {
        let mut values = desired.clone();
        if !self.encoder.is_empty() {
            let mut embedding = windows.clone();
            for layer in &self.encoder {
                embedding = layer.forward(&embedding)?;
            }
            values = Tensor::cat(&[desired, &embedding], 1)?;
        }
        for layer in &self.command {
            values = layer.forward(&values)?;
        }
        Ok(values)
    }

    fn layers(&self) -> impl Iterator<Item = &Layer> {
        self.encoder.iter().chain(&self.command)
    }

    pub(super) fn variables(&self) -> Vec<Var> {
        self.layers().flat_map(|layer| [layer.weights.clone(), layer.biases.clone()]).collect()
    }

    pub(super) fn tensors(&self) -> Result<BTreeMap<String, checkpoint::Tensor>> {
        let mut tensors = BTreeMap::new();
        for layer in self.layers() {
            keep(&mut tensors, format!("{}.weight", layer.name), &layer.weights)?;
            keep(&mut tensors, format!("{}.bias", layer.name), &layer.biases)?;
        }
        Ok(tensors)
    }
}
