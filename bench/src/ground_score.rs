//! How often the diagnosis of beliefs about the ground is right, on cases whose cause it is not told.

use std::fmt::{self, Display};
use std::sync::atomic::{AtomicBool, Ordering};

use bicycle::Vehicle;
use evidential::{EncounterError, Foretelling, LabelConfig, encounters};
use navigator::Config;
use rayon::prelude::*;
use scenarios::stream;
use serde::Serialize;
use sim_to_real::{GroundBeliefError, GroundCause, judge_ground};
use traversability::Encounter;

use crate::gap_score::Confusion;
use crate::ground_cases::{GroundCaseError, GroundFault, MappedDrives, ground_case};

/// Which cases.
#[derive(Clone, Debug)]
pub struct Request {
    /// The machines, in turn.
    pub vehicles: Vec<Vehicle>,
    /// Number of the first case of each machine.
    pub first_case: u64,
    /// Cases of each machine.
    pub n_cases: u64,
    /// Decides all of them.
    pub seed: u64,
    /// Cases at a time; the result does not depend on it.
    pub n_threads: usize,
}

/// A case and what was said of it.
#[derive(Clone, Debug, Serialize)]
pub struct ScoredCase {
    /// Which machine.
    pub vehicle: String,
    /// Which of its cases.
    pub number: u64,
    /// What had been changed.
    pub truth: String,
    /// The same with its size, for people.
    pub fault: String,
    /// What was named; `none` and `unknown` where nothing was.
    pub answer: String,
    /// What could not be told apart.
    pub credible: Vec<String>,
    /// Squared difference of the halves in standard errors over its numbers.
    pub difference: f64,
}

impl ScoredCase {
    /// Whether what was named is what had been changed.
    pub fn is_right(&self) -> bool {
        self.truth == self.answer
    }
}

/// All cases.
#[derive(Clone, Debug, Serialize)]
pub struct Report {
    /// Decided all of them.
    pub seed: u64,
    /// Machine by machine.
    pub cases: Vec<ScoredCase>,
    /// What was taken for what.
    pub confusion: Confusion,
}

/// Why there is no table.
#[derive(Debug, thiserror::Error)]
pub enum GroundScoreError {
    /// A case cannot be made or judged.
    #[error("{case}: {source}")]
    Case {
        /// Which one.
        case: String,
        /// Why.
        source: Box<BrokenCase>,
    },
    /// The system refused the threads.
    #[error("threads: {0}")]
    Threads(#[from] rayon::ThreadPoolBuildError),
}

/// Why a case cannot be made or judged.
#[derive(Debug, thiserror::Error)]
pub enum BrokenCase {
    /// It cannot be made.
    #[error(transparent)]
    Made(#[from] GroundCaseError),
    /// Its drives cannot be looked at.
    #[error(transparent)]
    Encounters(#[from] EncounterError),
    /// There is nothing to judge by.
    #[error(transparent)]
    Judged(#[from] GroundBeliefError),
}

/// Makes every case and diagnoses it; `after` sees each as it is done, in any order and on any thread.
///
/// # Errors
/// The first case that cannot be made or judged.
pub fn measure(request: &Request, after: impl Fn(&ScoredCase) + Sync) -> Result<Report, GroundScoreError> {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(request.n_threads).build()?;
    let numbers = request.first_case..request.first_case + request.n_cases;
    let jobs: Vec<(&Vehicle, u64)> = request
        .vehicles
        .iter()
        .flat_map(|vehicle| numbers.clone().map(move |number| (vehicle, number)))
        .collect();
    let failed = AtomicBool::new(false);
    let score = |&(vehicle, number): &(&Vehicle, u64)| {
        if failed.load(Ordering::Relaxed) {
            return None;
        }
        let case = || format!("{} case {number}", vehicle.name);
        let scored = score_case(vehicle, request.seed, number)
            .map_err(|source| GroundScoreError::Case { case: case(), source: Box::new(source) });
        match &scored {
            Ok(scored) => after(scored),
            Err(_) => failed.store(true, Ordering::Relaxed),
        }
        Some(scored)
    };
    let cases: Vec<ScoredCase> =
        pool.install(|| jobs.par_iter().filter_map(score).collect::<Result<_, _>>())?;
    let pairs = cases.iter().map(|case| (case.truth.clone(), case.answer.clone())).collect();
    Ok(Report { seed: request.seed, confusion: Confusion::of(pairs), cases })
}

fn score_case(vehicle: &Vehicle, seed: u64, number: u64) -> Result<ScoredCase, BrokenCase> {
    let mut rng = stream(seed, &[0x0F_A017, number]);
    let fault = GroundFault::draw(number as usize, vehicle, &mut rng);
    let made = ground_case(vehicle, &fault, scenarios::seed_of(seed, &[number]))?;
    let (reference, changed) = (met(vehicle, &made.reference)?, met(vehicle, &made.changed)?);
    let report = judge_ground(&changed, &reference, made.changed.maps.len())?;
    let change = report.change;
    let answer = match &change {
        Some(change) if change.is_unknown => "unknown".to_owned(),
        Some(change) => change.named.map_or("none".to_owned(), GroundCause::id),
        None => "none".to_owned(),
    };
    Ok(ScoredCase {
        vehicle: vehicle.name.clone(),
        number,
        truth: fault.id(),
        fault: fault.to_string(),
        answer,
        credible: change.iter().flat_map(|change| &change.credible).map(|cause| cause.id()).collect(),
        difference: change.map_or(0.0, |change| change.chi_squared / change.n_traits as f64),
    })
}

/// Footprints of drives, by physics alone.
fn met(vehicle: &Vehicle, drives: &MappedDrives) -> Result<Vec<Encounter>, EncounterError> {
    let foretelling = Foretelling {
        geometry: &vehicle.geometry,
        labelling: LabelConfig::for_vehicle(&vehicle.geometry, &vehicle.limits),
        prior: Config::for_vehicle(vehicle).prior,
        checkpoint: None,
    };
    encounters(&foretelling, &drives.log, &drives.maps)
}

impl Display for GroundFault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let id = self.id();
        match *self {
            Self::None | Self::Mislabelled { .. } => write!(f, "{id}"),
            Self::Friction { factor, .. } | Self::Wet { factor } => write!(f, "{id} x {factor:.2}"),
            Self::SensorHeight { offset_m } => write!(f, "{id} {offset_m:+.3} m"),
            Self::Heavier { factor } => write!(f, "{id} x {factor:.2}"),
        }
    }
}
