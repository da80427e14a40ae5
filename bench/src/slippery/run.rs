//! One drive over a course.

use std::fmt;
use std::sync::Arc;

use bicycle::{Model, Vehicle};
use navigator::{Config, FrictionConfig, NavigatorError, Route};
use scenarios::{Outcome, Stribeck, Task, World, seed_of, steady_friction};
use serde::Serialize;
use terrain::GridMap;
use traversability::CvarLevel;

use super::course::Course;
use super::{Settings, Told};
use crate::closed_loop::{ClosedLoop, Drive, DriveError, MapSource, Method};
use crate::sweep::BrokenDrive;

/// Sideslip of the rear axle from which the vehicle slides [rad] (10 degrees), at speeds from [m/s], and for how long until
/// a drive counts as one that slid [s].
const SLIP_RAD: f64 = 0.1745;
const SLIDING_MPS: f64 = 1.0;
const SLID_S: f64 = 0.3;
/// Sliding speed at which friction is told [m/s].
const TOLD_AT_MPS: f64 = 1.0;
/// How near to a goal counts as there [m].
const TOLERANCE_M: f64 = 3.0;
const LEVEL: f64 = 0.6;
/// Cycles between two moments of a trail.
const CYCLES_PER_MOMENT: u64 = 2;

/// Where the vehicle was at a time.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Moment {
    /// Its rear axle [m] and yaw [rad].
    pub pose: [f64; 3],
    /// [m/s].
    pub speed_mps: f64,
    /// Whether it slid.
    pub slides: bool,
}

/// One drive in numbers.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Run {
    /// What the controller was told.
    pub told: Told,
    /// Which course.
    pub course: u64,
    /// How it ended.
    pub outcome: Outcome,
    /// Simulated time until the end [s].
    pub time_s: f64,
    /// Time with the rear axle going at least 10 degrees from where it points, at 1 m/s or more [s].
    pub slid_s: f64,
    /// Largest sideslip at such speeds [rad].
    pub largest_slip_rad: f64,
    /// [m/s].
    pub fastest_mps: f64,
    /// Five times a second.
    pub trail: Vec<Moment>,
}

impl Run {
    /// Whether it went through all goals.
    pub fn arrived(&self) -> bool {
        self.outcome == Outcome::Goal
    }

    /// Whether it slid for 0.3 s or more.
    pub fn slid(&self) -> bool {
        self.slid_s >= SLID_S - 1e-9
    }
}

/// A drive to be done.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Job {
    pub told: Told,
    pub course: u64,
}

impl fmt::Display for Job {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "told {}, course {}", self.told.name(), self.course)
    }
}

impl Job {
    pub(super) fn drive(&self, settings: &Settings) -> Result<Run, BrokenDrive> {
        let mut closed = self.begin(settings)?;
        let cycle_s = closed.episode.cycle_s();
        let (mut slid_s, mut largest_slip_rad, mut fastest_mps) = (0.0, 0.0f64, 0.0f64);
        let mut trail = Vec::new();
        let outcome = loop {
            let [speed_mps, slip_rad] = motion(&closed);
            let slides = speed_mps >= SLIDING_MPS && slip_rad >= SLIP_RAD;
            slid_s += if slides { cycle_s } else { 0.0 };
            if speed_mps >= SLIDING_MPS {
                largest_slip_rad = largest_slip_rad.max(slip_rad);
            }
            fastest_mps = fastest_mps.max(speed_mps);
            if closed.episode.n_cycles().is_multiple_of(CYCLES_PER_MOMENT) {
                let pose = closed.episode.motion().pose;
                trail.push(Moment { pose: [pose.x_m, pose.y_m, pose.yaw_rad], speed_mps, slides });
            }
            if let Some(outcome) = closed.episode.outcome() {
                break outcome;
            }
            closed.cycle()?;
        };
        let (told, course, time_s) = (self.told, self.course, closed.episode.time_s());
        Ok(Run { told, course, outcome, time_s, slid_s, largest_slip_rad, fastest_mps, trail })
    }

    fn begin(&self, settings: &Settings) -> Result<ClosedLoop, BrokenDrive> {
        let Settings { vehicle, config, episode, seed } = settings;
        let course = Course::draw(*seed, self.course);
        let world = Arc::new(course.world()?);
        let first_m = course.goals_m.first().copied().unwrap_or_default();
        let route = Route::goals(course.goals_m.clone(), TOLERANCE_M)
            .map_err(|error| DriveError::from(NavigatorError::from(error)))?;
        let mut closed = ClosedLoop::new(Drive {
            task: Task::in_world(Arc::clone(&world), course.start, first_m, TOLERANCE_M),
            vehicle,
            model: Model::of(vehicle),
            config: self.config(vehicle, config),
            episode: episode.clone(),
            method: Method::Physics,
            networks: None,
            corrector: None,
            map_source: MapSource::Sensed,
            level: CvarLevel::new(LEVEL).unwrap_or(CvarLevel::MEAN),
            seed: seed_of(*seed, &[self.course]),
        })?;
        if self.told == Told::Cells {
            closed.navigator.know_friction(&Arc::new(friction(vehicle, &world)));
        }
        closed.follow(route)?;
        Ok(closed)
    }

    fn config(&self, vehicle: &Vehicle, config: &Config) -> Config {
        let mut config = config.clone();
        match self.told {
            Told::Nothing => {}
            Told::Least => {
                let friction = Some(told_friction(vehicle, Stribeck::ICE));
                let everywhere = FrictionConfig { open: friction, loose: friction, vegetation: friction };
                config.keep_to_friction(everywhere);
            }
            Told::Cells => config.keep_to_friction(FrictionConfig::default()),
        }
        config
    }
}

/// Speed over the ground [m/s] and sideslip [rad], of the rear axle.
fn motion(closed: &ClosedLoop) -> [f64; 2] {
    let [forward_mps, left_mps, _] = closed.episode.motion().velocity_mps;
    [forward_mps.hypot(left_mps), left_mps.abs().atan2(forward_mps.abs())]
}

/// What a wheel of the plant finds there while it slides sideways at the speed at which friction is told [-].
fn told_friction(vehicle: &Vehicle, ground: Stribeck) -> f64 {
    steady_friction(vehicle, ground, TOLD_AT_MPS, [0.0, TOLD_AT_MPS])[1].abs()
}

fn friction(vehicle: &Vehicle, world: &World) -> GridMap<f32> {
    let mut map = GridMap::filled(*world.geometry(), f32::NAN);
    let geometry = *world.geometry();
    let mut known: Vec<(Stribeck, f32)> = Vec::new();
    for (index, value) in map.values_mut().iter_mut().enumerate() {
        let [x_m, y_m] = geometry.centre_m(geometry.cell(index));
        let ground = world.patch(x_m, y_m).friction;
        let found = known.iter().find(|(kind, _)| *kind == ground).map(|(_, friction)| *friction);
        *value = found.unwrap_or_else(|| {
            let friction = told_friction(vehicle, ground) as f32;
            known.push((ground, friction));
            friction
        });
    }
    map
}
