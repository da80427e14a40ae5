//! Sizes of the networks.

use serde::{Deserialize, Serialize};
use traversability::N_BINS;

/// Sizes of the networks: a shared encoder, a softmax head per traversability parameter, a radial flow on the latent
/// and an evidence head with one sigmoid per parameter (PIETRA, section IV-D).
///
/// Names of the tensors in a checkpoint, weights as [outputs, inputs], f32:
/// `encoder.K.weight`, `encoder.K.bias` for K = 0.. with LeakyReLU of slope [`Architecture::LEAK`] after all but the
/// last, whose output is the latent; `heads.P.0.*`, `heads.P.1.*` for P = 0..4 with LeakyReLU between them, in the
/// order linear traction, angular traction, |roll|, |pitch|; `evidence.0.*`, `evidence.1.*` with LeakyReLU between
/// them; `flow.centre` [layers, latent], `flow.alpha` [layers], `flow.beta` [layers].
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Architecture {
    /// Numbers per footprint.
    pub n_inputs: usize,
    /// Widths of the encoder's hidden layers.
    pub encoder_hidden: Vec<usize>,
    /// Width of the latent, which also sets the certainty budget.
    pub n_latent: usize,
    /// Width of the hidden layer of every head.
    pub head_hidden: usize,
    /// Width of the evidence head's hidden layer.
    pub evidence_hidden: usize,
    /// Layers of the radial flow; 0 for methods without evidence.
    pub n_flow_layers: usize,
}

impl Architecture {
    /// Slope of LeakyReLU for negative arguments.
    pub const LEAK: f32 = 0.01;
    /// Number of traversability parameters.
    pub const N_HEADS: usize = 4;

    /// Multiplications and additions per footprint, the flow's included (3 per latent and layer).
    pub fn multiply_adds(&self) -> usize {
        let mut widths = vec![self.n_inputs];
        widths.extend(&self.encoder_hidden);
        widths.push(self.n_latent);
        let encoder: usize = widths.windows(2).map(|pair| pair[0] * pair[1]).sum();
        let heads = Self::N_HEADS * self.head_hidden * (self.n_latent + N_BINS);
        let evidence = self.evidence_hidden * (self.n_latent + Self::N_HEADS);
        encoder + heads + evidence + 3 * self.n_flow_layers * self.n_latent
    }

    /// Names and shapes of all tensors of a checkpoint. Without a flow there is neither an evidence head.
    pub fn tensor_shapes(&self) -> Vec<(String, Vec<usize>)> {
        let mut shapes = Vec::new();
        let mut layer = |name: String, [n_inputs, n_outputs]: [usize; 2]| {
            shapes.push((format!("{name}.weight"), vec![n_outputs, n_inputs]));
            shapes.push((format!("{name}.bias"), vec![n_outputs]));
        };
        let mut widths = vec![self.n_inputs];
        widths.extend(&self.encoder_hidden);
        widths.push(self.n_latent);
        for (k, pair) in widths.windows(2).enumerate() {
            layer(format!("encoder.{k}"), [pair[0], pair[1]]);
        }
        for head in 0..Self::N_HEADS {
            layer(format!("heads.{head}.0"), [self.n_latent, self.head_hidden]);
            layer(format!("heads.{head}.1"), [self.head_hidden, N_BINS]);
        }
        if self.n_flow_layers > 0 {
            layer("evidence.0".to_owned(), [self.n_latent, self.evidence_hidden]);
            layer("evidence.1".to_owned(), [self.evidence_hidden, Self::N_HEADS]);
            shapes.push(("flow.centre".to_owned(), vec![self.n_flow_layers, self.n_latent]));
            shapes.push(("flow.alpha".to_owned(), vec![self.n_flow_layers]));
            shapes.push(("flow.beta".to_owned(), vec![self.n_flow_layers]));
        }
        shapes
    }

    /// Logarithm of the certainty budget N of equation 10, that of a normal distribution: H log(4 pi) / 2.
    pub fn log_budget(&self) -> f64 {
        0.5 * self.n_latent as f64 * libm::log(4.0 * std::f64::consts::PI)
    }
}
