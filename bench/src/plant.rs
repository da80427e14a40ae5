//! The plant beside closed forms and beside a tyre of others, and what it costs: its tyre's friction over slip, the linear
//! traction that drives at different speeds would teach, and how much faster than real time it drives over rocks.

use std::sync::Arc;

use bicycle::{Command, Vehicle};
use scenarios::{
    Patch, Plant, PlantError, RockFieldConfig, RockFieldError, RockMap, Split, Stribeck, World, WorldError,
    published_tyre, rock_field, steady_friction,
};
use serde::Serialize;
use terrain::GridGeometry;
use thiserror::Error;

use crate::stopwatch::timed_ms;

/// Speeds at which the tyre is asked for its cornering force [m/s].
pub const ROLLING_MPS: [f64; 3] = [1.0, 5.0, 15.0];
/// Speeds of collection [m/s].
pub const COLLECTION_MPS: [f64; 5] = [0.5, 1.0, 2.0, 3.0, 4.0];
/// Speed at which the published tyre is met [m/s].
const PUBLISHED_MPS: f64 = 10.0;
/// Slip angles [degrees].
const ANGLES_DEG: [f64; 16] =
    [0.0, 0.5, 1.0, 1.5, 2.0, 3.0, 4.0, 5.0, 6.0, 8.0, 10.0, 12.0, 14.0, 16.0, 18.0, 20.0];
/// Driving before a label is taken, and while it is taken [m].
const RUN_UP_M: f64 = 8.0;
const LABEL_M: f64 = 4.0;
/// Driving over rocks whose cost is measured [s], from one place each, and commands meanwhile [Hz].
const DRIVE_S: f64 = 20.0;
const N_DRIVES: usize = 10;
const COMMAND_HZ: f64 = 10.0;

/// What was found.
#[derive(Clone, Debug, Serialize)]
pub struct Report {
    /// The machine.
    pub vehicle: String,
    /// Cornering force over load.
    pub cornering: Vec<Cornering>,
    /// A tyre with the stiffness and the peak of the published one, across: slip angles [degrees].
    pub published_across: Vec<Published>,
    /// The same along: braking slip [-].
    pub published_along: Vec<Published>,
    /// Linear traction by ground and speed of collection.
    pub labels: Vec<Labels>,
    /// Seconds driven over rocks per second of one core.
    pub times_real_time: f64,
}

/// Cornering force over load at a slip angle, on asphalt.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Cornering {
    /// Slip angle [degrees].
    pub angle_deg: f64,
    /// The plant's tyre at each of [`ROLLING_MPS`].
    pub plant: [f64; 3],
    /// The brush in closed form, which knows no speed.
    pub closed_form: f64,
}

/// Friction over load of our tyre and of the published one.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Published {
    /// Slip angle [degrees] or braking slip [-].
    pub slip: f64,
    /// The plant's tyre.
    pub plant: f64,
    /// The published one.
    pub published: f64,
}

/// Linear traction on a ground.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Labels {
    /// What the ground is.
    pub ground: &'static str,
    /// Achieved over commanded speed at each of [`COLLECTION_MPS`] [-].
    pub traction: [f64; 5],
}

/// Why the plant could not be measured.
#[derive(Debug, Error)]
pub enum PlantBenchError {
    /// The machine cannot be built.
    #[error(transparent)]
    Plant(#[from] PlantError),
    /// The ground cannot be made.
    #[error(transparent)]
    World(#[from] WorldError),
    /// The rocks cannot be made.
    #[error(transparent)]
    Rocks(#[from] RockFieldError),
    /// A command that is no number, which a description of the machine would have to bring about.
    #[error(transparent)]
    Command(#[from] scenarios::CommandError),
}

/// Measures the plant of a machine.
///
/// # Errors
/// The machine cannot be built.
pub fn measure(vehicle: &Vehicle) -> Result<Report, PlantBenchError> {
    Ok(Report {
        vehicle: vehicle.name.clone(),
        cornering: ANGLES_DEG.map(|angle_deg| cornering(vehicle, angle_deg)).to_vec(),
        published_across: published_across(vehicle),
        published_along: published_along(vehicle),
        labels: labels(vehicle)?,
        times_real_time: times_real_time(vehicle)?,
    })
}

fn cornering(vehicle: &Vehicle, angle_deg: f64) -> Cornering {
    let slip = angle_deg.to_radians().tan();
    let plant = ROLLING_MPS
        .map(|speed_mps| -steady_friction(vehicle, Stribeck::ASPHALT, speed_mps, [0.0, slip * speed_mps])[1]);
    let static_friction = f64::from(Stribeck::ASPHALT.static_friction);
    Cornering { angle_deg, plant, closed_form: brush(static_friction, vehicle.tyre.slip_stiffness, slip) }
}

/// m (1 - (1 - C s / 3 m)^3), and m from full sliding on (Pacejka, section 3.2).
fn brush(friction: f64, stiffness: f64, slip: f64) -> f64 {
    let adhering = (1.0 - stiffness * slip / (3.0 * friction)).max(0.0);
    friction * (1.0 - adhering.powi(3))
}

fn published_across(vehicle: &Vehicle) -> Vec<Published> {
    let compare = |[angle_deg, published]: [f64; 2]| {
        let slip_mps = [0.0, angle_deg.to_radians().tan() * PUBLISHED_MPS];
        let [_, left] = like_published(vehicle, 0, PUBLISHED_MPS, slip_mps);
        Published { slip: angle_deg, plant: -left, published }
    };
    published_tyre::ACROSS.map(compare).to_vec()
}

fn published_along(vehicle: &Vehicle) -> Vec<Published> {
    let compare = |[braking, published]: [f64; 2]| {
        let slip_mps = [braking * PUBLISHED_MPS, 0.0];
        let [forward, _] = like_published(vehicle, 1, PUBLISHED_MPS * (1.0 - braking), slip_mps);
        Published { slip: braking, plant: -forward, published }
    };
    published_tyre::ALONG.map(compare).to_vec()
}

/// Friction of the vehicle's tyre with the published stiffness and peak, across (0) or along (1).
fn like_published(vehicle: &Vehicle, direction: usize, rolling_mps: f64, slip_mps: [f64; 2]) -> [f64; 2] {
    let mut alike = vehicle.clone();
    alike.tyre.slip_stiffness = published_tyre::STIFFNESS[direction];
    let peak = published_tyre::PEAK[direction] / f64::from(Stribeck::ASPHALT.static_friction);
    steady_friction(&alike, Stribeck::ASPHALT.scaled(peak as f32), rolling_mps, slip_mps)
}

fn labels(vehicle: &Vehicle) -> Result<Vec<Labels>, PlantBenchError> {
    let grounds = [
        ("level asphalt", 0.0, Patch::open(Stribeck::ASPHALT)),
        ("asphalt, 15° up", 15.0, Patch::open(Stribeck::ASPHALT)),
        ("dirt, 20° up", 20.0, Patch::open(Stribeck::DIRT)),
        ("sand, 10° up", 10.0, Patch::open(Stribeck::SAND)),
        ("grass of 0.2 m", 0.0, Patch::open(Stribeck::GRASS).overgrown(0.2)),
    ];
    grounds
        .into_iter()
        .map(|(ground, slope_deg, patch)| labels_on(vehicle, ground, slope_deg, patch))
        .collect()
}

fn labels_on(
    vehicle: &Vehicle,
    ground: &'static str,
    slope_deg: f64,
    patch: Patch,
) -> Result<Labels, PlantBenchError> {
    let geometry = GridGeometry::centred(0.5, 200, 200, 0.0, 0.0);
    let grade = slope_deg.to_radians().tan();
    let world = Arc::new(World::from_fn(ground, geometry, |x_m, _| grade * x_m, |_, _| patch)?);
    let mut traction = [0.0; 5];
    for (label, speed_mps) in traction.iter_mut().zip(COLLECTION_MPS) {
        *label = label_at(vehicle, &world, speed_mps)?;
    }
    Ok(Labels { ground, traction })
}

/// Achieved over commanded speed of a straight drive.
fn label_at(vehicle: &Vehicle, world: &Arc<World>, speed_mps: f64) -> Result<f64, PlantBenchError> {
    let mut vehicle = vehicle.clone();
    vehicle.limits.speed_max_mps = vehicle.limits.speed_max_mps.max(speed_mps);
    let mut plant = Plant::new(&vehicle, Arc::clone(world), [-45.0, 0.0, 0.0])?;
    plant.set_command(Command { speed_mps: speed_mps as f32, steering_rad: 0.0 })?;
    plant.advance(RUN_UP_M / speed_mps + 6.0);
    let before = plant.pose();
    let duration_s = LABEL_M / speed_mps;
    plant.advance(duration_s);
    let after = plant.pose();
    let way_m = [after.x_m - before.x_m, after.y_m - before.y_m, after.z_m - before.z_m];
    Ok(way_m.iter().map(|m| m * m).sum::<f64>().sqrt() / (speed_mps * duration_s))
}

/// Seconds that the plant drives per second, weaving over rocks on one core.
fn times_real_time(vehicle: &Vehicle) -> Result<f64, PlantBenchError> {
    let map = RockMap { seed: 11, split: Split::Test, index: 0 };
    let pads_m = [[10.0, 10.0], [10.0, 25.0], [10.0, 40.0], [25.0, 25.0]];
    let world = Arc::new(rock_field(&RockFieldConfig::default(), map, &pads_m)?);
    let mut took_ms = 0.0;
    for drive in 0..N_DRIVES {
        let [x_m, y_m] = pads_m[drive % pads_m.len()];
        let mut plant = Plant::new(vehicle, Arc::clone(&world), [x_m, y_m, 0.9 * drive as f64])?;
        let (ms, done) = timed_ms(|| weave(&mut plant));
        done?;
        took_ms += ms;
    }
    Ok(1e3 * DRIVE_S * N_DRIVES as f64 / took_ms)
}

fn weave(plant: &mut Plant) -> Result<(), PlantBenchError> {
    for cycle in 0..(DRIVE_S * COMMAND_HZ) as usize {
        let steering_rad = (0.4 * (0.07 * cycle as f64).sin()) as f32;
        plant.set_command(Command { speed_mps: 1.0, steering_rad })?;
        plant.advance(1.0 / COMMAND_HZ);
    }
    Ok(())
}
