//! Short courses and coarse settings, and what is looked at after a drive.

use std::collections::BTreeMap;
use std::sync::Arc;

use bench::closed_loop::{ClosedLoop, Drive, MapSource, Method};
use bicycle::{Decision, Effect, Model, StopReason, Vehicle};
use navigator::Config;
use scenarios::{
    EpisodeConfig, Fault, Outcome, Patch, RangeSensorConfig, RockFieldConfig, RockMap, SensorFault, Split,
    Stribeck, Task, TraceRow, World, rock_field,
};
use terrain::GridGeometry;
use traversability::CvarLevel;

/// Height of whatever must not be touched [m].
const WALL_M: f32 = 1.5;

/// All that a drive needs.
pub struct Course {
    pub task: Task,
    pub vehicle: Vehicle,
    pub config: Config,
    pub episode: EpisodeConfig,
    pub method: Method,
    pub seed: u64,
}

impl Course {
    /// In a world, from (4, 0) eastwards to a goal on the x axis.
    pub fn along_x(world: World, distance_m: f64) -> Self {
        let start = [4.0, 0.0, 0.0];
        Self::new(Task::in_world(Arc::new(world), start, [4.0 + distance_m, 0.0], 1.0))
    }

    /// Flat, bare ground.
    pub fn flat(distance_m: f64) -> Self {
        Self::along_x(ground(|_, _| 0.0, |_, _| false), distance_m)
    }

    /// Over a rock field as rough as the default drive's.
    pub fn rocks(distance_m: f64, seed: u64) -> Self {
        let side_m = 24.0;
        let start = [6.0, 12.0, 0.0];
        let goal_m = [start[0] + distance_m, start[1]];
        let config =
            RockFieldConfig { side_m, resolution_m: 0.2, pad_radius_m: 3.0, ..RockFieldConfig::default() };
        let map = RockMap { seed, split: Split::Train, index: 0 };
        let world = rock_field(&config, map, &[[start[0], start[1]], goal_m]).unwrap();
        Self { seed, ..Self::new(Task::in_world(Arc::new(world), start, goal_m, 1.0)) }
    }

    fn new(task: Task) -> Self {
        let vehicle = formats::read_vehicle("pietra_full_size").unwrap();
        let mut episode = EpisodeConfig::for_vehicle(&vehicle);
        let sensor = RangeSensorConfig::for_vehicle(&vehicle);
        episode.range_sensor =
            Some(RangeSensorConfig { n_azimuths: 120, n_beams: 24, range_m: [0.3, 14.0], ..sensor });
        episode.rules.time_limit_s = 30.0;
        Self { config: coarse(&vehicle), task, vehicle, episode, method: Method::Physics, seed: 1 }
    }

    /// With a fault of the sensors from one time to another [s].
    pub fn with_fault(mut self, sensor: SensorFault, from_s: f64, until_s: f64) -> Self {
        self.episode.faults.push(Fault { sensor, from_s, until_s });
        self
    }

    pub fn begin(&self) -> ClosedLoop {
        self.begin_believing(Vec::new())
    }

    /// With a controller that believes in these effects.
    pub fn begin_believing(&self, effects: Vec<Effect>) -> ClosedLoop {
        ClosedLoop::new(Drive {
            task: self.task.clone(),
            vehicle: &self.vehicle,
            model: Model { effects, ..Model::of(&self.vehicle) },
            config: self.config.clone(),
            episode: self.episode.clone(),
            method: self.method,
            networks: None,
            corrector: None,
            map_source: MapSource::Sensed,
            level: CvarLevel::new(0.6).unwrap(),
            seed: self.seed,
        })
        .unwrap()
    }

    /// Drives to the end.
    pub fn drive(&self) -> Driven {
        let mut closed = self.begin();
        let outcome = loop {
            if let Some(outcome) = closed.episode.outcome() {
                break outcome;
            }
            closed.cycle().unwrap();
        };
        Driven { outcome, closed }
    }
}

/// A window of 20 m in cells of 0.3 m, eight headings, 256 futures of three seconds.
fn coarse(vehicle: &Vehicle) -> Config {
    let mut config = Config::for_vehicle(vehicle);
    config.elevation.resolution_m = 0.3;
    (config.elevation.n_rows, config.elevation.n_cols) = (96, 96);
    (config.elevation.recentre_m, config.risk_map.recentre_m) = (1.2, 1.2);
    (config.risk_map.n_rows, config.risk_map.n_cols, config.risk_map.n_yaws) = (66, 66, 8);
    (config.controller.n_rollouts, config.controller.n_steps) = (256, 30);
    config
}

/// Dirt from (0, -10) to (24, 10) m with this height [m], and walls where asked.
pub fn ground(height_m: impl Fn(f64, f64) -> f64, is_wall: impl Fn(f64, f64) -> bool) -> World {
    let geometry = GridGeometry { resolution_m: 0.25, origin: [0, -40], n_rows: 80, n_cols: 96 };
    let dirt = Patch::open(Stribeck::DIRT);
    let patch = |x_m: f64, y_m: f64| if is_wall(x_m, y_m) { dirt.obstructed(WALL_M) } else { dirt };
    World::from_fn("constructed", geometry, height_m, patch).unwrap()
}

/// A drive that has ended.
pub struct Driven {
    pub outcome: Outcome,
    pub closed: ClosedLoop,
}

impl Driven {
    pub fn trace(&self) -> &[TraceRow] {
        self.closed.episode.trace()
    }

    /// Cycles with a stop, by reason.
    pub fn stops(&self) -> BTreeMap<StopReason, usize> {
        let mut stops = BTreeMap::new();
        for row in self.trace() {
            if let Decision::Stop(reason) = row.decision {
                *stops.entry(reason).or_default() += 1;
            }
        }
        stops
    }

    /// When a reason first came up [s].
    pub fn first_stop_s(&self, reason: StopReason) -> Option<f64> {
        self.trace().iter().find(|row| row.decision == Decision::Stop(reason)).map(|row| row.time_s)
    }

    /// Largest distance from the x axis [m].
    pub fn detour_m(&self) -> f64 {
        self.trace().iter().map(|row| row.motion.pose.y_m.abs()).fold(0.0, f64::max)
    }

    /// What was decided and what came of it, bit for bit.
    pub fn bits(&self) -> Vec<[u64; 5]> {
        let row = |row: &TraceRow| {
            let (command, pose) = (row.command, row.motion.pose);
            [
                u64::from(command.speed_mps.to_bits()),
                u64::from(command.steering_rad.to_bits()),
                pose.x_m.to_bits(),
                pose.y_m.to_bits(),
                pose.yaw_rad.to_bits(),
            ]
        };
        self.trace().iter().map(row).collect()
    }
}
