//! Sideslip of the rear axle.

use super::definition::{Constants, Definition, Moving, Role, Stage, parameters};
use crate::lanes::{Lanes, Real};

parameters! {
    /// Sideslip of the rear axle.
    RearSlip {
        /// Slip angle C per lateral acceleration of the tyres [s2/m].
        compliance_s2_per_m in "s2/m": -0.05 to 0.2, neutral 0.0, tried [0.005, 0.02];
    }
}

impl Definition for RearSlip {
    const ID: &'static str = "rear_slip";
    const MEANING: &'static str = "rear slip: lateral speed = -C v (v yaw_rate - a_side)";
    const ROLE: Role = Role::Calibration;
    const STAGES: &'static [Stage] = &[Stage::Motion];

    #[inline(always)]
    fn on_motion<L: Lanes>(constants: &Constants, state: &mut Moving<L>) {
        let slip = state.tyre_acceleration() * Real::constant(state.forward.0, constants[0]);
        state.lateral = state.lateral - slip * state.forward;
    }
}
