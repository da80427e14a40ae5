//! One drive through the hall.

use std::fmt;

use bicycle::Model;
use rand::RngExt;
use scenarios::{ArenaConfig, ArenaWay, Outcome, Task, arena_way, seed_of, stream};
use serde::{Deserialize, Serialize};

use super::Settings;
use crate::closed_loop::{ClosedLoop, Drive, MapSource, Method};
use crate::sweep::BrokenDrive;

/// How far starts lie to either side of that of the hall [m], and how far they turn away from east [rad] (5 degrees).
const START_ASIDE_M: f64 = 0.1;
const START_YAW_RAD: f64 = 0.087;

/// Which bushes stand in the way.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Mission {
    /// 2 to 10 cm.
    Short,
    /// 10 to 30 cm; a wheel is 15 cm high.
    Tall,
}

impl Mission {
    /// Both.
    pub const ALL: [Self; 2] = [Self::Short, Self::Tall];

    /// Name in files and for people.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Short => "short",
            Self::Tall => "tall",
        }
    }

    /// Heights of its bushes [m].
    const fn heights_m(self) -> [f64; 2] {
        match self {
            Self::Short => [0.02, 0.1],
            Self::Tall => [0.1, 0.3],
        }
    }
}

/// One drive in numbers.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Run {
    /// Short bushes or tall ones.
    pub mission: Mission,
    /// What the controller knew of the ground.
    pub method: Method,
    /// Runs of one mission and number have bushes, start and sensor noise in common.
    pub number: u64,
    /// Height of the bushes [m].
    pub bush_height_m: f64,
    /// How it ended.
    pub outcome: Outcome,
    /// Simulated time until the end [s].
    pub time_s: f64,
    /// Way past the middle of the hall; null for one that did not get there.
    pub way: Option<ArenaWay>,
    /// Largest |roll| of the plant [deg].
    pub largest_roll_deg: f64,
    /// Largest |pitch| of the plant [deg].
    pub largest_pitch_deg: f64,
    /// x, y of the rear axle's centre at every cycle [m].
    pub path_m: Vec<[f64; 2]>,
}

impl Run {
    /// Whether it reached the goal.
    pub fn arrived(&self) -> bool {
        self.outcome == Outcome::Goal
    }
}

/// A drive to be done.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Job {
    pub mission: Mission,
    pub method: Method,
    pub number: u64,
}

impl fmt::Display for Job {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "{}, {} bushes, run {}", self.method.name(), self.mission.name(), self.number + 1)
    }
}

impl Job {
    pub(super) fn drive(&self, settings: &Settings) -> Result<Run, BrokenDrive> {
        let (task, bush_height_m) = self.task(settings.seed)?;
        let mut closed = self.begin(settings, task)?;
        let outcome = loop {
            if let Some(outcome) = closed.episode.outcome() {
                break outcome;
            }
            closed.cycle()?;
        };
        let episode = &closed.episode;
        let last = episode.motion().pose;
        let poses = episode.trace().iter().map(|row| row.motion.pose).chain([last]);
        let path_m: Vec<[f64; 2]> = poses.map(|pose| [pose.x_m, pose.y_m]).collect();
        Ok(Run {
            mission: self.mission,
            method: self.method,
            number: self.number,
            bush_height_m,
            outcome,
            time_s: episode.time_s(),
            way: arena_way(&path_m),
            largest_roll_deg: episode.largest_roll_rad().to_degrees(),
            largest_pitch_deg: episode.largest_pitch_rad().to_degrees(),
            path_m,
        })
    }

    /// What is to be driven, and the height of its bushes [m]: the same for every method.
    fn task(&self, seed: u64) -> Result<(Task, f64), BrokenDrive> {
        let mut rng = stream(seed, &[0xA12B, self.mission as u64, self.number]);
        let [low_m, high_m] = self.mission.heights_m();
        let bush_height_m = rng.random_range(low_m..high_m);
        let mut task = Task::arena(&ArenaConfig { bush_height_m, ..ArenaConfig::default() })?;
        task.start[1] += rng.random_range(-START_ASIDE_M..START_ASIDE_M);
        task.start[2] += rng.random_range(-START_YAW_RAD..START_YAW_RAD);
        Ok((task, bush_height_m))
    }

    fn begin(&self, settings: &Settings, task: Task) -> Result<ClosedLoop, BrokenDrive> {
        Ok(ClosedLoop::new(Drive {
            task,
            vehicle: &settings.vehicle,
            model: Model::of(&settings.vehicle),
            config: settings.config.clone(),
            episode: settings.episode.clone(),
            method: self.method,
            networks: settings.networks.of(self.method),
            corrector: None,
            map_source: MapSource::Sensed,
            level: settings.level,
            seed: seed_of(settings.seed, &[0xA12C, self.mission as u64, self.number]),
        })?)
    }
}
