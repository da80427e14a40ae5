//! A speed controller that brakes its reference otherwise than it speeds it up.

use super::definition::{Commanding, Constants, Definition, Role, Stage, parameters};
use crate::lanes::{Lanes, Real};

parameters! {
    /// A speed controller whose reference follows the command on ramps, one up and one down.
    SpeedRamp {
        /// Fastest growth of the speed A [m/s2].
        acceleration_mps2 in "m/s2": 0.05 to 1e6, neutral 1e6, tried [0.3, 0.6, 1.0, 1.8, 3.5];
        /// Fastest fall of the speed B [m/s2].
        deceleration_mps2 in "m/s2": 0.05 to 1e6, neutral 1e6, tried [0.3, 0.6, 1.0, 1.8, 3.5];
    }
}

impl Definition for SpeedRamp {
    const ID: &'static str = "speed_ramp";
    const MEANING: &'static str =
        "ramps of a speed controller: its reference follows the command, d|speed|/dt <= A and >= -B";
    const ROLE: Role = Role::Calibration;
    const STAGES: &'static [Stage] = &[Stage::Command];

    fn constants(&self, step_s: f64) -> [f64; 4] {
        [self.acceleration_mps2 * step_s, self.deceleration_mps2 * step_s, 0.0, 0.0]
    }

    fn n_slots(&self, _step_s: f64) -> usize {
        1
    }

    fn steady_state(&self, command: [f64; 2]) -> f64 {
        command[0]
    }

    /// A ramp that ends within a step falls short of the command by m^2 / (2 A dt) on average, with the change m.
    #[inline(always)]
    fn on_command<L: Lanes>(constants: &Constants, state: &mut Commanding<'_, L>) {
        let lanes = state.speed.0;
        let [up, down] = [constants[0], constants[1]].map(|limit| Real::constant(lanes, limit));
        let reached = Real(lanes, state.memory[0]);
        let distance = state.speed - reached;
        let is_braking = lanes.real(0.0).exceeds(distance * reached);
        let limit = Real(lanes, lanes.select(is_braking, down.1, up.1));
        let change = distance.clamp(-limit, limit);
        state.memory[0] = (reached + change).1;
        let half = lanes.real(0.5);
        state.speed = change * (lanes.real(1.0) - change.abs() * half / limit) + reached;
    }
}
