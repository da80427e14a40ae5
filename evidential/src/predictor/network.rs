//! The networks of a checkpoint, ready to be laid over blocks of footprints.

use bicycle::lanes::Block;
use pulp::Simd;
use traversability::N_BINS;

use super::CheckpointError;
use super::dense::{Activation, Dense};
use super::lanes::{exp, sigmoid, softmax};
use super::radial_flow::RadialFlow;
use super::tensors::Tensors;
use crate::{Architecture, Checkpoint, Standardisation};

const N_HEADS: usize = Architecture::N_HEADS;

/// All layers. Inputs are raw features: the first layer holds the standardisation too.
#[derive(Clone, Debug)]
pub(crate) struct Network {
    encoder: Vec<Dense>,
    /// First layers of the heads and, where there is evidence, of the evidence head, one after the other.
    hidden: Dense,
    /// Second layers of the heads.
    heads: Vec<Dense>,
    head_hidden: usize,
    evidence: Option<EvidenceHead>,
}

/// From latents to evidence.
#[derive(Clone, Debug)]
struct EvidenceHead {
    scales: Dense,
    flow: RadialFlow,
    log_budget: f32,
}

/// Largest and, negated, smallest logarithm of evidence before it is scaled (NOTES 1.1).
const LOG_EVIDENCE_MAX: f32 = 30.0;

/// Predictions for a block of footprints.
#[derive(Clone, Debug)]
pub(crate) struct BlockPrediction {
    /// Probabilities, shape [parameter, bin].
    pub probabilities: [[Block; N_BINS]; N_HEADS],
    /// Logarithm of the flow's density; zero without a flow.
    pub log_density: Block,
    /// Evidence per parameter; zero without a flow.
    pub evidence: [Block; N_HEADS],
}

/// Buffers for one block, so that nothing is allocated on the way.
#[derive(Clone, Debug)]
pub(crate) struct Workspace {
    /// Features, shape [feature].
    pub input: Vec<Block>,
    layers: [Vec<Block>; 2],
    hidden: Vec<Block>,
    pub prediction: BlockPrediction,
}

impl Workspace {
    /// Bytes of what it allocated.
    pub fn n_bytes(&self) -> usize {
        let blocks = [&self.input, &self.hidden].into_iter().chain(&self.layers);
        blocks.map(|blocks| size_of_val(&**blocks)).sum()
    }
}

impl Network {
    /// Takes the layers out of a checkpoint whose tensors have the right shapes.
    pub fn new(checkpoint: &Checkpoint) -> Result<Self, CheckpointError> {
        let sidecar = &checkpoint.sidecar;
        let architecture = &sidecar.architecture;
        let tensors = Tensors(&checkpoint.tensors);
        let leaky = Activation::Leaky(Architecture::LEAK);
        let mut widths = vec![architecture.n_inputs];
        widths.extend(&architecture.encoder_hidden);
        widths.push(architecture.n_latent);
        let last = widths.len() - 2;
        let mut encoder = Vec::new();
        for (k, pair) in widths.windows(2).enumerate() {
            let (mut weights, mut biases) = tensors.layer(&format!("encoder.{k}"), pair[1], pair[0])?;
            if k == 0 {
                standardise(&mut weights, &mut biases, &sidecar.standardisation);
            }
            encoder.push(Dense::new(&weights, &biases, if k == last { Activation::Linear } else { leaky }));
        }
        let (n_latent, head_hidden) = (architecture.n_latent, architecture.head_hidden);
        let (mut weights, mut biases) = (Vec::new(), Vec::new());
        let mut stack = |(more_weights, more_biases): (Vec<f32>, Vec<f32>)| {
            weights.extend(more_weights);
            biases.extend(more_biases);
        };
        let mut heads = Vec::new();
        for head in 0..N_HEADS {
            stack(tensors.layer(&format!("heads.{head}.0"), head_hidden, n_latent)?);
            let (weights, biases) = tensors.layer(&format!("heads.{head}.1"), N_BINS, head_hidden)?;
            heads.push(Dense::new(&weights, &biases, Activation::Linear));
        }
        let evidence = match &sidecar.density {
            Some(density) => {
                stack(tensors.layer("evidence.0", architecture.evidence_hidden, n_latent)?);
                Some(EvidenceHead::new(&tensors, architecture, density.log_budget)?)
            }
            None => None,
        };
        Ok(Self { encoder, hidden: Dense::new(&weights, &biases, leaky), heads, head_hidden, evidence })
    }

    /// Whether predictions come with density and evidence.
    pub fn is_evidential(&self) -> bool {
        self.evidence.is_some()
    }

    /// Bytes of the packed weights.
    pub fn n_bytes(&self) -> usize {
        let scales = self.evidence.as_ref().map(|evidence| &evidence.scales);
        let layers = self.encoder.iter().chain([&self.hidden]).chain(&self.heads).chain(scales);
        layers.map(Dense::n_bytes).sum()
    }

    /// Buffers of the right sizes.
    pub fn workspace(&self, n_inputs: usize) -> Workspace {
        let widest = self.encoder.iter().map(Dense::n_outputs).max().unwrap_or(0);
        Workspace {
            input: vec![Block::ZERO; n_inputs],
            layers: [vec![Block::ZERO; widest], vec![Block::ZERO; widest]],
            hidden: vec![Block::ZERO; self.hidden.n_outputs()],
            prediction: BlockPrediction {
                probabilities: [[Block::ZERO; N_BINS]; N_HEADS],
                log_density: Block::ZERO,
                evidence: [Block::ZERO; N_HEADS],
            },
        }
    }

    /// From [`Workspace::input`] to [`Workspace::prediction`].
    #[inline(always)]
    pub fn apply<S: Simd>(&self, simd: S, workspace: &mut Workspace) {
        let Workspace { input, layers: [here, there], hidden, prediction } = workspace;
        let (mut from, mut to) = (here, there);
        let mut width = input.len();
        for (k, layer) in self.encoder.iter().enumerate() {
            layer.apply(simd, if k == 0 { input } else { &from[..width] }, to);
            width = layer.n_outputs();
            (from, to) = (to, from);
        }
        let latent = &mut from[..width];
        self.hidden.apply(simd, latent, hidden);
        let parts = hidden.chunks_exact(self.head_hidden);
        for ((head, hidden), probabilities) in self.heads.iter().zip(parts).zip(&mut prediction.probabilities)
        {
            head.apply(simd, hidden, probabilities);
            softmax(simd, probabilities);
        }
        if let Some(evidence) = &self.evidence {
            let hidden = &hidden[N_HEADS * self.head_hidden..];
            evidence.apply(simd, latent, hidden, prediction);
        }
    }
}

impl EvidenceHead {
    fn new(tensors: &Tensors, architecture: &Architecture, log_budget: f64) -> Result<Self, CheckpointError> {
        let (n_latent, n_layers) = (architecture.n_latent, architecture.n_flow_layers);
        let (weights, biases) = tensors.layer("evidence.1", N_HEADS, architecture.evidence_hidden)?;
        let centres = tensors.values("flow.centre", &[n_layers, n_latent])?;
        let [raw_a, raw_b] =
            [tensors.values("flow.alpha", &[n_layers])?, tensors.values("flow.beta", &[n_layers])?];
        Ok(Self {
            scales: Dense::new(&weights, &biases, Activation::Linear),
            flow: RadialFlow::new(centres, raw_a, raw_b, n_latent),
            log_budget: log_budget as f32,
        })
    }

    /// Evidence s n, n = N p(z) (equation 10), s from the latent alone.
    #[inline(always)]
    fn apply<S: Simd>(
        &self,
        simd: S,
        latent: &mut [Block],
        hidden: &[Block],
        prediction: &mut BlockPrediction,
    ) {
        self.scales.apply(simd, hidden, &mut prediction.evidence);
        self.flow.log_density(simd, latent, &mut prediction.log_density);
        let (least, most) = (simd.splat_f32s(-LOG_EVIDENCE_MAX), simd.splat_f32s(LOG_EVIDENCE_MAX));
        for register in 0..Block::n_registers::<S>() {
            let log_density = prediction.log_density.get::<S>(register);
            let log_count = simd.add_f32s(log_density, simd.splat_f32s(self.log_budget));
            let count = exp(simd, simd.min_f32s(simd.max_f32s(log_count, least), most));
            for evidence in &mut prediction.evidence {
                let scale = sigmoid(simd, evidence.get::<S>(register));
                evidence.set::<S>(register, simd.mul_f32s(scale, count));
            }
        }
    }
}

/// Makes a layer for standardised features one for raw features.
fn standardise(weights: &mut [f32], biases: &mut [f32], standardisation: &Standardisation) {
    let Standardisation { mean, deviation } = standardisation;
    for (weights, bias) in weights.chunks_exact_mut(mean.len()).zip(biases) {
        let mut sum = f64::from(*bias);
        for ((weight, mean), deviation) in weights.iter_mut().zip(mean).zip(deviation) {
            let scaled = f64::from(*weight) / f64::from(*deviation);
            sum -= scaled * f64::from(*mean);
            *weight = scaled as f32;
        }
        *bias = sum as f32;
    }
}
