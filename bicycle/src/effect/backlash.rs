//! Play in the steering.

use super::definition::{Commanding, Constants, Definition, Stage, parameters};
use crate::lanes::{Lanes, Real};

parameters! {
    /// Play in the steering.
    Backlash {
        /// Half the play H [rad].
        half_width_rad in "rad": 0.0 to 0.3, neutral 0.0, tried [0.01, 0.025, 0.05, 0.1];
    }
}

impl Definition for Backlash {
    const ID: &'static str = "backlash";
    const MEANING: &'static str =
        "backlash: the steering moves only when the command pushes against an edge of its play of +-H";
    const STAGES: &'static [Stage] = &[Stage::Command];

    fn n_slots(&self, _step_s: f64) -> usize {
        1
    }

    fn steady_state(&self, command: [f64; 2]) -> f64 {
        command[1]
    }

    #[inline(always)]
    fn on_command<L: Lanes>(constants: &Constants, state: &mut Commanding<'_, L>) {
        let lanes = state.steering.0;
        let half = Real::constant(lanes, constants[0]);
        let reached = Real(lanes, state.memory[0]);
        state.steering = reached.clamp(state.steering - half, state.steering + half);
        state.memory[0] = state.steering.1;
    }
}
