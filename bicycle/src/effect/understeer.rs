//! Understeer growing with speed.

use super::definition::{Constants, Definition, Moving, Stage, parameters};
use super::gradient;
use crate::lanes::Lanes;

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

    fn least_at(speed_mps: f64) -> f64 {
        gradient::least_at(speed_mps)
    }

    #[inline(always)]
    fn on_motion<L: Lanes>(constants: &Constants, state: &mut Moving<L>) {
        let [gradient, divisor] = gradient::of(constants, state.forward);
        state.yaw_rate = gradient.mul_add(state.side_acceleration, state.yaw_rate) / divisor;
    }
}
