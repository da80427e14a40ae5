//! One drive of the table.

use std::collections::BTreeMap;
use std::fmt;

use bicycle::{Decision, Model, StopReason};
use mppi::Isa;
use scenarios::{Outcome, Task};
use serde::Serialize;
use traversability::CvarLevel;

use super::Settings;
use crate::closed_loop::{ClosedLoop, Drive, MapSource, Method};
use crate::sweep::BrokenDrive;

/// One drive in numbers. Positions are those of the rear axle's centre in the map frame.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct DriveResult {
    /// What the controller knew of the ground.
    pub method: Method,
    /// Risk tolerance (CVaR level); null where the method knows no distribution.
    pub alpha: Option<f64>,
    /// Decides world, start, goal, sensor noise and samples.
    pub seed: u64,
    /// How it ended.
    pub outcome: Outcome,
    /// Simulated time until the end [s].
    pub time_s: f64,
    /// Way driven [m].
    pub path_length_m: f64,
    /// Straight line left to the goal at the end [m].
    pub distance_to_goal_m: f64,
    /// Largest |roll| of the plant [deg].
    pub largest_roll_deg: f64,
    /// Largest |pitch| of the plant [deg].
    pub largest_pitch_deg: f64,
    /// Where a drive that did not reach the goal ended: x, y [m]; null for one that did.
    pub failed_at_m: Option<[f64; 2]>,
    /// Cycles in which the controller asked for a stop, by reason.
    pub stops: BTreeMap<StopReason, u64>,
}

/// A drive to be done.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Job {
    pub method: Method,
    /// `None` where the method knows no distribution.
    pub level: Option<CvarLevel>,
    pub seed: u64,
}

/// A drive that is done.
pub(super) struct Finished {
    pub result: DriveResult,
    /// Instruction set that the controller used.
    pub isa: Isa,
}

/// How a drive ended, in a word or two.
pub fn name_of_outcome(outcome: Outcome) -> &'static str {
    match outcome {
        Outcome::Goal => "goal reached",
        Outcome::RolledOver => "rolled over",
        Outcome::AttitudeLimit => "attitude limit exceeded",
        Outcome::Stuck => "stuck",
        Outcome::OutOfBounds => "out of bounds",
        Outcome::Timeout => "time limit passed",
        Outcome::Stopped => "stopped",
        Outcome::Collision => "collision",
        Outcome::InWater => "in water",
        Outcome::WalkerStruck => "walker struck",
    }
}

impl fmt::Display for Job {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(self.method.name())?;
        if let Some(level) = self.level {
            write!(formatter, ", alpha {}", level.get())?;
        }
        write!(formatter, ", seed {}", self.seed)
    }
}

impl Job {
    pub(super) fn drive(&self, settings: &Settings) -> Result<Finished, BrokenDrive> {
        let mut closed_loop = self.begin(settings)?;
        let mut stops = BTreeMap::new();
        let outcome = loop {
            if let Some(outcome) = closed_loop.episode.outcome() {
                break outcome;
            }
            if let Decision::Stop(reason) = closed_loop.cycle()?.decision {
                *stops.entry(reason).or_default() += 1;
            }
        };
        let isa = closed_loop.navigator.controller().diagnostics().isa;
        Ok(Finished { result: self.result(&closed_loop, outcome, stops), isa })
    }

    fn begin(&self, settings: &Settings) -> Result<ClosedLoop, BrokenDrive> {
        Ok(ClosedLoop::new(Drive {
            task: Task::rock_field(&settings.field, self.seed)?,
            vehicle: &settings.vehicle,
            model: Model::of(&settings.vehicle),
            config: settings.config.clone(),
            episode: settings.episode.clone(),
            method: self.method,
            networks: None,
            corrector: None,
            map_source: MapSource::Sensed,
            level: self.level.unwrap_or(CvarLevel::MEAN),
            seed: self.seed,
        })?)
    }

    fn result(
        &self,
        closed_loop: &ClosedLoop,
        outcome: Outcome,
        stops: BTreeMap<StopReason, u64>,
    ) -> DriveResult {
        let episode = &closed_loop.episode;
        let pose = episode.motion().pose;
        DriveResult {
            method: self.method,
            alpha: self.level.map(CvarLevel::get),
            seed: self.seed,
            outcome,
            time_s: episode.time_s(),
            path_length_m: episode.path_length_m(),
            distance_to_goal_m: episode.task().distance_to_goal_m(pose.x_m, pose.y_m),
            largest_roll_deg: episode.largest_roll_rad().to_degrees(),
            largest_pitch_deg: episode.largest_pitch_rad().to_degrees(),
            failed_at_m: (outcome != Outcome::Goal).then_some([pose.x_m, pose.y_m]),
            stops,
        }
    }
}
