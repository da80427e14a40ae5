//! A speed controller that asks the drive for the command's own acceleration.

use super::definition::{Commanding, Constants, Definition, Role, Stage, parameters};
use crate::lanes::{Lanes, Real};

parameters! {
    /// A speed controller that asks the drive for the command's own acceleration.
    FeedForward {
        /// Share F of it that is asked for [-].
        share in "-": 0.0 to 1.5, neutral 0.0, tried [0.5, 1.0];
    }
}

impl Definition for FeedForward {
    const ID: &'static str = "feed_forward";
    const MEANING: &'static str =
        "feed-forward to the speed loop: dv/dt = (command - v) / T + F d command/dt";
    const ROLE: Role = Role::Calibration;
    const STAGES: &'static [Stage] = &[Stage::Command];

    fn constants(&self, step_s: f64) -> [f64; 4] {
        [self.share / step_s, 0.0, 0.0, 0.0]
    }

    fn n_slots(&self, _step_s: f64) -> usize {
        1
    }

    fn steady_state(&self, command: [f64; 2]) -> f64 {
        command[0]
    }

    #[inline(always)]
    fn on_command<L: Lanes>(constants: &Constants, state: &mut Commanding<'_, L>) {
        let lanes = state.speed.0;
        let change = state.speed - Real(lanes, state.memory[0]);
        state.memory[0] = state.speed.1;
        state.acceleration = change.mul_add(Real::constant(lanes, constants[0]), state.acceleration);
    }
}
