//! A drive whose force falls as the speed grows.

use super::definition::{Constants, Definition, Driving, Role, Stage, parameters};
use crate::lanes::{Lanes, Real};

parameters! {
    /// A drive whose force falls as the speed grows.
    DrivePower {
        /// Largest power over mass P [m2/s3].
        power_m2_per_s3 in "m2/s3": 0.05 to 1e4, neutral 1e4, tried [0.5, 1.0, 2.0, 4.0, 8.0, 16.0, 32.0];
    }
}

/// Below this the force is that of this speed [m/s].
const SLOWEST_MPS: f64 = 0.3;

impl Definition for DrivePower {
    const ID: &'static str = "drive_power";
    const MEANING: &'static str = "drive power: acceleration of the drive <= P / max(|v|, 0.3 m/s)";
    const ROLE: Role = Role::Calibration;
    const STAGES: &'static [Stage] = &[Stage::Drive];

    #[inline(always)]
    fn on_drive<L: Lanes>(constants: &Constants, state: &mut Driving<L>) {
        let lanes = state.speed.0;
        let most = Real::constant(lanes, constants[0]) / state.speed.abs().max(lanes.real(SLOWEST_MPS));
        state.acceleration = state.acceleration.min(most);
    }
}
