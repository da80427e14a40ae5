//! The surface made ready for wheels: padded, so that no footprint needs a bounds check; holes filled beside
//! known ground, so that interpolation never meets one.

use std::ops::Range;

use rayon::prelude::*;
use terrain::{GridGeometry, GridMap, SurfaceCell};

use crate::ball::Ball;
use crate::ground_changes::CellRead;
use crate::lane_ground::{LaneGround, counts};
use crate::lattice::ResolutionRatio;
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
    /// Number of the values; the rest fills up.
    pub const N_VALUES: usize = 6;

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

/// Known with a height that is a number.
pub(crate) fn is_known(cell: &SurfaceCell) -> bool {
    cell.is_known() && cell.height_m.is_finite()
}

/// The padded ground under a window of the surface's lattice.
#[derive(Clone, Debug)]
pub(crate) struct ContactGround {
    window: GridGeometry,
    wheel: Ball,
    /// Distance of the heights that make the gradient [cells].
    baseline: i64,
    contacts: Vec<Contact>,
    /// What a wheel stands on, minus infinity where unknown [m].
    rests_m: Vec<f32>,
    /// What a belly may touch: level l holds the highest of the 2^l cells from each cell eastward, minus
    /// infinity where unknown [m].
    bumps_m: Vec<Vec<f32>>,
    lanes: LaneGround,
}

/// Cells of the padded ground.
#[derive(Clone)]
pub(crate) struct Area {
    pub rows: Range<usize>,
    pub cols: Range<usize>,
}

impl ContactGround {
    /// Ground of which nothing is known yet. The gradient is taken over about the diameter of a wheel, which
    /// does not feel what is smaller.
    pub fn unknown(window: GridGeometry, ratio: ResolutionRatio, lengths: &Lengths) -> Self {
        let cells = |length_m: f64| length_m / window.resolution_m;
        // A belly is longest along its diagonal.
        let widest_belly = cells(lengths.belly_diagonal_m()).ceil() as usize + 1;
        let n_levels = widest_belly.ilog2() as usize + 1;
        Self {
            window,
            wheel: Ball::new(lengths.envelope_radius_m, window.resolution_m),
            baseline: baseline(lengths, window.resolution_m),
            contacts: vec![Contact::NOWHERE; window.n_cells()],
            rests_m: vec![f32::NEG_INFINITY; window.n_cells()],
            bumps_m: vec![vec![f32::NEG_INFINITY; window.n_cells()]; n_levels],
            lanes: LaneGround::unknown(window, ratio, n_levels),
        }
    }

    /// How far a cell reads around itself [cells].
    pub fn reach_of(lengths: &Lengths, resolution_m: f64) -> i64 {
        Ball::new(lengths.envelope_radius_m, resolution_m).reach + baseline(lengths, resolution_m) + 1
    }

    /// Where the cells lie.
    pub fn window(&self) -> &GridGeometry {
        &self.window
    }

    /// Bytes of its arrays.
    pub fn n_bytes(&self) -> usize {
        let bumps = self.bumps_m.iter().map(|level| size_of_val(&**level)).sum::<usize>();
        size_of_val(&*self.contacts) + size_of_val(&*self.rests_m) + bumps + self.lanes.n_bytes()
    }

    /// Position of a lattice cell, which must lie in the window.
    #[inline(always)]
    pub fn index(&self, lattice: [i64; 2]) -> usize {
        let [col, row] = [0, 1].map(|axis| (lattice[axis] - self.window.origin[axis]) as usize);
        row * self.window.n_cols + col
    }

    /// Takes over what changed in the surface's lattice rectangle from `min` to `max`, both inclusive. Returns the cells
    /// that may be others than before.
    pub fn read(&mut self, surface: &GridMap<SurfaceCell>, min: [i64; 2], max: [i64; 2]) -> Area {
        let [west, south] = self.window.origin;
        let reach = self.wheel.reach + self.baseline + 1;
        let area = Area {
            rows: clipped(min[1] - south - reach, max[1] - south + reach, self.window.n_rows),
            cols: clipped(min[0] - west - reach, max[0] - west + reach, self.window.n_cols),
        };
        self.read_heights(surface, &area);
        self.raise_levels(area.rows.clone());
        self.rest_wheels(&area);
        self.read_contacts(surface, &area);
        self.fill_holes(&area);
        self.lanes.count(surface, area.rows.clone(), area.cols.start);
        self.lanes.read(area.rows.clone(), &self.contacts, &self.bumps_m);
        area
    }

    /// What poses read of a cell.
    pub fn cell_read(&self, surface: &GridMap<SurfaceCell>, row: usize, col: usize) -> CellRead {
        let [west, south] = self.window.origin;
        let index = row * self.window.n_cols + col;
        let values = &self.contacts[index].values;
        CellRead {
            contact: std::array::from_fn(|value| values[value].to_bits()),
            bump: self.bumps_m[0][index].to_bits(),
            counts: counts(cell_at(surface, [west + col as i64, south + row as i64])),
        }
    }

    fn read_heights(&mut self, surface: &GridMap<SurfaceCell>, area: &Area) {
        let (n_cols, [west, south]) = (self.window.n_cols, self.window.origin);
        let rows = self.bumps_m[0].par_chunks_mut(n_cols).enumerate();
        rows.filter(|(row, _)| area.rows.contains(row)).for_each(|(row, heights_m)| {
            for col in area.cols.clone() {
                let cell = cell_at(surface, [west + col as i64, south + row as i64]);
                heights_m[col] = if is_known(cell) { cell.height_m } else { f32::NEG_INFINITY };
            }
        });
    }

    fn rest_wheels(&mut self, area: &Area) {
        let (n_cols, wheel, heights_m) = (self.window.n_cols, &self.wheel, &self.bumps_m[0]);
        let rows = self.rests_m.par_chunks_mut(n_cols).enumerate();
        rows.filter(|(row, _)| area.rows.contains(row)).for_each(|(row, rests_m)| {
            wheel.rest(heights_m, n_cols, row, &area.cols, rests_m);
        });
    }

    fn read_contacts(&mut self, surface: &GridMap<SurfaceCell>, area: &Area) {
        let (n_cols, [west, south]) = (self.window.n_cols, self.window.origin);
        let rests =
            Rests { heights_m: &self.rests_m, window: &self.window, baseline: self.baseline as isize };
        let rows = self.contacts.par_chunks_mut(n_cols).enumerate();
        rows.filter(|(row, _)| area.rows.contains(row)).for_each(|(row, contacts)| {
            for col in area.cols.clone() {
                let cell = cell_at(surface, [west + col as i64, south + row as i64]);
                contacts[col] = rests.contact([col, row], cell);
            }
        });
    }

    /// Each level from the one below, whole rows.
    fn raise_levels(&mut self, rows: Range<usize>) {
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
    fn fill_holes(&mut self, area: &Area) {
        for row in area.rows.clone() {
            for col in area.cols.clone() {
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

    /// The same in layers, with what else is read for many poses at once.
    #[inline(always)]
    pub fn lanes(&self) -> &LaneGround {
        &self.lanes
    }
}

/// Overlap of an inclusive range with 0..n.
pub(crate) fn clipped(first: i64, last: i64, n: usize) -> Range<usize> {
    let start = first.clamp(0, n as i64) as usize;
    start..((last + 1).clamp(0, n as i64) as usize).max(start)
}

fn baseline(lengths: &Lengths, resolution_m: f64) -> i64 {
    ((lengths.wheel_radius_m / resolution_m).round() as i64).max(1)
}

/// The surface by lattice indices, unknown beyond its window.
fn cell_at(surface: &GridMap<SurfaceCell>, lattice: [i64; 2]) -> &SurfaceCell {
    surface.at_lattice(lattice).unwrap_or(&SurfaceCell::UNKNOWN)
}

/// The surface on which wheels stand.
struct Rests<'a> {
    heights_m: &'a [f32],
    window: &'a GridGeometry,
    baseline: isize,
}

impl Rests<'_> {
    fn height_m(&self, [col, row]: [usize; 2], east: isize, north: isize) -> Option<f32> {
        let col = col.checked_add_signed(east).filter(|&col| col < self.window.n_cols)?;
        let row = row.checked_add_signed(north).filter(|&row| row < self.window.n_rows)?;
        let height_m = self.heights_m[row * self.window.n_cols + col];
        height_m.is_finite().then_some(height_m)
    }

    fn contact(&self, place: [usize; 2], cell: &SurfaceCell) -> Contact {
        let Some(height_m) = self.height_m(place, 0, 0) else { return Contact::NOWHERE };
        let finite = |value: f32, limit: f32| if value.is_nan() { limit } else { value.clamp(0.0, limit) };
        let mut values = [0.0; 8];
        values[Contact::HEIGHT] = height_m;
        values[Contact::VARIANCE] = finite(cell.height_variance_m2, VARIANCE_MAX_M2);
        values[Contact::VEGETATION] = finite(cell.vegetation_height_m, f32::MAX);
        values[Contact::GRADIENT_EAST] = self.gradient(place, [1, 0]);
        values[Contact::GRADIENT_NORTH] = self.gradient(place, [0, 1]);
        Contact { values }
    }

    /// Mean of the central differences on three parallel lines, as many as are known; a one-sided difference
    /// where none is, level where the cell stands alone.
    fn gradient(&self, place: [usize; 2], [east, north]: [isize; 2]) -> f32 {
        let b = self.baseline;
        let run_m = b as f32 * self.window.resolution_m as f32;
        let height_m = |along: isize, across: isize| {
            self.height_m(place, along * east + across * north, along * north + across * east)
        };
        let central = |across: isize| Some((height_m(b, across)? - height_m(-b, across)?) / (2.0 * run_m));
        let (mut sum, mut n_lines) = (0.0, 0.0);
        for difference in [-b, 0, b].into_iter().filter_map(central) {
            sum += difference;
            n_lines += 1.0;
        }
        if n_lines > 0.0 {
            return sum / n_lines;
        }
        let centre_m = height_m(0, 0);
        let one_sided = |side: isize| Some((height_m(side * b, 0)? - centre_m?) / (side as f32 * run_m));
        one_sided(1).or_else(|| one_sided(-1)).unwrap_or(0.0)
    }
}
