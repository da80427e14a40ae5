//! Ground that no point tells of, inferred from what was seen around it.

use crate::plane::PlaneSums;
use crate::{Cell, CellRegion, GridGeometry};

/// Slope that unseen ground may well have; it makes extrapolated heights uncertain [-].
const POSSIBLE_SLOPE: f64 = 0.3;

/// Heights that inference may lean on, one per cell; NaN where there is none.
#[derive(Clone, Debug, Default)]
pub(super) struct Support {
    pub heights_m: Vec<f32>,
    pub variances_m2: Vec<f32>,
}

/// A height inferred from neighbours.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Inferred {
    pub height_m: f32,
    pub variance_m2: f32,
    /// The part of the variance that the neighbours themselves have, on average [m2].
    pub seen_m2: f32,
}

impl Support {
    /// The height that the known cells within `radius` along x and y suggest for `cell`; `None` without any.
    ///
    /// Their plane of least squares where it determines the height here better than a single cell would
    /// (leverage up to one), with the variance of its prediction. Otherwise their mean, with the variance
    /// that an unknown slope adds over the distance to them.
    pub fn infer(&self, geometry: &GridGeometry, cell: Cell, radius: usize) -> Option<Inferred> {
        let around = CellRegion::of_cell(cell).grown(radius, geometry);
        let mut sums = PlaneSums::default();
        let mut variance_sum_m2 = 0.0;
        let mut datum_m = f32::NAN;
        for row in around.rows {
            let first = row * geometry.n_cols;
            for col in around.cols.clone() {
                let height_m = self.heights_m[first + col];
                if height_m.is_nan() {
                    continue;
                }
                datum_m = if datum_m.is_nan() { height_m } else { datum_m };
                let (dx, dy) = (col as f64 - cell.col as f64, row as f64 - cell.row as f64);
                sums.add(dx, dy, f64::from(height_m) - f64::from(datum_m));
                variance_sum_m2 += f64::from(self.variances_m2[first + col]);
            }
        }
        (sums.n() > 0).then(|| {
            let seen_m2 = variance_sum_m2 / sums.n() as f64;
            let (rise_m, inferred_m2) = predict(&sums, geometry.resolution_m);
            Inferred {
                height_m: (f64::from(datum_m) + rise_m) as f32,
                variance_m2: (seen_m2 + inferred_m2) as f32,
                seen_m2: seen_m2 as f32,
            }
        })
    }
}

/// Height at the centre of the sums and the variance that inferring it adds.
fn predict(sums: &PlaneSums, resolution_m: f64) -> (f64, f64) {
    if let Some(plane) = sums.fit().filter(|plane| plane.leverage <= 1.0) {
        let freedom = plane.n.saturating_sub(3).max(1) as f64;
        return (plane.height, plane.residual_sum / freedom * (1.0 + plane.leverage));
    }
    let drift_m = POSSIBLE_SLOPE * sums.distance_of_mean().max(1.0) * resolution_m;
    let deviation_m = sums.deviation().unwrap_or(0.0);
    (sums.mean(), deviation_m * deviation_m + drift_m * drift_m)
}

/// Which cells have a marked cell within `radius` along x and y in each of the four quadrants around them (a
/// cell due east lies in two). The centre of such a cell lies in the convex hull of the marked ones.
#[derive(Clone, Debug, Default)]
pub(super) struct Enclosure {
    /// Bit 0: marked to the west or here, bit 1: to the east or here.
    sides: Vec<u8>,
    /// One bit per quadrant: south-west, south-east, north-west, north-east.
    pub quadrants: Vec<u8>,
}

impl Enclosure {
    /// All four quadrants hold a marked cell.
    pub const ALL: u8 = 0b1111;

    pub fn find(&mut self, marked: &[f32], geometry: &GridGeometry, radius: usize) {
        let (n_rows, n_cols) = (geometry.n_rows, geometry.n_cols);
        for buffer in [&mut self.sides, &mut self.quadrants] {
            buffer.clear();
            buffer.resize(geometry.n_cells(), 0);
        }
        for row in 0..n_rows {
            let marked = &marked[row * n_cols..][..n_cols];
            let sides = &mut self.sides[row * n_cols..][..n_cols];
            for shift in 0..=radius.min(n_cols - 1) {
                for col in shift..n_cols {
                    sides[col] |= u8::from(!marked[col - shift].is_nan());
                    sides[col - shift] |= 2 * u8::from(!marked[col].is_nan());
                }
            }
        }
        for shift in 0..=radius.min(n_rows - 1) {
            let by = shift * n_cols;
            for index in by..n_rows * n_cols {
                self.quadrants[index] |= self.sides[index - by];
                self.quadrants[index - by] |= self.sides[index] << 2;
            }
        }
    }
}
