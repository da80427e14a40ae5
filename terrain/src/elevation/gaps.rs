//! Ground that no point tells of, inferred from what was seen around it.

use crate::plane::PlaneSums;
use crate::{Cell, CellRegion, GridGeometry, Knowledge, SurfaceCell, TerrainClass};

/// Slope that unseen ground may well have; it makes extrapolated heights uncertain [-].
const POSSIBLE_SLOPE: f64 = 0.3;

/// What neighbours suggest for a cell.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Inferred {
    /// The neighbours' mean in class and vegetation, their plane or mean in height.
    pub surface: SurfaceCell,
    /// The part of the height's variance that the neighbours themselves have, on average [m2].
    pub seen_m2: f32,
}

/// The surface that the known cells within `radius` along x and y suggest for `cell`, of those that are no higher than
/// `ceiling_m`; `None` without any.
///
/// The height is that of their plane of least squares where it determines the height here better than a
/// single cell would (leverage up to one), with the variance of its prediction. Otherwise it is their mean,
/// with the variance that an unknown slope adds over the distance to them. `datum_m` is any height nearby:
/// squares are taken relative to it.
pub(super) fn infer(
    surface: &[SurfaceCell],
    geometry: &GridGeometry,
    cell: Cell,
    radius: usize,
    [datum_m, ceiling_m]: [f32; 2],
) -> Option<Inferred> {
    let around = CellRegion::of_cell(cell).grown(radius, geometry);
    let mut sums = PlaneSums::default();
    let mut cover = CoverSums::default();
    let west = around.cols.start as f64 - cell.col as f64;
    for row in around.rows {
        let (dy, mut dx) = (row as f64 - cell.row as f64, west - 1.0);
        for neighbour in &surface[row * geometry.n_cols..][around.cols.clone()] {
            dx += 1.0;
            // Unknown ground is NaN and no lower than anything.
            if neighbour.height_m <= ceiling_m {
                sums.add(dx, dy, f64::from(neighbour.height_m - datum_m));
                cover.add(neighbour);
            }
        }
    }
    (sums.n() > 0).then(|| {
        let per_cell = 1.0 / sums.n() as f32;
        let seen_m2 = cover.variance_m2 * per_cell;
        let (rise_m, inferred_m2) = predict(&sums, geometry.resolution_m);
        let surface = SurfaceCell {
            height_m: datum_m + rise_m as f32,
            height_variance_m2: seen_m2 + inferred_m2 as f32,
            vegetation_height_m: cover.vegetation_m * per_cell,
            class_probability: cover.probability.map(|sum| sum * per_cell),
            knowledge: Knowledge::Interpolated,
        };
        Inferred { surface, seen_m2 }
    })
}

/// Sums over neighbours of all but the height.
#[derive(Default)]
struct CoverSums {
    variance_m2: f32,
    vegetation_m: f32,
    probability: [f32; TerrainClass::COUNT],
}

impl CoverSums {
    fn add(&mut self, cell: &SurfaceCell) {
        self.variance_m2 += cell.height_variance_m2;
        self.vegetation_m += cell.vegetation_height_m;
        for (sum, p) in self.probability.iter_mut().zip(&cell.class_probability) {
            *sum += p;
        }
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

    /// Marked are the cells with a known height.
    pub fn find(&mut self, surface: &[SurfaceCell], geometry: &GridGeometry, radius: usize) {
        let (n_rows, n_cols) = (geometry.n_rows, geometry.n_cols);
        for buffer in [&mut self.sides, &mut self.quadrants] {
            buffer.clear();
            buffer.resize(geometry.n_cells(), 0);
        }
        for row in 0..n_rows {
            let marked = &surface[row * n_cols..][..n_cols];
            let sides = &mut self.sides[row * n_cols..][..n_cols];
            for shift in 0..=radius.min(n_cols - 1) {
                for col in shift..n_cols {
                    sides[col] |= u8::from(marked[col - shift].is_known());
                    sides[col - shift] |= 2 * u8::from(marked[col].is_known());
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
