//! The controller alone, over a risk map that is the same everywhere but for one rock: state, map and goal in, a
//! decision out, ten times a second. Who made the map, it does not know.
//!
//! `cargo run -p mppi --example drive_constant_map`

use std::error::Error;

use bicycle::{Command, Decision, GroundSample, Limits, Model, State, Stepper};
use mppi::{Config, Controller, CostToGo, CostToGoConfig, Input, Objective, Terminal};
use traversability::{GridGeometry, Risk, RiskMap};

const ROCK_M: [f64; 2] = [6.0, 0.2];
const GOAL_M: [f64; 2] = [12.0, 0.0];
const TRACTION: f32 = 0.8;
const LIMITS: Limits = Limits {
    speed_max_mps: 2.0,
    reverse_speed_max_mps: 1.0,
    steering_max_rad: 0.5,
    steering_rate_max_radps: 1.0,
    acceleration_max_mps2: 2.0,
    lateral_acceleration_max_mps2: 4.0,
    roll_max_rad: 0.5,
    pitch_max_rad: 0.5,
};

fn main() -> Result<(), Box<dyn Error>> {
    let geometry = GridGeometry::centred(0.2, 80, 120, 6.0, 0.0);
    let n_yaws = 8;
    let level = Risk { linear_traction: TRACTION, ..Risk::NONE };
    let mut map = RiskMap::constant(geometry, n_yaws, level);
    for index in 0..geometry.n_cells() {
        let [x_m, y_m] = geometry.centre_m(geometry.cell(index));
        if (x_m - ROCK_M[0]).hypot(y_m - ROCK_M[1]) < 1.0 {
            map.fill(|risks, _| risks[index * n_yaws..][..n_yaws].fill(level.blocked()));
        }
    }
    let mut field = CostToGo::new(CostToGoConfig::default(), &LIMITS, geometry.n_rows, geometry.n_cols)?;
    field.update(map.view(), GOAL_M, 0.0)?;

    let model = Model { wheelbase_m: 1.0, limits: LIMITS, effects: Vec::new() };
    let stepper = Stepper::new(&model, 0.1, 1.0);
    let mut controller = Controller::new(Config { n_rollouts: 512, ..Config::default() }, model, 1)?;
    let ground = GroundSample { linear_traction: f64::from(TRACTION), ..GroundSample::FIRM };
    let (mut state, mut nearest_m, mut n_cycles) = (State::default(), f64::INFINITY, 0_u64);
    while (state.x_m - GOAL_M[0]).hypot(state.y_m - GOAL_M[1]) > 0.5 && n_cycles < 300 {
        let terminal = Terminal::CostToGo(field.view());
        let objective = Objective::Goal { goal_m: GOAL_M, tolerance_m: 0.5, terminal };
        let elapsed_s = if n_cycles == 0 { 0.0 } else { 0.1 };
        let input = Input { state, elapsed_s, map: map.view(), objective, cycle: n_cycles };
        let command = match controller.decide(&input) {
            Decision::Drive(command) => command,
            Decision::Hold(_) | Decision::Stop(_) => Command::default(),
        };
        if n_cycles.is_multiple_of(10) {
            let Command { speed_mps, steering_rad } = command;
            println!("({:5.2}, {:5.2}) m: {speed_mps:.2} m/s, {steering_rad:5.2} rad", state.x_m, state.y_m);
        }
        state = stepper.step_state(&state, command, &ground, &mut [], 0);
        nearest_m = nearest_m.min((state.x_m - ROCK_M[0]).hypot(state.y_m - ROCK_M[1]));
        n_cycles += 1;
    }
    let time_s = n_cycles as f64 * 0.1;
    println!("there after {time_s:.1} s; {nearest_m:.2} m from the middle of the rock at the nearest");
    // 11.5 m at 0.8 of 2 m/s take 7.2 s at the least, and a second to get under way.
    assert!((7.2..12.0).contains(&time_s));
    assert!(nearest_m >= 0.9, "inside the blocked cells");
    Ok(())
}
