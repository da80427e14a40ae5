//! Speed commands too small to move the motor.

use super::definition::{Commanding, Constants, Definition, Stage, parameters};
use crate::lanes::{Lanes, Real};

parameters! {
    /// Speed commands too small to move the motor.
    MotorDeadband {
        /// Smallest command D that moves it [m/s].
        speed_mps in "m/s": 0.0 to 5.0, neutral 0.0, tried [0.3, 0.6, 1.0, 1.8, 3.0];
    }
}

impl Definition for MotorDeadband {
    const ID: &'static str = "motor_deadband";
    const MEANING: &'static str = "motor deadband: speed command = 0 where |command| < D";
    const STAGES: &'static [Stage] = &[Stage::Command];

    #[inline(always)]
    fn on_command<L: Lanes>(constants: &Constants, state: &mut Commanding<'_, L>) {
        let lanes = state.speed.0;
        let still = state.speed.abs().less(Real::constant(lanes, constants[0]));
        state.speed = lanes.real(0.0).or_else(still, state.speed);
    }
}
