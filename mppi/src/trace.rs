//! Every step of every rollout, for costs that look at them all.

use crate::chunk::Chunk;
use crate::cost::{Frame, Place, Step, StepCost};
use crate::kernel::{CHUNK, Row};
use bicycle::MotionState;
use bicycle::lanes::{Lanes, Real};

/// What is kept of one step of a chunk.
#[derive(Clone, Copy)]
pub(crate) struct TraceRows {
    /// Where the step ends: position in cells, yaw in turns, speed [m/s] and what turns.
    pub(crate) state: [Row; 5],
    /// Speed [m/s] and yaw rate [rad/s].
    pub(crate) rates: [Row; 2],
    /// Where the step began.
    pub(crate) risk: [Row; 4],
    /// 1 where the goal was not reached before the step, else 0.
    pub(crate) under_way: Row,
}

impl TraceRows {
    pub(crate) const ZERO: Self =
        Self { state: [Row::ZERO; 5], rates: [Row::ZERO; 2], risk: [Row::ZERO; 4], under_way: Row::ZERO };
}

/// One step of one rollout.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct TracedStep {
    /// Where it ends, in the map frame.
    pub state: MotionState,
    /// What was asked for: speed [m/s], and steering angle [rad] or yaw rate [rad/s].
    pub command: [f32; 2],
    /// Speed of the step before the ground takes its share [m/s].
    pub speed_mps: f32,
    /// Yaw rate of the step after the ground took its share [rad/s].
    pub yaw_rate_radps: f32,
    /// Where it began: worst linear traction [-], angular traction [-], |roll| [rad], |pitch| [rad].
    pub risk: [f32; 4],
    /// Whether the goal was not reached before it: only then does a [`StepCost`] count.
    pub is_under_way: bool,
}

/// All rollouts of an update, step by step, as they were rolled out.
pub struct Trace<'a> {
    pub(crate) chunks: &'a [Chunk],
    pub(crate) frame: Frame,
    pub(crate) start: MotionState,
}

impl Trace<'_> {
    /// Where all rollouts start.
    pub fn start(&self) -> MotionState {
        self.start
    }

    /// Number of rollouts.
    pub fn n_rollouts(&self) -> usize {
        self.chunks.len() * CHUNK
    }

    /// Steps of each.
    pub fn n_steps(&self) -> usize {
        self.chunks.first().map_or(0, |chunk| chunk.trace.len())
    }

    /// A step of a rollout; `None` where there is none.
    pub fn step(&self, rollout: usize, t: usize) -> Option<TracedStep> {
        let chunk = self.chunks.get(rollout / CHUNK).filter(|chunk| t < chunk.trace.len())?;
        Some(chunk.traced_step(rollout % CHUNK, t, &self.frame))
    }
}

/// A step cost whose rollouts are kept.
pub(crate) struct Kept<'a, C>(pub(crate) &'a C);

impl<C: StepCost> StepCost for Kept<'_, C> {
    const IS_NOTHING: bool = C::IS_NOTHING;
    const KEEPS_STEPS: bool = true;

    #[inline(always)]
    fn step<L: Lanes>(&self, step: &Step<'_, L>) -> Real<L> {
        self.0.step(step)
    }

    #[inline(always)]
    fn end<L: Lanes>(&self, end: &Place<'_, L>) -> Real<L> {
        self.0.end(end)
    }
}
