//! Gravity across the slope.

use super::STANDARD_GRAVITY_MPS2;
use super::definition::{Constants, Definition, Driving, Stage, parameters};
use crate::lanes::{Lanes, Real};

parameters! {
    /// Gravity across the slope.
    CrossSlope {
        /// Share S of gravity that acts [-].
        share in "-": -1.5 to 3.0, neutral 0.0, tried [-0.5, 0.5, 1.0, 1.5];
    }
}

impl Definition for CrossSlope {
    const ID: &'static str = "cross_slope";
    const MEANING: &'static str = "cross slope: the tyres have to hold S g dz/dy beside what the curve asks for; understeer and slip do the rest";
    const STAGES: &'static [Stage] = &[Stage::Drive];
    const USES_GROUND: bool = true;

    fn constants(&self, _step_s: f64) -> [f64; 4] {
        [self.share * STANDARD_GRAVITY_MPS2, 0.0, 0.0, 0.0]
    }

    #[inline(always)]
    fn on_drive<L: Lanes>(constants: &Constants, state: &mut Driving<L>) {
        let pull = Real::constant(state.speed.0, constants[0]) * state.slope()[1];
        state.side_acceleration = state.side_acceleration - pull;
    }
}
