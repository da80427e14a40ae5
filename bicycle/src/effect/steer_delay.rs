//! Transport delay of the steering command.

use super::{Acts, Commanding, Constants, Definition, Description, Parameter, delay_line};
use crate::Command;
use crate::lanes::Lanes;

/// Transport delay of the steering command.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SteerDelay {
    /// Delay D [s].
    pub delay_s: f64,
}

impl Definition for SteerDelay {
    const DESCRIPTION: Description = Description {
        id: "steer_delay",
        meaning: "transport delay of the steering command: x(t) = command(t - D)",
        parameters: &[Parameter { name: "delay_s", unit: "s", low: 0.0, high: 1.0, neutral: 0.0 }],
    };
    const ACTS: Acts = Acts::OnCommand;

    fn from_values([delay_s, ..]: [f64; 4]) -> Self {
        Self { delay_s }
    }

    fn values(&self) -> [f64; 4] {
        [self.delay_s, 0.0, 0.0, 0.0]
    }

    fn constants(&self, step_s: f64) -> [f64; 4] {
        delay_line::constants(self.delay_s, step_s)
    }

    fn n_slots(&self, step_s: f64) -> usize {
        delay_line::n_slots(self.delay_s, step_s)
    }

    fn recall(&self, slot: usize, step_s: f64, past: &dyn Fn(f64) -> Command) -> f64 {
        f64::from(past(delay_line::age_s(slot, self.n_slots(step_s), step_s)).steering_rad)
    }

    #[inline(always)]
    fn on_command<L: Lanes>(constants: &Constants, state: &mut Commanding<'_, L>) {
        state.steering = delay_line::pass(constants, state.memory, state.step, state.steering);
    }
}
