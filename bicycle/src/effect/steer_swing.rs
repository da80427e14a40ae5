//! Turning that leads or trails the steering by a way.

use super::definition::{Commanding, Constants, Definition, Role, Stage, parameters};
use crate::lanes::{Lanes, Real};

/// Below this the way takes as long as at this speed [m/s].
const SLOWEST_MPS: f64 = 0.3;

parameters! {
    /// Turning that leads or trails the steering by a way.
    SteerSwing {
        /// Way C by which the turning leads [m].
        lead_m in "m": -2.0 to 4.0, neutral 0.0, tried [-0.2, 0.2, 0.6];
    }
}

impl Definition for SteerSwing {
    const ID: &'static str = "steer_swing";
    const MEANING: &'static str = "swing: the turning leads the steering by a way, steering += C / max(v, 0.3 m/s) d steering/dt: forwards in a body that bends, backwards where tyres relax";
    const ROLE: Role = Role::Calibration;
    const STAGES: &'static [Stage] = &[Stage::Command];

    fn constants(&self, step_s: f64) -> [f64; 4] {
        [self.lead_m / step_s, 0.0, 0.0, 0.0]
    }

    fn n_slots(&self, _step_s: f64) -> usize {
        1
    }

    fn steady_state(&self, command: [f64; 2]) -> f64 {
        command[1]
    }

    #[inline(always)]
    fn on_command<L: Lanes>(constants: &Constants, state: &mut Commanding<'_, L>) {
        let lanes = state.steering.0;
        let change = state.steering - Real(lanes, state.memory[0]);
        state.memory[0] = state.steering.1;
        let speed = state.reached_speed.abs().max(lanes.real(SLOWEST_MPS));
        state.steering = (change * Real::constant(lanes, constants[0]) / speed) + state.steering;
    }
}
