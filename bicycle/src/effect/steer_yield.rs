//! Steering that yields as the speed grows.

use super::definition::{Constants, Definition, Moving, Stage, parameters};
use super::gradient;
use crate::lanes::Lanes;

parameters! {
    /// Steering that yields as the speed grows.
    SteerYield {
        /// Coefficient K [s2/m2].
        gradient_s2_per_m2 in "s2/m2": -0.01 to 1.0, neutral 0.0, tried [-0.004, 0.004, 0.012, 0.04, 0.12];
    }
}

impl Definition for SteerYield {
    const ID: &'static str = "steer_yield";
    const CAUSE: &'static str = "understeer";
    const MEANING: &'static str = "understeer of the steering, not of the tyres: yaw rate = v tan(steering) / (L (1 + K v^2)), whatever pushes sideways";
    const STAGES: &'static [Stage] = &[Stage::Motion];

    fn least_at(speed_mps: f64) -> f64 {
        gradient::least_at(speed_mps)
    }

    #[inline(always)]
    fn on_motion<L: Lanes>(constants: &Constants, state: &mut Moving<L>) {
        let [_, divisor] = gradient::of(constants, state.forward);
        state.yaw_rate = state.yaw_rate / divisor;
    }
}
