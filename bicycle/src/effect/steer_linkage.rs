//! Wheels that turn by a multiple of what the steering servo does.

use super::definition::{Constants, Definition, Moving, Stage, parameters};
use crate::lanes::{Lanes, Real};

parameters! {
    /// Wheels that turn by a multiple of what the steering servo does.
    SteerLinkage {
        /// Angle of the wheels over that of the servo G [-].
        ratio in "-": 0.2 to 2.0, neutral 1.0, tried [0.75, 0.9, 1.1, 1.25];
    }
}

impl Definition for SteerLinkage {
    const ID: &'static str = "steer_linkage";
    const CAUSE: &'static str = "steer_gain";
    const MEANING: &'static str =
        "steering gain behind the servo: yaw_rate = v tan(G angle) / L, at the servo's own rate";
    const STAGES: &'static [Stage] = &[Stage::Motion];

    fn constants(&self, _step_s: f64) -> [f64; 4] {
        [self.ratio, self.ratio * (self.ratio * self.ratio - 1.0) / 3.0, 0.0, 0.0]
    }

    /// tan(G atan t) / t = G + G (G^2 - 1) t^2 / 3 up to t^4, which is 1e-3 of it at 0.45.
    #[inline(always)]
    fn on_motion<L: Lanes>(constants: &Constants, state: &mut Moving<L>) {
        let [ratio, cubic] = [constants[0], constants[1]].map(|value| Real::constant(state.forward.0, value));
        let square = state.steering_tangent * state.steering_tangent;
        state.yaw_rate = state.yaw_rate * cubic.mul_add(square, ratio);
    }
}
