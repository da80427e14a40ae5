//! The ground in layers, as the prior reads it for many poses at once.

use std::ops::Range;

use terrain::{GridGeometry, GridMap, SurfaceCell, TerrainClass};

use crate::ground::{Contact, is_known};
use crate::lattice::ResolutionRatio;
use crate::planes::Planes;

/// Vegetation counts in shares of this.
pub(crate) const VEGETATION_SHARES: f32 = 255.0;

/// Layers over the window of the padded ground.
#[derive(Clone, Debug)]
pub(crate) struct LaneGround {
    planes: Planes,
    /// What wheels read: [`Contact::HEIGHT`] and so on.
    pub contacts: [Vec<f32>; Contact::N_VALUES],
    /// Level l holds the highest of the 2^l cells from each cell eastward, minus infinity where unknown [m].
    pub bumps_m: Vec<Vec<f32>>,
    /// Sums over the cells of a row before each column. Whole numbers, exact whatever the window.
    pub vegetation: Vec<f32>,
    pub obstacles: Vec<f32>,
    pub unknown: Vec<f32>,
}

impl LaneGround {
    /// Ground of which nothing is known yet.
    pub fn unknown(window: GridGeometry, ratio: ResolutionRatio, n_levels: usize) -> Self {
        let planes = Planes::new(window, ratio);
        let zeros = || planes.layer(0.0);
        Self {
            planes,
            contacts: std::array::from_fn(|_| zeros()),
            bumps_m: vec![planes.layer(f32::NEG_INFINITY); n_levels],
            vegetation: zeros(),
            obstacles: zeros(),
            unknown: zeros(),
        }
    }

    /// Order of the layers.
    pub fn planes(&self) -> &Planes {
        &self.planes
    }

    /// Bytes of the layers.
    pub fn n_bytes(&self) -> usize {
        let counts = [&self.vegetation, &self.obstacles, &self.unknown];
        let layers = self.contacts.iter().chain(&self.bumps_m).chain(counts);
        layers.map(|layer| size_of_val(&**layer)).sum()
    }

    /// Takes over rows of what wheels and bellies touch, each of one number per cell of the window.
    pub fn read(&mut self, rows: Range<usize>, contacts: &[Contact], bumps_m: &[Vec<f32>]) {
        let GridGeometry { origin: [west, south], n_cols, .. } = *self.planes.window();
        for row in rows {
            for col in 0..n_cols {
                let index = self.planes.index([west + col as i64, south + row as i64]);
                let cell = row * n_cols + col;
                for (layer, value) in self.contacts.iter_mut().zip(contacts[cell].values) {
                    layer[index] = value;
                }
                for (layer, level_m) in self.bumps_m.iter_mut().zip(bumps_m) {
                    layer[index] = level_m[cell];
                }
            }
        }
    }

    /// Counts the cells of some rows, from a column on.
    pub fn count(&mut self, surface: &GridMap<SurfaceCell>, rows: Range<usize>, first_col: usize) {
        let GridGeometry { origin: [west, south], n_cols, .. } = *self.planes.window();
        for row in rows {
            let lattice = |col: usize| [west + col as i64, south + row as i64];
            let first = self.planes.index(lattice(first_col));
            let mut sums = [self.vegetation[first], self.obstacles[first], self.unknown[first]];
            for col in first_col..n_cols {
                let cell = surface.at_lattice(lattice(col)).unwrap_or(&SurfaceCell::UNKNOWN);
                sums.iter_mut().zip(counts(cell)).for_each(|(sum, count)| *sum += f32::from(count));
                let index = self.planes.index(lattice(col + 1));
                [self.vegetation[index], self.obstacles[index], self.unknown[index]] = sums;
            }
        }
    }
}

/// Shares of vegetation, obstacles and unknown cells that a cell counts for.
pub(crate) fn counts(cell: &SurfaceCell) -> [u8; 3] {
    let known = is_known(cell);
    let vegetation = cell.class_probability[TerrainClass::Vegetation as usize].clamp(0.0, 1.0);
    // Not a number counts as none.
    let shares = if known { (vegetation * VEGETATION_SHARES).round() as u8 } else { 0 };
    let is_obstacle = cell.class() == TerrainClass::Obstacle;
    [shares, u8::from(is_obstacle), u8::from(!known)]
}
