//! One update of the controller: 1024 rollouts of 50 steps over a risk map of 81 x 96 cells and 13 yaws.
//!
//! The map holds independent random values, so that every lookup is as unfriendly to the caches as it gets. The vehicle
//! moves along a line by one step of the plan from update to update, as in a drive; noise is fresh every time.

use crate::stopwatch::{milliseconds_since, now};
use crate::{BenchError, Spread};
use bicycle::effect::{SteerLag, Understeer};
use bicycle::{Effect, Model, State};
use mppi::{Config, Controller, CostToGo, CostToGoConfig, Input, Isa, Objective, Phase, Terminal};
use rand::{RngExt, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;
use serde::Serialize;
use traversability::{GridGeometry, Risk, RiskMap};

const RESOLUTION_M: f64 = 0.5;
const N_ROWS: usize = 96;
const N_COLS: usize = 81;
const N_YAWS: usize = 13;
const GOAL_M: [f64; 2] = [12.0, 14.0];
const TOLERANCE_M: f64 = 0.5;
/// Where the vehicle starts [m, m, rad].
const START: [f64; 3] = [-10.0, -10.0, 0.78];
/// It moves at this speed along its yaw [m/s] ..
const SPEED_MPS: f64 = 1.0;
/// .. and is put back to the start after so many updates.
const N_UPDATES_PER_LAP: u64 = 200;
const N_WARM_UP: u64 = 50;
const SEED: u64 = 7;

/// How much the controller has to do.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Work {
    /// Time to goal with latch, attitude limits, white noise on the controls, no effects: [`Config::minimal`].
    Bound,
    /// The same with two effects in the model: lagging steering and understeer.
    Effects,
    /// What `surefoot drive` does by default: [`Config::default`] and the cost-to-go field at the end of the horizon.
    Drive,
}

/// How to measure.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Request {
    /// Threads that share the rollouts.
    pub n_threads: usize,
    /// Updates to measure, after a warm-up.
    pub n_updates: usize,
    /// What they do.
    pub work: Work,
    /// Instruction set.
    pub isa: Isa,
}

/// What was measured.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Report {
    /// Threads that shared the rollouts.
    pub threads: usize,
    /// Updates measured.
    pub updates: usize,
    /// What they did.
    pub config: Work,
    /// Instruction set in use.
    pub isa: Isa,
    /// Time of an update [ms].
    pub ms: Spread,
    /// Median time of its parts [ms].
    pub split_ms: Split,
}

/// Median times of the parts of an update [ms].
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Split {
    /// Shifting the plan, sampling the controls, rolling them out and pricing them.
    pub rollout: f64,
    /// Weighing, averaging and judging.
    pub update: f64,
}

/// Lets the controller decide again and again.
///
/// # Errors
/// No update asked for, or an instruction set or threads that are not to be had.
pub fn measure(request: Request) -> Result<Report, BenchError> {
    measure_config(config(request.work, request.n_threads, request.isa), request.work, request.n_updates)
}

/// The same of a controller with other settings than the work has.
pub(crate) fn measure_config(config: Config, work: Work, n_updates: usize) -> Result<Report, BenchError> {
    if n_updates == 0 {
        return Err(BenchError::NoUpdates);
    }
    let model = model(work)?;
    let map = random_map();
    let mut field = CostToGo::new(CostToGoConfig::default(), &model.limits, N_ROWS, N_COLS)?;
    field.update(map.view(), GOAL_M, 0.0)?;
    let terminal = match work {
        Work::Bound | Work::Effects => Terminal::StraightLine,
        Work::Drive => Terminal::CostToGo(field.view()),
    };
    let objective = Objective::Goal { goal_m: GOAL_M, tolerance_m: TOLERANCE_M, terminal };
    let (step_s, threads) = (config.step_s, config.n_threads);
    let mut controller = Controller::new(config, model, SEED)?;
    let mut laps = Laps::with_room_for(n_updates);
    for cycle in 0..N_WARM_UP + n_updates as u64 {
        let state = state(cycle, step_s);
        let input = Input { state, elapsed_s: step_s, map: map.view(), objective, cycle };
        let lap = Laps::of(&mut controller, &input);
        if cycle >= N_WARM_UP {
            laps.push(lap);
        }
    }
    let (ms, split_ms) = laps.spread();
    Ok(Report { threads, updates: n_updates, config: work, isa: controller.diagnostics().isa, ms, split_ms })
}

/// Times of all updates [ms].
struct Laps {
    total: Vec<f64>,
    /// Rollout, update.
    parts: [Vec<f64>; 2],
}

impl Laps {
    fn with_room_for(n_updates: usize) -> Self {
        Self { total: Vec::with_capacity(n_updates), parts: [(); 2].map(|()| Vec::with_capacity(n_updates)) }
    }

    /// One decision: the time of the whole and of its parts.
    fn of(controller: &mut Controller, input: &Input<'_>) -> (f64, [f64; 2]) {
        let start = now();
        let (mut parts, mut passed) = ([0.0; 2], 0.0);
        controller.decide_observed(input, |phase| {
            let until = milliseconds_since(start);
            let part = match phase {
                Phase::Rollout => 0,
                Phase::Update => 1,
            };
            parts[part] += until - passed;
            passed = until;
        });
        (milliseconds_since(start), parts)
    }

    fn push(&mut self, (total, parts): (f64, [f64; 2])) {
        self.total.push(total);
        self.parts.iter_mut().zip(parts).for_each(|(all, part)| all.push(part));
    }

    fn spread(self) -> (Spread, Split) {
        let [rollout, update] = self.parts.map(|part| Spread::of(part).median);
        (Spread::of(self.total), Split { rollout, update })
    }
}

/// The settings of a work.
pub(crate) fn config(work: Work, n_threads: usize, isa: Isa) -> Config {
    let config = match work {
        Work::Bound | Work::Effects => Config::minimal(),
        Work::Drive => Config::default(),
    };
    Config { n_threads, isa, ..config }
}

/// The full-size vehicle; the limits of the bound's work are those of the hand-written yardstick.
fn model(work: Work) -> Result<Model, BenchError> {
    let mut model = Model::of(&formats::read_vehicle("pietra_full_size")?);
    if work == Work::Drive {
        return Ok(model);
    }
    model.wheelbase_m = 2.5;
    model.limits.speed_max_mps = 6.0;
    model.limits.reverse_speed_max_mps = 0.0;
    model.limits.steering_max_rad = 0.5;
    model.limits.acceleration_max_mps2 = 10.0;
    model.limits.roll_max_rad = 30_f64.to_radians();
    model.limits.pitch_max_rad = 30_f64.to_radians();
    if work == Work::Effects {
        model.effects = vec![
            Effect::SteerLag(SteerLag { time_constant_s: 0.2 }),
            Effect::Understeer(Understeer { gradient_s2_per_m2: 0.02 }),
        ];
    }
    Ok(model)
}

/// Traction from 0.5 to 1, attitudes from 0 to 0.6 rad, each value on its own.
fn random_map() -> RiskMap {
    let geometry = GridGeometry::centred(RESOLUTION_M, N_ROWS, N_COLS, 0.0, 0.0);
    let mut map = RiskMap::constant(geometry, N_YAWS, Risk::NONE);
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(SEED);
    map.fill(|risks, _| {
        for risk in risks {
            *risk = Risk {
                linear_traction: rng.random_range(0.5..1.0),
                angular_traction: rng.random_range(0.5..1.0),
                roll_rad: rng.random_range(0.0..0.6),
                pitch_rad: rng.random_range(0.0..0.6),
            };
        }
    });
    map
}

/// Where the vehicle is in a cycle.
fn state(cycle: u64, step_s: f64) -> State {
    let [x_m, y_m, yaw_rad] = START;
    let travelled_m = SPEED_MPS * step_s * (cycle % N_UPDATES_PER_LAP) as f64;
    let (sin, cos) = yaw_rad.sin_cos();
    State {
        x_m: x_m + travelled_m * cos,
        y_m: y_m + travelled_m * sin,
        yaw_rad,
        speed_mps: SPEED_MPS,
        steering_rad: 0.0,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const REQUEST: Request = Request { n_threads: 1, n_updates: 3, work: Work::Bound, isa: Isa::Auto };

    #[test]
    fn every_work_is_measured_and_its_parts_make_the_whole() {
        for work in [Work::Bound, Work::Effects, Work::Drive] {
            let report = measure(Request { work, ..REQUEST }).unwrap();
            assert_eq!((report.threads, report.updates, report.config), (1, 3, work));
            assert!(
                0.0 < report.ms.min && report.ms.min <= report.ms.median && report.ms.median <= report.ms.p99
            );
            let Split { rollout, update } = report.split_ms;
            // Of a sum, the median is not the sum of the medians, but the parts cannot be longer than the whole.
            assert!([rollout, update].iter().all(|&part| part > 0.0 && part < report.ms.p99));
        }
    }

    #[test]
    fn the_work_is_that_of_the_yardstick() {
        for work in [Work::Bound, Work::Effects, Work::Drive] {
            let config = config(work, 1, Isa::Auto);
            assert_eq!((config.n_rollouts, config.n_steps, config.n_iterations), (1024, 50, 1));
        }
        let view_of = random_map();
        let geometry = view_of.view().geometry;
        assert_eq!((geometry.n_rows, geometry.n_cols, view_of.view().n_yaws), (96, 81, 13));
        assert_eq!(model(Work::Effects).unwrap().effects.len(), 2);
    }

    #[test]
    fn the_vehicle_stays_on_the_map_and_short_of_the_goal() {
        let map = random_map();
        for cycle in 0..2 * N_UPDATES_PER_LAP {
            let State { x_m, y_m, yaw_rad, .. } = state(cycle, 0.1);
            assert!(map.view().risk_at(x_m, y_m, yaw_rad) != Risk::OUTSIDE);
            assert!((GOAL_M[0] - x_m).hypot(GOAL_M[1] - y_m) > 5.0, "{cycle}");
        }
    }

    #[test]
    fn nothing_to_measure_is_refused() {
        assert!(matches!(measure(Request { n_updates: 0, ..REQUEST }), Err(BenchError::NoUpdates)));
    }
}
