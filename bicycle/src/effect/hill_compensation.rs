//! A speed controller that pushes against the slope that it feels.

use super::STANDARD_GRAVITY_MPS2;
use super::definition::{Constants, Definition, Driving, Role, Stage, parameters};
use crate::lanes::{Lanes, Real};

parameters! {
    /// A speed controller that pushes against the slope that it feels.
    HillCompensation {
        /// Share C of the nominal vehicle's weight along the slope that it pushes against [-].
        share in "-": 0.0 to 1.5, neutral 0.0, tried [0.5, 1.0];
    }
}

impl Definition for HillCompensation {
    const ID: &'static str = "hill_compensation";
    const MEANING: &'static str =
        "hill compensation: the drive gives C g dz/dx more, within its limits and before the mass";
    const ROLE: Role = Role::Calibration;
    const STAGES: &'static [Stage] = &[Stage::Drive];
    const USES_GROUND: bool = true;

    fn constants(&self, _step_s: f64) -> [f64; 4] {
        [self.share * STANDARD_GRAVITY_MPS2, 0.0, 0.0, 0.0]
    }

    #[inline(always)]
    fn on_drive<L: Lanes>(constants: &Constants, state: &mut Driving<L>) {
        let push = Real::constant(state.speed.0, constants[0]) * state.slope()[0];
        state.drive_by(push);
    }
}
