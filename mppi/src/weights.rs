//! From costs to weights: the information-theoretic soft minimum (Williams et al. 2017) and its temperature.

mod temperature;

use crate::chunk::Chunk;
use crate::config::Temperature;
use crate::kernel::functions::exp_of_negative;
use crate::kernel::{self, CHUNK, Kernel, Row, Work};
use bicycle::lanes::{Instructions, Real};

/// Costs above this count as not finite.
const WORST_COST_S: f64 = 1e30;

/// What the weights of an iteration came to.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct WeightSummary {
    /// Least cost of all rollouts [s].
    pub(crate) baseline_s: f32,
    /// Sum of the weights exp((baseline - cost) / temperature).
    pub(crate) normalizer: f32,
    /// (sum w)^2 / sum w^2.
    pub(crate) effective_sample_size: f32,
    /// Temperature that was used [s].
    pub(crate) temperature_s: f32,
    /// Rollouts without a finite cost; they have no weight.
    pub(crate) n_non_finite: usize,
    /// Chunk and lane of the cheapest rollout.
    pub(crate) best: (usize, usize),
}

impl WeightSummary {
    /// -T ln(mean exp(-cost / T)) over `n` rollouts [s].
    pub(crate) fn free_energy_s(&self, n: usize) -> f32 {
        self.baseline_s - self.temperature_s * libm::logf(self.normalizer / n as f32)
    }
}

/// Weighs all rollouts; `last_s` is the temperature to search from.
pub(crate) struct Weigh<'a> {
    pub(crate) chunks: &'a mut [Chunk],
    pub(crate) temperature: Temperature,
    pub(crate) last_s: f32,
}

impl Weigh<'_> {
    pub(crate) fn on(self, instructions: Instructions) -> WeightSummary {
        kernel::run(instructions, self)
    }
}

impl Work for Weigh<'_> {
    type Output = WeightSummary;
    #[inline(always)]
    fn run<K: Kernel>(self, kernel: K) -> WeightSummary {
        let mut n_non_finite = 0;
        let (mut baseline_s, mut best_chunk) = (f32::MAX, 0);
        for (index, chunk) in self.chunks.iter_mut().enumerate() {
            n_non_finite += quarantine(&mut chunk.costs);
            let least_s = least(kernel, &chunk.costs);
            if least_s < baseline_s {
                (baseline_s, best_chunk) = (least_s, index);
            }
        }
        let costs = &self.chunks[best_chunk].costs.0;
        let best = (best_chunk, costs.iter().position(|&cost| cost == baseline_s).unwrap_or(0));
        let temperature_s = match self.temperature {
            Temperature::Fixed { temperature_s } => temperature_s as f32,
            Temperature::EffectiveSampleSize { fraction } => {
                let wanted = fraction as f32 * (self.chunks.len() * CHUNK) as f32;
                let sample_size = |temperature_s| weigh_all(kernel, self.chunks, baseline_s, temperature_s).1;
                let found_s = temperature::find(wanted, self.last_s, sample_size);
                found_s.clamp(Temperature::LOWEST_S, Temperature::HIGHEST_S)
            }
        };
        let (normalizer, effective_sample_size) = weigh_all(kernel, self.chunks, baseline_s, temperature_s);
        WeightSummary { baseline_s, normalizer, effective_sample_size, temperature_s, n_non_finite, best }
    }
}

#[inline(always)]
fn least<K: Kernel>(kernel: K, costs: &Row) -> f32 {
    let mut least = kernel.real(f64::from(f32::MAX));
    for first in (0..CHUNK).step_by(K::WIDTH) {
        least = least.min(Real(kernel, kernel.load(costs, first)));
    }
    kernel.smallest(least.1)
}

/// Replaces costs that are not finite by the worst finite one; counts them.
#[inline(always)]
fn quarantine(costs: &mut Row) -> usize {
    let mut n = 0;
    for cost in &mut costs.0 {
        let broken = cost.is_nan() || cost.abs() > WORST_COST_S as f32;
        n += usize::from(broken);
        *cost = if broken { f32::MAX } else { *cost };
    }
    n
}

/// Fills in the weights; their sum and the effective sample size.
#[inline(always)]
fn weigh_all<K: Kernel>(kernel: K, chunks: &mut [Chunk], baseline_s: f32, temperature_s: f32) -> (f32, f32) {
    let (baseline, inverse) =
        (kernel.real(f64::from(baseline_s)), kernel.real(1.0 / f64::from(temperature_s)));
    let (mut sum, mut squares) = (kernel.real(0.0), kernel.real(0.0));
    for chunk in chunks {
        for first in (0..CHUNK).step_by(K::WIDTH) {
            let cost = Real(kernel, kernel.load(&chunk.costs, first));
            let weight = exp_of_negative((baseline - cost) * inverse);
            (sum, squares) = (sum + weight, weight.mul_add(weight, squares));
            kernel.store(&mut chunk.weights, first, weight.1);
        }
    }
    let sum = kernel.sum(sum.1);
    (sum, sum * sum / kernel.sum(squares.1))
}

#[cfg(test)]
mod tests;
