//! Resistance of the turned front wheels.

use super::definition::{Constants, Definition, Driving, Role, Stage, parameters};
use crate::lanes::{Lanes, Real};

parameters! {
    /// Resistance of the turned front wheels.
    CorneringDrag {
        /// Share C of the ideal tyre force [-].
        share in "-": -1.0 to 5.0, neutral 0.0, tried [0.3, 1.0];
    }
}

impl Definition for CorneringDrag {
    const ID: &'static str = "cornering_drag";
    const MEANING: &'static str =
        "cornering drag: dv/dt -= C v |yaw_rate tan(steering)|, the front tyres lateral force along the body";
    const ROLE: Role = Role::Calibration;
    const STAGES: &'static [Stage] = &[Stage::Drive];

    #[inline(always)]
    fn on_drive<L: Lanes>(constants: &Constants, state: &mut Driving<L>) {
        let pull = state.speed * (state.yaw_rate * state.steering_tangent).abs();
        state.acceleration = state.acceleration - pull * Real::constant(state.speed.0, constants[0]);
    }
}
