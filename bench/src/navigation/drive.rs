//! One drive of the table.

use std::collections::BTreeMap;
use std::fmt;

use bicycle::{Decision, Model, StopReason};
use scenarios::{Bounds, Episode, Outcome, RockFieldConfig, RockFieldError, RockMap, Split, Task, seed_of};
use serde::{Deserialize, Serialize};
use traversability::CvarLevel;

use super::external::{Answers, ComputeTime, External};
use super::plan::Settings;
use super::{Entrant, PlannerName};
use crate::closed_loop::{ClosedLoop, Drive, DriveError, MapSource, Method};
use crate::sweep::BrokenDrive;

/// One drive in numbers. Positions are those of the rear axle's centre in the map frame.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct DriveResult {
    /// Who drove.
    pub method: Entrant,
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
    /// Longest time in which no wheel touched the ground [s].
    pub longest_flight_s: f64,
    /// Where a drive that did not reach the goal ended: x, y [m]; null for one that did.
    pub failed_at_m: Option<[f64; 2]>,
    /// Cycles in which the controller asked for a stop, by reason.
    pub stops: BTreeMap<StopReason, u64>,
    /// How long a planner of other people's took for its commands.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub compute: Option<ComputeTime>,
}

/// A start with its goal on a map of the benchmark: what drives by different methods share.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Place {
    /// Of the benchmark.
    pub seed: u64,
    /// Map, from 0.
    pub map: u32,
    /// Start and goal on it, from 0.
    pub pair: u32,
}

impl Place {
    /// World, start and goal.
    ///
    /// # Errors
    /// A field that cannot be, or that has no room for such a drive.
    pub fn task(&self, field: &RockFieldConfig) -> Result<Task, RockFieldError> {
        let map = RockMap { seed: self.seed, split: Split::Test, index: self.map };
        Task::on_rock_map(field, map, self.pair)
    }

    /// Corners of the ground [m]: every planner is told where it ends, which no sensor shows.
    pub fn fence_m(field: &RockFieldConfig) -> Vec<[f64; 2]> {
        Bounds { south_west_m: [0.0; 2], north_east_m: [field.side_m; 2] }.corners_m()
    }

    /// Seed of the sensors' noise and the controller's samples.
    pub fn seed_of_drive(&self) -> u64 {
        seed_of(self.seed, &[0xD21E, self.map.into(), self.pair.into()])
    }
}

/// A drive to be done.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Job {
    pub who: Entrant,
    /// `None` where the method knows no distribution.
    pub level: Option<CvarLevel>,
    pub map: u32,
    pub pair: u32,
}

impl DriveResult {
    /// Whether both ended the same way; how long a planner took for its commands is another time each time.
    pub fn ended_like(&self, other: &Self) -> bool {
        Self { compute: None, ..self.clone() } == Self { compute: None, ..other.clone() }
    }
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
        formatter.write_str(self.who.name())?;
        if let Some(level) = self.level {
            write!(formatter, ", alpha {}", level.get())?;
        }
        write!(formatter, ", map {}, pair {}", self.map + 1, self.pair + 1)
    }
}

impl Job {
    /// Whether this drive gave that result.
    pub(super) fn is_of(&self, drive: &DriveResult) -> bool {
        (&self.who, self.level.map(CvarLevel::get), self.map, self.pair)
            == (&drive.method, drive.alpha, drive.map, drive.pair)
    }

    pub(super) fn drive(
        &self,
        settings: &Settings,
        external: &External<'_>,
    ) -> Result<DriveResult, BrokenDrive> {
        match &self.who {
            Entrant::Ours(method) => self.drive_ours(*method, settings),
            Entrant::External(name) => self.drive_external(name, settings, external),
        }
    }

    fn drive_ours(&self, method: Method, settings: &Settings) -> Result<DriveResult, BrokenDrive> {
        let mut closed_loop = self.begin(method, settings)?;
        let mut stops = BTreeMap::new();
        while closed_loop.episode.outcome().is_none() {
            if let Decision::Stop(reason) = closed_loop.cycle()?.decision {
                *stops.entry(reason).or_default() += 1;
            }
        }
        Ok(self.result(&closed_loop.episode, Answers { stops, ..Answers::default() }))
    }

    fn drive_external(
        &self,
        name: &PlannerName,
        settings: &Settings,
        external: &External<'_>,
    ) -> Result<DriveResult, BrokenDrive> {
        let Settings { field, seed, vehicle, episode, .. } = settings;
        let place = self.place(*seed);
        let episode = Episode::new(place.task(field)?, vehicle, episode.clone(), place.seed_of_drive())
            .map_err(DriveError::from)?;
        let (episode, answers) = external(name, episode).map_err(BrokenDrive::External)?;
        Ok(self.result(&episode, answers))
    }

    fn place(&self, seed: u64) -> Place {
        Place { seed, map: self.map, pair: self.pair }
    }

    fn begin(&self, method: Method, settings: &Settings) -> Result<ClosedLoop, BrokenDrive> {
        let place = self.place(settings.seed);
        Ok(ClosedLoop::new(Drive {
            task: place.task(&settings.field)?,
            vehicle: &settings.vehicle,
            model: Model::of(&settings.vehicle),
            config: settings.config.clone(),
            episode: settings.episode.clone(),
            method,
            networks: None,
            corrector: None,
            map_source: MapSource::Sensed,
            level: self.level.unwrap_or(CvarLevel::MEAN),
            seed: place.seed_of_drive(),
        })?)
    }

    /// Of an episode that has ended; one that has not was broken off.
    fn result(&self, episode: &Episode, answers: Answers) -> DriveResult {
        let outcome = episode.outcome().unwrap_or(Outcome::Stopped);
        let pose = episode.motion().pose;
        DriveResult {
            method: self.who.clone(),
            alpha: self.level.map(CvarLevel::get),
            map: self.map,
            pair: self.pair,
            outcome,
            time_s: episode.time_s(),
            path_length_m: episode.path_length_m(),
            distance_to_goal_m: episode.task().distance_to_goal_m(pose.x_m, pose.y_m),
            largest_roll_deg: episode.largest_roll_rad().to_degrees(),
            largest_pitch_deg: episode.largest_pitch_rad().to_degrees(),
            longest_flight_s: episode.longest_flight_s(),
            failed_at_m: (outcome != Outcome::Goal).then_some([pose.x_m, pose.y_m]),
            stops: answers.stops,
            compute: ComputeTime::of(&answers.cycles_ms),
        }
    }
}

/// A drive that ended so, for tests of what is made of drives.
#[cfg(test)]
pub(super) fn driven(
    method: impl Into<Entrant>,
    alpha: Option<f64>,
    pair: u32,
    outcome: Outcome,
    time_s: f64,
) -> DriveResult {
    DriveResult {
        method: method.into(),
        alpha,
        map: 0,
        pair,
        outcome,
        time_s,
        path_length_m: 44.0,
        distance_to_goal_m: 1.0,
        largest_roll_deg: 10.0,
        largest_pitch_deg: 12.0,
        longest_flight_s: 0.0,
        failed_at_m: (outcome != Outcome::Goal).then_some([20.0, 31.26]),
        stops: BTreeMap::new(),
        compute: None,
    }
}
