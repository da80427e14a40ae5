//! Steering with inertia: a servo of second order, without and with a limit of its rate.

use super::definition::{Commanding, Constants, Definition, Role, Stage, parameters};
use crate::lanes::{Lanes, Real};

parameters! {
    /// Steering with inertia.
    SteerServo {
        /// Delay of a ramp T: twice the damping over the natural frequency [s].
        time_constant_s in "s": 0.0 to 2.0, neutral 0.0, tried [0.06, 0.15, 0.3, 0.7];
        /// Damping ratio Z; below 1 it overshoots [-].
        damping in "-": 0.3 to 3.0, neutral 1.0, tried [0.5, 0.7];
    }
}

impl Definition for SteerServo {
    const ID: &'static str = "steer_servo";
    const MEANING: &'static str =
        "second-order steering: d2x/dt2 = W^2 (command - x) - 2 Z W dx/dt with W = 2 Z / T";
    const ROLE: Role = Role::Calibration;
    const STAGES: &'static [Stage] = &[Stage::Command];

    /// What a step makes of distance e = x - command and rate, for a command that is held over it: with s = Z W,
    /// c = cosh(W sqrt(Z^2 - 1) dt) and h = sinh(..) / (W sqrt(Z^2 - 1)), or cos and sin where Z < 1,
    /// e' = exp(-s dt) ((c + s h) e + h x'), x'' = exp(-s dt) (-W^2 h e + (c - s h) x').
    fn constants(&self, step_s: f64) -> [f64; 4] {
        if self.time_constant_s <= 0.0 {
            return [0.0; 4];
        }
        let natural = 2.0 * self.damping / self.time_constant_s;
        let mean = self.damping * natural;
        let square = mean * mean - natural * natural;
        let apart = square.abs().sqrt();
        let decay = libm::exp(-mean * step_s);
        let [even, odd] = if apart * step_s < 1e-6 {
            [decay, decay * step_s]
        } else if square < 0.0 {
            [decay * libm::cos(apart * step_s), decay * libm::sin(apart * step_s) / apart]
        } else {
            let [slow, fast] = [apart - mean, -apart - mean].map(|rate| libm::exp(rate * step_s));
            [0.5 * (slow + fast), 0.5 * (slow - fast) / apart]
        };
        [even + mean * odd, odd, -natural * natural * odd, even - mean * odd]
    }

    /// The angle, and the angle with the rate added, so that at rest both are the command.
    fn n_slots(&self, _step_s: f64) -> usize {
        2
    }

    fn steady_state(&self, command: [f64; 2]) -> f64 {
        command[1]
    }

    #[inline(always)]
    fn on_command<L: Lanes>(constants: &Constants, state: &mut Commanding<'_, L>) {
        let lanes = state.steering.0;
        let [own, of_rate, to_rate, rate_kept] = constants.map(|value| Real::constant(lanes, value));
        let reached = Real(lanes, state.memory[0]);
        let rate = Real(lanes, state.memory[1]) - reached;
        let distance = reached - state.steering;
        let next = state.steering + distance.mul_add(own, rate * of_rate);
        let next_rate = distance.mul_add(to_rate, rate * rate_kept);
        state.memory[0] = next.1;
        state.memory[1] = (next + next_rate).1;
        state.steering = next;
    }
}

/// Steps of a limited servo in one of the vehicle.
const N_SUBSTEPS: usize = 4;

parameters! {
    /// Steering with inertia and a limit of its rate.
    LimitedServo {
        /// Delay of a ramp T: twice the damping over the natural frequency [s].
        time_constant_s in "s": 0.0 to 2.0, neutral 0.0, tried [0.06, 0.15, 0.3, 0.7];
        /// Damping ratio Z; below 1 it overshoots [-].
        damping in "-": 0.3 to 3.0, neutral 1.0, tried [0.5, 0.7];
        /// Fastest change R [rad/s].
        rate_radps in "rad/s": 0.02 to 1e6, neutral 1e6, tried [0.15, 0.3, 0.6, 1.2, 2.4];
    }
}

impl Definition for LimitedServo {
    const ID: &'static str = "limited_servo";
    const MEANING: &'static str = "second-order steering within a rate: dr/dt = W^2 (command - x) - 2 Z W r with W = 2 Z / T, \
        dx/dt = r, |r| <= R";
    const ROLE: Role = Role::Calibration;
    const STAGES: &'static [Stage] = &[Stage::Command];

    /// By the implicit Euler method, whose rate after a part h of a step is (r + h W^2 e) / (1 + 2 Z W h + W^2 h^2): what is
    /// kept of the rate, what the distance adds to it, h, and R.
    fn constants(&self, step_s: f64) -> [f64; 4] {
        let part_s = step_s / N_SUBSTEPS as f64;
        if self.time_constant_s <= 0.0 {
            return [0.0, 1.0 / part_s, part_s, self.rate_radps];
        }
        let natural = 2.0 * self.damping / self.time_constant_s;
        let stiffness = natural * natural * part_s;
        let kept = 1.0 / (1.0 + 2.0 * self.damping * natural * part_s + stiffness * part_s);
        [kept, stiffness * kept, part_s, self.rate_radps]
    }

    /// The angle, and the angle with the rate added, so that at rest both are the command.
    fn n_slots(&self, _step_s: f64) -> usize {
        2
    }

    fn steady_state(&self, command: [f64; 2]) -> f64 {
        command[1]
    }

    #[inline(always)]
    fn on_command<L: Lanes>(constants: &Constants, state: &mut Commanding<'_, L>) {
        let lanes = state.steering.0;
        let [kept, by_distance, part, limit] = constants.map(|value| Real::constant(lanes, value));
        let mut reached = Real(lanes, state.memory[0]);
        let mut rate = Real(lanes, state.memory[1]) - reached;
        for _ in 0..N_SUBSTEPS {
            let distance = state.steering - reached;
            rate = distance.mul_add(by_distance, rate * kept).clamp(-limit, limit);
            reached = rate.mul_add(part, reached);
        }
        state.memory[0] = reached.1;
        state.memory[1] = (reached + rate).1;
        state.steering = reached;
    }
}
