//! Steering ratio: the wheels turn by a multiple of the commanded angle.

use super::{Acts, Commanding, Constants, Definition, Description, Parameter};
use crate::lanes::Lanes;
use crate::lanes::Real;

/// Steering ratio: the wheels turn by a multiple of the commanded angle.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SteerGain {
    /// Ratio G [-].
    pub ratio: f64,
}

impl Definition for SteerGain {
    const DESCRIPTION: Description = Description {
        id: "steer_gain",
        meaning: "steering ratio: x = G command",
        parameters: &[Parameter { name: "ratio", unit: "-", low: 0.3, high: 2.0, neutral: 1.0 }],
    };
    const ACTS: Acts = Acts::OnCommand;

    fn from_values([ratio, ..]: [f64; 4]) -> Self {
        Self { ratio }
    }

    fn values(&self) -> [f64; 4] {
        [self.ratio, 0.0, 0.0, 0.0]
    }

    fn constants(&self, _step_s: f64) -> [f64; 4] {
        [self.ratio, 0.0, 0.0, 0.0]
    }

    #[inline(always)]
    fn on_command<L: Lanes>(constants: &Constants, state: &mut Commanding<'_, L>) {
        state.steering = state.steering * Real::constant(state.steering.0, constants[0]);
    }
}
