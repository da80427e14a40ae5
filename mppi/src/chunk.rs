//! The memory of one chunk of rollouts: everything that the inner loops write.

use crate::cost::{Frame, Future};
use crate::diagnostics::CostTerm;
use crate::kernel::Row;
use crate::sampling::Control;
use crate::summary::Totals;
use crate::trace::{TraceRows, TracedStep};

/// Controls, costs and sums of [`crate::kernel::CHUNK`] rollouts.
#[derive(Clone)]
pub(crate) struct Chunk {
    /// Speed [m/s] and steering angle [rad] of every step.
    pub(crate) controls: Vec<[Row; 2]>,
    /// Cost of every rollout by term [s].
    pub(crate) terms: [Row; CostTerm::COUNT],
    /// Where every rollout ends, where somebody asks: position in cells, yaw in turns, speed [m/s] and what turns.
    pub(crate) ends: [Row; 5],
    /// Every step of every rollout, where somebody looks at them; else nothing.
    pub(crate) trace: Vec<TraceRows>,
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
            ends: [Row::ZERO; 5],
            trace: Vec::new(),
            costs: Row::ZERO,
            n_broken: Row::ZERO,
            weights: Row::ZERO,
            sums: vec![[0.0; 2]; n_steps],
            is_negligible: false,
            totals: Totals::default(),
        }
    }

    /// One rollout, whose end is kept.
    pub(crate) fn future(&self, lane: usize, frame: &Frame) -> Future {
        let end = frame.state(self.ends.each_ref().map(|row| row.0[lane]));
        Future { end, cost_s: self.costs.0[lane], n_broken: self.n_broken.0[lane] }
    }

    /// One step of one rollout, whose trace is kept.
    pub(crate) fn traced_step(&self, lane: usize, t: usize, frame: &Frame) -> TracedStep {
        let TraceRows { state, rates, risk, under_way } = &self.trace[t];
        let [speed_mps, yaw_rate_radps] = rates.each_ref().map(|row| row.0[lane]);
        TracedStep {
            state: frame.state(state.each_ref().map(|row| row.0[lane])),
            command: self.controls[t].each_ref().map(|row| row.0[lane]),
            speed_mps,
            yaw_rate_radps,
            risk: risk.each_ref().map(|row| row.0[lane]),
            is_under_way: under_way.0[lane] > 0.0,
        }
    }

    /// The controls of one rollout, step by step.
    pub(crate) fn controls_of(&self, lane: usize) -> impl Iterator<Item = Control> + Clone + '_ {
        self.controls.iter().map(move |rows| [rows[0].0[lane], rows[1].0[lane]])
    }
}
