//! One drive through the rock field of `surefoot drive`, faster than there, so that a gap can matter.

use std::collections::VecDeque;

use bicycle::{Model, Vehicle};
use mppi::Isa;
use navigator::Config;
use scenarios::{Deviation, EpisodeConfig, Outcome, RockFieldConfig, Task, TestMachine};
use traversability::CvarLevel;

use super::drive::{DriveResult, End, Errors, Job};
use super::{ClosedLoopError, PLAN_AHEAD};
use crate::closed_loop::{ClosedLoop, Drive, MapSource, Method};

/// Fastest command among the rocks [m/s].
const SPEED_MPS: f64 = 3.0;
/// Risk tolerance, the default of `surefoot drive`.
const LEVEL: f64 = 0.6;
/// Longest drive [s].
const TIME_LIMIT_S: f64 = 90.0;

/// What all drives of a machine have in common.
pub(super) struct Rocks {
    field: RockFieldConfig,
    vehicle: Vehicle,
    config: Config,
    level: CvarLevel,
}

impl Rocks {
    /// For the machine, held to a speed that fits the rocks.
    pub fn new(machine: &TestMachine, isa: Isa) -> Result<Self, ClosedLoopError> {
        let mut vehicle = machine.vehicle.clone();
        vehicle.limits.speed_max_mps = SPEED_MPS;
        let mut config = Config::for_vehicle(&vehicle);
        config.controller.n_threads = 1;
        config.controller.isa = isa;
        Ok(Self { field: RockFieldConfig::default(), vehicle, config, level: CvarLevel::new(LEVEL)? })
    }

    /// Drives until the episode ends. The plan is compared with what becomes of it.
    pub fn drive(
        &self,
        machine: &TestMachine,
        job: Job,
        (model, deviations): (Model, &[Deviation]),
    ) -> Result<DriveResult, ClosedLoopError> {
        let mut episode = EpisodeConfig::for_vehicle(&self.vehicle);
        episode.rules.time_limit_s = TIME_LIMIT_S;
        episode.deviations = [&machine.peculiarities[..], deviations].concat();
        let mut closed = ClosedLoop::new(Drive {
            task: Task::rock_field(&self.field, job.seed)?,
            vehicle: &self.vehicle,
            model: Model { limits: self.vehicle.limits, ..model },
            config: self.config.clone(),
            episode,
            method: Method::Physics,
            networks: None,
            corrector: None,
            map_source: MapSource::Sensed,
            level: self.level,
            seed: job.seed,
        })?;
        let mut errors = Errors::default();
        let mut foreseen: VecDeque<Option<[f64; 2]>> = VecDeque::new();
        let outcome = loop {
            if let Some(outcome) = closed.episode.outcome() {
                break outcome;
            }
            let is_driven = matches!(closed.cycle()?.decision, bicycle::Decision::Drive(_));
            let navigator = &closed.navigator;
            let plan = navigator
                .risk_map()
                .filter(|_| is_driven)
                .map(|map| navigator.controller().nominal_trajectory(map));
            foreseen.push_back(
                plan.and_then(|states| states.get(PLAN_AHEAD).map(|state| [state.x_m, state.y_m])),
            );
            if foreseen.len() == PLAN_AHEAD {
                let pose = closed.episode.motion().pose;
                if let Some([x_m, y_m]) = foreseen.pop_front().flatten() {
                    errors.plan((pose.x_m - x_m).hypot(pose.y_m - y_m));
                }
            }
        };
        let way = (closed.episode.time_s(), closed.episode.path_length_m());
        Ok(errors.result(job, end(outcome), way))
    }
}

fn end(outcome: Outcome) -> End {
    match outcome {
        Outcome::Goal => End::Goal,
        Outcome::RolledOver => End::RolledOver,
        Outcome::AttitudeLimit => End::AttitudeLimit,
        Outcome::Stuck => End::Stuck,
        Outcome::OutOfBounds => End::OutOfBounds,
        Outcome::Timeout => End::Timeout,
        Outcome::Stopped => End::Stopped,
        // Nobody walks about there.
        Outcome::Collision | Outcome::WalkerStruck => End::Collision,
        Outcome::InWater => End::InWater,
    }
}
