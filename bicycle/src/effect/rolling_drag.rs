//! Constant resistance.

use super::definition::{Constants, Definition, Driving, Stage, parameters};
use crate::lanes::{Lanes, Real};

parameters! {
    /// Constant resistance.
    RollingDrag {
        /// Deceleration C [m/s2].
        deceleration_mps2 in "m/s2": -1.0 to 5.0, neutral 0.0, tried [0.2, 0.6, 1.2];
    }
}

impl Definition for RollingDrag {
    const ID: &'static str = "rolling_drag";
    const MEANING: &'static str = "rolling drag: dv/dt -= C against the motion";
    const STAGES: &'static [Stage] = &[Stage::Drive];

    #[inline(always)]
    fn on_drive<L: Lanes>(constants: &Constants, state: &mut Driving<L>) {
        let drag = Real::constant(state.speed.0, constants[0]);
        state.acceleration = state.acceleration - drag * state.direction();
    }
}
