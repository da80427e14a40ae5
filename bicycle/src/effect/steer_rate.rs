//! Limit of the steering rate.

use super::definition::{Commanding, Constants, Definition, Stage, parameters};
use super::ramp;
use crate::lanes::Lanes;

parameters! {
    /// Limit of the steering rate.
    SteerRate {
        /// Fastest change R [rad/s].
        rate_radps in "rad/s": 0.02 to 1e6, neutral 1e6, tried [0.15, 0.3, 0.6, 1.2, 2.4];
    }
}

impl Definition for SteerRate {
    const ID: &'static str = "steer_rate";
    const MEANING: &'static str = "steering rate limit: |d steering/dt| <= R";
    const STAGES: &'static [Stage] = &[Stage::Command];

    fn constants(&self, step_s: f64) -> [f64; 4] {
        ramp::constants(self.rate_radps, step_s)
    }

    fn n_slots(&self, _step_s: f64) -> usize {
        1
    }

    fn steady_state(&self, command: [f64; 2]) -> f64 {
        command[1]
    }

    #[inline(always)]
    fn on_command<L: Lanes>(constants: &Constants, state: &mut Commanding<'_, L>) {
        state.steering = ramp::pass(constants, state.memory, state.steering);
    }
}
