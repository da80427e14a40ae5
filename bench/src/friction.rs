//! Friction found without labels, beside the truth of plants that whoever finds it never saw.
//!
//! A drive crosses stripes of three of seven grounds, each with its published friction times 0.6 to 1.4, some driven
//! hard and some gently, by a driver who knows none. Sensors are noisy, the inertia that the description states is off
//! by up to 30 %, the wheel speed by up to 2 %.

mod drive;
mod score;
pub mod seen;

use bicycle::{DriveLogError, Vehicle};
use friction::{Chassis, Drive, FindError, Grip, find_friction};
use scenarios::{CommandError, PlantError, Stribeck, WorldError};
use serde::Serialize;
use thiserror::Error;

use crate::sweep::in_turns;
use drive::{TestDrive, test_drive};
pub use score::{Row, Score, Share, Verdict};

/// Seeds below this are for development; what is published comes from those at and above it.
pub const WITHHELD_SEED: u64 = 1000;

/// What to drive.
#[derive(Clone, Debug)]
pub struct Request {
    /// Shipped vehicles or files.
    pub vehicles: Vec<Vehicle>,
    /// The first seed.
    pub first_seed: u64,
    /// Drives of each vehicle.
    pub n_seeds: u64,
    /// Threads.
    pub n_threads: usize,
}

/// What came out.
#[derive(Clone, Debug, Serialize)]
pub struct Report {
    /// The first seed.
    pub first_seed: u64,
    /// Drives of each vehicle.
    pub n_seeds: u64,
    /// One for each ground of each drive.
    pub rows: Vec<Row>,
    /// All together.
    pub score: Score,
    /// Whether the pass rule holds, by part.
    pub verdict: Verdict,
}

/// Why there is no table.
#[derive(Debug, Error)]
pub enum FrictionBenchError {
    /// The plant cannot be built.
    #[error(transparent)]
    Plant(#[from] PlantError),
    /// The ground cannot be made.
    #[error(transparent)]
    World(#[from] WorldError),
    /// A command is no number.
    #[error(transparent)]
    Command(#[from] CommandError),
    /// A row is none.
    #[error(transparent)]
    Log(#[from] DriveLogError),
    /// The vehicle does not stay on its wheels.
    #[error("{vehicle}, seed {seed}: expected a drive on wheels and on the map, found none in 20 attempts")]
    NoDrive {
        /// Name.
        vehicle: String,
        /// Seed.
        seed: u64,
    },
    /// A drive says nothing.
    #[error(transparent)]
    Find(#[from] FindError),
    /// A network learns nothing.
    #[error(transparent)]
    Training(#[from] friction::TrainingError),
    /// The system refused the threads.
    #[error("threads: {0}")]
    Threads(#[from] rayon::ThreadPoolBuildError),
}

/// Drives and finds; `after` is called after each drive.
///
/// # Errors
/// A vehicle that cannot be driven.
pub fn measure(request: &Request, after: impl Fn() + Sync) -> Result<Report, FrictionBenchError> {
    let seeds = request.first_seed..request.first_seed + request.n_seeds;
    let jobs: Vec<_> =
        request.vehicles.iter().flat_map(|vehicle| seeds.clone().map(move |seed| (vehicle, seed))).collect();
    let pool = rayon::ThreadPoolBuilder::new().num_threads(request.n_threads).build()?;
    let rows = in_turns(&pool, jobs.len(), |index| {
        let (vehicle, seed) = jobs[index];
        let rows = rows(vehicle, seed);
        after();
        rows
    })?;
    let rows = rows.concat();
    let score = Score::of(&rows);
    Ok(Report {
        first_seed: request.first_seed,
        n_seeds: request.n_seeds,
        verdict: Verdict::of(&score),
        score,
        rows,
    })
}

/// Speed of sliding that an answer is for [m/s].
fn sliding_mps(grip: &Grip) -> f64 {
    match *grip {
        Grip::Measured { sliding_mps, .. } => sliding_mps,
        Grip::AtLeast { .. } => friction::SLIDING_MPS,
    }
}

/// A ground whose friction a drive showed.
pub(crate) struct FoundGround {
    pub name: &'static str,
    /// What only the plant knows.
    pub truth: Stribeck,
    /// What was found [-].
    pub friction: f64,
}

/// The grounds of a seed's drive that were driven at their limit.
pub(crate) fn found_grounds(vehicle: &Vehicle, seed: u64) -> Result<Vec<FoundGround>, FrictionBenchError> {
    let TestDrive { log, classes, grounds, described } = test_drive(vehicle, seed)?;
    let named = grounds.map(|ground| (ground.name, ground.published));
    let found = find_friction(&Chassis::of(&described), &named, &[Drive { log: &log, classes: &classes }])?;
    let measured = grounds.iter().zip(&found.grounds).filter_map(|(ground, found)| match found.grip {
        Grip::Measured { friction, .. } => {
            Some(FoundGround { name: ground.name, truth: ground.stribeck, friction })
        }
        Grip::AtLeast { .. } => None,
    });
    Ok(measured.collect())
}

fn rows(vehicle: &Vehicle, seed: u64) -> Result<Vec<Row>, FrictionBenchError> {
    let TestDrive { log, classes, grounds, described } = test_drive(vehicle, seed)?;
    let named = grounds.map(|ground| (ground.name, ground.published));
    let drive = Drive { log: &log, classes: &classes };
    let found = find_friction(&Chassis::of(&described), &named, &[drive])?;
    let row = |(ground, found): (&drive::Ground, &friction::GroundFriction)| Row {
        vehicle: vehicle.name.clone(),
        seed,
        ground: ground.name,
        is_aggressive: ground.is_aggressive,
        true_friction: ground.at(vehicle, sliding_mps(&found.grip)),
        true_most_friction: ground.most_friction,
        true_at_limit_s: ground.at_limit_s,
        published_friction: f64::from(ground.published.at(sliding_mps(&found.grip) as f32)),
        driven_s: found.driven_s,
        at_limit_s: found.at_limit_s,
        grip: found.grip,
    };
    // Ground that the drive never came to is no case.
    let driven = grounds.iter().zip(&found.grounds).filter(|(_, found)| found.driven_s > 0.0);
    Ok(driven.map(row).collect())
}
