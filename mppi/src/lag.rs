//! How far the effects of a model keep its actuators behind the commands.

use bicycle::{Extent, GroundSample, MotionState, MotionStepper};

/// Length of the ramp that the lag is read from, and hence the longest lag that is found [s].
const RAMP_S: f64 = 1.0;

/// Time by which the two actuators stay behind commands that have risen for a second as fast as the limits allow, so much
/// a second, on firm ground [s]; zero for a model without effects or lags. The stepper's unit must be 1 m.
pub(crate) fn of_actuators<S: MotionStepper>(stepper: &S, rates: [f64; 2], step_s: f64) -> [f64; 2] {
    if stepper.extent() != Extent::Whole {
        return [0.0; 2];
    }
    let n_steps = (RAMP_S / step_s).ceil() as usize;
    let mut memory = vec![0.0; stepper.n_slots()];
    stepper.recall(&|_| [0.0; 2], &mut memory);
    let (mut state, mut command) = (MotionState::default(), [0.0; 2]);
    for t in 0..n_steps {
        command = rates.map(|rate| rate * step_s * (t + 1) as f64);
        let asked = command.map(|value| value as f32);
        state = stepper.step_one(&state, asked, &GroundSample::FIRM, &mut memory, t);
    }
    let behind = [command[0] - state.speed_mps, command[1] - state.turn];
    [0, 1].map(|c| (behind[c] / rates[c]).clamp(0.0, RAMP_S))
}

#[cfg(test)]
mod tests {
    use super::*;
    use bicycle::effect::{SpeedLag, SpeedLoop, SteerDelay, SteerLag};
    use bicycle::{Effect, Limits, Model, Stepper};

    const STEP_S: f64 = 0.1;

    fn lag_s(effects: Vec<Effect>) -> [f64; 2] {
        let limits = Limits {
            speed_max_mps: 9.0,
            reverse_speed_max_mps: 1.0,
            steering_max_rad: 0.5,
            steering_rate_max_radps: 0.4,
            acceleration_max_mps2: 2.0,
            lateral_acceleration_max_mps2: 3.0,
            roll_max_rad: 0.5,
            pitch_max_rad: 0.5,
        };
        let rates = [limits.acceleration_max_mps2, limits.steering_rate_max_radps];
        let model = Model { wheelbase_m: 2.0, limits, effects };
        of_actuators(&Stepper::new(&model, STEP_S, 1.0), rates, STEP_S)
    }

    #[test]
    fn actuators_without_effects_keep_up() {
        assert_eq!(lag_s(Vec::new()), [0.0; 2]);
    }

    /// A first-order lag stays behind a ramp by T (1 - exp(-t / T)); a delay by the delay.
    #[test]
    fn lags_and_delays_stay_behind_by_their_times() {
        let slow = Effect::SpeedLag(SpeedLag { time_constant_s: 0.3 });
        let [speed_s, steering_s] = lag_s(vec![Effect::SteerDelay(SteerDelay { delay_s: 0.25 }), slow]);
        assert!((speed_s - 0.3 * (1.0 - (-1.0_f64 / 0.3).exp())).abs() < 0.06, "{speed_s}");
        assert!((steering_s - 0.25).abs() < 0.06, "{steering_s}");
        let [speed_s, steering_s] = lag_s(vec![
            Effect::SteerLag(SteerLag { time_constant_s: 0.2 }),
            Effect::SpeedLoop(SpeedLoop { time_constant_s: 0.4 }),
        ]);
        assert!((speed_s - 0.4 * (1.0 - (-1.0_f64 / 0.4).exp())).abs() < 0.08, "{speed_s}");
        assert!((steering_s - 0.2).abs() < 0.06, "{steering_s}");
    }

    #[test]
    fn what_never_follows_counts_for_the_ramps_length() {
        let [speed_s, _] = lag_s(vec![Effect::SpeedLag(SpeedLag { time_constant_s: 3.0 })]);
        assert!((0.7..=1.0).contains(&speed_s), "{speed_s}");
    }
}
