//! The whole planner on a map of one's own, without sensors: a wall with one gap, given as a surface. What is measured
//! goes into `observe`, a decision comes out of `decide`; here the model itself is the vehicle.
//!
//! `cargo run -p navigator --example own_surface`

use std::error::Error;

use bicycle::{Decision, GroundSample, Model, Odometry, State, Stepper};
use navigator::{Belief, Config, Navigator, Setup, Surface};
use terrain::{GridGeometry, GridMap, SurfaceCell, TerrainClass};
use traversability::CvarLevel;

/// Within the window of the risk map, 4 m to every side of the start: without scans it stays where it was made.
const GOAL_M: [f64; 2] = [3.5, 0.0];
const WALL_M: f64 = 2.0;
const CYCLE_S: f64 = 0.1;

/// Level ground, and a wall that is open for y from 0.5 to 2 m.
fn walled(resolution_m: f64) -> GridMap<SurfaceCell> {
    let geometry = GridGeometry::centred(resolution_m, 160, 160, 0.0, 0.0);
    let mut surface = GridMap::filled(geometry, SurfaceCell::certain(0.0, TerrainClass::Open, 0.0));
    for (index, cell) in surface.values_mut().iter_mut().enumerate() {
        let [x_m, y_m] = geometry.centre_m(geometry.cell(index));
        if (x_m - WALL_M).abs() < 0.1 && !(0.5..2.0).contains(&y_m) {
            *cell = SurfaceCell::certain(0.0, TerrainClass::Obstacle, 0.0);
        }
    }
    surface
}

fn main() -> Result<(), Box<dyn Error>> {
    let vehicle = formats::read_vehicle("rc_car")?;
    let config = Config::for_vehicle(&vehicle);
    let model = Model::of(&vehicle);
    let stepper = Stepper::new(&model, CYCLE_S, 1.0);
    let mut navigator = Navigator::new(Setup {
        geometry: &vehicle.geometry,
        surface: Surface::Given(walled(config.elevation.resolution_m)),
        model,
        config,
        belief: Belief::Physics,
        level: CvarLevel::new(0.5)?,
        seed: 1,
        goal_m: GOAL_M,
        tolerance_m: 0.3,
    })?;

    let (mut state, mut at_wall_m, mut n_cycles) = (State::default(), None, 0_u64);
    while (state.x_m - GOAL_M[0]).hypot(state.y_m - GOAL_M[1]) > 0.3 && n_cycles < 200 {
        let now_ns = n_cycles * 100_000_000;
        let odometry = Odometry {
            valid_at_ns: now_ns,
            position_m: [state.x_m, state.y_m, 0.0],
            attitude_rad: [0.0, 0.0, state.yaw_rad],
            velocity_mps: [state.speed_mps, 0.0],
            yaw_rate_radps: state.speed_mps * state.steering_rad.tan() / vehicle.geometry.wheelbase_m,
            wheel_speed_mps: state.speed_mps,
            steering_rad: state.steering_rad,
        };
        navigator.observe(now_ns, &odometry, None)?;
        let decision = navigator.decide(now_ns)?;
        if n_cycles.is_multiple_of(10) {
            println!(
                "{:4.1} s at ({:4.2}, {:5.2}) m: {decision:?}",
                now_ns as f64 * 1e-9,
                state.x_m,
                state.y_m
            );
        }
        let Decision::Drive(command) = decision else {
            state.speed_mps = 0.0;
            n_cycles += 1;
            continue;
        };
        let before = state;
        state = stepper.step_state(&state, command, &GroundSample::FIRM, &mut [], 0);
        if (before.x_m < WALL_M) != (state.x_m < WALL_M) {
            at_wall_m = Some(state.y_m);
        }
        n_cycles += 1;
    }
    let at_wall_m = at_wall_m.ok_or("expected to get past the wall")?;
    println!("past the wall at y = {at_wall_m:.2} m, there after {:.1} s", n_cycles as f64 * CYCLE_S);
    assert!(n_cycles < 200, "never came to the goal");
    // Half of its 0.25 m of width must fit beside each end of the wall.
    assert!((0.62..1.88).contains(&at_wall_m));
    Ok(())
}
