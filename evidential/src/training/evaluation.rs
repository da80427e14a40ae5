//! How good the networks are on data they do not learn from.

use std::collections::BTreeMap;

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
    /// Standard error of its sum over the parameters: how much other drives of the kind would change it.
    pub standard_error: f64,
    /// n / (n + n_prior) of every example; empty without evidence.
    pub learned_weights: Vec<f64>,
}

impl Evaluation {
    pub(super) fn new(network: &Network, samples: &Samples, terms: &LossTerms) -> Result<Self> {
        let mut by_drive: BTreeMap<u32, Errors> = BTreeMap::new();
        let mut learned_weights = Vec::new();
        for (scored, &drive) in scores(network, samples, terms)?.iter().zip(samples.drives()) {
            by_drive.entry(drive).or_default().add(&scored.emd2);
            learned_weights.extend(scored.learned_weight);
        }
        let (emd2, standard_error) = means(by_drive.values());
        Ok(Self { emd2, standard_error, learned_weights })
    }

    /// Sum over the parameters, by which training is steered.
    pub(super) fn total(&self) -> f64 {
        self.emd2.iter().sum()
    }
}

/// How well each example is met.
pub(super) fn scores(network: &Network, samples: &Samples, terms: &LossTerms) -> Result<Vec<Scored>> {
    let mut scores = Vec::with_capacity(samples.n);
    for start in (0..samples.n).step_by(CHUNK) {
        let (inputs, targets) = samples.chunk(start, CHUNK)?;
        let outputs = network.outputs(&inputs)?;
        let width = outputs.dim(1)?;
        let outputs = outputs.flatten_all()?.to_vec1::<f32>()?;
        let rows = outputs.chunks_exact(width).zip(targets.chunks_exact(N_TARGETS));
        scores.extend(rows.map(|(output, target)| terms.score(output, target)));
    }
    Ok(scores)
}

/// Errors of one drive, added up per parameter.
#[derive(Default)]
struct Errors {
    sums: [f64; Architecture::N_HEADS],
    counts: [f64; Architecture::N_HEADS],
}

impl Errors {
    fn add(&mut self, emd2: &[Option<f64>; Architecture::N_HEADS]) {
        for (head, emd2) in emd2.iter().enumerate() {
            self.sums[head] += emd2.unwrap_or(0.0);
            self.counts[head] += f64::from(u8::from(emd2.is_some()));
        }
    }
}

/// Mean over all examples per parameter, and the standard error of the sum of these means. Drives are drawn, not
/// examples, since neighbours in time are alike: the means are ratios of sums over drives, whose variance is that of
/// their linear form (Cochran, Sampling Techniques, section 6.3).
fn means<'a>(drives: impl Iterator<Item = &'a Errors> + Clone) -> ([f64; Architecture::N_HEADS], f64) {
    let total = |of: fn(&Errors, usize) -> f64, head: usize| drives.clone().map(|d| of(d, head)).sum::<f64>();
    let counts: [f64; Architecture::N_HEADS] =
        std::array::from_fn(|head| total(|d, head| d.counts[head], head));
    let emd2: [f64; Architecture::N_HEADS] =
        std::array::from_fn(|head| total(|d, head| d.sums[head], head) / counts[head]);
    let of_drive = |drive: &Errors| -> f64 {
        (0..counts.len())
            .map(|head| (drive.sums[head] - emd2[head] * drive.counts[head]) / counts[head])
            .sum()
    };
    let n = drives.clone().count() as f64;
    let squares: f64 = drives.map(|drive| of_drive(drive).powi(2)).sum();
    (emd2, (squares * n / (n - 1.0).max(1.0)).sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn standard_error_is_that_of_the_mean_over_drives() {
        // Drives of one example each, errors 1, 2 and 6 in one parameter and 0 in the others: mean 3, variance 7.
        let drive = |error: f64| Errors { sums: [error, 0.0, 0.0, 0.0], counts: [1.0; 4] };
        let drives = [drive(1.0), drive(2.0), drive(6.0)];
        let (emd2, standard_error) = means(drives.iter());
        assert_eq!(emd2, [3.0, 0.0, 0.0, 0.0]);
        assert!((standard_error - (7f64 / 3.0).sqrt()).abs() < 1e-12);
        // The same drives with every example a hundred times: no more is known.
        let longer = drives.map(|d| Errors { sums: d.sums.map(|s| 100.0 * s), counts: [100.0; 4] });
        assert!((means(longer.iter()).1 - standard_error).abs() < 1e-12);
    }
}
