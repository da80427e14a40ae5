//! Steering that is not straight when it is told to be.

use super::definition::{Commanding, Constants, Definition, Stage, parameters};
use crate::lanes::{Lanes, Real};

parameters! {
    /// Steering that is not straight when it is told to be.
    SteerBias {
        /// Angle B at a command of zero [rad].
        angle_rad in "rad": -0.3 to 0.3, neutral 0.0, tried [-0.06, -0.02, 0.02, 0.06];
    }
}

impl Definition for SteerBias {
    const ID: &'static str = "steer_bias";
    const MEANING: &'static str = "steering bias: x = command + B (trim)";
    const STAGES: &'static [Stage] = &[Stage::Command];

    #[inline(always)]
    fn on_command<L: Lanes>(constants: &Constants, state: &mut Commanding<'_, L>) {
        state.steering = state.steering + Real::constant(state.steering.0, constants[0]);
    }
}
