//! A speed controller that closes the distance to the command in proportion.

use super::actuator::lag;
use super::definition::{Constants, Definition, Driving, Role, Stage, parameters};
use crate::lanes::{Lanes, Real};

parameters! {
    /// A speed controller that closes the distance to the command in proportion.
    SpeedLoop {
        /// Time constant T [s].
        time_constant_s in "s": 0.0 to 5.0, neutral 0.0, tried [0.2, 0.5, 1.0];
    }
}

impl Definition for SpeedLoop {
    const ID: &'static str = "speed_loop";
    const MEANING: &'static str = "speed loop: dv/dt = (command - v) / T, so that forces leave an offset";
    const ROLE: Role = Role::Calibration;
    const STAGES: &'static [Stage] = &[Stage::Drive];

    fn constants(&self, step_s: f64) -> [f64; 4] {
        [lag::constants(self.time_constant_s, step_s)[0] / step_s, 0.0, 0.0, 0.0]
    }

    #[inline(always)]
    fn on_drive<L: Lanes>(constants: &Constants, state: &mut Driving<L>) {
        let rate = Real::constant(state.speed.0, constants[0]);
        let limit = state.acceleration.abs();
        state.acceleration = ((state.asked_speed - state.speed) * rate).clamp(-limit, limit);
        state.drive_by(state.asked_acceleration);
    }
}
