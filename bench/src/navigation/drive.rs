//! One drive of the table.

use std::collections::BTreeMap;
use std::fmt;

use bicycle::{Decision, Model, StopReason};
use scenarios::{Outcome, RockMap, Split, Task, seed_of};
use serde::{Deserialize, Serialize};
use traversability::CvarLevel;

use super::plan::Settings;
use crate::closed_loop::{ClosedLoop, Drive, MapSource, Method};
use crate::sweep::BrokenDrive;

/// One drive in numbers. Positions are those of the rear axle's centre in the map frame.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct DriveResult {
    /// What the controller knew of the ground.
    pub method: Method,
    /// Risk tolerance (CVaR level); null where the method knows no distribution.
    pub alpha: Option<f64>,
    /// Map, from 0.
    pub map: u32,
    /// Start and goal on it, from 0.
    pub pair: u32,
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
    pub map: u32,
    pub pair: u32,
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
        write!(formatter, ", map {}, pair {}", self.map + 1, self.pair + 1)
    }
}

impl Job {
    /// Whether this drive gave that result.
    pub(super) fn is_of(&self, drive: &DriveResult) -> bool {
        (self.method, self.level.map(CvarLevel::get), self.map, self.pair)
            == (drive.method, drive.alpha, drive.map, drive.pair)
    }

    pub(super) fn drive(&self, settings: &Settings) -> Result<DriveResult, BrokenDrive> {
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
        Ok(self.result(&closed_loop, outcome, stops))
    }

    fn begin(&self, settings: &Settings) -> Result<ClosedLoop, BrokenDrive> {
        let map = RockMap { seed: settings.seed, split: Split::Test, index: self.map };
        Ok(ClosedLoop::new(Drive {
            task: Task::on_rock_map(&settings.field, map, self.pair)?,
            vehicle: &settings.vehicle,
            model: Model::of(&settings.vehicle),
            config: settings.config.clone(),
            episode: settings.episode.clone(),
            method: self.method,
            networks: None,
            corrector: None,
            map_source: MapSource::Sensed,
            level: self.level.unwrap_or(CvarLevel::MEAN),
            seed: seed_of(settings.seed, &[0xD21E, self.map.into(), self.pair.into()]),
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
            map: self.map,
            pair: self.pair,
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

/// A drive that ended so, for tests of what is made of drives.
#[cfg(test)]
pub(super) fn driven(
    method: Method,
    alpha: Option<f64>,
    pair: u32,
    outcome: Outcome,
    time_s: f64,
) -> DriveResult {
    DriveResult {
        method,
        alpha,
        map: 0,
        pair,
        outcome,
        time_s,
        path_length_m: 44.0,
        distance_to_goal_m: 1.0,
        largest_roll_deg: 10.0,
        largest_pitch_deg: 12.0,
        failed_at_m: (outcome != Outcome::Goal).then_some([20.0, 31.26]),
        stops: BTreeMap::new(),
    }
}
