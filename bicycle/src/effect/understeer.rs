//! Understeer growing with speed.

use super::definition::{Constants, Definition, Moving, Stage, parameters};
use crate::lanes::{Lanes, Real};

parameters! {
    /// Understeer growing with speed.
    Understeer {
        /// Coefficient K [s2/m2].
        gradient_s2_per_m2 in "s2/m2": -0.01 to 1.0, neutral 0.0, tried [-0.004, 0.004, 0.012, 0.04, 0.12];
    }
}

impl Definition for Understeer {
    const ID: &'static str = "understeer";
    const MEANING: &'static str = "understeer: yaw rate = (v tan(steering) / L + K v a_side) / (1 + K v^2)";
    const STAGES: &'static [Stage] = &[Stage::Motion];

    #[inline(always)]
    fn on_motion<L: Lanes>(constants: &Constants, state: &mut Moving<L>) {
        let lanes = state.forward.0;
        let gradient = Real::constant(lanes, constants[0]) * state.forward;
        let turned = gradient.mul_add(state.side_acceleration, state.yaw_rate);
        state.yaw_rate = turned / gradient.mul_add(state.forward, lanes.real(1.0));
    }
}
