//! Tyres that slip more for the same lateral acceleration, as on less grip or with less pressure.

use super::definition::{Commanding, Constants, Definition, Moving, Stage, parameters};
use crate::lanes::{Lanes, Real};

parameters! {
    /// Tyres that slip more for the same lateral acceleration.
    TyreSlip {
        /// Additional slip angle C per lateral acceleration [s2/m].
        compliance_s2_per_m in "s2/m": 0.0 to 0.3, neutral 0.0, tried [0.004, 0.012, 0.04];
    }
}

impl Definition for TyreSlip {
    const ID: &'static str = "tyre_slip";
    const CAUSE: &'static str = "friction";
    const MEANING: &'static str = "tyres that slip more: lateral speed -= C v (v yaw_rate - a_side), and the steering is followed with a time constant of C v";
    const STAGES: &'static [Stage] = &[Stage::Command, Stage::Motion];

    fn constants(&self, step_s: f64) -> [f64; 4] {
        [self.compliance_s2_per_m, step_s, 0.0, 0.0]
    }

    fn n_slots(&self, _step_s: f64) -> usize {
        1
    }

    fn steady_state(&self, command: [f64; 2]) -> f64 {
        command[1]
    }

    /// An axle that carries a mass m and slips by C per acceleration has a cornering stiffness of m / C, so that its sideways
    /// velocity answers with the time constant m v / (m / C). Implicit over a step, for it may be short.
    #[inline(always)]
    fn on_command<L: Lanes>(constants: &Constants, state: &mut Commanding<'_, L>) {
        let lanes = state.steering.0;
        let [compliance, step] = [constants[0], constants[1]].map(|value| Real::constant(lanes, value));
        let share = step / compliance.mul_add(state.reached_speed.abs(), step);
        let reached = Real(lanes, state.memory[0]);
        state.steering = share.mul_add(state.steering - reached, reached);
        state.memory[0] = state.steering.1;
    }

    #[inline(always)]
    fn on_motion<L: Lanes>(constants: &Constants, state: &mut Moving<L>) {
        let slip = state.tyre_acceleration() * Real::constant(state.forward.0, constants[0]);
        state.lateral = state.lateral - slip * state.forward;
    }
}
