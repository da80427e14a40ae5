//! A speed controller that feels a slope late.

use super::STANDARD_GRAVITY_MPS2;
use super::actuator::lag;
use super::definition::{Constants, Definition, Driving, Role, Stage, parameters};
use crate::lanes::{Lanes, Real};

parameters! {
    /// A speed controller that pushes against the slope that it feels, late.
    FeltSlope {
        /// Share C of the nominal vehicle's weight along the slope that it pushes against [-].
        share in "-": 0.0 to 1.5, neutral 0.0, tried [0.5, 1.0];
        /// Time constant T with which it feels the slope [s].
        time_constant_s in "s": 0.0 to 3.0, neutral 0.0, tried [0.2, 0.5];
    }
}

impl Definition for FeltSlope {
    const ID: &'static str = "felt_slope";
    const MEANING: &'static str = "hill compensation that is late: the drive gives what C g dz/dx ahead is behind a lag of T more, within its limits and before the mass";
    const ROLE: Role = Role::Calibration;
    const STAGES: &'static [Stage] = &[Stage::Drive];
    const USES_GROUND: bool = true;

    fn constants(&self, step_s: f64) -> [f64; 4] {
        let closed = lag::constants(self.time_constant_s, step_s)[0];
        [self.share * STANDARD_GRAVITY_MPS2, closed, 0.0, 0.0]
    }

    /// What is felt follows from the ground.
    fn held_follows_per_s(&self) -> Option<f64> {
        Some(0.0)
    }

    #[inline(always)]
    fn on_drive<L: Lanes>(constants: &Constants, state: &mut Driving<L>) {
        let [weight, closed] = [constants[0], constants[1]].map(|value| Real::constant(state.speed.0, value));
        let distance = weight * state.slope()[0] - state.held;
        state.held = distance.mul_add(closed, state.held);
        state.drive_by(state.held);
    }
}
