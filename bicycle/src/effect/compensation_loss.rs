//! A speed controller that pushes less against the slope than its simulator's.

use super::STANDARD_GRAVITY_MPS2;
use super::definition::{Constants, Definition, Driving, Stage, parameters};
use crate::lanes::{Lanes, Real};

parameters! {
    /// A speed controller that pushes less against the slope than its simulator's.
    CompensationLoss {
        /// Share S of the weight along the slope that it does not push against any more [-].
        share in "-": -1.5 to 2.5, neutral 0.0, tried [-0.5, 0.4, 0.8, 1.2];
    }
}

impl Definition for CompensationLoss {
    const ID: &'static str = "compensation_loss";
    const CAUSE: &'static str = "slope_gravity";
    const MEANING: &'static str =
        "slope gravity made by a loss of hill compensation: the drive gives S g dz/dx less, within its limits";
    const STAGES: &'static [Stage] = &[Stage::Drive];
    const USES_GROUND: bool = true;

    fn constants(&self, _step_s: f64) -> [f64; 4] {
        [self.share * STANDARD_GRAVITY_MPS2, 0.0, 0.0, 0.0]
    }

    #[inline(always)]
    fn on_drive<L: Lanes>(constants: &Constants, state: &mut Driving<L>) {
        let push = Real::constant(state.speed.0, constants[0]) * state.slope()[0];
        state.drive_by(-push);
    }
}
