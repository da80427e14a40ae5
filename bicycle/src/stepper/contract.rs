//! The bicycle's steps as what every motion model offers.

use super::Stepper;
use crate::lanes::{Lanes, Real, Scalar};
use crate::{Command, Extent, GroundSample, LaneState, MotionStepper, Rates};

impl MotionStepper for Stepper {
    fn extent(&self) -> Extent {
        match (self.has_effects(), self.has_instant_actuators()) {
            (true, _) => Extent::Whole,
            (false, true) => Extent::Bare,
            (false, false) => Extent::Plain,
        }
    }

    #[inline(always)]
    fn step_bare<L: Lanes>(
        &self,
        state: &mut LaneState<L>,
        command: [Real<L>; 2],
        ground: &GroundSample<Real<L>>,
    ) -> Rates<L> {
        Self::step_bare(self, state, command, ground)
    }

    #[inline(always)]
    fn step_plain<L: Lanes>(
        &self,
        state: &mut LaneState<L>,
        command: [Real<L>; 2],
        ground: &GroundSample<Real<L>>,
    ) -> Rates<L> {
        Self::step_plain(self, state, command, ground)
    }

    #[inline(always)]
    fn step<L: Lanes>(
        &self,
        state: &mut LaneState<L>,
        command: [Real<L>; 2],
        ground: &GroundSample<Real<L>>,
        memory: &mut [L::Value],
        step: usize,
    ) -> Rates<L> {
        Self::step(self, state, command, ground, memory, step)
    }

    fn with_instant_actuators(self) -> Self {
        Self::with_instant_actuators(self)
    }

    fn rescale(&mut self, unit_m: f64) {
        Self::rescale(self, unit_m);
    }

    fn uses_ground(&self) -> bool {
        Self::uses_ground(self)
    }

    fn n_slots(&self) -> usize {
        Self::n_slots(self)
    }

    fn n_held(&self) -> usize {
        Self::n_held(self)
    }

    fn past_s(&self) -> f64 {
        Self::past_s(self)
    }

    fn recall(&self, past: &dyn Fn(f64) -> [f32; 2], memory: &mut [f64]) {
        Self::recall(self, &|age_s| Command::from(past(age_s)), memory);
    }

    fn correct_held(&self, memory: &mut [f64], faster_mps: f64) {
        Self::correct_held(self, memory, Real(Scalar, faster_mps));
    }
}
