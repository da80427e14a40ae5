//! What drive and brakes can do.

use super::definition::{Constants, Definition, Driving, Role, Stage, parameters};
use crate::lanes::{Lanes, Real};

parameters! {
    /// What drive and brakes can do.
    DriveLimit {
        /// Largest acceleration A [m/s2].
        acceleration_mps2 in "m/s2": 0.05 to 50.0, neutral 50.0, tried [1.0, 1.5, 2.0, 2.7, 3.5, 4.5, 6.0];
        /// Largest deceleration B [m/s2].
        deceleration_mps2 in "m/s2": 0.05 to 50.0, neutral 50.0, tried [1.0, 1.5, 2.0, 2.7, 3.5, 4.5, 6.0];
    }
}

impl Definition for DriveLimit {
    const ID: &'static str = "drive_limit";
    const MEANING: &'static str = "drive limit: -B <= acceleration of the drive <= A";
    const ROLE: Role = Role::Calibration;
    const STAGES: &'static [Stage] = &[Stage::Drive];

    #[inline(always)]
    fn on_drive<L: Lanes>(constants: &Constants, state: &mut Driving<L>) {
        let lanes = state.speed.0;
        let [most, least] = [constants[0], constants[1]].map(|limit| Real::constant(lanes, limit));
        state.acceleration = state.acceleration.clamp(-least, most);
    }
}
