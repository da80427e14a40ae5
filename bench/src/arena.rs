//! PIETRA's hall (section VI, figures 9 and 10): what becomes of plants and a ramp that a car has never driven on, by what
//! it knows of the ground.
//!
//! The networks learn on level concrete and turf alone ([`Training`]); then every method drives the same missions, over
//! short bushes and tall ones, from starts that differ a little.

mod rules;
mod run;
mod training;

use std::collections::BTreeMap;

use bicycle::Vehicle;
use mppi::Isa;
use navigator::Config;
use scenarios::{ARENA_SIZE_M, ArenaWay, Bounds, EpisodeConfig, Outcome};
use serde::Serialize;
use traversability::CvarLevel;

use crate::Verdict;
use crate::closed_loop::Method;
use crate::collection::CollectionError;
use crate::statistics::{Mean, Paired, wilson_interval};
use crate::sweep::{SweepError, hash_of, sweep};
use run::Job;
pub use run::{Mission, Run};
pub use training::Training;

/// Name of the machine that drives.
pub const VEHICLE: &str = "rc_car";

/// Which drives to do, and how.
#[derive(Clone, Debug, PartialEq)]
pub struct Request {
    /// What the controller knows of the ground.
    pub methods: Vec<Method>,
    /// Drives of every method and mission.
    pub n_runs: u64,
    /// Risk tolerance of the methods that know distributions.
    pub level: CvarLevel,
    /// Decides the bushes, the starts, what is learned from, noise and samples.
    pub seed: u64,
    /// Longest drive, simulated [s].
    pub time_limit_s: f64,
    /// Drives at a time.
    pub n_threads: usize,
    /// Instruction set of the controller.
    pub isa: Isa,
}

/// What the drives of a mission and method add up to.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Row {
    /// Short bushes or tall ones.
    pub mission: Mission,
    /// What the controller knew of the ground.
    pub method: Method,
    /// Drives.
    pub n: usize,
    /// Drives that reached the goal.
    pub n_goal: usize,
    /// The same as a share, with its 95 % interval (Wilson).
    pub goal: [f64; 3],
    /// Time of the drives that reached the goal [s].
    pub time_s: Option<Mean>,
    /// Drives by the way that they took; those that took none are not among them.
    pub ways: BTreeMap<ArenaWay, usize>,
    /// Drives by how they ended.
    pub outcomes: BTreeMap<Outcome, usize>,
}

/// `pietra` beside another method, over the runs of both missions.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Comparison {
    /// The other method.
    pub other: Method,
    /// Over the runs, `pietra` being the one.
    #[serde(flatten)]
    pub paired: Paired,
}

/// All drives and what they add up to.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Report {
    /// Name of the machine.
    pub vehicle: &'static str,
    /// Risk tolerance of the methods that know distributions.
    pub alpha: f64,
    /// What decided all drives.
    pub seed: u64,
    /// Drives of every method and mission.
    pub n_runs: u64,
    /// Longest drive, simulated [s].
    pub time_limit_s: f64,
    /// Instruction set that the controller used.
    pub isa: Isa,
    /// [`formats::config_hash`] of the pipeline's configuration.
    pub config_hash: String,
    /// What was learned from; null where no method learned anything.
    pub training: Option<Training>,
    /// A row for each mission and method.
    pub rows: Vec<Row>,
    /// `pietra` beside the others.
    pub comparisons: Vec<Comparison>,
    /// Rules that were settled before the first drive.
    pub verdicts: Vec<Verdict>,
    /// Row by row, by number.
    pub runs: Vec<Run>,
}

/// Why there is no table.
#[derive(Debug, thiserror::Error)]
pub enum ArenaTableError {
    /// The drives.
    #[error(transparent)]
    Sweep(#[from] SweepError),
    /// The drives to learn from.
    #[error("drives to learn from: {0}")]
    Collection(#[from] CollectionError),
    /// The training.
    #[error("training of {method}: {source}")]
    Training {
        /// Which networks.
        method: &'static str,
        /// Why.
        source: evidential::TrainError,
    },
}

/// What is being done.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stage {
    /// Driving and training on level ground.
    Learning,
    /// Driving the missions.
    Driving,
}

/// What all drives have in common.
struct Settings {
    vehicle: Vehicle,
    config: Config,
    episode: EpisodeConfig,
    level: CvarLevel,
    seed: u64,
    networks: training::Networks,
}

/// Learns, and does all drives; `on_stage` hears of each part as it begins, `after_run` of every drive as it ends, in any
/// order and on any thread. `revision` names the program in the checkpoints.
///
/// # Errors
/// Nothing to drive, nothing learned, no threads to be had, or a drive that could not begin or go on.
pub fn measure(
    request: &Request,
    revision: &str,
    on_stage: impl Fn(Stage),
    after_run: impl Fn(&Run) + Sync,
) -> Result<Report, ArenaTableError> {
    let jobs: Vec<Job> = jobs(request);
    if jobs.is_empty() {
        let expected = "at least one run of at least one method";
        return Err(SweepError::NoDrives { expected }.into());
    }
    on_stage(Stage::Learning);
    let settings = settings(request, revision)?;
    on_stage(Stage::Driving);
    let after = |run: &Run| {
        after_run(run);
        Ok(())
    };
    let runs = sweep(&jobs, request.n_threads, |job| job.drive(&settings), after)?;
    let rows: Vec<Row> = runs.chunks(request.n_runs as usize).filter_map(Row::of).collect();
    let others = request.methods.iter().filter(|method| **method != Method::Pietra);
    let comparisons: Vec<Comparison> = others.filter_map(|&other| Comparison::of(other, &runs)).collect();
    Ok(Report {
        vehicle: VEHICLE,
        alpha: request.level.get(),
        seed: request.seed,
        n_runs: request.n_runs,
        time_limit_s: request.time_limit_s,
        isa: settings.config.controller.isa,
        config_hash: hash_of(&settings.config)?,
        training: settings.networks.training.clone(),
        verdicts: rules::verdicts(&rows, &runs),
        rows,
        comparisons,
        runs,
    })
}

/// Row by row, each row by ascending number.
fn jobs(request: &Request) -> Vec<Job> {
    let rows = Mission::ALL
        .into_iter()
        .flat_map(|mission| request.methods.iter().map(move |&method| (mission, method)));
    rows.flat_map(|(mission, method)| (0..request.n_runs).map(move |number| Job { mission, method, number }))
        .collect()
}

fn settings(request: &Request, revision: &str) -> Result<Settings, ArenaTableError> {
    let vehicle = formats::read_vehicle(VEHICLE).map_err(SweepError::from)?;
    let mut config = Config::for_vehicle(&vehicle);
    config.controller.n_threads = 1;
    config.controller.isa = request.isa;
    // Every planner is told where the walls of the hall are, which no map shows.
    config.areas.geofence_m = Bounds { south_west_m: [0.0; 2], north_east_m: ARENA_SIZE_M }.corners_m();
    let mut episode = EpisodeConfig::for_vehicle(&vehicle);
    episode.rules.time_limit_s = request.time_limit_s;
    let networks = training::Networks::learn(&vehicle, request, revision)?;
    Ok(Settings { vehicle, config, episode, level: request.level, seed: request.seed, networks })
}

impl Row {
    /// Of the drives of one mission and method; `None` of no drive.
    fn of(runs: &[Run]) -> Option<Self> {
        let first = runs.first()?;
        let (mut ways, mut outcomes) = (BTreeMap::new(), BTreeMap::new());
        for run in runs {
            *outcomes.entry(run.outcome).or_default() += 1;
            if let Some(way) = run.way {
                *ways.entry(way).or_default() += 1;
            }
        }
        let times_s: Vec<f64> = runs.iter().filter(|run| run.arrived()).map(|run| run.time_s).collect();
        let (n, n_goal) = (runs.len(), times_s.len());
        let [low, high] = wilson_interval(n_goal, n);
        Some(Self {
            mission: first.mission,
            method: first.method,
            n,
            n_goal,
            goal: [n_goal as f64 / n as f64, low, high],
            time_s: Mean::of(&times_s),
            ways,
            outcomes,
        })
    }
}

impl Comparison {
    /// Over the runs that both drove; `None` where there is none.
    fn of(other: Method, runs: &[Run]) -> Option<Self> {
        let arrivals_s = |method: Method| {
            let of_method = runs.iter().filter(move |run| run.method == method);
            of_method.map(|run| run.arrived().then_some(run.time_s))
        };
        let pairs_s: Vec<[Option<f64>; 2]> = arrivals_s(Method::Pietra)
            .zip(arrivals_s(other))
            .map(|(one_s, other_s)| [one_s, other_s])
            .collect();
        (!pairs_s.is_empty()).then(|| Self { other, paired: Paired::of(&pairs_s) })
    }
}
