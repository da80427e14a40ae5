//! First-order lag of the speed command.

use super::definition::{Commanding, Constants, Definition, Stage, parameters};
use super::lag;
use crate::lanes::Lanes;

parameters! {
    /// First-order lag of the speed command.
    SpeedLag {
        /// Time constant T [s].
        time_constant_s in "s": 0.0 to 3.0, neutral 0.0, tried [0.15, 0.4, 0.8, 1.6];
    }
}

impl Definition for SpeedLag {
    const ID: &'static str = "speed_lag";
    const MEANING: &'static str = "first-order speed: T dx/dt = command - x";
    const STAGES: &'static [Stage] = &[Stage::Command];

    fn constants(&self, step_s: f64) -> [f64; 4] {
        lag::constants(self.time_constant_s, step_s)
    }

    fn n_slots(&self, _step_s: f64) -> usize {
        1
    }

    fn steady_state(&self, command: [f64; 2]) -> f64 {
        command[0]
    }

    #[inline(always)]
    fn on_command<L: Lanes>(constants: &Constants, state: &mut Commanding<'_, L>) {
        state.speed = lag::pass(constants, state.memory, state.speed);
    }
}
