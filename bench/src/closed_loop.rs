//! The closed loop that every drive and every navigation table runs: an episode of the plant and the navigator that
//! decides in it.
#![allow(clippy::disallowed_methods, reason = "what a cycle costs is measured here")]

use std::sync::{Arc, Mutex, PoisonError};
use std::time::Instant;

use bicycle::{Decision, Model, Vehicle};
use evidential::{Checkpoint, ShippedError, Unfamiliar, shipped};
use formats::ElevationFile;
use navigator::{
    Belief, Config, Destination, Navigator, NavigatorError, Order, RiskOracle, Route, Setup, Surface,
};
use rayon::prelude::*;
use scenarios::{
    Episode, EpisodeConfig, EpisodeError, Task, Traversability, Truth, TruthField, World, WorldLayers,
};
use serde::{Deserialize, Serialize};
use terrain::{Cell, GridGeometry, GridMap, SurfaceCell};
use traversability::{CvarLevel, Ground, Risk, RiskMap};

/// What the controller knows of the ground.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Method {
    /// What was learned, over the physics prior by evidence.
    Pietra,
    /// The same; ground unlike the training data is avoided.
    PietraAvoid,
    /// What was learned, over the uniform prior by evidence; ground unlike the training data is avoided.
    Evora,
    /// What was learned with a loss that keeps it close to physics, alone.
    PhysicsInformed,
    /// What was learned, alone.
    Vanilla,
    /// The physics prior on the map.
    Physics,
    /// No slip and full traction everywhere.
    Nominal,
    /// The plant's true traction and attitude.
    Truth,
}

impl Method {
    /// Name on the command line and in files.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Pietra => "pietra",
            Self::PietraAvoid => "pietra-avoid",
            Self::Evora => "evora",
            Self::PhysicsInformed => "physics-informed",
            Self::Vanilla => "vanilla",
            Self::Physics => "physics",
            Self::Nominal => "nominal",
            Self::Truth => "truth",
        }
    }

    /// How the networks that it drives on were trained, and what becomes of ground unlike their training data; `None`
    /// for a method without networks.
    pub const fn learned(self) -> Option<(evidential::Method, Unfamiliar)> {
        match self {
            Self::Pietra => Some((evidential::Method::Pietra, Unfamiliar::Fuse)),
            Self::PietraAvoid => Some((evidential::Method::Pietra, Unfamiliar::Avoid)),
            Self::Evora => Some((evidential::Method::Evora, Unfamiliar::Avoid)),
            Self::PhysicsInformed => Some((evidential::Method::PhysicsInformed, Unfamiliar::Fuse)),
            Self::Vanilla => Some((evidential::Method::Vanilla, Unfamiliar::Fuse)),
            Self::Physics | Self::Nominal | Self::Truth => None,
        }
    }

    /// Whether it knows distributions, of which a CVaR level makes a risk.
    pub const fn has_level(self) -> bool {
        !matches!(self, Self::Nominal | Self::Truth)
    }
}

/// Where the controller's map comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum MapSource {
    /// Fused online from simulated range scans.
    Sensed,
    /// The world itself.
    Oracle,
}

/// Everything that one drive is made of.
pub struct Drive<'a> {
    /// Where, from where, where to.
    pub task: Task,
    /// The machine that is simulated.
    pub vehicle: &'a Vehicle,
    /// What the controller believes of it.
    pub model: Model,
    /// Settings of the pipeline.
    pub config: Config,
    /// Sensors, rules and faults.
    pub episode: EpisodeConfig,
    /// What the controller knows of the ground.
    pub method: Method,
    /// Networks in place of those that come with the program, for a method that has any.
    pub networks: Option<Arc<Checkpoint>>,
    /// What corrects commands for the ground under the wheels, if anything does.
    pub corrector: Option<Arc<kinodynamics::Checkpoint>>,
    /// Where its map comes from.
    pub map_source: MapSource,
    /// Share of the worst outcomes to plan for.
    pub level: CvarLevel,
    /// Decides sensor noise and samples.
    pub seed: u64,
}

/// Why a drive cannot begin or go on.
#[derive(Debug, thiserror::Error)]
pub enum DriveError {
    /// The plant or its sensors.
    #[error(transparent)]
    Episode(#[from] EpisodeError),
    /// The planner.
    #[error(transparent)]
    Navigator(#[from] NavigatorError),
    /// No networks that come with the program will do.
    #[error(transparent)]
    Shipped(#[from] ShippedError),
    /// The networks were trained in another way than the method asks for.
    #[error("networks for method {method}: expected trained by {expected}, found by {found}")]
    Training {
        /// What was asked for.
        method: &'static str,
        /// How its networks are trained.
        expected: &'static str,
        /// How these were trained.
        found: &'static str,
    },
}

/// One control cycle, and what it cost on this machine.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cycle {
    /// What was decided.
    pub decision: Decision,
    /// Time of mapping, risk map and cost to go [ms]; `None` in a cycle that renewed no map.
    pub map_ms: Option<f64>,
    /// Time of the controller [ms].
    pub control_ms: f64,
}

/// A plant and its planner.
pub struct ClosedLoop {
    /// The plant's side.
    pub episode: Episode,
    /// The planner's side.
    pub navigator: Navigator,
}

impl ClosedLoop {
    /// Puts the vehicle at the start with a planner that has seen nothing.
    pub fn new(drive: Drive<'_>) -> Result<Self, DriveError> {
        let belief = belief(&drive)?;
        let Drive { task, vehicle, model, config, episode, corrector, map_source, level, seed, .. } = drive;
        let surface = match map_source {
            MapSource::Sensed => Surface::Sensed,
            MapSource::Oracle => Surface::Given(true_surface(&task.world, config.elevation.resolution_m)),
        };
        let (goal_m, tolerance_m) = (task.goal_m, task.goal_tolerance_m);
        let navigator = Navigator::new(Setup {
            geometry: &vehicle.geometry,
            model,
            config,
            belief,
            surface,
            level,
            seed,
            goal_m,
            tolerance_m,
        })?;
        let navigator = match &corrector {
            Some(checkpoint) => navigator.with_corrector(checkpoint)?,
            None => navigator,
        };
        Ok(Self { episode: Episode::new(task, vehicle, episode, seed)?, navigator })
    }

    /// Drives a route in place of the task's one goal.
    pub fn follow(&mut self, route: Route) -> Result<(), DriveError> {
        let now_ns = self.episode.observe().valid_at_ns;
        // Nothing speaks against an order of now.
        self.navigator.order(Order::Drive(route), now_ns).ok();
        Ok(())
    }

    /// Observes, decides and drives on for one control cycle. The episode ends at the last goal of the mission.
    pub fn cycle(&mut self) -> Result<Cycle, DriveError> {
        let observation = self.episode.observe();
        self.navigator.hear_imu(&observation.imu);
        let began = Instant::now();
        let is_renewed = self.navigator.observe(
            observation.valid_at_ns,
            &observation.odometry,
            observation.scan.as_deref(),
        )?;
        let mapped = Instant::now();
        let decision = self.navigator.decide(observation.valid_at_ns)?;
        let decided = Instant::now();
        if let Some(target) = self.navigator.mission().target() {
            let Destination { goal_m, tolerance_m } = target.end();
            self.episode.set_goal(goal_m, tolerance_m);
        }
        self.episode.apply(&decision)?;
        let milliseconds = |from: Instant, to: Instant| to.duration_since(from).as_secs_f64() * 1e3;
        Ok(Cycle {
            decision,
            map_ms: is_renewed.then(|| milliseconds(began, mapped)),
            control_ms: milliseconds(mapped, decided),
        })
    }
}

fn belief(drive: &Drive<'_>) -> Result<Belief, DriveError> {
    let Drive { task, vehicle, config, method, networks, .. } = drive;
    let Some((training, unfamiliar)) = method.learned() else {
        return Ok(match method {
            Method::Truth => Belief::Given(truth(vehicle, &task.world, config)),
            Method::Nominal => Belief::Nominal,
            _ => Belief::Physics,
        });
    };
    let checkpoint = match networks {
        Some(checkpoint) => Arc::clone(checkpoint),
        None => Arc::new(shipped(training, &vehicle.geometry)?),
    };
    let found = checkpoint.sidecar.method;
    if found != training {
        let (method, expected, found) = (method.name(), training.name(), found.name());
        return Err(DriveError::Training { method, expected, found });
    }
    Ok(Belief::Learned { checkpoint, unfamiliar })
}

/// Yaws that the truth is asked for within one yaw bin.
const YAWS_PER_BIN: usize = 3;

/// The plant's true traversability as risk: no distribution, hence the same at every CVaR level. A cell and a yaw bin
/// stand for every pose in them, so their risk is the worst that is true within the bin and half a cell around.
fn truth(vehicle: &Vehicle, world: &Arc<World>, config: &Config) -> RiskOracle {
    let truth = Truth::new(vehicle, Arc::clone(world));
    let n_yaws = YAWS_PER_BIN * config.risk_map.n_yaws;
    let field = Mutex::new(TruthField::new(truth, config.risk_resolution_m(), n_yaws));
    Arc::new(move |window, n_yaws, risks| {
        // A field that was poisoned by a panic elsewhere is still a cache of true values.
        let mut field = field.lock().unwrap_or_else(PoisonError::into_inner);
        let around = GridGeometry {
            origin: window.origin.map(|index| index - 1),
            n_rows: window.n_rows + 2,
            n_cols: window.n_cols + 2,
            ..*window
        };
        field.prepare(&around);
        let field = &*field;
        risks.par_chunks_mut(n_yaws).enumerate().for_each(|(index, risks)| {
            let Cell { row, col } = window.cell(index);
            let [x, y] = [window.origin[0] + col as i64, window.origin[1] + row as i64];
            risks.fill(Risk::NONE);
            for place in [[x, y], [x - 1, y], [x + 1, y], [x, y - 1], [x, y + 1]] {
                let there = field.at(place).unwrap_or_default().chunks(YAWS_PER_BIN);
                for (risk, there) in risks.iter_mut().zip(there) {
                    *risk = there.iter().fold(*risk, |risk, there| worse(risk, risk_of(there)));
                }
            }
        });
    })
}

fn worse(one: Risk, other: Risk) -> Risk {
    Risk {
        linear_traction: one.linear_traction.min(other.linear_traction),
        angular_traction: one.angular_traction.min(other.angular_traction),
        roll_rad: one.roll_rad.max(other.roll_rad),
        pitch_rad: one.pitch_rad.max(other.pitch_rad),
    }
}

fn risk_of(there: &Traversability) -> Risk {
    let risk = Risk {
        linear_traction: there.linear_traction as f32,
        angular_traction: there.angular_traction as f32,
        roll_rad: there.roll_rad.abs() as f32,
        pitch_rad: there.pitch_rad.abs() as f32,
    };
    if there.is_blocked { risk.blocked() } else { risk }
}

/// The world as a perfect map would show it.
pub fn true_surface(world: &World, resolution_m: f64) -> GridMap<SurfaceCell> {
    let bounds = world.bounds();
    let first = bounds.south_west_m.map(|edge_m| (edge_m / resolution_m).ceil() as i64);
    let last = bounds.north_east_m.map(|edge_m| (edge_m / resolution_m).floor() as i64);
    let n = [0, 1].map(|axis| (last[axis] - first[axis]).max(0) as usize);
    let geometry = GridGeometry { resolution_m, origin: first, n_rows: n[1], n_cols: n[0] };
    let mut surface = GridMap::filled(geometry, SurfaceCell::UNKNOWN);
    for (index, cell) in surface.values_mut().iter_mut().enumerate() {
        let [x_m, y_m] = geometry.centre_m(geometry.cell(index));
        let patch = world.patch(x_m, y_m);
        *cell = SurfaceCell::certain(world.height_m(x_m, y_m) as f32, patch.class, patch.vegetation_height_m);
    }
    surface
}

/// Slope and class under every cell of a world, and no risk anywhere.
pub(crate) fn slopes(world: &World) -> RiskMap {
    let geometry = *world.geometry();
    let mut map = RiskMap::constant(geometry, 1, Risk::NONE);
    map.fill(|_, grounds| {
        for (index, ground) in grounds.iter_mut().enumerate() {
            let [x_m, y_m] = geometry.centre_m(geometry.cell(index));
            let gradient = world.gradient(x_m, y_m).map(|value| value as f32);
            *ground = Ground { gradient, class: world.patch(x_m, y_m).class as u8, ..Ground::default() };
        }
    });
    map
}

/// An elevation file's layers as a world takes them.
pub fn layers_of(file: ElevationFile) -> WorldLayers {
    WorldLayers {
        elevation_m: file.elevation,
        canopy_height_m: file.layers.canopy_height_m,
        low_vegetation_fraction: file.layers.low_vegetation_fraction,
        water: file.layers.water,
        ground_gap_m: file.layers.ground_gap_m,
    }
}
