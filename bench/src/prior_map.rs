//! The risk map of the physics prior over 81 x 96 cells and 13 yaws: whole, and after a part of the ground changed.

use crate::stopwatch::timed_ms;
use crate::{BenchError, Spread};
use bicycle::lanes::{Instructions, Isa};
use physics_prior::{Assumption, PriorConfig, PriorMap};
use rand::{RngExt, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;
use serde::Serialize;
use terrain::{Cell, CellRegion, GridGeometry, GridMap, SurfaceCell, TerrainClass};
use traversability::CvarLevel;

pub(crate) const WINDOW: GridGeometry =
    GridGeometry { resolution_m: 0.1, origin: [0, 0], n_rows: 96, n_cols: 81 };
pub(crate) const N_YAWS: usize = 13;
/// 12 x 13 of 96 x 81 cells are 2 %.
pub(crate) const CHANGED: [usize; 2] = [12, 13];
pub(crate) const CVAR_LEVEL: f64 = 0.4;
pub(crate) const SEED: u64 = 1;

/// How to measure.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Request {
    /// Threads that share the work.
    pub n_threads: usize,
    /// Maps to make.
    pub n_updates: usize,
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
    /// Maps made.
    pub updates: usize,
    /// Poses of a map: cells times yaws.
    pub poses: usize,
    /// Cells that changed before an update in part.
    pub changed_cells: usize,
    /// Time of a whole map and of an update in part [ms].
    pub ms: Times,
}

/// Times of the two kinds of update [ms].
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Times {
    /// The whole map.
    pub full: Spread,
    /// After one contiguous block of 2 % of the cells changed.
    pub changed: Spread,
}

/// Makes the map of a small vehicle again and again, each time whole and then after a block of the ground changed.
///
/// # Errors
/// No update asked for, or no threads to be had.
pub fn measure(request: Request) -> Result<Report, BenchError> {
    if request.n_updates == 0 {
        return Err(BenchError::NoUpdates);
    }
    let instructions = Instructions::find(request.isa).map_err(mppi::ConfigError::from)?;
    let pool = rayon::ThreadPoolBuilder::new().num_threads(request.n_threads).build()?;
    let vehicle = formats::read_vehicle("rc_car")?;
    let prior = PriorConfig::for_vehicle(&vehicle.geometry);
    let level = CvarLevel::new(CVAR_LEVEL)?;
    let assumption = Assumption::Physics { prior, level };
    let resolution_m = WINDOW.resolution_m;
    let mut map = PriorMap::new(&vehicle.geometry, &assumption, resolution_m, WINDOW, N_YAWS, instructions)?;
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(SEED);
    let mut ground = GridMap::filled(WINDOW, SurfaceCell::UNKNOWN);
    roughen(&mut ground, CellRegion::whole(&WINDOW).cells(), &mut rng);
    let (mut full_ms, mut changed_ms) = (Vec::new(), Vec::new());
    // The first round only warms up.
    for round in 0..=request.n_updates {
        let (whole_ms, done) = timed_ms(|| pool.install(|| map.update_all(&ground)));
        done?;
        let block = block(&mut rng);
        roughen(&mut ground, block.cells(), &mut rng);
        let (part_ms, done) = timed_ms(|| pool.install(|| map.update(&ground)));
        done?;
        if round > 0 {
            full_ms.push(whole_ms);
            changed_ms.push(part_ms);
        }
    }
    Ok(Report {
        threads: request.n_threads,
        isa: instructions.isa(),
        updates: request.n_updates,
        poses: WINDOW.n_cells() * N_YAWS,
        changed_cells: CHANGED[0] * CHANGED[1],
        ms: Times { full: Spread::of(full_ms), changed: Spread::of(changed_ms) },
    })
}

/// A block of 2 % of the cells, anywhere in the window.
pub(crate) fn block(rng: &mut Xoshiro256PlusPlus) -> CellRegion {
    let mut side = |n: usize, length: usize| {
        let start = rng.random_range(0..=n - length);
        start..start + length
    };
    CellRegion { rows: side(WINDOW.n_rows, CHANGED[0]), cols: side(WINDOW.n_cols, CHANGED[1]) }
}

/// Rough ground, some of it under plants, as uncertain as a range sensor leaves it.
pub(crate) fn roughen(
    ground: &mut GridMap<SurfaceCell>,
    cells: impl Iterator<Item = Cell>,
    rng: &mut Xoshiro256PlusPlus,
) {
    let geometry = *ground.geometry();
    for cell in cells {
        let [x_m, y_m] = geometry.centre_m(cell);
        let waves_m = 0.15 * (0.9 * x_m).sin() * (0.7 * y_m).cos();
        let height_m = waves_m as f32 + rng.random_range(-0.02..0.02);
        let (class, plants_m) = match rng.random_range(0..4) {
            0 => (TerrainClass::Vegetation, rng.random_range(0.0..0.2)),
            _ => (TerrainClass::Open, 0.0),
        };
        let certain = SurfaceCell::certain(height_m, class, plants_m);
        ground[cell] = SurfaceCell { height_variance_m2: 1e-4, ..certain };
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_work_is_what_it_says() {
        let report = measure(Request { n_threads: 1, n_updates: 2, isa: Isa::Portable }).unwrap();
        assert_eq!((report.threads, report.updates, report.poses), (1, 2, 81 * 96 * 13));
        assert_eq!(report.isa, Isa::Portable);
        let share = report.changed_cells as f64 / WINDOW.n_cells() as f64;
        assert!((share - 0.02).abs() < 2e-4, "{share}");
        for spread in [report.ms.full, report.ms.changed] {
            assert!(0.0 < spread.min && spread.min <= spread.median && spread.median <= spread.p99);
        }
    }

    #[test]
    fn nothing_to_measure_is_refused() {
        let request = Request { n_threads: 1, n_updates: 0, isa: Isa::Auto };
        assert!(matches!(measure(request), Err(BenchError::NoUpdates)));
    }

    #[test]
    fn every_part_of_the_ground_is_known() {
        let mut ground = GridMap::filled(WINDOW, SurfaceCell::UNKNOWN);
        let cells = CellRegion::whole(&WINDOW).cells();
        roughen(&mut ground, cells, &mut Xoshiro256PlusPlus::seed_from_u64(SEED));
        assert!(ground.values().iter().all(|cell| cell.is_known() && cell.height_m.is_finite()));
    }
}
