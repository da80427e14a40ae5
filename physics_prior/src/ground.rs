//! The surface made ready for wheels: padded, so that no footprint needs a bounds check; holes filled beside
//! known ground, so that interpolation never meets one; counts summed along rows.

use rayon::prelude::*;
use terrain::{Cell, GridGeometry, GridMap, SurfaceCell, TerrainClass};

use crate::lengths::Lengths;

/// What wheels read of a cell, adjacent so that interpolation runs over all quantities at once.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(C, align(32))]
pub(crate) struct Contact {
    /// [`Contact::HEIGHT`] and so on.
    pub values: [f32; 8],
}

impl Contact {
    /// Height of the ground [m].
    pub const HEIGHT: usize = 0;
    /// Variance of the height [m2].
    pub const VARIANCE: usize = 1;
    /// Height of vegetation [m].
    pub const VEGETATION: usize = 2;
    /// Height change per metre eastward [-].
    pub const GRADIENT_EAST: usize = 3;
    /// Height change per metre northward [-].
    pub const GRADIENT_NORTH: usize = 4;
    /// 1 where the ground is unknown, else 0.
    pub const UNKNOWN: usize = 5;

    const NOWHERE: Self = {
        let mut values = [0.0; 8];
        values[Self::UNKNOWN] = 1.0;
        Self { values }
    };

    /// Whether the cell itself is unknown, even if its values were filled in.
    pub fn is_unknown(&self) -> bool {
        self.values[Self::UNKNOWN] > 0.0
    }
}

/// Largest standard deviation of a height that makes a difference [m]; keeps the arithmetic finite.
const VARIANCE_MAX_M2: f32 = 100.0;

/// Cells of a footprint by kind. Vegetation counts in shares of 255.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Counts {
    pub vegetation_255: u32,
    pub obstacles: u32,
    pub unknown: u32,
}

/// Counts packed into one number, so that sums along a row are exact and cost one subtraction.
type Packed = u64;

fn packed(cell: &SurfaceCell) -> Packed {
    let known = is_known(cell);
    let vegetation = cell.class_probability[TerrainClass::Vegetation as usize].clamp(0.0, 1.0);
    let vegetation_255 = if known { (vegetation * 255.0).round() as u64 } else { 0 };
    let obstacle = u64::from(cell.class() == TerrainClass::Obstacle);
    vegetation_255 | obstacle << 32 | u64::from(!known) << 48
}

fn unpacked(sum: Packed) -> Counts {
    Counts { vegetation_255: sum as u32, obstacles: (sum >> 32) as u32 & 0xffff, unknown: (sum >> 48) as u32 }
}

/// Known with a height that is a number.
fn is_known(cell: &SurfaceCell) -> bool {
    cell.is_known() && cell.height_m.is_finite()
}

/// The padded ground under a window of the surface's lattice.
#[derive(Clone, Debug)]
pub(crate) struct ContactGround {
    window: GridGeometry,
    /// Distance of the heights that make the gradient [cells].
    baseline: i64,
    contacts: Vec<Contact>,
    /// What a belly may touch: level l holds the highest of the 2^l cells from each cell eastward, minus
    /// infinity where unknown [m].
    bumps_m: Vec<Vec<f32>>,
    /// Sums of the cells before each column, one more than columns per row.
    sums: Vec<Packed>,
}

impl ContactGround {
    /// Ground of which nothing is known yet. The gradient is taken over about the diameter of a wheel, which
    /// does not feel what is smaller.
    pub fn unknown(window: GridGeometry, lengths: &Lengths) -> Self {
        let cells = |length_m: f64| length_m / window.resolution_m;
        // A belly is longest along its diagonal.
        let widest_belly = cells(lengths.belly_diagonal_m()).ceil() as usize + 1;
        let n_levels = widest_belly.ilog2() as usize + 1;
        let baseline = (cells(lengths.wheel_radius_m).round() as i64).max(1);
        Self {
            window,
            baseline,
            contacts: vec![Contact::NOWHERE; window.n_cells()],
            bumps_m: vec![vec![f32::NEG_INFINITY; window.n_cells()]; n_levels],
            sums: vec![0; window.n_rows * (window.n_cols + 1)],
        }
    }

    /// Where the cells lie.
    pub fn window(&self) -> &GridGeometry {
        &self.window
    }

    /// How far a change of the surface reaches [cells].
    pub fn reach(&self) -> i64 {
        self.baseline + 1
    }

    /// Position of a lattice cell, which must lie in the window.
    #[inline(always)]
    pub fn index(&self, lattice: [i64; 2]) -> usize {
        let [col, row] = [0, 1].map(|axis| (lattice[axis] - self.window.origin[axis]) as usize);
        row * self.window.n_cols + col
    }

    /// Takes over the surface in the lattice rectangle from `min` to `max`, both inclusive.
    pub fn read(&mut self, surface: &GridMap<SurfaceCell>, min: [i64; 2], max: [i64; 2]) {
        let [west, south] = self.window.origin;
        let rows = clipped(min[1] - south, max[1] - south, self.window.n_rows);
        let cols = clipped(min[0] - west, max[0] - west, self.window.n_cols);
        let (n_cols, baseline) = (self.window.n_cols, self.baseline);
        let lines = self.contacts.par_chunks_mut(n_cols).zip(self.bumps_m[0].par_chunks_mut(n_cols));
        lines
            .zip(self.sums.par_chunks_mut(n_cols + 1))
            .enumerate()
            .filter(|(row, _)| rows.contains(row))
            .for_each(|(row, ((contacts, bumps_m), sums))| {
                let reader = Reader { surface, baseline };
                for col in cols.clone() {
                    let lattice = [west + col as i64, south + row as i64];
                    contacts[col] = reader.contact(lattice);
                    bumps_m[col] = reader.height_m(lattice).unwrap_or(f32::NEG_INFINITY);
                }
                for col in cols.start..n_cols {
                    let lattice = [west + col as i64, south + row as i64];
                    sums[col + 1] = sums[col] + packed(reader.cell(lattice));
                }
            });
        self.raise_levels(rows.clone());
        self.fill_holes(rows, cols);
    }

    /// Each level from the one below, whole rows.
    fn raise_levels(&mut self, rows: std::ops::Range<usize>) {
        let cells = rows.start * self.window.n_cols..rows.end * self.window.n_cols;
        for level in 1..self.bumps_m.len() {
            let (below, above) = self.bumps_m.split_at_mut(level);
            let reach = 1 << (level - 1);
            let rows = below[level - 1][cells.clone()].chunks(self.window.n_cols);
            for (below, above) in rows.zip(above[0][cells.clone()].chunks_mut(self.window.n_cols)) {
                for (k, above) in above.iter_mut().enumerate() {
                    // The window's border ends the stretch.
                    *above = below[k].max(below[(k + reach).min(below.len() - 1)]);
                }
            }
        }
    }

    /// Gives unknown cells the mean of the known cells around them; they stay marked as unknown.
    fn fill_holes(&mut self, rows: std::ops::Range<usize>, cols: std::ops::Range<usize>) {
        for row in rows {
            for col in cols.clone() {
                let index = row * self.window.n_cols + col;
                if self.contacts[index].is_unknown() {
                    self.contacts[index] = self.mean_around(row, col);
                }
            }
        }
    }

    fn mean_around(&self, row: usize, col: usize) -> Contact {
        let (mut sum, mut n_known) = ([0.0f32; 8], 0.0f32);
        for row in row.saturating_sub(1)..(row + 2).min(self.window.n_rows) {
            for col in col.saturating_sub(1)..(col + 2).min(self.window.n_cols) {
                let contact = &self.contacts[row * self.window.n_cols + col];
                if !contact.is_unknown() {
                    sum.iter_mut().zip(&contact.values).for_each(|(sum, value)| *sum += value);
                    n_known += 1.0;
                }
            }
        }
        if n_known == 0.0 {
            return Contact::NOWHERE;
        }
        let mut values = sum.map(|sum| sum / n_known);
        values[Contact::UNKNOWN] = 1.0;
        Contact { values }
    }

    /// What wheels read, by [`ContactGround::index`].
    pub fn contacts(&self) -> &[Contact] {
        &self.contacts
    }

    /// Heights that a belly may touch, by [`ContactGround::index`] [m].
    #[inline(always)]
    pub fn bumps_m(&self) -> &[f32] {
        &self.bumps_m[0]
    }

    /// Highest of some adjacent cells of a row, at most as many as the widest belly has [m].
    #[inline(always)]
    pub fn highest_m(&self, start: usize, n_cells: usize) -> f32 {
        let level = n_cells.ilog2() as usize;
        let stretches = &self.bumps_m[level];
        stretches[start].max(stretches[start + n_cells - (1 << level)])
    }

    /// Counts over spans of adjacent cells, each given as row and column in the window and number of cells.
    #[inline(always)]
    pub fn counts(&self, spans: impl Iterator<Item = (usize, usize, usize)>) -> Counts {
        let mut sum = 0;
        for (row, col, n_cells) in spans {
            let start = row * (self.window.n_cols + 1) + col;
            sum += self.sums[start + n_cells] - self.sums[start];
        }
        unpacked(sum)
    }
}

/// Overlap of an inclusive range with 0..n.
pub(crate) fn clipped(first: i64, last: i64, n: usize) -> std::ops::Range<usize> {
    let start = first.clamp(0, n as i64) as usize;
    start..((last + 1).clamp(0, n as i64) as usize).max(start)
}

/// The surface by lattice indices, unknown beyond its window.
struct Reader<'a> {
    surface: &'a GridMap<SurfaceCell>,
    baseline: i64,
}

impl Reader<'_> {
    fn cell(&self, lattice: [i64; 2]) -> &SurfaceCell {
        let geometry = self.surface.geometry();
        let [col, row] = [0, 1].map(|axis| lattice[axis] - geometry.origin[axis]);
        let inside = (0..geometry.n_cols as i64).contains(&col) && (0..geometry.n_rows as i64).contains(&row);
        if inside {
            &self.surface[Cell { row: row as usize, col: col as usize }]
        } else {
            &SurfaceCell::UNKNOWN
        }
    }

    fn height_m(&self, lattice: [i64; 2]) -> Option<f32> {
        let cell = self.cell(lattice);
        is_known(cell).then_some(cell.height_m)
    }

    fn contact(&self, lattice: [i64; 2]) -> Contact {
        let cell = self.cell(lattice);
        if !is_known(cell) {
            return Contact::NOWHERE;
        }
        let finite = |value: f32, limit: f32| if value.is_nan() { limit } else { value.clamp(0.0, limit) };
        let mut values = [0.0; 8];
        values[Contact::HEIGHT] = cell.height_m;
        values[Contact::VARIANCE] = finite(cell.height_variance_m2, VARIANCE_MAX_M2);
        values[Contact::VEGETATION] = finite(cell.vegetation_height_m, f32::MAX);
        values[Contact::GRADIENT_EAST] = self.gradient(lattice, [1, 0]);
        values[Contact::GRADIENT_NORTH] = self.gradient(lattice, [0, 1]);
        Contact { values }
    }

    /// Mean of the central differences on three parallel lines, as many as are known; a one-sided difference
    /// where none is, level where the cell stands alone.
    fn gradient(&self, [x, y]: [i64; 2], [along_x, along_y]: [i64; 2]) -> f32 {
        let (b, run_m) = (self.baseline, self.baseline as f32 * self.surface.geometry().resolution_m as f32);
        let height_m = |along: i64, across: i64| {
            self.height_m([x + along * along_x + across * along_y, y + along * along_y + across * along_x])
        };
        let central = |across: i64| Some((height_m(b, across)? - height_m(-b, across)?) / (2.0 * run_m));
        let (mut sum, mut n_lines) = (0.0, 0.0);
        for difference in [-b, 0, b].into_iter().filter_map(central) {
            sum += difference;
            n_lines += 1.0;
        }
        if n_lines > 0.0 {
            return sum / n_lines;
        }
        let centre_m = height_m(0, 0);
        let one_sided = |side: i64| Some((height_m(side * b, 0)? - centre_m?) / (side as f32 * run_m));
        one_sided(1).or_else(|| one_sided(-1)).unwrap_or(0.0)
    }
}
