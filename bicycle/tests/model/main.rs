//! The model against closed forms, and its packs against its reference.
#![allow(clippy::unwrap_used, reason = "a test that cannot be set up has failed")]

mod closed_forms;
mod packs;
mod sliding;
mod steering;
mod validity;

use bicycle::effect::{CATALOGUE, Effect};
use bicycle::{Command, GroundSample, Limits, Model, State, Stepper};

const STEP_S: f64 = 0.1;
const WHEELBASE_M: f64 = 2.0;

fn model(effects: Vec<Effect>) -> Model {
    let limits = Limits {
        speed_max_mps: 5.0,
        reverse_speed_max_mps: 2.0,
        steering_max_rad: 0.6,
        steering_rate_max_radps: 1.0,
        acceleration_max_mps2: 2.0,
        lateral_acceleration_max_mps2: 5.0,
        roll_max_rad: 0.5,
        pitch_max_rad: 0.5,
    };
    Model { wheelbase_m: WHEELBASE_M, limits, effects }
}

fn effect(id: &str, value: f64) -> Effect {
    effect_of(id, &[value])
}

/// An effect with these values of its first parameters; the others change nothing.
fn effect_of(id: &str, first: &[f64]) -> Effect {
    let parameters = CATALOGUE.iter().find(|description| description.id == id).unwrap().parameters;
    let mut values = [0.0; 4];
    for (place, parameter) in parameters.iter().enumerate() {
        values[place] = first.get(place).copied().unwrap_or(parameter.neutral);
    }
    Effect::from_values(id, values).unwrap()
}

/// Drives `n` steps with one command on firm ground with actuators that follow at once.
fn run(effects: Vec<Effect>, start: State, command: Command, n: usize) -> Vec<State> {
    let stepper = Stepper::new(&model(effects), STEP_S, 1.0).with_instant_actuators();
    let mut memory = vec![0.0; stepper.n_slots()];
    let mut states = vec![start];
    for t in 0..n {
        let next = stepper.step_state(&states[t], command, &GroundSample::FIRM, &mut memory, t);
        states.push(next);
    }
    states
}

fn command(speed_mps: f32, steering_rad: f32) -> Command {
    Command { speed_mps, steering_rad }
}
