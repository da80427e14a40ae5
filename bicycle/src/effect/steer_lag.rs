//! First-order steering: the actuator closes the share 1 - exp(-dt / T) of its distance to the command per step.

use super::{Acts, Commanding, Constants, Definition, Description, Parameter};
use crate::lanes::Lanes;
use crate::lanes::Real;

/// First-order steering: the actuator closes the share 1 - exp(-dt / T) of its distance to the command per step.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SteerLag {
    /// Time constant T [s].
    pub time_constant_s: f64,
}

impl Definition for SteerLag {
    const DESCRIPTION: Description = Description {
        id: "steer_lag",
        meaning: "first-order steering: x += (command - x) (1 - exp(-dt / T))",
        parameters: &[Parameter { name: "time_constant_s", unit: "s", low: 0.0, high: 2.0, neutral: 0.0 }],
    };
    const ACTS: Acts = Acts::OnCommand;

    fn from_values([time_constant_s, ..]: [f64; 4]) -> Self {
        Self { time_constant_s }
    }

    fn values(&self) -> [f64; 4] {
        [self.time_constant_s, 0.0, 0.0, 0.0]
    }

    fn constants(&self, step_s: f64) -> [f64; 4] {
        let kept = if self.time_constant_s > 0.0 { (-step_s / self.time_constant_s).exp() } else { 0.0 };
        [1.0 - kept, 0.0, 0.0, 0.0]
    }

    #[inline(always)]
    fn on_command<L: Lanes>(constants: &Constants, state: &mut Commanding<'_, L>) {
        let share = Real::constant(state.steering.0, constants[0]);
        state.steering = (state.steering - state.reached_steering).mul_add(share, state.reached_steering);
    }
}
