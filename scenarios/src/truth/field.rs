//! The truth on a lattice of poses, worked out where it is first asked for and kept: the ground does not change.

use std::collections::BTreeMap;
use std::f64::consts::TAU;

use rayon::prelude::*;
use terrain::GridGeometry;

use super::{Traversability, Truth};

/// Cells along the side of a block.
const BLOCK: i64 = 16;

/// Traversability for every cell of the lattice of a resolution and every yaw bin.
///
/// The pose of a cell and a bin is the one of the risk map: the rear axle's centre in the cell's centre, the yaw at
/// (k + 1/2) 2 pi / `n_yaws`.
#[derive(Clone, Debug)]
pub struct TruthField {
    truth: Truth,
    resolution_m: f64,
    n_yaws: usize,
    /// Row-major cells of a block, all yaws of a cell together.
    blocks: BTreeMap<[i64; 2], Vec<Traversability>>,
}

impl TruthField {
    /// A field of which nothing was asked yet.
    pub fn new(truth: Truth, resolution_m: f64, n_yaws: usize) -> Self {
        Self { truth, resolution_m, n_yaws, blocks: BTreeMap::new() }
    }

    /// Works out what is not yet known of a window, on all of rayon's threads.
    pub fn prepare(&mut self, window: &GridGeometry) {
        let [first, last] = [
            window.origin,
            [window.origin[0] + window.n_cols as i64 - 1, window.origin[1] + window.n_rows as i64 - 1],
        ]
        .map(|cell| cell.map(|index| index.div_euclid(BLOCK)));
        let all = (first[1]..=last[1]).flat_map(|y| (first[0]..=last[0]).map(move |x| [x, y]));
        let missing: Vec<_> = all.filter(|block| !self.blocks.contains_key(block)).collect();
        let found: Vec<_> = missing.into_par_iter().map(|block| (block, self.block(block))).collect();
        self.blocks.extend(found);
    }

    /// All yaws of the cell with this lattice index (x, y); nothing when its window was not prepared.
    pub fn at(&self, cell: [i64; 2]) -> Option<&[Traversability]> {
        let block = self.blocks.get(&cell.map(|index| index.div_euclid(BLOCK)))?;
        let [col, row] = cell.map(|index| index.rem_euclid(BLOCK) as usize);
        let start = (row * BLOCK as usize + col) * self.n_yaws;
        block.get(start..start + self.n_yaws)
    }

    fn block(&self, block: [i64; 2]) -> Vec<Traversability> {
        let mut poses = Vec::with_capacity((BLOCK * BLOCK) as usize * self.n_yaws);
        for row in 0..BLOCK {
            for col in 0..BLOCK {
                let centre =
                    |block: i64, index: i64| ((block * BLOCK + index) as f64 + 0.5) * self.resolution_m;
                let (x_m, y_m) = (centre(block[0], col), centre(block[1], row));
                poses.extend((0..self.n_yaws).map(|yaw| {
                    let yaw_rad = (yaw as f64 + 0.5) * TAU / self.n_yaws as f64;
                    self.truth.traversability(x_m, y_m, yaw_rad)
                }));
            }
        }
        poses
    }
}
