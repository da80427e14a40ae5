//! A vehicle heavier or lighter than its simulator.

use super::definition::{Constants, Definition, Driving, Stage, parameters};
use crate::lanes::{Lanes, Real};

parameters! {
    /// A vehicle heavier or lighter than its simulator.
    Mass {
        /// True over nominal mass M [-].
        ratio in "-": 0.3 to 4.0, neutral 1.0, tried [0.7, 1.3, 1.7, 2.4];
    }
}

impl Definition for Mass {
    const ID: &'static str = "mass";
    const MEANING: &'static str = "mass: the same drive force accelerates 1/M as much, gravity as before";
    const STAGES: &'static [Stage] = &[Stage::Drive];

    fn constants(&self, _step_s: f64) -> [f64; 4] {
        [1.0 / self.ratio, 0.0, 0.0, 0.0]
    }

    #[inline(always)]
    fn on_drive<L: Lanes>(constants: &Constants, state: &mut Driving<L>) {
        state.acceleration = state.acceleration * Real::constant(state.speed.0, constants[0]);
    }
}
