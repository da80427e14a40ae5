//! Steering angle out of proportion with the command.

use super::definition::{Commanding, Constants, Definition, Stage, parameters};
use crate::lanes::{Lanes, Real};

parameters! {
    /// Steering angle out of proportion with the command.
    SteerGain {
        /// Achieved over commanded angle G [-].
        ratio in "-": 0.2 to 2.0, neutral 1.0, tried [0.75, 0.9, 1.1, 1.25];
    }
}

impl Definition for SteerGain {
    const ID: &'static str = "steer_gain";
    const MEANING: &'static str = "steering gain: x = G command (steering ratio, wheelbase)";
    const STAGES: &'static [Stage] = &[Stage::Command];

    #[inline(always)]
    fn on_command<L: Lanes>(constants: &Constants, state: &mut Commanding<'_, L>) {
        state.steering = state.steering * Real::constant(state.steering.0, constants[0]);
    }
}
