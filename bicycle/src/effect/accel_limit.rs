//! Limit of the acceleration.

use super::definition::{Commanding, Constants, Definition, Stage, parameters};
use super::ramp;
use crate::lanes::Lanes;

parameters! {
    /// Limit of the acceleration.
    AccelLimit {
        /// Fastest change of the speed A [m/s2].
        acceleration_mps2 in "m/s2": 0.05 to 1e6, neutral 1e6, tried [0.3, 0.6, 1.0, 1.8, 3.5];
    }
}

impl Definition for AccelLimit {
    const ID: &'static str = "accel_limit";
    const MEANING: &'static str = "acceleration limit: |d speed/dt| <= A";
    const STAGES: &'static [Stage] = &[Stage::Command];

    fn constants(&self, step_s: f64) -> [f64; 4] {
        ramp::constants(self.acceleration_mps2, step_s)
    }

    fn n_slots(&self, _step_s: f64) -> usize {
        1
    }

    fn steady_state(&self, command: [f64; 2]) -> f64 {
        command[0]
    }

    #[inline(always)]
    fn on_command<L: Lanes>(constants: &Constants, state: &mut Commanding<'_, L>) {
        state.speed = ramp::pass(constants, state.memory, state.speed);
    }
}
