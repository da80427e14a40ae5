//! Cost terms of all rollouts in a few numbers.

use crate::chunk::Chunk;
use crate::diagnostics::CostTerm;
use crate::kernel::{CHUNK, Kernel, Work};
use bicycle::lanes::Real;

/// What the costs of an iteration came to.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct CostSummary {
    /// Terms of the cheapest rollout [s].
    pub(crate) best_terms_s: [f32; CostTerm::COUNT],
    /// Mean terms over the rollouts of finite cost [s].
    pub(crate) mean_terms_s: [f32; CostTerm::COUNT],
    /// Rollouts that keep every limit.
    pub(crate) n_feasible: usize,
}

/// Sums up weighed chunks.
pub(crate) struct Summarize<'a> {
    pub(crate) chunks: &'a [Chunk],
    pub(crate) baseline_s: f32,
}

impl Work for Summarize<'_> {
    type Output = CostSummary;
    #[inline(always)]
    fn run<K: Kernel>(self, kernel: K) -> CostSummary {
        let (zero, one) = (kernel.real(0.0), kernel.real(1.0));
        // Quarantined costs are the largest f32.
        let broken = kernel.real(f64::from(f32::MAX));
        let mut sums = [zero; CostTerm::COUNT];
        let (mut n_finite, mut n_feasible) = (zero, zero);
        let mut summary = CostSummary::default();
        for chunk in self.chunks {
            for first in (0..CHUNK).step_by(K::WIDTH) {
                let load = |row| Real(kernel, kernel.load(row, first));
                let finite = load(&chunk.costs).less(broken);
                let terms = chunk.terms.each_ref().map(load);
                for (sum, term) in sums.iter_mut().zip(terms) {
                    *sum = sum.add_where(finite, term);
                }
                let excess = terms[CostTerm::Attitude as usize] + terms[CostTerm::Lateral as usize];
                n_finite = n_finite.add_where(finite, one);
                n_feasible =
                    n_feasible.add_where(kernel.and(finite, excess.less(one * kernel.real(1e-9))), one);
            }
            if let Some(lane) = chunk.costs.0.iter().position(|&cost| cost == self.baseline_s) {
                summary.best_terms_s = chunk.terms.each_ref().map(|row| row.0[lane]);
            }
        }
        let n_finite = kernel.sum(n_finite.1).max(1.0);
        summary.mean_terms_s = sums.map(|sum| kernel.sum(sum.1) / n_finite);
        summary.n_feasible = kernel.sum(n_feasible.1) as usize;
        summary
    }
}
