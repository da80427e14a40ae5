//! The order in which rollouts are judged when the plan itself may not be driven.

use crate::chunk::Chunk;
use crate::kernel::CHUNK;
use std::cmp::Ordering;

/// Room for the order of all rollouts.
#[derive(Clone, Debug, Default)]
pub(crate) struct Ranking(Vec<Rank>);

#[derive(Clone, Copy, Debug)]
struct Rank {
    n_broken: f32,
    cost_s: f32,
    number: usize,
}

impl Rank {
    fn compare(&self, other: &Self) -> Ordering {
        let by_cost = || self.cost_s.total_cmp(&other.cost_s);
        let by_number = || self.number.cmp(&other.number);
        self.n_broken.total_cmp(&other.n_broken).then_with(by_cost).then_with(by_number)
    }
}

impl Ranking {
    /// Room for `n` rollouts.
    pub(crate) fn new(n: usize) -> Self {
        Self(Vec::with_capacity(n))
    }

    /// Chunk and lane of the first `n` rollouts of finite cost: those that break a limit in the fewest steps first, and
    /// of them the cheapest. Allocates nothing.
    pub(crate) fn first(&mut self, n: usize, chunks: &[Chunk]) -> impl Iterator<Item = (usize, usize)> {
        self.0.clear();
        for (index, chunk) in chunks.iter().enumerate() {
            let ranks = chunk.costs.0.iter().zip(&chunk.n_broken.0).enumerate();
            let rank = |(lane, (&cost_s, &n_broken))| Rank { n_broken, cost_s, number: index * CHUNK + lane };
            // Costs that are not finite were replaced by the largest number.
            self.0.extend(ranks.map(rank).filter(|rank| rank.cost_s < f32::MAX));
        }
        if n < self.0.len() {
            self.0.select_nth_unstable_by(n, Rank::compare);
            self.0.truncate(n);
        }
        self.0.sort_unstable_by(Rank::compare);
        self.0.iter().map(|rank| (rank.number / CHUNK, rank.number % CHUNK))
    }
}
