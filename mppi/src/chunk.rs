//! The memory of one chunk of rollouts: everything that the inner loops write.

use crate::diagnostics::CostTerm;
use crate::kernel::Row;
use crate::sampling::Control;
use crate::summary::Totals;

/// Controls, costs and sums of [`crate::kernel::CHUNK`] rollouts.
#[derive(Clone)]
pub(crate) struct Chunk {
    /// Speed [m/s] and steering angle [rad] of every step.
    pub(crate) controls: Vec<[Row; 2]>,
    /// Cost of every rollout by term [s].
    pub(crate) terms: [Row; CostTerm::COUNT],
    /// Cost of every rollout [s]; not finite when the rollout met a number that is not.
    pub(crate) costs: Row,
    /// Steps of every rollout that break a limit of attitude.
    pub(crate) n_broken: Row,
    /// Weight of every rollout, not normalised.
    pub(crate) weights: Row,
    /// Weighted sums of the controls of every step.
    pub(crate) sums: Vec<Control>,
    /// Whether every weight is zero; the sums are then not computed.
    pub(crate) is_negligible: bool,
    /// What the costs of the chunk came to.
    pub(crate) totals: Totals,
}

impl Chunk {
    pub(crate) fn new(n_steps: usize) -> Self {
        Self {
            controls: vec![[Row::ZERO; 2]; n_steps],
            terms: [Row::ZERO; CostTerm::COUNT],
            costs: Row::ZERO,
            n_broken: Row::ZERO,
            weights: Row::ZERO,
            sums: vec![[0.0; 2]; n_steps],
            is_negligible: false,
            totals: Totals::default(),
        }
    }

    /// The controls of one rollout, step by step.
    pub(crate) fn controls_of(&self, lane: usize) -> impl Iterator<Item = Control> + Clone + '_ {
        self.controls.iter().map(move |rows| [rows[0].0[lane], rows[1].0[lane]])
    }
}
