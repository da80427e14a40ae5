//! Speed out of proportion with the command.

use super::definition::{Commanding, Constants, Definition, Stage, parameters};
use crate::lanes::{Lanes, Real};

parameters! {
    /// Speed out of proportion with the command.
    SpeedScale {
        /// Achieved over commanded speed S [-].
        ratio in "-": 0.2 to 2.0, neutral 1.0, tried [0.8, 0.92, 1.08, 1.2];
    }
}

impl Definition for SpeedScale {
    const ID: &'static str = "speed_scale";
    const MEANING: &'static str = "speed scale: x = S command (wheel radius, linear drag)";
    const STAGES: &'static [Stage] = &[Stage::Command];

    #[inline(always)]
    fn on_command<L: Lanes>(constants: &Constants, state: &mut Commanding<'_, L>) {
        state.speed = state.speed * Real::constant(state.speed.0, constants[0]);
    }
}
