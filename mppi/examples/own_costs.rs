//! Costs of one's own: a disc that every step is to keep out of, and a heading to end with, which a whole rollout pays
//! for. Both become part of the controller when it is compiled.
//!
//! `cargo run -p mppi --example own_costs`

use std::error::Error;
use std::f64::consts::{FRAC_PI_2, TAU};

use bicycle::lanes::{Lanes, Real};
use bicycle::{Command, GroundSample, Limits, Model, State, Stepper};
use mppi::{Config, Controller, Future, Input, Objective, RolloutCost, Step, StepCost, Terminal};
use traversability::{GridGeometry, Risk, RiskMap};

const GOAL_M: [f64; 2] = [12.0, 0.0];
const TOLERANCE_M: f64 = 0.5;
const DISC_M: [f64; 2] = [6.0, 0.2];

/// So many seconds for every step within a disc.
struct KeepOut {
    centre_m: [f64; 2],
    radius_m: f64,
    price_s: f64,
}

impl StepCost for KeepOut {
    #[inline(always)]
    fn step<L: Lanes>(&self, step: &Step<'_, L>) -> Real<L> {
        let lanes = step.lanes();
        let inside = step.distance_m(self.centre_m).less(lanes.real(self.radius_m));
        lanes.real(0.0).add_where(inside, lanes.real(self.price_s))
    }
}

/// Seconds per radian that a future ends facing elsewhere.
struct EndFacing {
    yaw_rad: f64,
    price_s_per_rad: f64,
}

impl RolloutCost for EndFacing {
    fn add(&self, futures: &[Future], added_s: &mut [f32]) {
        for (future, added_s) in futures.iter().zip(added_s) {
            let off_turns = (future.end.yaw_rad - self.yaw_rad) / TAU;
            let off_rad = (off_turns - off_turns.round()).abs() * TAU;
            *added_s += (self.price_s_per_rad * off_rad) as f32;
        }
    }
}

fn model() -> Model {
    let limits = Limits {
        speed_max_mps: 2.0,
        reverse_speed_max_mps: 0.0,
        steering_max_rad: 0.5,
        steering_rate_max_radps: 1.0,
        acceleration_max_mps2: 2.0,
        lateral_acceleration_max_mps2: 4.0,
        roll_max_rad: 0.5,
        pitch_max_rad: 0.5,
    };
    Model { wheelbase_m: 1.0, limits, effects: Vec::new() }
}

/// The nearest that a drive to the goal comes to the disc's centre [m], and where the plan of its tenth cycle ends
/// facing [rad].
fn drive<S: StepCost, R: RolloutCost>(costs: (S, R)) -> Result<[f64; 2], Box<dyn Error>> {
    let map = RiskMap::constant(GridGeometry::centred(0.2, 100, 120, 6.0, 0.0), 8, Risk::NONE);
    let stepper = Stepper::new(&model(), 0.1, 1.0);
    let mut controller = Controller::with_costs(Config::default(), model(), costs, 1)?;
    let (mut state, mut nearest_m, mut facing_rad) = (State::default(), f64::INFINITY, 0.0);
    for cycle in 0..300 {
        if (state.x_m - GOAL_M[0]).hypot(state.y_m - GOAL_M[1]) <= TOLERANCE_M {
            return Ok([nearest_m, facing_rad]);
        }
        let terminal = Terminal::StraightLine;
        let objective = Objective::Goal { goal_m: GOAL_M, tolerance_m: TOLERANCE_M, terminal };
        let elapsed_s = if cycle == 0 { 0.0 } else { 0.1 };
        let decision = controller.decide(&Input { state, elapsed_s, map: map.view(), objective, cycle });
        if cycle == 10 {
            facing_rad = controller.nominal_trajectory(map.view()).last().map_or(0.0, |end| end.yaw_rad);
        }
        let command = decision.command(Command::default());
        state = stepper.step_state(&state, command, &GroundSample::FIRM, &mut [], 0);
        nearest_m = nearest_m.min((state.x_m - DISC_M[0]).hypot(state.y_m - DISC_M[1]));
    }
    Err("not there after 30 s".into())
}

fn main() -> Result<(), Box<dyn Error>> {
    let [through_m, straight_rad] = drive(((), ()))?;
    let [around_m, _] = drive((KeepOut { centre_m: DISC_M, radius_m: 1.5, price_s: 1.0 }, ()))?;
    let [_, turned_rad] = drive(((), EndFacing { yaw_rad: FRAC_PI_2, price_s_per_rad: 2.0 }))?;
    println!(
        "without costs: {through_m:.2} m from the centre, a plan that ends facing {straight_rad:.2} rad"
    );
    println!("with: {around_m:.2} m from the centre, a plan that ends facing {turned_rad:.2} rad");
    assert!(through_m < 0.7 && around_m > 1.4);
    assert!(turned_rad > straight_rad + 0.2);
    Ok(())
}
