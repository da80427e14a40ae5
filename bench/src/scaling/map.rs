//! The learned map of a small vehicle with more or less to do.

use std::sync::Arc;

use bicycle::lanes::Instructions;
use evidential::{BeliefMap, BeliefMapError, Learned, Unfamiliar};
use rand::seq::SliceRandom;
use rand::{RngExt, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;
use terrain::{Cell, CellRegion, GridGeometry, GridMap, SurfaceCell};
use traversability::CvarLevel;

use super::{Over, Point, Request, thread_counts};
use crate::learned_map::{Sizes, untrained};
use crate::prior_map::{CVAR_LEVEL, N_YAWS, SEED, WINDOW, roughen};
use crate::stopwatch::timed_ms;
use crate::{BenchError, Spread};

/// Cells along each side of a square window.
const SIDES: [usize; 6] = [32, 64, 96, 128, 160, 192];
const YAWS: [usize; 6] = [4, 8, 13, 16, 24, 36];
const SHARES: [f64; 10] = [0.0, 0.0005, 0.001, 0.002, 0.005, 0.01, 0.02, 0.1, 0.3, 1.0];

/// What a map is made of, and by how many threads.
#[derive(Clone, Copy)]
struct Size {
    window: GridGeometry,
    n_yaws: usize,
    n_threads: usize,
}

pub(super) fn points(
    over: Over,
    request: &Request,
    instructions: Instructions,
) -> Result<Vec<Point>, BenchError> {
    let usual = Size { window: WINDOW, n_yaws: N_YAWS, n_threads: request.n_threads };
    let whole = |value: usize, size: Size| {
        Maker::new(size, instructions)?.measure_whole(value as f64, request.n_maps)
    };
    let square = |side: usize| GridGeometry { n_rows: side, n_cols: side, ..WINDOW };
    match over {
        Over::Cells => {
            SIDES.map(|side| whole(side * side, Size { window: square(side), ..usual })).into_iter().collect()
        }
        Over::Yaws => YAWS.map(|n_yaws| whole(n_yaws, Size { n_yaws, ..usual })).into_iter().collect(),
        Over::MapThreads => {
            let counts = thread_counts(request.n_threads).into_iter();
            counts.map(|n_threads| whole(n_threads, Size { n_threads, ..usual })).collect()
        }
        _ => {
            let mut maker = Maker::new(usual, instructions)?;
            SHARES.iter().map(|&share| maker.measure_changed(over, share, request.n_maps)).collect()
        }
    }
}

/// A map with the ground below it.
struct Maker {
    map: BeliefMap,
    ground: GridMap<SurfaceCell>,
    pool: rayon::ThreadPool,
    rng: Xoshiro256PlusPlus,
    n_poses: usize,
}

impl Maker {
    fn new(Size { window, n_yaws, n_threads }: Size, instructions: Instructions) -> Result<Self, BenchError> {
        let vehicle = formats::read_vehicle("rc_car")?;
        // As large as those that come with the program.
        let sizes = Sizes { encoder_hidden: vec![32, 32], ..Sizes::default() };
        let learned = Learned {
            checkpoint: Arc::new(untrained(&vehicle.geometry, &vehicle.name, &sizes, SEED)?),
            unfamiliar: Unfamiliar::Fuse,
            obstacle_margin_m: 0.0,
            level: CvarLevel::new(CVAR_LEVEL)?,
        };
        let resolution_m = window.resolution_m;
        let map = BeliefMap::new(&vehicle.geometry, &learned, resolution_m, window, n_yaws, instructions)?;
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(SEED);
        let mut ground = GridMap::filled(window, SurfaceCell::UNKNOWN);
        roughen(&mut ground, CellRegion::whole(&window).cells(), &mut rng);
        let pool = rayon::ThreadPoolBuilder::new().num_threads(n_threads).build()?;
        Ok(Self { map, ground, pool, rng, n_poses: window.n_cells() * n_yaws })
    }

    /// Whole maps.
    fn measure_whole(&mut self, value: f64, n_maps: usize) -> Result<Point, BenchError> {
        self.measure(value, n_maps, |_| (), |map, ground| map.update_all(ground))
    }

    /// Maps each of which is brought up to date after a share of the cells changed.
    fn measure_changed(&mut self, over: Over, share: f64, n_maps: usize) -> Result<Point, BenchError> {
        let change = |maker: &mut Self| {
            let cells = changed(over, share, maker.ground.geometry(), &mut maker.rng);
            roughen(&mut maker.ground, cells.into_iter(), &mut maker.rng);
        };
        self.measure(share, n_maps, change, |map, ground| map.update(ground))
    }

    fn measure(
        &mut self,
        value: f64,
        n_maps: usize,
        prepare: impl Fn(&mut Self),
        update: fn(&mut BeliefMap, &GridMap<SurfaceCell>) -> Result<usize, BeliefMapError>,
    ) -> Result<Point, BenchError> {
        let (mut ms, mut n_judged) = (Vec::with_capacity(n_maps), 0);
        // The first one only warms up.
        for round in 0..=n_maps {
            prepare(self);
            let Self { map, ground, pool, .. } = self;
            let (map_ms, judged) = timed_ms(|| pool.install(|| update(map, ground)));
            let judged = judged?;
            if round > 0 {
                ms.push(map_ms);
                n_judged += judged;
            }
        }
        let judged_share = Some(n_judged as f64 / (n_maps * self.n_poses) as f64);
        Ok(Point { value, judged_share, ms: Spread::of(ms) })
    }
}

/// So many cells of a window, in one block or anywhere.
fn changed(over: Over, share: f64, window: &GridGeometry, rng: &mut Xoshiro256PlusPlus) -> Vec<Cell> {
    if over == Over::ChangedBlock {
        let mut side = |n: usize| {
            let length = (n as f64 * share.sqrt()).round() as usize;
            let start = rng.random_range(0..=n - length);
            start..start + length
        };
        return CellRegion { rows: side(window.n_rows), cols: side(window.n_cols) }.cells().collect();
    }
    let mut cells: Vec<Cell> = CellRegion::whole(window).cells().collect();
    let n_changed = (cells.len() as f64 * share).round() as usize;
    cells.partial_shuffle(rng, n_changed).0.to_vec()
}
