//! A speed controller that pushes back until the command is reached.

use super::definition::{Constants, Definition, Driving, Role, Stage, parameters};
use crate::lanes::{Lanes, Real};

parameters! {
    /// A speed controller that pushes back until the command is reached.
    SpeedIntegral {
        /// Acceleration J that each metre of distance to the command builds up [1/s2].
        gain_per_s2 in "1/s2": 0.0 to 50.0, neutral 0.0, tried [1.0, 3.0, 8.0];
    }
}

/// What the integral holds follows a force that the model does not know so many times more slowly than the controller's
/// own integral answers it, 1 / sqrt(J): faster, and the observer would take for built up what an effect does.
const OBSERVER_PERIODS: f64 = 4.0;

impl Definition for SpeedIntegral {
    const ID: &'static str = "speed_integral";
    const MEANING: &'static str = "integral of the speed: dv/dt = ... + I with dI/dt = J (command - v), so that no offset is left; it waits while a limit of the drive withholds what it asks for";
    const ROLE: Role = Role::Calibration;
    const STAGES: &'static [Stage] = &[Stage::Drive];

    fn constants(&self, step_s: f64) -> [f64; 4] {
        [self.gain_per_s2 * step_s, 0.0, 0.0, 0.0]
    }

    fn held_follows_per_s(&self) -> Option<f64> {
        Some(self.gain_per_s2.sqrt() / OBSERVER_PERIODS)
    }

    #[inline(always)]
    fn on_drive<L: Lanes>(_constants: &Constants, state: &mut Driving<L>) {
        state.drive_by(state.held);
    }

    /// Windup is what no controller is built with: beyond a limit of the drive nothing more is built up.
    #[inline(always)]
    fn once_driven<L: Lanes>(constants: &Constants, state: &mut Driving<L>) {
        let lanes = state.speed.0;
        let distance = state.asked_speed - state.speed;
        let built_up = distance * Real::constant(lanes, constants[0]);
        let is_in_vain = (distance * state.withheld).exceeds(lanes.real(0.0));
        state.held = state.held + Real(lanes, lanes.select(is_in_vain, lanes.real(0.0).1, built_up.1));
    }
}
