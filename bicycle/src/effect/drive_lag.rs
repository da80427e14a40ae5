//! A motor that is slow to give the force that its controller wants.

use super::actuator::lag;
use super::definition::{Constants, Definition, Driving, Stage, parameters};
use crate::lanes::{Lanes, Real};

parameters! {
    /// A motor that is slow to give the force that its controller wants.
    DriveLag {
        /// Time constant T [s].
        time_constant_s in "s": 0.0 to 3.0, neutral 0.0, tried [0.1, 0.25, 0.5, 1.0];
    }
}

impl Definition for DriveLag {
    const ID: &'static str = "drive_lag";
    const CAUSE: &'static str = "speed_lag";
    const MEANING: &'static str =
        "first-order motor inside the speed loop: T da/dt = wanted - a, dv/dt = a + forces";
    const STAGES: &'static [Stage] = &[Stage::Drive];

    fn constants(&self, step_s: f64) -> [f64; 4] {
        lag::constants(self.time_constant_s, step_s)
    }

    /// What it gives follows from what was wanted, which was measured.
    fn held_follows_per_s(&self) -> Option<f64> {
        Some(0.0)
    }

    #[inline(always)]
    fn on_drive<L: Lanes>(constants: &Constants, state: &mut Driving<L>) {
        let [closed, mean] = [constants[0], constants[1]].map(|share| Real::constant(state.speed.0, share));
        let distance = state.acceleration - state.held;
        state.acceleration = distance.mul_add(mean, state.held);
        state.held = distance.mul_add(closed, state.held);
    }
}
