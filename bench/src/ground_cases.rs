//! Drives whose ground, vehicle or sensors are not what they were: cases for the diagnosis of beliefs about the ground.
//!
//! A case is a vehicle, drives of when all was right, and drives after something changed; what changed is told apart
//! from them. Everything that changes does so in the plant or in the sensors' data, by no formula of the diagnosis.

use std::f64::consts::TAU;
use std::sync::Arc;

use bicycle::{Command, Decision, DriveLog, DriveLogError, Odometry, Vehicle};
use evidential::MapAt;
use navigator::{Config, assumed_ground};
use rand::{Rng, RngExt};
use scenarios::{
    Bounds, Deviation, Episode, EpisodeConfig, EpisodeError, Patch, Rules, Stribeck, Task, World, WorldError,
    stream,
};
use terrain::{ElevationMap, GridGeometry, Pose, Scan, TerrainClass};

use crate::collection::{measured_row, untilted};

/// What has changed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum GroundFault {
    /// Nothing.
    None,
    /// Friction of one class is another.
    Friction {
        /// Which class.
        class: TerrainClass,
        /// Factor on its friction [-].
        factor: f64,
    },
    /// All ground is wet.
    Wet {
        /// Factor on all friction [-].
        factor: f64,
    },
    /// The range sensor sits elsewhere than it is said to.
    SensorHeight {
        /// So much higher do its points come out [m].
        offset_m: f64,
    },
    /// What is of the second class is called by the name of the first.
    Mislabelled {
        /// As it is called.
        named: TerrainClass,
        /// As it is.
        really: TerrainClass,
    },
    /// The vehicle carries a load.
    Heavier {
        /// Mass over the described one [-].
        factor: f64,
    },
}

/// Drives with the maps that were made on the way, each a run of the log.
#[derive(Clone, Debug, Default)]
pub struct MappedDrives {
    /// What was measured and commanded, a run for every drive.
    pub log: DriveLog,
    /// The maps of each.
    pub maps: Vec<Vec<MapAt>>,
}

/// A case of a sealed set.
#[derive(Clone, Debug)]
pub struct GroundCase {
    /// When all was right.
    pub reference: MappedDrives,
    /// After the change.
    pub changed: MappedDrives,
}

/// Why there is no case.
#[derive(Debug, thiserror::Error)]
pub enum GroundCaseError {
    /// The hills are none.
    #[error(transparent)]
    World(#[from] WorldError),
    /// The plant gave up.
    #[error(transparent)]
    Episode(#[from] EpisodeError),
    /// The mapping refused its settings.
    #[error("elevation map: {0}")]
    Elevation(#[from] terrain::SettingError),
    /// The mapping refused a pose.
    #[error(transparent)]
    Fuse(#[from] terrain::FuseError),
    /// The odometry makes no log.
    #[error(transparent)]
    Log(#[from] DriveLogError),
}

/// Drives of each half of a case.
const N_DRIVES: [u64; 2] = [3, 3];
/// Length of a drive [s].
const DRIVE_S: f64 = 35.0;
/// Control cycles between two maps that are kept.
const CYCLES_PER_MAP: u64 = 10;
/// Half of a world's side over the vehicle's length.
const HALF_SIDE_LENGTHS: f64 = 16.0;
/// Cells of a world along each side.
const N_CELLS: usize = 240;
/// Waves that hills and patches are made of.
const N_WAVES: usize = 9;
/// Root mean square of the hills' slope, from the gentlest to the steepest world [-].
const SLOPE: [f64; 2] = [0.2, 0.32];
/// Speed of the drives over that of a wave as long as the vehicle, the root of length and 1 m/s2 [-], as far as twice the
/// vehicle's limit allows.
const SPEED: f64 = 2.0;

impl GroundFault {
    /// What the diagnosis would call it.
    pub fn id(&self) -> String {
        let name = |class: TerrainClass| format!("{class:?}").to_lowercase();
        match *self {
            Self::None => "none".to_owned(),
            Self::Friction { class, .. } => format!("friction_{}", name(class)),
            Self::Wet { .. } => "wet".to_owned(),
            Self::SensorHeight { .. } => "height_bias".to_owned(),
            Self::Mislabelled { named, really } => format!("{}_is_{}", name(named), name(really)),
            Self::Heavier { .. } => "heavier".to_owned(),
        }
    }

    /// One of six kinds, of a size that somebody would want to know of.
    pub fn draw(kind: usize, vehicle: &Vehicle, rng: &mut impl Rng) -> Self {
        let classes = [TerrainClass::Open, TerrainClass::Loose, TerrainClass::Vegetation];
        match kind % 6 {
            0 => Self::None,
            1 => Self::Friction {
                class: classes[rng.random_range(0..3)],
                factor: rng.random_range(0.35..0.55),
            },
            2 => Self::Wet { factor: rng.random_range(0.4..0.6) },
            3 => {
                let sign = if rng.random::<bool>() { 1.0 } else { -1.0 };
                let radius_m = vehicle.geometry.wheel_radius_m;
                Self::SensorHeight { offset_m: sign * radius_m * rng.random_range(0.15..0.4) }
            }
            4 => {
                let [named, really] = [[0, 2], [2, 0], [1, 2], [2, 1]][rng.random_range(0..4)];
                Self::Mislabelled { named: classes[named], really: classes[really] }
            }
            _ => Self::Heavier { factor: rng.random_range(1.4..1.9) },
        }
    }

    fn deviations(&self) -> Vec<Deviation> {
        match *self {
            Self::Heavier { factor } => vec![Deviation::Mass { factor }],
            _ => Vec::new(),
        }
    }

    fn friction(&self, class: TerrainClass) -> f64 {
        match *self {
            Self::Wet { factor } => factor,
            Self::Friction { class: changed, factor } if changed == class => factor,
            _ => 1.0,
        }
    }

    fn spoil(&self, scan: &Scan) -> Scan {
        let mut spoilt = scan.clone();
        match *self {
            Self::SensorHeight { offset_m } => {
                spoilt.origin_m[2] += offset_m as f32;
                spoilt.points.iter_mut().for_each(|point| point.position_m[2] += offset_m as f32);
            }
            Self::Mislabelled { named, really } => {
                let wrong = spoilt.points.iter_mut().filter(|point| point.class == really);
                wrong.for_each(|point| point.class = named);
            }
            _ => {}
        }
        spoilt
    }
}

/// Makes a case. The ground of the two halves is of one kind, its hills are others.
///
/// # Errors
/// A plant that leaves the numbers.
pub fn ground_case(vehicle: &Vehicle, fault: &GroundFault, seed: u64) -> Result<GroundCase, GroundCaseError> {
    let vehicle = &driven(vehicle);
    let mut rng = stream(seed, &[0x6_20BD]);
    let kind = Kind {
        grips: [rng.random_range(0.7..0.9), rng.random_range(0.5..0.65), rng.random_range(0.55..0.75)],
        resistance: rng.random_range(0.03..0.07),
        plants_m: vehicle.geometry.wheel_radius_m * rng.random_range(0.5..0.9),
        slope: rng.random_range(SLOPE[0]..SLOPE[1]),
    };
    let half = |fault: &GroundFault, half: usize| {
        let mut drives = MappedDrives::default();
        for number in 0..N_DRIVES[half] {
            drive(vehicle, &kind, fault, [seed, half as u64, number], &mut drives)?;
        }
        Ok::<_, GroundCaseError>(drives)
    };
    Ok(GroundCase { reference: half(&GroundFault::None, 0)?, changed: half(fault, 1)? })
}

/// The vehicle as it is driven: at speeds that go with its length, whatever it is limited to.
fn driven(vehicle: &Vehicle) -> Vehicle {
    let mut driven = vehicle.clone();
    let speed_mps = SPEED * vehicle.geometry.length_m.sqrt();
    driven.limits.speed_max_mps = speed_mps.min(2.0 * vehicle.limits.speed_max_mps);
    driven
}

/// What the ground of a case is like.
struct Kind {
    /// Friction of open, loose and overgrown ground [-].
    grips: [f64; 3],
    /// Resistance of loose ground over load [-].
    resistance: f64,
    /// Height of the plants [m].
    plants_m: f64,
    /// Root mean square of the slope [-].
    slope: f64,
}

impl Kind {
    fn world(&self, vehicle: &Vehicle, fault: &GroundFault, rng: &mut impl Rng) -> Result<World, WorldError> {
        let length_m = vehicle.geometry.length_m;
        let hills = Waves::draw([5.0 * length_m, 14.0 * length_m], rng);
        let [meadow, loose] = [(); 2].map(|()| Waves::draw([4.0 * length_m, 10.0 * length_m], rng));
        let friction = |class: TerrainClass| {
            let friction = (self.grips[class as usize] * fault.friction(class)) as f32;
            Stribeck {
                static_friction: friction,
                dynamic_friction: friction,
                viscous_friction: 0.0,
                ..Stribeck::GRASS
            }
        };
        let patch = |x_m: f64, y_m: f64| {
            if meadow.height(x_m, y_m) > 0.5 {
                Patch::open(friction(TerrainClass::Vegetation)).overgrown(self.plants_m as f32)
            } else if loose.height(x_m, y_m) > 0.4 {
                let open = Patch::open(friction(TerrainClass::Loose));
                Patch { class: TerrainClass::Loose, rolling_resistance: self.resistance as f32, ..open }
            } else {
                Patch::open(friction(TerrainClass::Open))
            }
        };
        let edge_m = 2.0 * HALF_SIDE_LENGTHS * length_m / N_CELLS as f64;
        let geometry = GridGeometry::centred(edge_m, N_CELLS, N_CELLS, 0.0, 0.0);
        let scale_m = self.slope / hills.slope_per_m();
        World::from_fn("ground case", geometry, |x_m, y_m| scale_m * hills.height(x_m, y_m), patch)
    }
}

/// A smooth random function of the place, of unit variance.
struct Waves(Vec<([f64; 2], f64)>);

impl Waves {
    fn draw(lengths_m: [f64; 2], rng: &mut impl Rng) -> Self {
        let wave = |_| {
            let (number, way_rad) =
                (TAU / rng.random_range(lengths_m[0]..lengths_m[1]), rng.random_range(0.0..TAU));
            ([number * way_rad.cos(), number * way_rad.sin()], rng.random_range(0.0..TAU))
        };
        Self((0..N_WAVES).map(wave).collect())
    }

    fn height(&self, x_m: f64, y_m: f64) -> f64 {
        let sum: f64 =
            self.0.iter().map(|([east, north], phase)| (east * x_m + north * y_m + phase).sin()).sum();
        sum / (0.5 * N_WAVES as f64).sqrt()
    }

    fn slope_per_m(&self) -> f64 {
        let squares: f64 = self.0.iter().map(|([east, north], _)| east * east + north * north).sum();
        (squares / N_WAVES as f64).sqrt()
    }
}

/// Somebody at the wheel: speeds and bends that change every few seconds, back to the middle when far from it.
struct Driver {
    until_s: f64,
    command: Command,
}

impl Driver {
    fn command(
        &mut self,
        vehicle: &Vehicle,
        odometry: &Odometry,
        time_s: f64,
        rng: &mut impl Rng,
    ) -> Command {
        let [x_m, y_m, _] = odometry.position_m;
        let lock_rad = vehicle.limits.steering_max_rad;
        let is_far = x_m.hypot(y_m) > 0.6 * HALF_SIDE_LENGTHS * vehicle.geometry.length_m;
        if is_far {
            let bearing_rad = (-y_m).atan2(-x_m) - odometry.attitude_rad[2];
            let wrapped_rad = bearing_rad.sin().atan2(bearing_rad.cos());
            self.command.steering_rad = wrapped_rad.clamp(-0.7 * lock_rad, 0.7 * lock_rad) as f32;
        } else if time_s >= self.until_s {
            let fastest_mps = vehicle.limits.speed_max_mps;
            let speed_mps = fastest_mps * rng.random_range(0.45..1.0);
            let steering_rad = 0.6 * lock_rad * rng.random_range(-1.0..1.0_f64).powi(3);
            self.command = Command { speed_mps: speed_mps as f32, steering_rad: steering_rad as f32 };
            self.until_s = time_s + rng.random_range(2.0..6.0);
        }
        self.command
    }
}

/// Drives until the time is over or the vehicle cannot go on.
fn drive(
    vehicle: &Vehicle,
    kind: &Kind,
    fault: &GroundFault,
    key: [u64; 3],
    drives: &mut MappedDrives,
) -> Result<(), GroundCaseError> {
    let mut rng = stream(key[0], &[0xD_21FE, key[1], key[2]]);
    let world = Arc::new(kind.world(vehicle, fault, &mut rng)?);
    let edge_m = 0.95 * HALF_SIDE_LENGTHS * vehicle.geometry.length_m;
    let task = Task {
        world: Arc::clone(&world),
        start: [0.0, 0.0, rng.random_range(0.0..TAU)],
        goal_m: [f64::INFINITY; 2],
        goal_tolerance_m: 0.0,
        bounds: Bounds { south_west_m: [-edge_m; 2], north_east_m: [edge_m; 2] },
    };
    let config = EpisodeConfig {
        rules: Rules { time_limit_s: DRIVE_S, ..Rules::default() },
        deviations: fault.deviations(),
        ..EpisodeConfig::for_vehicle(vehicle)
    };
    let mut episode = Episode::new(task, &untilted(vehicle), config, rng.random())?;
    let mut map = ElevationMap::new(Config::for_vehicle(vehicle).elevation)?;
    let mut driver = Driver { until_s: 0.0, command: Command::default() };
    let (name, mut maps) = (key[2].to_string(), Vec::new());
    while episode.outcome().is_none() {
        let (observation, time_s) = (episode.observe().clone(), episode.time_s());
        let pose = pose(&observation.odometry);
        if let Some(scan) = &observation.scan {
            map.fuse(&fault.spoil(scan), &pose)?;
        }
        if episode.n_cycles() == 0 {
            map.assume_ground(&pose, &assumed_ground(&vehicle.geometry))?;
        }
        if episode.n_cycles().is_multiple_of(CYCLES_PER_MAP) {
            maps.push(MapAt { at_s: time_s, surface: map.surface().clone() });
        }
        let command = driver.command(vehicle, &observation.odometry, time_s, &mut rng);
        drives.log.push(&name, &measured_row(time_s, &observation.odometry, &command))?;
        episode.apply(&Decision::Drive(command))?;
    }
    drives.maps.push(maps);
    Ok(())
}

fn pose(odometry: &Odometry) -> Pose {
    let [x_m, y_m, z_m] = odometry.position_m;
    let [roll_rad, pitch_rad, yaw_rad] = odometry.attitude_rad;
    Pose { x_m, y_m, z_m, roll_rad, pitch_rad, yaw_rad }
}
