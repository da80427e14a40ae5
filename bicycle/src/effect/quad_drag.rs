//! Resistance growing with the square of the speed.

use super::definition::{Constants, Definition, Driving, Stage, parameters};
use crate::lanes::{Lanes, Real};

parameters! {
    /// Resistance growing with the square of the speed.
    QuadDrag {
        /// Coefficient C [1/m].
        coefficient_per_m in "1/m": -0.05 to 2.0, neutral 0.0, tried [0.01, 0.03, 0.1, 0.3];
    }
}

impl Definition for QuadDrag {
    const ID: &'static str = "quad_drag";
    const MEANING: &'static str = "quadratic drag: dv/dt -= C v |v|";
    const STAGES: &'static [Stage] = &[Stage::Drive];

    #[inline(always)]
    fn on_drive<L: Lanes>(constants: &Constants, state: &mut Driving<L>) {
        let drag = Real::constant(state.speed.0, constants[0]);
        state.acceleration = state.acceleration - drag * state.speed * state.speed.abs();
    }
}
