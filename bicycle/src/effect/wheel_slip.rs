//! A speed controller that reads its wheels.

use super::actuator::lag;
use super::definition::{Constants, Definition, Driving, Role, Stage, parameters};
use crate::lanes::{Lanes, Real};

parameters! {
    /// A speed controller that reads wheels which slip with the force of the drive, or an engine that droops under it.
    WheelSlip {
        /// Slip S per acceleration that the drive gives [s2/m].
        slip_s2_per_m in "s2/m": -0.02 to 0.3, neutral 0.0, tried [0.01, 0.05];
        /// Time constant T with which it follows the force [s].
        time_constant_s in "s": 0.0 to 2.0, neutral 0.0, tried [0.1, 0.5];
    }
}

impl Definition for WheelSlip {
    const ID: &'static str = "wheel_slip";
    const MEANING: &'static str = "slip of the wheels that the controller reads: v (1 + S a) stands for v in the speed loop, with the drive's acceleration a behind a lag of T";
    const ROLE: Role = Role::Calibration;
    const STAGES: &'static [Stage] = &[Stage::Drive];

    fn constants(&self, step_s: f64) -> [f64; 4] {
        [self.slip_s2_per_m, lag::constants(self.time_constant_s, step_s)[0], 0.0, 0.0]
    }

    /// What the drive gives follows from what was wanted, which was measured.
    fn held_follows_per_s(&self) -> Option<f64> {
        Some(0.0)
    }

    #[inline(always)]
    fn on_drive<L: Lanes>(constants: &Constants, state: &mut Driving<L>) {
        let slip = state.held * Real::constant(state.speed.0, constants[0]);
        state.asked_speed = state.asked_speed - state.speed * slip;
    }

    #[inline(always)]
    fn once_driven<L: Lanes>(constants: &Constants, state: &mut Driving<L>) {
        let distance = state.acceleration + state.resisted - state.held;
        state.held = distance.mul_add(Real::constant(state.speed.0, constants[1]), state.held);
    }
}
