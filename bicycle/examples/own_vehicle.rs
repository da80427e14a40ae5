//! A vehicle of one's own: wheelbase, limits and one effect make a model, and the stepper foretells where it goes.
//!
//! `cargo run -p bicycle --example own_vehicle`

use std::error::Error;

use bicycle::effect::SteerLag;
use bicycle::{Command, Effect, GroundSample, Limits, Model, State, Stepper};

const STEP_S: f64 = 0.01;
const LAG_S: f64 = 0.3;

fn main() -> Result<(), Box<dyn Error>> {
    let model = Model {
        wheelbase_m: 1.8,
        limits: Limits {
            speed_max_mps: 3.0,
            reverse_speed_max_mps: 1.0,
            steering_max_rad: 0.5,
            // The servo itself is fast here: what is slow is its answer, the effect below.
            steering_rate_max_radps: 100.0,
            acceleration_max_mps2: 2.0,
            lateral_acceleration_max_mps2: 4.0,
            roll_max_rad: 0.5,
            pitch_max_rad: 0.5,
        },
        effects: vec![Effect::SteerLag(SteerLag { time_constant_s: LAG_S })],
    };
    model.validate()?;

    let stepper = Stepper::new(&model, STEP_S, 1.0);
    let mut memory = vec![0.0; stepper.n_slots()];
    let command = Command { speed_mps: 2.0, steering_rad: 0.3 };
    let mut state = State { speed_mps: 2.0, ..State::default() };
    stepper.fill_steady_state(Command { steering_rad: 0.0, ..command }, &mut memory);
    let mut steering_after_lag_rad = 0.0;
    let mut farthest_m = 0.0_f64;
    let mut began_circle = State::default();
    for step in 0..1500 {
        state = stepper.step_state(&state, command, &GroundSample::FIRM, &mut memory, step);
        match step {
            29 => steering_after_lag_rad = state.steering_rad,
            // Ten time constants later nothing is left of the lag.
            299 => began_circle = state,
            300.. => {
                farthest_m =
                    farthest_m.max((state.x_m - began_circle.x_m).hypot(state.y_m - began_circle.y_m))
            }
            _ => (),
        }
    }
    println!("steering after one lag of {LAG_S} s: {steering_after_lag_rad:.3} of 0.3 rad");
    println!("diameter of the circle: {farthest_m:.2} m");
    // A first-order lag has gone 1 - 1/e of the way, and the rear axle's circle has the radius L / tan(steering).
    assert!((steering_after_lag_rad - 0.3 * (1.0 - (-1.0_f64).exp())).abs() < 0.01);
    assert!((farthest_m - 2.0 * 1.8 / 0.3_f64.tan()).abs() < 0.05);
    Ok(())
}
