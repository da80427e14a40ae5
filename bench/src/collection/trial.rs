//! One trial: a start, sinusoidal steering, and what the vehicle measures until something ends it.

use std::f64::consts::{FRAC_PI_2, TAU};
use std::sync::Arc;

use bicycle::{Column, Command, Decision, DriveRow, Odometry, Vehicle};
use evidential::{Example, Label, Surveyor};
use navigator::{Config, assumed_ground};
use rand::{Rng, RngExt};
use scenarios::{
    Bounds, Episode, EpisodeConfig, Outcome, RangeSensorConfig, Split, Task, Truth, World, stream,
};
use terrain::{AssumedGround, ElevationMap, GridMap, Pose, SurfaceCell};

use super::{CollectionError, Place, Request, Trial};
use crate::closed_loop::MapSource;

/// A world ready to be driven in.
pub(super) struct Field {
    pub world: Arc<World>,
    /// The world as a perfect map shows it.
    pub surface: GridMap<SurfaceCell>,
    truth: Truth,
}

impl Field {
    pub fn new(vehicle: &Vehicle, world: Arc<World>, surface: GridMap<SurfaceCell>) -> Self {
        Self { truth: Truth::new(vehicle, Arc::clone(&world)), world, surface }
    }
}

/// What a trial leaves behind.
pub(super) struct Driven {
    pub map: u32,
    /// Name of the run in the log.
    pub name: String,
    /// Odometry and command of every cycle.
    pub rows: Vec<DriveRow>,
    /// Where the map is the robot's own: the ground under the pose of every row as known then, without label.
    pub sensed: Option<Vec<Option<Example>>>,
    pub outcome: Outcome,
    pub time_s: f64,
}

impl Driven {
    pub fn trial(&self, n_labels: usize, n_examples: usize) -> Trial {
        Trial {
            map: self.map,
            outcome: Some(self.outcome),
            time_s: self.time_s,
            n_examples,
            n_unknown_ground: n_labels - n_examples,
        }
    }
}

/// Places tried for a start.
const STARTS_TRIED: usize = 1000;
/// Least traction at the start: the vehicle shall get going.
const TRACTION_MIN: f64 = 0.3;
/// Tilt up to which a trial goes on; the plant counts as rolled over before [rad].
const TILT_MAX_RAD: f64 = 0.999 * FRAC_PI_2;

/// Steering over time: a sine around an offset.
#[derive(Clone, Copy, Debug)]
struct Steering {
    offset_rad: f64,
    amplitude_rad: f64,
    period_s: f64,
    phase_rad: f64,
}

impl Steering {
    /// Amplitudes from a third of the lock to all of it, periods of four to ten body lengths driven but not below 4 s,
    /// offsets up to a third of the lock, which turn the trials in circles of many sizes.
    fn random(request: &Request, rng: &mut impl Rng) -> Self {
        let lock_rad = request.vehicle.limits.steering_max_rad;
        let length_s = (request.vehicle.geometry.length_m / request.speed_mps).max(1.0);
        Self {
            offset_rad: lock_rad * rng.random_range(-0.33..0.33),
            amplitude_rad: lock_rad * rng.random_range(0.33..1.0),
            period_s: length_s * rng.random_range(4.0..10.0),
            phase_rad: rng.random_range(0.0..TAU),
        }
    }

    fn at(&self, time_s: f64, lock_rad: f64) -> f64 {
        let wave = (TAU * time_s / self.period_s + self.phase_rad).sin();
        (self.offset_rad + self.amplitude_rad * wave).clamp(-lock_rad, lock_rad)
    }
}

/// Drives trial `trial` of map `map`.
pub(super) fn drive(
    request: &Request,
    config: &Config,
    vehicle: &Vehicle,
    field: &Field,
    [map, trial]: [u32; 2],
    surveyor: &Surveyor,
) -> Result<Driven, CollectionError> {
    let key = [0xC0_11EC7, split(&request.place) as u64, u64::from(map), u64::from(trial)];
    let mut rng = stream(request.seed, &key);
    let steering = Steering::random(request, &mut rng);
    let task = task(vehicle, field, map, &mut rng)?;
    let name = format!("map {map} trial {trial}");
    let broken = |source| CollectionError::Episode { trial: name.clone(), source };
    let mut own_map = OwnMap::of(request, config, vehicle, surveyor)?;
    let mut episode =
        Episode::new(task, &untilted(vehicle), episode_config(request), rng.random()).map_err(broken)?;
    let mut rows = Vec::new();
    while episode.outcome().is_none() {
        let observation = episode.observe();
        let time_s = episode.time_s();
        let lock_rad = vehicle.limits.steering_max_rad;
        let command = Command {
            speed_mps: request.speed_mps as f32,
            steering_rad: steering.at(time_s, lock_rad) as f32,
        };
        rows.push(measured_row(time_s, &observation.odometry, &command));
        if let Some(own_map) = &mut own_map {
            own_map.observe(&observation.odometry, observation.scan.as_deref(), &field.surface)?;
        }
        episode.apply(&Decision::Drive(command)).map_err(broken)?;
    }
    Ok(Driven {
        map,
        rows,
        sensed: own_map.map(|own_map| own_map.under_rows),
        outcome: episode.outcome().unwrap_or(Outcome::Stopped),
        time_s: episode.time_s(),
        name,
    })
}

fn split(place: &Place) -> Split {
    match place {
        Place::Rocks { split, .. } | Place::Arena { split } | Place::Floor { split } => *split,
    }
}

/// The vehicle with limits that no attitude breaks: trials end when it lies on its side, not before.
pub(crate) fn untilted(vehicle: &Vehicle) -> Vehicle {
    let mut vehicle = vehicle.clone();
    vehicle.limits.roll_max_rad = TILT_MAX_RAD;
    vehicle.limits.pitch_max_rad = TILT_MAX_RAD;
    vehicle
}

fn episode_config(request: &Request) -> EpisodeConfig {
    EpisodeConfig {
        range_sensor: match request.map_source {
            MapSource::Oracle => None,
            MapSource::Sensed => Some(RangeSensorConfig::for_vehicle(&request.vehicle)),
        },
        odometry: request.odometry,
        rules: request.rules(),
        ..EpisodeConfig::for_vehicle(&request.vehicle)
    }
}

/// A start anywhere in the map, in any heading, where the vehicle stands within its limits; no goal.
fn task(vehicle: &Vehicle, field: &Field, map: u32, rng: &mut impl Rng) -> Result<Task, CollectionError> {
    // Every footprint up to the end of the trial shall lie on the map, the neighbours of its cells too.
    let reach_m = vehicle.geometry.length_m + 2.0 * field.surface.geometry().resolution_m;
    let Bounds { south_west_m, north_east_m } = Bounds::of(field.surface.geometry());
    let bounds = Bounds {
        south_west_m: south_west_m.map(|edge_m| edge_m + reach_m),
        north_east_m: north_east_m.map(|edge_m| edge_m - reach_m),
    };
    let limits = &vehicle.limits;
    for _ in 0..STARTS_TRIED {
        let [x_m, y_m] = [0, 1].map(|axis| {
            let share: f64 = rng.random();
            bounds.south_west_m[axis] + share * (bounds.north_east_m[axis] - bounds.south_west_m[axis])
        });
        let yaw_rad = rng.random_range(0.0..TAU);
        let there = field.truth.traversability(x_m, y_m, yaw_rad);
        if !there.is_blocked
            && there.linear_traction >= TRACTION_MIN
            && there.roll_rad.abs() <= limits.roll_max_rad
            && there.pitch_rad.abs() <= limits.pitch_max_rad
        {
            // A goal that is infinitely far is never reached.
            let goal_m = [f64::INFINITY; 2];
            let world = Arc::clone(&field.world);
            return Ok(Task { world, start: [x_m, y_m, yaw_rad], goal_m, goal_tolerance_m: 0.0, bounds });
        }
    }
    Err(CollectionError::NoStart { map, tries: STARTS_TRIED })
}

/// The row of a drive log that a robot would write: what it measures, and the command that it answers with.
pub(crate) fn measured_row(time_s: f64, odometry: &Odometry, command: &Command) -> DriveRow {
    DriveRow::new(time_s)
        .with_odometry(odometry)
        .with(Column::CmdSpeed, f64::from(command.speed_mps))
        .with(Column::CmdSteer, f64::from(command.steering_rad))
}

/// The map that the robot makes as it drives, and what it shows under the vehicle at every row.
struct OwnMap {
    elevation: ElevationMap,
    assumed: AssumedGround,
    surveyor: Surveyor,
    under_rows: Vec<Option<Example>>,
}

impl OwnMap {
    /// `None` where features come from the true surface.
    fn of(
        request: &Request,
        config: &Config,
        vehicle: &Vehicle,
        surveyor: &Surveyor,
    ) -> Result<Option<Self>, CollectionError> {
        if request.map_source == MapSource::Oracle {
            return Ok(None);
        }
        let assumed = assumed_ground(&vehicle.geometry);
        let elevation = ElevationMap::new(config.elevation)?;
        Ok(Some(Self { elevation, assumed, surveyor: surveyor.clone(), under_rows: Vec::new() }))
    }

    fn observe(
        &mut self,
        odometry: &Odometry,
        scan: Option<&terrain::Scan>,
        truth: &GridMap<SurfaceCell>,
    ) -> Result<(), CollectionError> {
        let [x_m, y_m, z_m] = odometry.position_m;
        let [roll_rad, pitch_rad, yaw_rad] = odometry.attitude_rad;
        let pose = Pose { x_m, y_m, z_m, roll_rad, pitch_rad, yaw_rad };
        if let Some(scan) = scan {
            self.elevation.fuse(scan, &pose)?;
        }
        if self.under_rows.is_empty() {
            self.elevation.assume_ground(&pose, &self.assumed)?;
        }
        let label = Label { time_s: 0.0, pose: [x_m, y_m, yaw_rad], measured: [f32::NAN; 4] };
        let seen = self.surveyor.example(self.elevation.surface(), &label, 0)?;
        // How uneven the ground is does not depend on who looks.
        let unevenness_m = self.surveyor.unevenness_m(truth, label.pose);
        let under = seen.zip(unevenness_m).map(|(seen, unevenness_m)| Example { unevenness_m, ..seen });
        self.under_rows.push(under);
        Ok(())
    }
}
