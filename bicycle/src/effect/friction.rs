//! Grip of the tyres.

use super::STANDARD_GRAVITY_MPS2;
use super::definition::{Commanding, Constants, Definition, Driving, Moving, Stage, parameters};
use crate::lanes::{Lanes, Real};

parameters! {
    /// Grip of the tyres.
    Friction {
        /// Friction coefficient M [-].
        mu in "-": 0.02 to 10.0, neutral 10.0, tried [0.2, 0.3, 0.4, 0.55, 0.8];
        /// Share D of the weight on driven wheels [-].
        driven_share in "-": 0.35 to 1.0, neutral 1.0, tried [0.5, 1.0];
        /// Product of the axles' distances from the centre of gravity over the squared radius of gyration, N [-].
        agility in "-": 0.3 to 10.0, neutral 10.0, tried [1.0, 3.0];
    }
}

/// Share of the grip that is left for the curve when the drive takes all it can.
const LEAST_LEFT: f64 = 0.1;

impl Definition for Friction {
    const ID: &'static str = "friction";
    const MEANING: &'static str = "friction: lateral acceleration a of the tyres falls to a / (1 + (a / G)^4)^(1/4) with \
        G^2 = (M g)^2 - (dv/dt)^2; |d yaw_rate/dt| <= N M g / L; -M g <= dv/dt <= D M g";
    const STAGES: &'static [Stage] = &[Stage::Command, Stage::Drive, Stage::Motion];

    fn constants(&self, step_s: f64) -> [f64; 4] {
        let limit_mps2 = self.mu * STANDARD_GRAVITY_MPS2;
        [
            limit_mps2,
            limit_mps2 * self.driven_share,
            self.agility * limit_mps2 * step_s,
            limit_mps2 * limit_mps2,
        ]
    }

    fn n_slots(&self, _step_s: f64) -> usize {
        1
    }

    fn steady_state(&self, command: [f64; 2]) -> f64 {
        command[1]
    }

    /// The yaw rate is v steering / L, so a bound of its change bounds that of the steering by N M g / v.
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
        let [brakes, drive] = [constants[0], constants[1]].map(|limit| Real::constant(state.speed.0, limit));
        state.acceleration = state.acceleration.clamp(-brakes, drive);
    }

    #[inline(always)]
    fn on_motion<L: Lanes>(constants: &Constants, state: &mut Moving<L>) {
        let lanes = state.forward.0;
        let (grip, taken) = (Real::constant(lanes, constants[3]), state.acceleration * state.acceleration);
        let left = (grip - taken).max(grip * lanes.real(LEAST_LEFT));
        let used = state.tyre_acceleration();
        let square = used * used / left;
        state.yaw_rate = state.yaw_rate / square.mul_add(square, lanes.real(1.0)).sqrt().sqrt();
    }
}
