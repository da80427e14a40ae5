//! One drive along a course: the plant with its gap, its sensors, and the shipping controller.

use std::sync::Arc;

use bicycle::{Command, Model, SensorModel};
use mppi::{Config, Controller, Input, Objective, ReferencePath};
use scenarios::{Deviation, OdometrySensor, Plant, TestMachine};
use traversability::RiskMap;

use super::course::Course;
use super::drive::{DriveResult, End, Errors, Job};
use super::{ClosedLoopError, PLAN_AHEAD};
use crate::closed_loop::slopes;

/// Control cycles per second [Hz].
const CONTROL_HZ: f64 = 10.0;
/// Longest drive over the course's duration [-].
const TIME_LIMIT: f64 = 2.5;

/// What all drives of a machine have in common.
pub(super) struct Track {
    map: RiskMap,
    config: Config,
}

impl Track {
    /// The machine's hills as the controller sees them.
    pub fn new(machine: &TestMachine, isa: mppi::Isa) -> Self {
        let config = Config { n_threads: 1, isa, ..Config::default() };
        Self { map: slopes(&machine.world), config }
    }

    /// Drives to the end of the course, or off it.
    pub fn drive(
        &self,
        machine: &TestMachine,
        job: Job,
        (model, deviations): (Model, &[Deviation]),
    ) -> Result<DriveResult, ClosedLoopError> {
        let course = Course::draw(machine, job.seed);
        let all = [&machine.peculiarities[..], deviations].concat();
        let mut plant = Plant::deviating(&machine.vehicle, &all, Arc::clone(&machine.world), course.start())?;
        let mut sensor = OdometrySensor::deviating(machine.sensors, &all, job.seed);
        let correction = SensorModel::of(&model.effects);
        let mut controller = Controller::new(self.config.clone(), model, job.seed)?;
        let mut errors = Errors::default();
        let mut foreseen = std::collections::VecDeque::new();
        let (mut along_m, mut command, mut path_length_m) = (0.0, Command::default(), 0.0);
        let period_s = 1.0 / CONTROL_HZ;
        let n_most = (TIME_LIMIT * course.duration_s() * CONTROL_HZ) as u64;
        let mut end = End::Timeout;
        for cycle in 0..n_most {
            let odometry = sensor.measure(&plant.motion(), (cycle as f64 * period_s * 1e9) as u64);
            let decision = controller.decide(&Input {
                state: correction.corrected(&odometry).state(),
                elapsed_s: if cycle == 0 { 0.0 } else { period_s },
                map: self.map.view(),
                objective: Objective::Path(ReferencePath {
                    points_m: &course.points_m,
                    speed_mps: course.speed_mps(along_m),
                    tolerance_m: course.tolerance_m,
                }),
                cycle,
            });
            command = decision.command(command);
            if let Some(state) = controller.nominal_trajectory(self.map.view()).get(PLAN_AHEAD) {
                foreseen.push_back([state.x_m, state.y_m]);
            }
            let before = plant.pose();
            plant.set_command(command)?;
            plant.advance(period_s);
            let pose = plant.pose();
            path_length_m += (pose.x_m - before.x_m).hypot(pose.y_m - before.y_m);
            let (passed_m, away_m) = course.nearest([pose.x_m, pose.y_m], along_m);
            errors.across(away_m, plant.motion().velocity_mps[0] - course.speed_mps(along_m));
            if foreseen.len() == PLAN_AHEAD {
                let [x_m, y_m] = foreseen.pop_front().unwrap_or_default();
                errors.plan((pose.x_m - x_m).hypot(pose.y_m - y_m));
            }
            along_m = passed_m;
            let verdict = if plant.rolled_over() || !plant.is_finite() {
                Some(End::RolledOver)
            } else if away_m > course.corridor_m {
                Some(End::LeftCourse)
            } else {
                (along_m >= course.length_m() - course.tolerance_m).then_some(End::Goal)
            };
            if let Some(verdict) = verdict {
                end = verdict;
                break;
            }
        }
        Ok(errors.result(job, end, (plant.time_s(), path_length_m)))
    }
}
