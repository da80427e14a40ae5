//! How many futures the time for a decision allows.

/// Futures are sampled in blocks of so many.
const BLOCK: usize = 64;
/// Share of the way that the estimate of a rollout's time goes down towards a shorter one; up it goes at once, because
/// one deadline missed is worse than a few futures less.
const RELIEF: f64 = 0.1;

/// Keeps decisions within their time by sampling fewer futures on a processor that is too slow for all.
#[derive(Clone, Copy, Debug)]
pub struct Budget {
    n_max: usize,
    budget_ns: u64,
    rollout_ns: f64,
}

impl Budget {
    /// For decisions of up to `n_max` futures that may take `budget_ns`.
    pub fn new(n_max: usize, budget_ns: u64) -> Self {
        Self { n_max, budget_ns, rollout_ns: 0.0 }
    }

    /// Futures to sample: all, or as many whole blocks as fit, at least one.
    pub fn n_rollouts(&self) -> usize {
        let fitting = self.budget_ns as f64 / self.rollout_ns;
        if fitting >= self.n_max as f64 { self.n_max } else { (fitting as usize / BLOCK * BLOCK).max(BLOCK) }
    }

    /// Takes in how long a decision of so many futures took.
    pub fn learn(&mut self, n_rollouts: usize, took_ns: u64) {
        let rollout_ns = took_ns as f64 / n_rollouts.max(1) as f64;
        let share = if rollout_ns > self.rollout_ns { 1.0 } else { RELIEF };
        self.rollout_ns += share * (rollout_ns - self.rollout_ns);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_fast_processor_samples_all() {
        let mut budget = Budget::new(1024, 50_000_000);
        assert_eq!(budget.n_rollouts(), 1024, "before anything is known");
        budget.learn(1024, 2_000_000);
        assert_eq!(budget.n_rollouts(), 1024);
    }

    #[test]
    fn a_slow_one_samples_what_fits_and_recovers() {
        let mut budget = Budget::new(1024, 50_000_000);
        // 100 us a rollout: 500 fit into 50 ms, 448 in whole blocks.
        budget.learn(1024, 102_400_000);
        assert_eq!(budget.n_rollouts(), 448);
        // So slow that none fits: one block all the same, or nothing would ever be decided.
        budget.learn(448, 1_000_000_000);
        assert_eq!(budget.n_rollouts(), 64);
        for _ in 0..60 {
            budget.learn(budget.n_rollouts(), 1000 * budget.n_rollouts() as u64);
        }
        assert_eq!(budget.n_rollouts(), 1024);
    }
}
