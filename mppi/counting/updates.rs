//! So many updates of the controller on one thread, 1024 rollouts of 50 steps, for whoever counts or samples what they
//! cost: the difference of two runs is the difference in updates.
//!
//! `cargo run --release -p mppi --example updates -- bound|default|effects portable|neon|avx2|avx512 N`

use std::error::Error;

use bicycle::effect::{SteerLag, Understeer};
use bicycle::{Effect, Limits, Model, State};
use mppi::{Config, Controller, CostToGo, CostToGoConfig, Input, Isa, Objective, Terminal};
use rand::{RngExt, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;
use traversability::{GridGeometry, Risk, RiskMap};

const GOAL_M: [f64; 2] = [12.0, 14.0];
const LIMITS: Limits = Limits {
    speed_max_mps: 6.0,
    reverse_speed_max_mps: 0.0,
    steering_max_rad: 0.5,
    steering_rate_max_radps: 1.0,
    acceleration_max_mps2: 10.0,
    lateral_acceleration_max_mps2: 4.0,
    roll_max_rad: 0.52,
    pitch_max_rad: 0.52,
};

fn main() -> Result<(), Box<dyn Error>> {
    let words: Vec<String> = std::env::args().skip(1).collect();
    let [work, isa, n_updates] = words.as_slice() else {
        return Err("expected what to do, an instruction set and a number of updates".into());
    };
    let isa = Isa::SETS.into_iter().find(|known| format!("{known:?}").eq_ignore_ascii_case(isa));
    let isa = isa.ok_or_else(|| format!("expected an instruction set of {:?}", Isa::SETS))?;
    let mut field = CostToGo::new(CostToGoConfig::default(), &LIMITS, 96, 81)?;
    let map = random_map();
    field.update(map.view(), GOAL_M, 0.0)?;
    let lag = Effect::SteerLag(SteerLag { time_constant_s: 0.2 });
    let understeer = Effect::Understeer(Understeer { gradient_s2_per_m2: 0.02 });
    let (config, terminal, effects) = match work.as_str() {
        "bound" => (Config::minimal(), Terminal::StraightLine, Vec::new()),
        "default" => (Config::default(), Terminal::CostToGo(field.view()), Vec::new()),
        "effects" => (Config::minimal(), Terminal::StraightLine, vec![lag, understeer]),
        _ => return Err(format!("expected bound, default or effects, found {work}").into()),
    };
    let step_s = config.step_s;
    let model = Model { wheelbase_m: 2.5, limits: LIMITS, effects };
    let mut controller = Controller::new(Config { n_threads: 1, isa, ..config }, model, 7)?;
    let objective = Objective::Goal { goal_m: GOAL_M, tolerance_m: 0.5, terminal };
    let mut last = None;
    for cycle in 0..n_updates.parse()? {
        let input = Input {
            state: along_a_line(cycle, step_s),
            elapsed_s: step_s,
            map: map.view(),
            objective,
            cycle,
        };
        last = Some(controller.decide(&input));
    }
    println!("{last:?}");
    Ok(())
}

/// Values that are independent, so that every lookup is as unfriendly to the caches as it gets; attitudes within the
/// limits, because an update that starts beyond one does other work.
fn random_map() -> RiskMap {
    let mut map = RiskMap::constant(GridGeometry::centred(0.5, 96, 81, 0.0, 0.0), 13, Risk::NONE);
    let mut random = Xoshiro256PlusPlus::seed_from_u64(7);
    map.fill(|risks, _| {
        for risk in risks {
            *risk = Risk {
                linear_traction: random.random_range(0.5..1.0),
                angular_traction: random.random_range(0.5..1.0),
                roll_rad: random.random_range(0.0..0.5),
                pitch_rad: random.random_range(0.0..0.5),
            };
        }
    });
    map
}

/// Where a vehicle is that drives 1 m/s for 20 s and is put back.
fn along_a_line(cycle: u64, step_s: f64) -> State {
    let travelled_m = step_s * (cycle % 200) as f64;
    State {
        x_m: -10.0 + travelled_m * libm::cos(0.78),
        y_m: -10.0 + travelled_m * libm::sin(0.78),
        yaw_rad: 0.78,
        speed_mps: 1.0,
        steering_rad: 0.0,
    }
}
