//! The networks of [`Architecture`] in Candle, as training needs them.

mod dense;

use std::collections::BTreeMap;

use candle_core::{Device, Result, Tensor, Var, bail};
use rand::RngExt;
use rand_xoshiro::Xoshiro256PlusPlus;
use traversability::N_BINS;

use crate::flow::LogDensity;
use crate::random::stream;
use crate::{Architecture, Checkpoint, weights};
use dense::{Activation, Dense};

/// Key of the random stream that initialises the networks.
const INITIAL_KEY: u64 = 1;

/// Trainable networks: encoder, a head per parameter, and for methods with evidence the evidence head and the flow.
pub(crate) struct Network {
    encoder: Vec<Layer>,
    heads: Vec<[Layer; 2]>,
    evidence: Option<Evidence>,
}

/// What tells how far the prediction may be trusted.
struct Evidence {
    scale: [Layer; 2],
    /// [layers, latent].
    flow_centres: Var,
    /// [2, layers]: alpha, beta.
    flow_shapes: Var,
}

/// A fully connected layer.
struct Layer {
    /// [outputs, inputs].
    weights: Var,
    biases: Var,
    activation: Activation,
}

impl Layer {
    /// Weights from the uniform distribution that keeps the spread of its inputs (Kaiming): variance 2/inputs before
    /// LeakyReLU, 1/inputs otherwise. Biases are zero.
    fn new(sizes: [usize; 2], activation: Activation, rng: &mut Xoshiro256PlusPlus) -> Result<Self> {
        let [n_inputs, n_outputs] = sizes;
        let gain = match activation {
            Activation::LeakyRelu => 2.0 / (1.0 + Architecture::LEAK * Architecture::LEAK),
            Activation::Linear => 1.0,
        };
        let bound = (3.0 * gain / n_inputs as f32).sqrt();
        Ok(Self {
            weights: uniform(&[n_outputs, n_inputs], bound, rng)?,
            biases: Var::from_vec(vec![0f32; n_outputs], n_outputs, &Device::Cpu)?,
            activation,
        })
    }

    fn pair(sizes: [usize; 3], rng: &mut Xoshiro256PlusPlus) -> Result<[Self; 2]> {
        let [n_inputs, n_hidden, n_outputs] = sizes;
        Ok([
            Self::new([n_inputs, n_hidden], Activation::LeakyRelu, rng)?,
            Self::new([n_hidden, n_outputs], Activation::Linear, rng)?,
        ])
    }

    fn forward(&self, inputs: &Tensor) -> Result<Tensor> {
        inputs.apply_op3(&self.weights, &self.biases, Dense(self.activation))
    }
}

fn uniform(shape: &[usize], bound: f32, rng: &mut Xoshiro256PlusPlus) -> Result<Var> {
    let n = shape.iter().product();
    let values: Vec<f32> = (0..n).map(|_| rng.random_range(-bound..bound)).collect();
    Var::from_vec(values, shape, &Device::Cpu)
}

/// Weights and biases of layers.
fn arrays<'a>(layers: impl Iterator<Item = &'a Layer>) -> Vec<Var> {
    layers.flat_map(|layer| [layer.weights.clone(), layer.biases.clone()]).collect()
}

fn forward_pair(layers: &[Layer; 2], inputs: &Tensor) -> Result<Tensor> {
    layers[1].forward(&layers[0].forward(inputs)?)
}

impl Network {
    /// Networks of which every weight follows from the seed.
    pub(crate) fn new(architecture: &Architecture, seed: u64) -> Result<Self> {
        let mut rng = stream(seed, &[INITIAL_KEY]);
        let mut widths = vec![architecture.n_inputs];
        widths.extend(&architecture.encoder_hidden);
        let mut encoder = Vec::new();
        for pair in widths.windows(2) {
            encoder.push(Layer::new([pair[0], pair[1]], Activation::LeakyRelu, &mut rng)?);
        }
        let n_latent = architecture.n_latent;
        let last = widths[widths.len() - 1];
        encoder.push(Layer::new([last, n_latent], Activation::Linear, &mut rng)?);
        let mut heads = Vec::new();
        for _ in 0..Architecture::N_HEADS {
            heads.push(Layer::pair([n_latent, architecture.head_hidden, N_BINS], &mut rng)?);
        }
        let evidence = match architecture.n_flow_layers {
            0 => None,
            n_layers => Some(Evidence::new(architecture, n_layers, &mut rng)?),
        };
        Ok(Self { encoder, heads, evidence })
    }

    /// Networks with the weights of a checkpoint, which is known to be whole.
    pub(crate) fn of(checkpoint: &Checkpoint) -> Result<Self> {
        let network = Self::new(&checkpoint.sidecar.architecture, 0)?;
        let kept = |name: &str| match checkpoint.tensors.get(name) {
            Some(tensor) => Tensor::from_slice(&tensor.values, tensor.shape.as_slice(), &Device::Cpu),
            None => bail!("expected weights of the name {name}"),
        };
        for (name, layer) in network.named_layers() {
            layer.weights.set(&kept(&format!("{name}.weight"))?)?;
            layer.biases.set(&kept(&format!("{name}.bias"))?)?;
        }
        if let Some(evidence) = &network.evidence {
            evidence.flow_centres.set(&kept("flow.centre")?)?;
            let shapes = [kept("flow.alpha")?, kept("flow.beta")?];
            evidence.flow_shapes.set(&Tensor::stack(&shapes, 0)?)?;
        }
        Ok(network)
    }

    /// Latents [rows, latent] of inputs [rows, inputs].
    pub(crate) fn latents(&self, inputs: &Tensor) -> Result<Tensor> {
        let mut values = inputs.clone();
        for layer in &self.encoder {
            values = layer.forward(&values)?;
        }
        Ok(values)
    }

    /// Log densities [rows] of latents; `None` without a flow.
    pub(crate) fn log_densities(&self, latents: &Tensor) -> Result<Option<Tensor>> {
        let density = |evidence: &Evidence| {
            latents.apply_op3(&evidence.flow_centres, &evidence.flow_shapes, LogDensity)
        };
        self.evidence.as_ref().map(density).transpose()
    }

    /// Everything that the loss asks for, one example per row: logits of all heads, then with evidence the logits of
    /// the evidence scales and the log density.
    pub(crate) fn outputs(&self, inputs: &Tensor) -> Result<Tensor> {
        self.outputs_of_latents(&self.latents(inputs)?)
    }

    /// The same of latents.
    pub(crate) fn outputs_of_latents(&self, latents: &Tensor) -> Result<Tensor> {
        let mut parts = Vec::with_capacity(Architecture::N_HEADS + 2);
        for head in &self.heads {
            parts.push(forward_pair(head, latents)?);
        }
        if let Some(evidence) = &self.evidence {
            parts.push(forward_pair(&evidence.scale, latents)?);
        }
        if let Some(densities) = self.log_densities(latents)? {
            parts.push(densities.unsqueeze(1)?);
        }
        Tensor::cat(&parts, 1)
    }

    /// All trainable arrays, always in the same order.
    pub(crate) fn variables(&self) -> Vec<Var> {
        let mut variables = arrays(self.encoder.iter());
        variables.extend(self.head_variables());
        variables.extend(self.flow_variables());
        variables
    }

    /// Trainable arrays of the heads, that of the evidence scales among them.
    pub(crate) fn head_variables(&self) -> Vec<Var> {
        let pairs = self.heads.iter().chain(self.evidence.as_ref().map(|evidence| &evidence.scale));
        arrays(pairs.flatten())
    }

    /// The flow's trainable arrays; none without a flow.
    pub(crate) fn flow_variables(&self) -> Vec<Var> {
        let arrays = |evidence: &Evidence| [evidence.flow_centres.clone(), evidence.flow_shapes.clone()];
        self.evidence.iter().flat_map(arrays).collect()
    }

    /// The weights under the names of [`Architecture`].
    pub(crate) fn tensors(&self) -> Result<BTreeMap<String, weights::Tensor>> {
        let mut tensors = BTreeMap::new();
        let mut put = |name: String, tensor: &Tensor| -> Result<()> {
            let values = tensor.contiguous()?.flatten_all()?.to_vec1()?;
            tensors.insert(name, weights::Tensor { shape: tensor.dims().to_vec(), values });
            Ok(())
        };
        for (name, layer) in self.named_layers() {
            put(format!("{name}.weight"), &layer.weights)?;
            put(format!("{name}.bias"), &layer.biases)?;
        }
        if let Some(evidence) = &self.evidence {
            put("flow.centre".to_owned(), &evidence.flow_centres)?;
            put("flow.alpha".to_owned(), &evidence.flow_shapes.get(0)?)?;
            put("flow.beta".to_owned(), &evidence.flow_shapes.get(1)?)?;
        }
        Ok(tensors)
    }

    fn named_layers(&self) -> Vec<(String, &Layer)> {
        let encoder = self.encoder.iter().enumerate().map(|(k, layer)| (format!("encoder.{k}"), layer));
        let mut named: Vec<(String, &Layer)> = encoder.collect();
        for (parameter, head) in self.heads.iter().enumerate() {
            named.extend(head.iter().enumerate().map(|(k, layer)| (format!("heads.{parameter}.{k}"), layer)));
        }
        if let Some(evidence) = &self.evidence {
            let scale = evidence.scale.iter().enumerate();
            named.extend(scale.map(|(k, layer)| (format!("evidence.{k}"), layer)));
        }
        named
    }
}

impl Evidence {
    /// The flow starts as NatPN's: everything uniform within 1/sqrt(latent).
    fn new(architecture: &Architecture, n_layers: usize, rng: &mut Xoshiro256PlusPlus) -> Result<Self> {
        let (n_latent, n_hidden) = (architecture.n_latent, architecture.evidence_hidden);
        let bound = 1.0 / (n_latent as f32).sqrt();
        Ok(Self {
            scale: Layer::pair([n_latent, n_hidden, Architecture::N_HEADS], rng)?,
            flow_centres: uniform(&[n_layers, n_latent], bound, rng)?,
            flow_shapes: uniform(&[2, n_layers], bound, rng)?,
        })
    }
}
