//! The risk map of learned beliefs over 81 x 96 cells and 13 yaws: whole, and after a part of the ground changed.
//!
//! What a map costs does not depend on the values of the weights, so networks of any size are measured untrained.

mod scan_drive;
mod untrained;

use std::sync::Arc;

use bicycle::Geometry;
use bicycle::lanes::{Instructions, Isa};
use evidential::{BeliefMap, Checkpoint, FeatureLayout, Learned, Predictor, Unfamiliar};
use physics_prior::{Assumption, PriorMap};
use rand::SeedableRng;
use rand_xoshiro::Xoshiro256PlusPlus;
use rayon::prelude::*;
use serde::Serialize;
use terrain::{CellRegion, GridMap, SurfaceCell};
use traversability::CvarLevel;

use crate::prior_map::{CHANGED, CVAR_LEVEL, N_YAWS, SEED, WINDOW, block, roughen};
use crate::stopwatch::timed_ms;
use crate::{BenchError, Spread};

pub use scan_drive::{ScanDrive, ScanDriveReport, measure_scan_drive};
pub use untrained::{Sizes, untrained};

/// How to measure.
#[derive(Clone, Debug, PartialEq)]
pub struct Request {
    /// Threads that share the work.
    pub n_threads: usize,
    /// Maps to make of every network.
    pub n_updates: usize,
    /// Sizes of the networks; every one is measured.
    pub sizes: Vec<Sizes>,
    /// Instruction set.
    pub isa: Isa,
}

/// What was measured.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Report {
    /// Threads that shared the work.
    pub threads: usize,
    /// Instruction set that was used.
    pub isa: Isa,
    /// Maps made of every network.
    pub updates: usize,
    /// Poses of a map: cells times yaws.
    pub poses: usize,
    /// Cells that changed before an update in part.
    pub changed_cells: usize,
    /// One for each size of the networks, in the order asked for.
    pub networks: Vec<NetworkReport>,
}

/// What the maps of one network cost.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct NetworkReport {
    /// Widths and numbers of layers.
    pub sizes: Sizes,
    /// Multiplications and additions per footprint.
    pub multiply_adds: usize,
    /// Memory of the map with all that it is made from [MB].
    pub memory_mb: f64,
    /// Times of the map [ms].
    pub ms: Times,
    /// Times of its parts, each measured alone over all poses [ms].
    pub alone_ms: Parts,
}

/// Times of the two kinds of update [ms].
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Times {
    /// The whole map.
    pub full: Spread,
    /// After one contiguous block of 2 % of the cells changed.
    pub changed: Spread,
}

/// Times of the parts of a whole map [ms].
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Parts {
    /// The physics prior and its CVaR, as a map of its own.
    pub prior: Spread,
    /// Networks and flow on features already extracted.
    pub networks: Spread,
}

/// Makes the map of a small vehicle again and again, each time whole and then after a block of the ground changed.
///
/// # Errors
/// No update or network asked for, networks that make no sense, or no threads to be had.
pub fn measure(request: &Request) -> Result<Report, BenchError> {
    if request.n_updates == 0 || request.sizes.is_empty() {
        return Err(BenchError::NoUpdates);
    }
    let instructions = Instructions::find(request.isa).map_err(mppi::ConfigError::from)?;
    let pool = rayon::ThreadPoolBuilder::new().num_threads(request.n_threads).build()?;
    let geometry = formats::read_vehicle("rc_car")?.geometry;
    let networks = request.sizes.iter().map(|sizes| {
        let checkpoint = untrained(&geometry, "rc_car", sizes, SEED)?;
        pool.install(|| measure_network(&geometry, checkpoint, sizes, request.n_updates, instructions))
    });
    Ok(Report {
        threads: request.n_threads,
        isa: instructions.isa(),
        updates: request.n_updates,
        poses: WINDOW.n_cells() * N_YAWS,
        changed_cells: CHANGED[0] * CHANGED[1],
        networks: networks.collect::<Result<_, _>>()?,
    })
}

fn measure_network(
    geometry: &Geometry,
    checkpoint: Checkpoint,
    sizes: &Sizes,
    n_updates: usize,
    instructions: Instructions,
) -> Result<NetworkReport, BenchError> {
    let level = CvarLevel::new(CVAR_LEVEL)?;
    let assumption = Assumption::Physics { prior: checkpoint.sidecar.prior, level };
    let predictor = Predictor::new(&checkpoint, instructions).map_err(evidential::BeliefMapError::from)?;
    let multiply_adds = checkpoint.sidecar.architecture.multiply_adds();
    let learned = Learned {
        checkpoint: Arc::new(checkpoint),
        unfamiliar: Unfamiliar::Fuse,
        obstacle_margin_m: 0.0,
        level,
    };
    let resolution_m = WINDOW.resolution_m;
    let mut prior = PriorMap::new(geometry, &assumption, resolution_m, WINDOW, N_YAWS, instructions)?;
    let mut map = BeliefMap::new(geometry, &learned, resolution_m, WINDOW, N_YAWS, instructions)?;
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(SEED);
    let mut ground = GridMap::filled(WINDOW, SurfaceCell::UNKNOWN);
    roughen(&mut ground, CellRegion::whole(&WINDOW).cells(), &mut rng);
    let footprints = footprints(&learned.checkpoint.sidecar.layout, &ground);
    let mut ms: [Vec<f64>; 4] = Default::default();
    // The first round only warms up.
    for round in 0..=n_updates {
        let (full_ms, done) = timed_ms(|| map.update_all(&ground));
        done?;
        let (prior_ms, done) = timed_ms(|| prior.update_all(&ground));
        done?;
        let (networks_ms, predicted) = timed_ms(|| predict(&predictor, &footprints));
        predicted?;
        let block = block(&mut rng);
        roughen(&mut ground, block.cells(), &mut rng);
        let (changed_ms, done) = timed_ms(|| map.update(&ground));
        done?;
        if round > 0 {
            let round_ms = [full_ms, changed_ms, prior_ms, networks_ms];
            ms.iter_mut().zip(round_ms).for_each(|(all_ms, round_ms)| all_ms.push(round_ms));
        }
    }
    let [full, changed, prior, networks] = ms.map(Spread::of);
    Ok(NetworkReport {
        sizes: sizes.clone(),
        multiply_adds,
        memory_mb: map.n_bytes() as f64 * 1e-6,
        ms: Times { full, changed },
        alone_ms: Parts { prior, networks },
    })
}

/// Features of as many footprints as the map has poses, those of its inner cells again and again.
fn footprints(layout: &FeatureLayout, ground: &GridMap<SurfaceCell>) -> Vec<Vec<f32>> {
    let inner = CellRegion { rows: 10..WINDOW.n_rows - 10, cols: 10..WINDOW.n_cols - 10 };
    let features = |(index, cell)| {
        let [x_m, y_m] = WINDOW.centre_m(cell);
        layout.features(ground, [x_m, y_m, index as f64])
    };
    let some: Vec<Vec<f32>> = inner.cells().enumerate().filter_map(features).collect();
    some.iter().cycle().take(WINDOW.n_cells() * N_YAWS).cloned().collect()
}

/// Footprints that are handed to a thread at a time.
const CHUNK: usize = 1024;

fn predict(predictor: &Predictor, footprints: &[Vec<f32>]) -> Result<(), BenchError> {
    let chunks = footprints.par_chunks(CHUNK);
    let predicted = chunks.map(|chunk| predictor.predict(chunk).map(drop));
    Ok(predicted.collect::<Result<(), _>>().map_err(evidential::BeliefMapError::from)?)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_work_is_what_it_says() {
        let sizes = Sizes { encoder_hidden: vec![8], n_latent: 4, ..Sizes::default() };
        let report =
            measure(&Request { n_threads: 1, n_updates: 1, sizes: vec![sizes], isa: Isa::Auto }).unwrap();
        assert_eq!((report.threads, report.updates, report.poses), (1, 1, 81 * 96 * 13));
        let network = &report.networks[0];
        // 144 x 8 + 8 x 4, four heads of 32 x (4 + 12), 16 x (4 + 4), and 3 x 8 x 4 of the flow.
        assert_eq!(network.multiply_adds, 1152 + 32 + 2048 + 128 + 96);
        assert!(network.memory_mb > 1.6, "the result alone has 16 bytes a pose");
        for spread in [network.ms.full, network.ms.changed, network.alone_ms.prior, network.alone_ms.networks]
        {
            assert!(0.0 < spread.min && spread.min <= spread.median && spread.median <= spread.p99);
        }
    }

    #[test]
    fn nothing_to_measure_is_refused() {
        let request = Request { n_threads: 1, n_updates: 0, sizes: vec![Sizes::default()], isa: Isa::Auto };
        assert!(matches!(measure(&request), Err(BenchError::NoUpdates)));
        let request = Request { n_threads: 1, n_updates: 1, sizes: Vec::new(), isa: Isa::Auto };
        assert!(matches!(measure(&request), Err(BenchError::NoUpdates)));
    }
}
