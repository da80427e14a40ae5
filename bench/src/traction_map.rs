//! The posterior idea on real ground: a network's prediction in a forest it never saw, fused by density with a physics
//! prior, against the traction that was measured there.
//!
//! Nothing here is fitted to the measured distributions: the prior comes from the map's heights and classes and from
//! figures found elsewhere ([`physics_prior::SkidSteerPrior`]), the evidence from the network's density
//! ([`evidence_of`]). The measured distributions are read in one place, where errors are taken.

mod evidence;
mod prior;
mod score;

use formats::{TractionMap, TractionPmfs};
use physics_prior::SkidSteerPrior;
use serde::Serialize;
use terrain::{FilteredGround, GridMap};
use traversability::Pmf;

pub use evidence::{FOREIGN_EVIDENCE_MAX, LATENT_EVIDENCE_MAX, evidence_of};
pub use prior::{GROUND_FILTER, Prior, prior_of};
pub use score::{Head, Interval, MethodScore};

/// Edge of the square blocks that the bootstrap draws [m]: cells of one block are correlated, by the terrain, by the
/// drive that passed there and by the network's patch.
pub const BLOCK_M: f64 = 5.0;

/// Redraws of the bootstrap.
pub const N_RESAMPLES: usize = 2000;

/// How a distribution of traction can be had. The order is that of every table.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Source {
    /// The network's prediction as it is.
    Prediction,
    /// The same probability for every bin.
    Uniform,
    /// The physics prior alone.
    Prior,
    /// Prediction and uniform distribution by evidence, as EVORA has it.
    FusedWithUniform,
    /// Prediction and physics prior by evidence (PIETRA, equation 11).
    FusedWithPhysics,
    /// The prediction in distribution, the physics prior out of it.
    Switch,
}

impl Source {
    /// All of them.
    pub const ALL: [Self; 6] = [
        Self::Prediction,
        Self::Uniform,
        Self::Prior,
        Self::FusedWithUniform,
        Self::FusedWithPhysics,
        Self::Switch,
    ];

    /// The name in tables and pictures.
    pub fn name(self) -> &'static str {
        match self {
            Self::Prediction => "prediction",
            Self::Uniform => "uniform",
            Self::Prior => "physics prior",
            Self::FusedWithUniform => "fused with uniform",
            Self::FusedWithPhysics => "fused with physics",
            Self::Switch => "switch",
        }
    }
}

/// What was found on a traction map.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct TractionMapReport {
    /// Cells with a measured distribution.
    pub n_cells: usize,
    /// Of these, cells out of distribution: density below that of all training (EVORA's default threshold 0).
    pub n_out_of_distribution: usize,
    /// Of these, cells in which something stands or hangs above the ground.
    pub n_obstructed: usize,
    /// Blocks that the bootstrap draws.
    pub n_blocks: usize,
    /// Edge of a block [m].
    pub block_m: f64,
    /// Redraws of the bootstrap.
    pub n_resamples: usize,
    /// Seed of the bootstrap.
    pub seed: u64,
    /// The finest step of the heights [m]; null where all are one height.
    pub height_step_m: Option<f32>,
    /// Weight of the prediction in the fused distribution, n / (n + n_phys): quantiles of 5, 50 and 95 % of the cells.
    pub prediction_weight: [f64; 3],
    /// Achieved over commanded speed.
    pub linear: Head,
    /// Achieved over commanded yaw rate.
    pub angular: Head,
}

/// A report and the maps behind it.
#[derive(Clone, Debug)]
pub struct Judgement {
    /// The numbers.
    pub report: TractionMapReport,
    /// The ground that the heights were filtered to.
    pub ground: FilteredGround,
    /// The physics prior.
    pub prior: TractionPmfs,
    /// Prediction and physics prior by evidence.
    pub fused: TractionPmfs,
}

/// Why a traction map cannot be judged.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum JudgeError {
    /// The ground cannot be found.
    #[error(transparent)]
    Ground(#[from] terrain::SettingError),
}

/// Judges a traction map. Intervals are of 95 %, from a bootstrap over spatial blocks drawn with `seed`.
///
/// # Errors
/// The ground cannot be found.
pub fn judge(map: &TractionMap, seed: u64) -> Result<Judgement, JudgeError> {
    let prior = prior_of(map)?;
    let cells: Vec<usize> = map.known_cells().collect();
    let blocks = score::Blocks::of(map.geometry(), &cells, BLOCK_M);
    let heads = [
        (&map.measured.linear, &map.predicted.linear, &prior.pmfs.linear),
        (&map.measured.angular, &map.predicted.angular, &prior.pmfs.angular),
    ];
    let [linear, angular] = heads.map(|(measured, predicted, physics)| {
        let at = |index: usize, source| distribution(map, [predicted, physics], index, source);
        let errors = Source::ALL.map(|source| {
            cells.iter().map(|&i| score::emd2(&at(i, source), &measured.values()[i])).collect::<Vec<f64>>()
        });
        let density =
            cells.iter().map(|&i| f64::from(map.normalised_density.values()[i])).collect::<Vec<_>>();
        score::head(&errors, &density, &blocks, seed)
    });
    let report = report(map, &prior, &blocks, seed, [linear, angular]);
    let fused = TractionPmfs {
        linear: fused_map(map, [&map.predicted.linear, &prior.pmfs.linear]),
        angular: fused_map(map, [&map.predicted.angular, &prior.pmfs.angular]),
    };
    Ok(Judgement { report, ground: prior.ground, prior: prior.pmfs, fused })
}

fn report(
    map: &TractionMap,
    prior: &Prior,
    blocks: &score::Blocks,
    seed: u64,
    [linear, angular]: [Head; 2],
) -> TractionMapReport {
    let cells: Vec<usize> = map.known_cells().collect();
    let density = |index: usize| f64::from(map.normalised_density.values()[index]);
    let mut weights: Vec<f64> = cells.iter().map(|&i| f64::from(prediction_weight(density(i)))).collect();
    weights.sort_by(f64::total_cmp);
    TractionMapReport {
        n_cells: cells.len(),
        n_out_of_distribution: cells.iter().filter(|&&i| density(i) < 0.0).count(),
        n_obstructed: cells.iter().filter(|&&i| !prior.ground.is_ground.values()[i]).count(),
        n_blocks: blocks.n(),
        block_m: BLOCK_M,
        n_resamples: N_RESAMPLES,
        seed,
        height_step_m: prior.height_step_m,
        prediction_weight: [0.05, 0.5, 0.95].map(|share| score::quantile(&weights, share)),
        linear,
        angular,
    }
}

/// n / (n + n_phys) of equation 11.
fn prediction_weight(density: f64) -> f32 {
    let evidence = evidence_of(density);
    (evidence / (evidence + SkidSteerPrior::default().evidence)) as f32
}

fn distribution(
    map: &TractionMap,
    [predicted, physics]: [&GridMap<Pmf>; 2],
    index: usize,
    source: Source,
) -> Pmf {
    let density = f64::from(map.normalised_density.values()[index]);
    let (predicted, physics) = (predicted.values()[index], physics.values()[index]);
    match source {
        Source::Prediction => predicted,
        Source::Uniform => Pmf::UNIFORM,
        Source::Prior => physics,
        Source::FusedWithUniform => Pmf::UNIFORM.mixed_with(&predicted, prediction_weight(density)),
        Source::FusedWithPhysics => physics.mixed_with(&predicted, prediction_weight(density)),
        Source::Switch if density < 0.0 => physics,
        Source::Switch => predicted,
    }
}

fn fused_map(map: &TractionMap, authors: [&GridMap<Pmf>; 2]) -> GridMap<Pmf> {
    let mut fused = GridMap::filled(*map.geometry(), Pmf::UNIFORM);
    for index in map.known_cells() {
        fused.values_mut()[index] = distribution(map, authors, index, Source::FusedWithPhysics);
    }
    fused
}
