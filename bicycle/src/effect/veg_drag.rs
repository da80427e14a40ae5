//! Resistance in vegetation.

use super::definition::{Constants, Definition, Driving, Stage, parameters};
use crate::lanes::{Constant, Lanes, Real};

parameters! {
    /// Resistance in vegetation.
    VegDrag {
        /// Deceleration C [m/s2].
        deceleration_mps2 in "m/s2": -1.0 to 8.0, neutral 0.0, tried [0.4, 1.2, 2.5];
    }
}

impl Definition for VegDrag {
    const ID: &'static str = "veg_drag";
    const MEANING: &'static str = "vegetation drag: dv/dt -= C against the motion, in vegetation only";
    const STAGES: &'static [Stage] = &[Stage::Drive];
    const USES_GROUND: bool = true;

    #[inline(always)]
    fn on_drive<L: Lanes>(constants: &Constants, state: &mut Driving<L>) {
        let drag = Real::constant(state.speed.0, constants[0]) * state.on_class(Constant::new(2.0));
        state.acceleration = state.acceleration - drag * state.direction();
    }
}
