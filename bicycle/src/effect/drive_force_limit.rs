//! A drive and brakes weaker than the simulator's.

use super::definition::{Constants, Definition, Driving, Stage, parameters};
use crate::lanes::{Lanes, Real};

parameters! {
    /// A drive and brakes weaker than the simulator's.
    DriveForceLimit {
        /// Largest force over mass A [m/s2].
        acceleration_mps2 in "m/s2": 0.05 to 1e6, neutral 1e6, tried [0.5, 1.0, 1.8, 3.0];
    }
}

impl Definition for DriveForceLimit {
    const ID: &'static str = "drive_force_limit";
    const CAUSE: &'static str = "accel_limit";
    const MEANING: &'static str = "acceleration limit made by a weak drive: |drive force| <= A mass";
    const STAGES: &'static [Stage] = &[Stage::Drive];

    #[inline(always)]
    fn on_drive<L: Lanes>(constants: &Constants, state: &mut Driving<L>) {
        let limit = Real::constant(state.speed.0, constants[0]);
        state.acceleration = state.acceleration.clamp(-limit, limit);
    }
}
