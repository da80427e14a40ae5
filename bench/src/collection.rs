//! Data to learn from: a plant driven over generated worlds without a planner, as PIETRA gathers it (section V-A): 20
//! trials on each of ten maps, sinusoidal steering, 2 m/s, until the vehicle rolls over, is stuck or leaves the map.
//!
//! Labels come from the odometry that a robot would have; features from the true surface, or from the map that the
//! robot itself fuses from its scans as it drives.

mod height_scale;
mod place;
mod recorded;
mod trial;

use std::sync::Arc;

use bicycle::{DriveLog, Vehicle};
use evidential::{
    Dataset, DatasetError, DatasetOrigin, Example, FeatureLayout, Label, LabelConfig, LabelError, Responses,
    Surveyor, SurveyorError, estimate_responses, labels,
};
use navigator::Config;
use physics_prior::{PriorConfig, SlopeLaw};
use rayon::prelude::*;
use scenarios::{Bounds, EpisodeError, LayersError, OdometryConfig, Outcome, Rules, World};
use serde::Serialize;
use terrain::{GridMap, SurfaceCell};

use crate::closed_loop::{MapSource, true_surface};
pub use height_scale::{HeightScale, ScaleRound, find_height_scale};
pub use place::{Place, PlaceError};
pub use recorded::{collect_recorded, recorded_surface};
use trial::{Driven, Field, drive};
pub(crate) use trial::{measured_row, untilted};

/// What to drive.
#[derive(Clone, Debug)]
pub struct Request {
    /// The machine, with its usual limits: they decide the resolution of its maps. The drives may be faster.
    pub vehicle: Vehicle,
    /// The worlds.
    pub place: Place,
    /// Number of the first world within its family.
    pub first_map: u32,
    /// Worlds to drive in.
    pub n_maps: u32,
    /// Trials in each.
    pub n_trials: u32,
    /// Commanded speed [m/s].
    pub speed_mps: f64,
    /// Longest trial, simulated [s].
    pub time_limit_s: f64,
    /// What the features are taken from.
    pub map_source: MapSource,
    /// The physics prior that the examples hold.
    pub prior: PriorConfig,
    /// How well the vehicle knows its own motion.
    pub odometry: OdometryConfig,
    /// Decides worlds, starts, steering and sensor noise.
    pub seed: u64,
    /// Threads that share the trials; the result does not depend on it.
    pub n_threads: usize,
}

/// PIETRA's speed for the full-size vehicle [m/s].
const SPEED_MPS: f64 = 2.0;

impl Request {
    /// PIETRA's collection on ten maps: 20 trials on each, 2 m/s for a full-size vehicle and less than 1.5 m/s for one
    /// that is made for less, trials of up to 40 s.
    pub fn new(vehicle: Vehicle, place: Place, seed: u64) -> Self {
        let speed_mps =
            if vehicle.geometry.length_m < 1.0 { vehicle.limits.speed_max_mps } else { SPEED_MPS };
        let odometry = OdometryConfig::for_length(vehicle.geometry.length_m);
        let prior = paper_prior(&vehicle);
        Self {
            vehicle,
            prior,
            place,
            first_map: 0,
            n_maps: 10,
            n_trials: 20,
            speed_mps,
            time_limit_s: 40.0,
            map_source: MapSource::Oracle,
            odometry,
            seed,
            n_threads: 1,
        }
    }

    /// The machine with its limits raised as far as the collection drives it.
    fn driven_vehicle(&self) -> Vehicle {
        let mut vehicle = self.vehicle.clone();
        vehicle.limits.speed_max_mps = vehicle.limits.speed_max_mps.max(self.speed_mps);
        vehicle
    }

    fn rules(&self) -> Rules {
        Rules { time_limit_s: self.time_limit_s, ..Rules::default() }
    }
}

/// Where recorded drives come from, for people.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Recorded {
    /// Name of the log.
    pub log: String,
    /// Name of the elevation.
    pub ground: String,
}

/// One trial, or one run of a recording, in numbers.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Trial {
    /// Which world.
    pub map: u32,
    /// How it ended; `None` for a recording.
    pub outcome: Option<Outcome>,
    /// Time until then [s].
    pub time_s: f64,
    /// Labels that became examples.
    pub n_examples: usize,
    /// Labels whose footprint lies on ground that is not known well enough.
    pub n_unknown_ground: usize,
}

/// What was gathered.
pub struct Collection {
    /// The examples, trial by trial; a drive is a trial.
    pub dataset: Dataset,
    /// The trials, map by map.
    pub trials: Vec<Trial>,
    /// What stands between command and motion, as the logs tell it.
    pub responses: Responses,
    /// Thresholds of the labels.
    pub labelling: LabelConfig,
    /// The worlds.
    pub worlds: Vec<Arc<World>>,
    /// The odometry of all trials, one run each.
    pub log: DriveLog,
}

/// Why nothing was gathered.
#[derive(Debug, thiserror::Error)]
pub enum CollectionError {
    /// Nothing to drive.
    #[error("{field}: expected a finite number > 0, found {found}")]
    Setting {
        /// Name of the setting.
        field: &'static str,
        /// The value.
        found: f64,
    },
    /// A world cannot be made.
    #[error(transparent)]
    Place(#[from] PlaceError),
    /// No place to start was found.
    #[error("map {map}: expected a place where the vehicle can stand, found none in {tries} tries")]
    NoStart {
        /// Which world.
        map: u32,
        /// Places tried.
        tries: usize,
    },
    /// The layers of a recording's ground make no world.
    #[error("elevation: {0}")]
    Layers(#[from] LayersError),
    /// A recording of nothing.
    #[error(
        "log: expected a vehicle that moves or is told to, at finite poses, found none in {n_rows} rows of {n_runs} runs"
    )]
    NothingLabelled {
        /// Rows of the log.
        n_rows: usize,
        /// Its runs.
        n_runs: usize,
    },
    /// A recording's ground lies elsewhere.
    #[error(
        "elevation: expected ground under at least half of the {n_labels} labelled poses, x {:.1} to {:.1}, y {:.1} to \
         {:.1} m, found it under {n_covered}; it covers x {:.1} to {:.1}, y {:.1} to {:.1} m",
        drive.south_west_m[0], drive.north_east_m[0], drive.south_west_m[1], drive.north_east_m[1],
        ground.south_west_m[0], ground.north_east_m[0], ground.south_west_m[1], ground.north_east_m[1]
    )]
    NotCovered {
        /// Labels of all runs.
        n_labels: usize,
        /// Labels on known ground.
        n_covered: usize,
        /// Around the labels.
        drive: Bounds,
        /// Around the ground.
        ground: Bounds,
    },
    /// The plant gave up; a trial that ends badly is a result and no error.
    #[error("{trial}: {source}")]
    Episode {
        /// Map and trial.
        trial: String,
        /// Why.
        source: EpisodeError,
    },
    /// The mapping refused its settings.
    #[error("elevation map: {0}")]
    Elevation(#[from] terrain::SettingError),
    /// The mapping refused a pose.
    #[error(transparent)]
    Fuse(#[from] terrain::FuseError),
    /// The odometry makes no log.
    #[error(transparent)]
    Log(#[from] bicycle::DriveLogError),
    /// The log makes no labels.
    #[error(transparent)]
    Labels(#[from] LabelError),
    /// The ground cannot be judged.
    #[error(transparent)]
    Survey(#[from] SurveyorError),
    /// The labels make no dataset.
    #[error(transparent)]
    Dataset(#[from] DatasetError),
    /// The system refused the threads.
    #[error("threads: {0}")]
    Threads(#[from] rayon::ThreadPoolBuildError),
}

/// Drives all trials; `after_trial` is called as each one ends, in any order and on any thread.
///
/// # Errors
/// Nothing to drive, a world that cannot be made or not be stood in, a plant that left the numbers, nothing labelled.
pub fn collect(request: &Request, after_trial: impl Fn() + Sync) -> Result<Collection, CollectionError> {
    check(request)?;
    let pool = rayon::ThreadPoolBuilder::new().num_threads(request.n_threads).build()?;
    pool.install(|| gather(request, &after_trial))
}

fn check(request: &Request) -> Result<(), CollectionError> {
    let settings = [
        ("maps", f64::from(request.n_maps)),
        ("trials", f64::from(request.n_trials)),
        ("speed_mps", request.speed_mps),
        ("time_limit_s", request.time_limit_s),
    ];
    match settings.into_iter().find(|(_, found)| !(found.is_finite() && *found > 0.0)) {
        Some((field, found)) => Err(CollectionError::Setting { field, found }),
        None => Ok(()),
    }
}

fn gather(request: &Request, after_trial: &(impl Fn() + Sync)) -> Result<Collection, CollectionError> {
    let config = Config::for_vehicle(&request.vehicle);
    let vehicle = request.driven_vehicle();
    let layout = FeatureLayout::for_vehicle(&vehicle.geometry);
    let surveyor = Surveyor::new(&vehicle.geometry, layout, request.prior, config.elevation.resolution_m)?;
    let fields = fields(request, &vehicle, config.elevation.resolution_m)?;
    let driven: Vec<Driven> = (0..request.n_maps * request.n_trials)
        .into_par_iter()
        .map(|index| {
            let (place, trial) = (index / request.n_trials, index % request.n_trials);
            let number = [request.first_map + place, trial];
            let driven = drive(request, &config, &vehicle, &fields[place as usize], number, &surveyor);
            after_trial();
            driven
        })
        .collect::<Result<_, _>>()?;
    let log = log(&driven)?;
    let labelling = LabelConfig::for_vehicle(&vehicle.geometry, &vehicle.limits);
    let responses = estimate_responses(&log, &vehicle.geometry, &labelling)?;
    let runs: Vec<_> = log.runs().collect();
    let (examples, trials): (Vec<Vec<Example>>, Vec<Trial>) = (driven.par_iter().zip(&runs).enumerate())
        .map(|(index, (driven, run))| {
            let labels = labels(run, &vehicle.geometry, &responses, &labelling)?;
            let examples = match &driven.sensed {
                None => {
                    let surface = &fields[(driven.map - request.first_map) as usize].surface;
                    examples(&surveyor, &labels, surface, index as u32)?
                }
                Some(sensed) => sensed_examples(sensed, run.time_s(), &labels, index as u32),
            };
            let trial = driven.trial(labels.len(), examples.len());
            Ok((examples, trial))
        })
        .collect::<Result<Vec<_>, CollectionError>>()?
        .into_iter()
        .unzip();
    let names = driven.into_iter().map(|driven| driven.name).collect();
    let examples = examples.into_iter().flatten().collect();
    let dataset = dataset_of(&vehicle, layout, request.prior, names, provenance(request), examples)?;
    let worlds = fields.into_iter().map(|field| field.world).collect();
    Ok(Collection { dataset, trials, responses, labelling, worlds, log })
}

fn fields(request: &Request, vehicle: &Vehicle, resolution_m: f64) -> Result<Vec<Field>, PlaceError> {
    let field = |map| {
        let world = Arc::new(request.place.world(request.seed, map)?);
        let surface = true_surface(&world, resolution_m);
        Ok(Field::new(vehicle, world, surface))
    };
    (request.first_map..request.first_map + request.n_maps).into_par_iter().map(field).collect()
}

/// What examples are told by physics: equation 15 as printed, which the networks of the paper's tables are fused with.
fn paper_prior(vehicle: &Vehicle) -> PriorConfig {
    PriorConfig { slope_law: SlopeLaw::Linear {}, ..Config::for_vehicle(vehicle).prior }
}

fn dataset_of(
    vehicle: &Vehicle,
    layout: FeatureLayout,
    prior: PriorConfig,
    drives: Vec<String>,
    provenance: String,
    examples: Vec<Example>,
) -> Result<Dataset, DatasetError> {
    let origin = DatasetOrigin { vehicle: vehicle.name.clone(), layout, prior, drives, provenance };
    let dataset = Dataset { origin, examples };
    dataset.validate()?;
    Ok(dataset)
}

fn provenance(request: &Request) -> String {
    let source = match request.map_source {
        MapSource::Oracle => "the true surface",
        MapSource::Sensed => "the map fused from scans during the drive",
    };
    let from =
        if request.first_map > 0 { format!(" from number {}", request.first_map) } else { String::new() };
    format!(
        "{}; {} maps{from}, {} trials each, open loop at {} m/s with sinusoidal steering, seed {}; features from {source}",
        request.place, request.n_maps, request.n_trials, request.speed_mps, request.seed
    )
}

/// All trials as one log.
fn log(driven: &[Driven]) -> Result<DriveLog, CollectionError> {
    let mut log = DriveLog::default();
    for trial in driven {
        for row in &trial.rows {
            log.push(&trial.name, row)?;
        }
    }
    Ok(log)
}

/// Examples of one drive; labels whose ground is not known well enough give none.
fn examples(
    surveyor: &Surveyor,
    labels: &[Label],
    surface: &GridMap<SurfaceCell>,
    drive: u32,
) -> Result<Vec<Example>, SurveyorError> {
    let mut surveyor = surveyor.clone();
    labels.iter().filter_map(|label| surveyor.example(surface, label, drive).transpose()).collect()
}

/// The same where the ground was looked at during the drive, at every row of its log; labels stand at rows.
fn sensed_examples(sensed: &[Option<Example>], time_s: &[f64], labels: &[Label], drive: u32) -> Vec<Example> {
    let example = |label: &Label| {
        let row = time_s.partition_point(|&time_s| time_s < label.time_s);
        let under = sensed.get(row)?.as_ref()?;
        Some(Example { measured: label.measured, drive, ..under.clone() })
    };
    labels.iter().filter_map(example).collect()
}
