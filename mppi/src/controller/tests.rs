//! What a controller keeps from cycle to cycle.
#![allow(clippy::unwrap_used, reason = "a panic is how a test fails")]

use super::*;
use crate::{Objective, Terminal};
use bicycle::{GroundSample, Limits};
use traversability::{GridGeometry, Risk, RiskMap};

const STEP_S: f64 = 0.1;

fn model(drag_mps2: f64) -> Model {
    let limits = Limits {
        speed_max_mps: 2.0,
        reverse_speed_max_mps: 1.0,
        steering_max_rad: 0.5,
        steering_rate_max_radps: 1.0,
        acceleration_max_mps2: 2.0,
        lateral_acceleration_max_mps2: 3.0,
        roll_max_rad: 0.5,
        pitch_max_rad: 0.5,
    };
    let values = [("speed_loop", 0.4), ("speed_integral", 3.0), ("rolling_drag", drag_mps2)];
    let effect = |(id, value): (&str, f64)| Effect::from_values(id, [value, 0.0, 0.0, 0.0]).unwrap();
    Model { wheelbase_m: 2.0, limits, effects: values.map(effect).to_vec() }
}

/// The vehicle's motor controller meets a drag of 0.6 m/s2 that the model does not know. Rolling at its command, its
/// integral holds 0.6 m/s2; the model's must hold nothing, because what pushes back and what it pushes against cancel in
/// every speed that was measured. A model that knows the drag must hold it.
#[test]
fn what_is_held_is_what_the_model_does_not_know_to_be_cancelled() {
    for (known_mps2, held_mps2) in [(0.0, 0.0), (0.6, 0.6)] {
        let mut map = RiskMap::constant(GridGeometry::centred(0.25, 160, 160, 0.0, 0.0), 1, Risk::NONE);
        map.close_border();
        let objective =
            Objective::Goal { goal_m: [19.0, 0.0], tolerance_m: 0.5, terminal: Terminal::StraightLine };
        let config = Config { n_threads: 1, n_rollouts: 256, ..Config::default() };
        let mut controller = Controller::new(config, model(known_mps2), 1).unwrap();
        let vehicle = Stepper::new(&model(0.6), STEP_S, 1.0);
        let mut memory = vec![0.0; vehicle.n_slots()];
        let mut state = State { x_m: -15.0, ..State::default() };
        for cycle in 0..100 {
            let input = Input { state, elapsed_s: STEP_S, cycle, map: map.view(), objective };
            let Decision::Drive(command) = controller.decide(&input) else { panic!("{cycle}") };
            state = vehicle.step_state(&state, command, &GroundSample::FIRM, &mut memory, cycle as usize);
        }
        assert!(state.speed_mps > 1.5 && (vehicle.held(&mut memory)[0] - 0.6).abs() < 0.2);
        let found_mps2 = controller.held_mps2[0];
        assert!((found_mps2 - held_mps2).abs() < 0.2, "{known_mps2}: {found_mps2}");
        controller.reset();
        assert_eq!(controller.held_mps2, [0.0]);
    }
}
