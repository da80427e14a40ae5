//! One run among walkers.

use std::f64::consts::TAU;
use std::fmt;
use std::sync::Arc;

use bicycle::{Decision, Model, StopReason};
use rand::RngExt;
use scenarios::{EpisodeConfig, Outcome, Patch, Stribeck, Strike, Task, World, WorldError, seed_of, stream};
use serde::Serialize;
use terrain::GridGeometry;
use traversability::CvarLevel;

use super::{Handling, Settings};
use crate::closed_loop::{ClosedLoop, Drive, MapSource, Method};
use crate::sweep::BrokenDrive;

/// From start to goal [m].
const DISTANCE_M: f64 = 18.0;
/// Side of the world [m].
const SIDE_M: f64 = 44.0;
/// Risk tolerance.
const LEVEL: f64 = 0.6;
/// Cycles between two moments of a trail.
const CYCLES_PER_MOMENT: u64 = 5;

/// Somebody was struck, see [`Strike`].
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Contact {
    /// When, since the start [s].
    pub time_s: f64,
    /// Where the walker was [m].
    pub at_m: [f64; 2],
    /// Speed of the vehicle then [m/s].
    pub speed_mps: f64,
    /// When it could first be foreseen [s]; null if never.
    pub foreseen_at_s: Option<f64>,
    /// Whether a stop would have avoided it.
    pub was_avoidable: bool,
}

/// Where everybody was at a time.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Moment {
    /// Since the start [s].
    pub time_s: f64,
    /// The vehicle's rear axle [m] and yaw [rad].
    pub pose: [f64; 3],
    /// The walkers [m].
    pub walkers_m: Vec<[f64; 2]>,
    /// Whether the vehicle stopped for something that moves.
    pub stops: bool,
}

/// One run in numbers.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Crossing {
    /// How what moves was dealt with.
    pub handling: Handling,
    /// Which people and which world.
    pub number: u64,
    /// How it ended.
    pub outcome: Outcome,
    /// Simulated time until the end [s].
    pub time_s: f64,
    /// Whom the vehicle struck.
    pub contact: Option<Contact>,
    /// How often somebody walked into the standing vehicle.
    pub n_walked_into: u64,
    /// Decisions to stop for something that moves.
    pub n_stops_for_moving: u64,
    /// Nearest that the moving vehicle came to anybody [m], looked at every cycle.
    pub least_clearance_m: f64,
    /// Twice a second.
    pub trail: Vec<Moment>,
}

/// A run to be done.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Job {
    pub handling: Handling,
    pub number: u64,
}

impl fmt::Display for Job {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "{}, run {}", self.handling.name(), self.number)
    }
}

impl Job {
    pub(super) fn drive(&self, settings: &Settings) -> Result<Crossing, BrokenDrive> {
        let mut closed = self.begin(settings)?;
        let (mut n_stops, mut least_m, mut trail) = (0, f64::INFINITY, Vec::new());
        let outcome = loop {
            let is_moment = closed.episode.n_cycles().is_multiple_of(CYCLES_PER_MOMENT);
            if is_moment {
                trail.push(moment(&closed));
            }
            if let Some(outcome) = closed.episode.outcome() {
                break outcome;
            }
            let stops = closed.cycle()?.decision == Decision::Stop(StopReason::MovingObstacle);
            n_stops += u64::from(stops);
            if is_moment && let Some(moment) = trail.last_mut() {
                moment.stops = stops;
            }
            least_m = least_m.min(clearance_m(&closed, settings));
        };
        Ok(Crossing {
            handling: self.handling,
            number: self.number,
            outcome,
            time_s: closed.episode.time_s(),
            contact: closed.episode.strike().map(contact),
            n_walked_into: closed.episode.n_walked_into(),
            n_stops_for_moving: n_stops,
            least_clearance_m: least_m,
            trail,
        })
    }

    fn begin(&self, settings: &Settings) -> Result<ClosedLoop, BrokenDrive> {
        let Settings { vehicle, config, episode, n_walkers, .. } = settings;
        let seed = seed_of(settings.seed, &[self.number]);
        let task = task(seed)?;
        let walkers = task.crossing_walkers(*n_walkers, vehicle.limits.speed_max_mps, seed);
        let moving = config.moving.filter(|_| self.handling == Handling::Tracked);
        Ok(ClosedLoop::new(Drive {
            task,
            vehicle,
            model: Model::of(vehicle),
            config: navigator::Config { moving, ..config.clone() },
            episode: EpisodeConfig { walkers, ..episode.clone() },
            method: Method::Physics,
            networks: None,
            corrector: None,
            map_source: MapSource::Sensed,
            level: CvarLevel::new(LEVEL).unwrap_or(CvarLevel::MEAN),
            seed,
        })?)
    }
}

/// Gently rolling open ground, and a way across its middle.
fn task(seed: u64) -> Result<Task, WorldError> {
    let mut random = stream(seed, &[0xC7]);
    let yaw_rad: f64 = random.random_range(0.0..TAU);
    let waves: Vec<[f64; 4]> = (0..6)
        .map(|_| {
            let (direction_rad, length_m): (f64, f64) =
                (random.random_range(0.0..TAU), random.random_range(6.0..16.0));
            let wave = TAU / length_m;
            [wave * direction_rad.cos(), wave * direction_rad.sin(), random.random_range(0.0..TAU), 0.03]
        })
        .collect();
    let height_m = |x_m: f64, y_m: f64| {
        waves
            .iter()
            .map(|[east, north, phase, height_m]| height_m * (east * x_m + north * y_m + phase).sin())
            .sum()
    };
    let n = (SIDE_M / 0.1) as usize;
    let geometry = GridGeometry { resolution_m: 0.1, origin: [0, 0], n_rows: n, n_cols: n };
    let world = World::from_fn("meadow", geometry, height_m, |_, _| Patch::open(Stribeck::DIRT))?;
    let at = |along_m: f64| [0.5 * SIDE_M + along_m * yaw_rad.cos(), 0.5 * SIDE_M + along_m * yaw_rad.sin()];
    let [x_m, y_m] = at(-0.5 * DISTANCE_M);
    Ok(Task::in_world(Arc::new(world), [x_m, y_m, yaw_rad], at(0.5 * DISTANCE_M), 1.0))
}

fn moment(closed: &ClosedLoop) -> Moment {
    let pose = closed.episode.motion().pose;
    Moment {
        time_s: closed.episode.time_s(),
        pose: [pose.x_m, pose.y_m, pose.yaw_rad],
        walkers_m: closed.episode.walkers().iter().map(scenarios::Walker::position_m).collect(),
        stops: false,
    }
}

/// From the moving vehicle to the nearest walker [m]; of one that stands, infinite.
fn clearance_m(closed: &ClosedLoop, settings: &Settings) -> f64 {
    let motion = closed.episode.motion();
    if motion.velocity_mps[0].hypot(motion.velocity_mps[1]) < 0.05 {
        return f64::INFINITY;
    }
    let walkers = closed.episode.walkers().iter();
    walkers
        .map(|walker| walker.clearance_m(&settings.vehicle.geometry, &motion.pose))
        .fold(f64::INFINITY, f64::min)
}

fn contact(strike: Strike) -> Contact {
    let Strike { time_s, at_m, speed_mps, foreseen_at_s, was_avoidable, .. } = strike;
    Contact { time_s, at_m, speed_mps, foreseen_at_s, was_avoidable }
}
