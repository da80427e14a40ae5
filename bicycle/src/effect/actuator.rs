//! Actuators that follow their command late, slowly or not all the way: a channel of the command passes through a follower.

pub(super) mod lag;

mod delay_line;
mod lag_chain;
mod play;
mod ramp;

use super::definition::{Commanding, Constants, Definition, Stage, Values, parameters};
use crate::lanes::Lanes;

/// Effects by the channel that passes, its place in a command, and the module that it passes through.
macro_rules! followers {
    ($($(#[$doc:meta])* $name:ident $id:literal $(of $cause:literal)?: $meaning:literal,
        $channel:ident[$place:literal] through $follower:ident $parameters:tt)*) => {$(
        parameters! { $(#[$doc])* $name $parameters }

        impl Definition for $name {
            const ID: &'static str = $id;
            $(const CAUSE: &'static str = $cause;)?
            const MEANING: &'static str = $meaning;
            const STAGES: &'static [Stage] = &[Stage::Command];

            fn constants(&self, step_s: f64) -> [f64; 4] {
                $follower::constants(self.values()[0], step_s)
            }

            fn n_slots(&self, step_s: f64) -> usize {
                $follower::n_slots(self.values()[0], step_s)
            }

            fn steady_state(&self, command: [f64; 2]) -> f64 {
                command[$place]
            }

            #[inline(always)]
            fn on_command<L: Lanes>(constants: &Constants, state: &mut Commanding<'_, L>) {
                state.$channel = $follower::pass(constants, state.memory, state.step, state.$channel);
            }
        }
    )*};
}

followers! {
    /// Transport delay of the steering command.
    SteerDelay "steer_delay": "transport delay of the steering command: x(t) = command(t - D)", steering[1] through delay_line
    {
        /// Delay D [s].
        delay_s in "s": 0.0 to 1.0, neutral 0.0, tried [0.05, 0.12, 0.25, 0.45];
    }

    /// Transport delay of the speed command.
    SpeedDelay "speed_delay": "transport delay of the speed command: x(t) = command(t - D)", speed[0] through delay_line
    {
        /// Delay D [s].
        delay_s in "s": 0.0 to 1.0, neutral 0.0, tried [0.05, 0.12, 0.25, 0.45];
    }

    /// Play in the steering.
    Backlash "backlash": "backlash: the steering moves only when the command pushes against an edge of its play of +-H", steering[1] through play
    {
        /// Half the play H [rad].
        half_width_rad in "rad": 0.0 to 0.3, neutral 0.0, tried [0.01, 0.025, 0.05, 0.1];
    }

    /// Limit of the steering rate.
    SteerRate "steer_rate": "steering rate limit: |d steering/dt| <= R", steering[1] through ramp
    {
        /// Fastest change R [rad/s].
        rate_radps in "rad/s": 0.02 to 1e6, neutral 1e6, tried [0.15, 0.3, 0.6, 1.2, 2.4];
    }

    /// Limit of the acceleration.
    AccelLimit "accel_limit": "acceleration limit: |d speed/dt| <= A", speed[0] through ramp
    {
        /// Fastest change of the speed A [m/s2].
        acceleration_mps2 in "m/s2": 0.05 to 1e6, neutral 1e6, tried [0.3, 0.6, 1.0, 1.8, 3.5];
    }

    /// First-order lag of the steering command.
    SteerLag "steer_lag": "first-order steering: T dx/dt = command - x", steering[1] through lag
    {
        /// Time constant T [s].
        time_constant_s in "s": 0.0 to 2.0, neutral 0.0, tried [0.06, 0.15, 0.3, 0.7];
    }

    /// First-order lag of the speed command.
    SpeedLag "speed_lag": "first-order speed: T dx/dt = command - x", speed[0] through lag
    {
        /// Time constant T [s].
        time_constant_s in "s": 0.0 to 3.0, neutral 0.0, tried [0.15, 0.4, 0.8, 1.6];
    }

    /// Two lags of the speed command in series, as a throttle before a torque.
    SpeedLagChain "speed_lag_chain" of "speed_lag": "second-order speed: two lags of T / 2 in series", speed[0] through lag_chain
    {
        /// Time constants of both together T [s].
        time_constant_s in "s": 0.0 to 3.0, neutral 0.0, tried [0.15, 0.4, 0.8, 1.6];
    }
}
