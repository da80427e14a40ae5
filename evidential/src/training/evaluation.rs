//! How good the networks are on data they do not learn from.

use candle_core::Result;
use serde::{Deserialize, Serialize};

use super::samples::Samples;
use crate::Architecture;
use crate::loss::{LossTerms, N_TARGETS, Scored};
use crate::network::Network;

/// Rows judged at a time.
const CHUNK: usize = 1024;

/// Percentiles of something over a dataset.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Percentiles {
    /// 5 % lie below.
    pub p05: f64,
    /// 25 % lie below.
    pub p25: f64,
    /// Half lies below.
    pub p50: f64,
    /// 75 % lie below.
    pub p75: f64,
    /// 95 % lie below.
    pub p95: f64,
}

impl Percentiles {
    /// Of at least one number; the nearest rank, without interpolation.
    pub(super) fn of(mut values: Vec<f64>) -> Self {
        values.sort_by(f64::total_cmp);
        let last = values.len() - 1;
        let at = |share: f64| values[(share * last as f64).round() as usize];
        Self { p05: at(0.05), p25: at(0.25), p50: at(0.5), p75: at(0.75), p95: at(0.95) }
    }
}

/// How good the networks are.
pub(super) struct Evaluation {
    /// Mean EMD2 of the expected posterior PMF to the measured bin, per parameter.
    pub emd2: [f64; Architecture::N_HEADS],
    /// n / (n + n_prior) of every example; empty without evidence.
    pub learned_weights: Vec<f64>,
}

impl Evaluation {
    pub(super) fn new(network: &Network, samples: &Samples, terms: &LossTerms) -> Result<Self> {
        let mut sums = [0.0; Architecture::N_HEADS];
        let mut counts = [0usize; Architecture::N_HEADS];
        let mut learned_weights = Vec::new();
        for start in (0..samples.n).step_by(CHUNK) {
            let (inputs, targets) = samples.chunk(start, CHUNK)?;
            let outputs = network.outputs(&inputs)?;
            let width = outputs.dim(1)?;
            let outputs = outputs.flatten_all()?.to_vec1::<f32>()?;
            for (output, target) in outputs.chunks_exact(width).zip(targets.chunks_exact(N_TARGETS)) {
                let Scored { emd2, learned_weight } = terms.score(output, target);
                for (head, emd2) in emd2.into_iter().enumerate() {
                    sums[head] += emd2.unwrap_or(0.0);
                    counts[head] += usize::from(emd2.is_some());
                }
                learned_weights.extend(learned_weight);
            }
        }
        let emd2 = std::array::from_fn(|head| sums[head] / counts[head] as f64);
        Ok(Self { emd2, learned_weights })
    }

    /// Sum over the parameters, by which training is steered.
    pub(super) fn total(&self) -> f64 {
        self.emd2.iter().sum()
    }
}
