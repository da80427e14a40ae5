//! Gravity along the slope.

use super::STANDARD_GRAVITY_MPS2;
use super::definition::{Constants, Definition, Driving, Stage, parameters};
use crate::lanes::{Lanes, Real};

parameters! {
    /// Gravity along the slope.
    SlopeGravity {
        /// Share S of gravity that acts [-].
        share in "-": -1.5 to 2.5, neutral 0.0, tried [-0.5, 0.4, 0.8, 1.2];
    }
}

impl Definition for SlopeGravity {
    const ID: &'static str = "slope_gravity";
    const MEANING: &'static str = "slope gravity: dv/dt -= S g dz/dx ahead";
    const STAGES: &'static [Stage] = &[Stage::Drive];
    const USES_GROUND: bool = true;

    fn constants(&self, _step_s: f64) -> [f64; 4] {
        [self.share * STANDARD_GRAVITY_MPS2, 0.0, 0.0, 0.0]
    }

    #[inline(always)]
    fn on_drive<L: Lanes>(constants: &Constants, state: &mut Driving<L>) {
        let pull = Real::constant(state.speed.0, constants[0]) * state.slope()[0];
        state.acceleration = state.acceleration - pull;
    }
}
