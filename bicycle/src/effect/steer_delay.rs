//! Transport delay of the steering command.

use super::definition::{Commanding, Constants, Definition, Stage, parameters};
use super::delay_line;
use crate::lanes::Lanes;

parameters! {
    /// Transport delay of the steering command.
    SteerDelay {
        /// Delay D [s].
        delay_s in "s": 0.0 to 1.0, neutral 0.0, tried [0.05, 0.12, 0.25, 0.45];
    }
}

impl Definition for SteerDelay {
    const ID: &'static str = "steer_delay";
    const MEANING: &'static str = "transport delay of the steering command: x(t) = command(t - D)";
    const STAGES: &'static [Stage] = &[Stage::Command];

    fn constants(&self, step_s: f64) -> [f64; 4] {
        delay_line::constants(self.delay_s, step_s)
    }

    fn n_slots(&self, step_s: f64) -> usize {
        delay_line::n_slots(self.delay_s, step_s)
    }

    fn steady_state(&self, command: [f64; 2]) -> f64 {
        command[1]
    }

    #[inline(always)]
    fn on_command<L: Lanes>(constants: &Constants, state: &mut Commanding<'_, L>) {
        state.steering = delay_line::pass(constants, state.memory, state.step, state.steering);
    }
}
