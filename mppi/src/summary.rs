//! The average of the sampled controls, and cost terms in a few numbers.

use crate::chunk::Chunk;
use crate::diagnostics::CostTerm;
use crate::kernel::{self, CHUNK, Kernel, Row, Work};
use bicycle::lanes::{Instructions, Real};

/// What the costs of some rollouts came to.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Totals {
    /// Sums of the terms over the rollouts of finite cost [s].
    pub(crate) terms_s: [f32; CostTerm::COUNT],
    /// Rollouts of finite cost.
    pub(crate) n_finite: f32,
    /// Rollouts that keep every limit.
    pub(crate) n_feasible: f32,
}

impl Totals {
    pub(crate) fn plus(mut self, other: &Self) -> Self {
        self.terms_s.iter_mut().zip(other.terms_s).for_each(|(sum, term)| *sum += term);
        Self {
            n_finite: self.n_finite + other.n_finite,
            n_feasible: self.n_feasible + other.n_feasible,
            ..self
        }
    }

    /// Mean terms [s].
    pub(crate) fn mean_terms_s(&self) -> [f32; CostTerm::COUNT] {
        self.terms_s.map(|sum| sum / self.n_finite.max(1.0))
    }
}

/// Adds up a weighed chunk: its weighted controls and its cost terms.
pub(crate) struct Accumulate<'a> {
    pub(crate) chunk: &'a mut Chunk,
}

impl Accumulate<'_> {
    pub(crate) fn on(self, instructions: Instructions) {
        kernel::run(instructions, self);
    }
}

impl Work for Accumulate<'_> {
    type Output = ();
    #[inline(always)]
    fn run<K: Kernel>(self, kernel: K) {
        let chunk = self.chunk;
        chunk.totals = total(kernel, chunk);
        chunk.is_negligible = chunk.weights.0.iter().all(|&weight| weight == 0.0);
        if chunk.is_negligible {
            return;
        }
        let weights = &chunk.weights;
        // Two steps of two controls at a time: a sum over the lanes is shuffling, which four share.
        for (rows, sums) in chunk.controls.chunks(2).zip(chunk.sums.chunks_mut(2)) {
            let [one, other] = [&rows[0], &rows[rows.len() - 1]];
            let values = [&one[0], &one[1], &other[0], &other[1]].map(|row| dot(kernel, weights, row));
            let [a, b, c, d] = kernel.sums(values);
            sums.iter_mut().zip([[a, b], [c, d]]).for_each(|(sum, value)| *sum = value);
        }
    }
}

/// Products, added up until a pack is left: rollout i in the order of i mod 16, whatever the width of the packs.
#[inline(always)]
fn dot<K: Kernel>(kernel: K, weights: &Row, row: &Row) -> K::Value {
    let mut halves = [kernel.real(0.0); 2];
    for first in (0..CHUNK).step_by(K::WIDTH) {
        let half = usize::from(first % 16 >= K::WIDTH);
        let weight = Real(kernel, kernel.load(weights, first));
        halves[half] = weight.mul_add(Real(kernel, kernel.load(row, first)), halves[half]);
    }
    (halves[0] + halves[1]).1
}

#[inline(always)]
fn total<K: Kernel>(kernel: K, chunk: &Chunk) -> Totals {
    let (zero, one) = (kernel.real(0.0), kernel.real(1.0));
    // Quarantined costs are the largest f32.
    let broken = kernel.real(f64::from(f32::MAX));
    let mut sums = [zero; CostTerm::COUNT];
    let (mut n_finite, mut n_feasible) = (zero, zero);
    for first in (0..CHUNK).step_by(K::WIDTH) {
        let finite = Real(kernel, kernel.load(&chunk.costs, first)).less(broken);
        for (sum, row) in sums.iter_mut().zip(&chunk.terms) {
            *sum = sum.add_where(finite, Real(kernel, kernel.load(row, first)));
        }
        let n_broken = Real(kernel, kernel.load(&chunk.n_broken, first));
        let lateral = Real(kernel, kernel.load(&chunk.terms[CostTerm::Lateral as usize], first));
        let feasible = kernel.and(finite, (n_broken + lateral).less(kernel.real(1e-9)));
        n_finite = n_finite.add_where(finite, one);
        n_feasible = n_feasible.add_where(feasible, one);
    }
    let mut terms_s = [0.0; CostTerm::COUNT];
    for (terms_s, sums) in terms_s.chunks_mut(4).zip(sums.chunks(4)) {
        let values = std::array::from_fn(|place| sums.get(place).unwrap_or(&zero).1);
        terms_s.iter_mut().zip(kernel.sums(values)).for_each(|(term_s, sum)| *term_s = sum);
    }
    let [n_finite, n_feasible, ..] = kernel.sums([n_finite.1, n_feasible.1, zero.1, zero.1]);
    Totals { terms_s, n_finite, n_feasible }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};
    use rand_xoshiro::Xoshiro256PlusPlus;

    /// Each of four packs added up by itself, and all of them at once.
    struct Sums<'a>(&'a [Row; 4]);

    impl Work for Sums<'_> {
        type Output = [[f32; 4]; 2];
        fn run<K: Kernel>(self, kernel: K) -> [[f32; 4]; 2] {
            let values = self.0.each_ref().map(|row| kernel.load(row, 0));
            [values.map(|value| kernel.sum(value)), kernel.sums(values)]
        }
    }

    #[test]
    fn four_sums_at_once_are_those_of_one_after_the_other_to_the_bit() {
        let mut generator = Xoshiro256PlusPlus::seed_from_u64(7);
        for _ in 0..200 {
            let rows: [Row; 4] = std::array::from_fn(|_| {
                Row(std::array::from_fn(|_| generator.random_range(-9.0..9.0_f32).exp2()))
            });
            for instructions in Instructions::all() {
                let [singly, at_once] = kernel::run(instructions, Sums(&rows));
                assert_eq!(singly.map(f32::to_bits), at_once.map(f32::to_bits), "{instructions:?}");
            }
        }
    }
}
