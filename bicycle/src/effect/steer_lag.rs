//! First-order lag of the steering command.

use super::definition::{Commanding, Constants, Definition, Stage, parameters};
use super::lag;
use crate::lanes::Lanes;

parameters! {
    /// First-order lag of the steering command.
    SteerLag {
        /// Time constant T [s].
        time_constant_s in "s": 0.0 to 2.0, neutral 0.0, tried [0.06, 0.15, 0.3, 0.7];
    }
}

impl Definition for SteerLag {
    const ID: &'static str = "steer_lag";
    const MEANING: &'static str = "first-order steering: T dx/dt = command - x";
    const STAGES: &'static [Stage] = &[Stage::Command];

    fn constants(&self, step_s: f64) -> [f64; 4] {
        lag::constants(self.time_constant_s, step_s)
    }

    fn n_slots(&self, _step_s: f64) -> usize {
        1
    }

    fn steady_state(&self, command: [f64; 2]) -> f64 {
        command[1]
    }

    #[inline(always)]
    fn on_command<L: Lanes>(constants: &Constants, state: &mut Commanding<'_, L>) {
        state.steering = lag::pass(constants, state.memory, state.steering);
    }
}
