//! Grip of the tyres.

use super::STANDARD_GRAVITY_MPS2;
use super::definition::{Commanding, Constants, Definition, Driving, Moving, Stage, parameters};
use crate::lanes::{Lanes, Real};

parameters! {
    /// Grip of the tyres.
    Friction {
        /// Friction coefficient [-].
        mu in "-": 0.02 to 10.0, neutral 10.0, tried [0.15, 0.25, 0.35, 0.5, 0.8];
    }
}

impl Definition for Friction {
    const ID: &'static str = "friction";
    const MEANING: &'static str = "friction: lateral acceleration a of the tyres falls to a / (1 + (a / mu g)^4)^(1/4), drive and brakes stay below mu g";
    const STAGES: &'static [Stage] = &[Stage::Command, Stage::Drive, Stage::Motion];

    fn constants(&self, step_s: f64) -> [f64; 4] {
        let limit_mps2 = self.mu * STANDARD_GRAVITY_MPS2;
        [limit_mps2, 1.0 / limit_mps2, limit_mps2 * step_s, 0.0]
    }

    fn n_slots(&self, _step_s: f64) -> usize {
        1
    }

    fn settled(&self, command: [f64; 2]) -> f64 {
        command[1]
    }

    #[inline(always)]
    fn on_command<L: Lanes>(constants: &Constants, state: &mut Commanding<'_, L>) {
        let lanes = state.steering.0;
        let speed = state.reached_speed.abs().max(lanes.real(0.1));
        let limit = Real::constant(lanes, constants[2]) / speed;
        let reached = Real(lanes, state.memory[0]);
        state.steering = state.steering.clamp(reached - limit, reached + limit);
        state.memory[0] = state.steering.1;
    }

    #[inline(always)]
    fn on_drive<L: Lanes>(constants: &Constants, state: &mut Driving<L>) {
        let limit = Real::constant(state.speed.0, constants[0]);
        state.acceleration = state.acceleration.clamp(-limit, limit);
    }

    #[inline(always)]
    fn on_motion<L: Lanes>(constants: &Constants, state: &mut Moving<L>) {
        let lanes = state.forward.0;
        let used = state.tyre_acceleration() * Real::constant(lanes, constants[1]);
        let square = used * used;
        let divisor = square.mul_add(square, lanes.real(1.0)).sqrt().sqrt();
        state.yaw_rate = state.yaw_rate / divisor;
    }
}
