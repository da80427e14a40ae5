//! Trim: the wheels are off by a constant angle, left positive.

use super::{Acts, Commanding, Constants, Definition, Description, Parameter};
use crate::lanes::Lanes;
use crate::lanes::Real;

/// Trim: the wheels are off by a constant angle, left positive.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SteerBias {
    /// Angle B [rad].
    pub bias_rad: f64,
}

impl Definition for SteerBias {
    const DESCRIPTION: Description = Description {
        id: "steer_bias",
        meaning: "trim: x = command + B",
        parameters: &[Parameter { name: "bias_rad", unit: "rad", low: -0.3, high: 0.3, neutral: 0.0 }],
    };
    const ACTS: Acts = Acts::OnCommand;

    fn from_values([bias_rad, ..]: [f64; 4]) -> Self {
        Self { bias_rad }
    }

    fn values(&self) -> [f64; 4] {
        [self.bias_rad, 0.0, 0.0, 0.0]
    }

    fn constants(&self, _step_s: f64) -> [f64; 4] {
        [self.bias_rad, 0.0, 0.0, 0.0]
    }

    #[inline(always)]
    fn on_command<L: Lanes>(constants: &Constants, state: &mut Commanding<'_, L>) {
        state.steering = state.steering + Real::constant(state.steering.0, constants[0]);
    }
}
