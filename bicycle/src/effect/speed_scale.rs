//! Wheel radius: the vehicle rolls a multiple of what its drive believes.

use super::{Acts, Constants, Definition, Description, Moving, Parameter};
use crate::lanes::Lanes;
use crate::lanes::Real;

/// Wheel radius: the vehicle rolls a multiple of what its drive believes.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SpeedScale {
    /// Ratio S [-].
    pub ratio: f64,
}

impl Definition for SpeedScale {
    const DESCRIPTION: Description = Description {
        id: "speed_scale",
        meaning: "wheel radius: v = S v, and the yaw rate with it",
        parameters: &[Parameter { name: "ratio", unit: "-", low: 0.3, high: 2.0, neutral: 1.0 }],
    };
    const ACTS: Acts = Acts::OnMotion;

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
    fn on_motion<L: Lanes>(constants: &Constants, state: &mut Moving<'_, L>) {
        let ratio = Real::constant(state.forward.0, constants[0]);
        state.forward = state.forward * ratio;
        state.yaw_rate = state.yaw_rate * ratio;
    }
}
