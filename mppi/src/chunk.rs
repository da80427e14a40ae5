//! The memory of one chunk of rollouts: everything that the inner loops write.

use crate::diagnostics::CostTerm;
use crate::kernel::Row;

/// Sixteen partial sums, the same on every instruction set.
pub(crate) type Partial = [f32; 16];

/// Controls, costs and sums of [`crate::kernel::CHUNK`] rollouts.
#[derive(Clone)]
pub(crate) struct Chunk {
    /// Speed [m/s] and steering angle [rad] of every step.
    pub(crate) controls: Vec<[Row; 2]>,
    /// Cost of every rollout by term [s].
    pub(crate) terms: [Row; CostTerm::COUNT],
    /// Cost of every rollout [s]; not finite when the rollout met a number that is not.
    pub(crate) costs: Row,
    /// Weight of every rollout, not normalised.
    pub(crate) weights: Row,
    /// Weighted sums of the controls of every step.
    pub(crate) sums: Vec<[Partial; 2]>,
    /// Whether every weight is zero; the sums are then not computed.
    pub(crate) is_negligible: bool,
}

impl Chunk {
    pub(crate) fn new(n_steps: usize) -> Self {
        Self {
            controls: vec![[Row::ZERO; 2]; n_steps],
            terms: [Row::ZERO; CostTerm::COUNT],
            costs: Row::ZERO,
            weights: Row::ZERO,
            sums: vec![[[0.0; 16]; 2]; n_steps],
            is_negligible: false,
        }
    }
}
