//! Resistance of loose ground.

use super::definition::{Constants, Definition, Driving, Role, Stage, parameters};
use crate::lanes::{Constant, Lanes, Real};

parameters! {
    /// Resistance of loose ground.
    LooseDrag {
        /// Deceleration C [m/s2].
        deceleration_mps2 in "m/s2": -1.0 to 8.0, neutral 0.0, tried [0.4, 1.2, 2.5];
    }
}

impl Definition for LooseDrag {
    const ID: &'static str = "loose_drag";
    const MEANING: &'static str = "loose-ground drag: dv/dt -= C against the motion, in loose ground only";
    const ROLE: Role = Role::Calibration;
    const STAGES: &'static [Stage] = &[Stage::Drive];
    const USES_GROUND: bool = true;

    #[inline(always)]
    fn on_drive<L: Lanes>(constants: &Constants, state: &mut Driving<L>) {
        let drag = Real::constant(state.speed.0, constants[0]) * state.on_class(Constant::new(1.0));
        state.acceleration = state.acceleration - drag * state.direction();
    }
}
