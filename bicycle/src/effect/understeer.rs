//! Understeer growing with speed.

use super::{Acts, Constants, Definition, Description, Moving, Parameter};
use crate::lanes::Lanes;
use crate::lanes::Real;

/// Understeer growing with speed.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Understeer {
    /// Coefficient K [s2/m2].
    pub gradient_s2_per_m2: f64,
}

impl Definition for Understeer {
    const DESCRIPTION: Description = Description {
        id: "understeer",
        meaning: "understeer: yaw rate = v tan(steering) / (L (1 + K v^2))",
        parameters: &[Parameter {
            name: "gradient_s2_per_m2",
            unit: "s2/m2",
            low: -0.01,
            high: 1.0,
            neutral: 0.0,
        }],
    };
    const ACTS: Acts = Acts::OnMotion;

    fn from_values([gradient_s2_per_m2, ..]: [f64; 4]) -> Self {
        Self { gradient_s2_per_m2 }
    }

    fn values(&self) -> [f64; 4] {
        [self.gradient_s2_per_m2, 0.0, 0.0, 0.0]
    }

    fn constants(&self, _step_s: f64) -> [f64; 4] {
        [self.gradient_s2_per_m2, 0.0, 0.0, 0.0]
    }

    #[inline(always)]
    fn on_motion<L: Lanes>(constants: &Constants, state: &mut Moving<'_, L>) {
        let lanes = state.forward.0;
        let squared = state.forward * state.forward;
        let loss = squared.mul_add(Real::constant(lanes, constants[0]), lanes.real(1.0));
        state.yaw_rate = state.yaw_rate / loss;
    }
}
