//! Where a footprint's features lie relative to the cell under its rear axle.

use physics_prior::{CellSpan, Planes};
use terrain::PatchShape;

use crate::FeatureLayout;

/// Four cells around some points.
#[derive(Clone, Debug)]
pub(super) struct Quad {
    /// South-west cell of the four: columns, rows from the base cell.
    pub offset: [i64; 2],
    /// [`Planes::delta`] of the south-west, south-east, north-west and north-east cell.
    pub deltas: [isize; 4],
    pub points: Vec<Point>,
}

/// A point between the centres of four cells.
#[derive(Clone, Copy, Debug)]
pub(super) struct Point {
    /// Which one it is of those that were asked for.
    pub index: usize,
    /// How far east and north of the south-west cell's centre it lies [cells].
    pub place: [f32; 2],
    /// Bilinear weights: south-west, south-east, north-west, north-east.
    pub weights: [f32; 4],
}

/// The cell that holds a point.
#[derive(Clone, Copy, Debug)]
pub(super) struct Nearest {
    /// Columns, rows from the base cell.
    offset: [i64; 2],
    /// [`Planes::delta`] of the same.
    pub delta: isize,
}

/// Everything that [`FeatureLayout`] samples, for one yaw and one place within the base cell.
#[derive(Clone, Debug)]
pub(super) struct PatchStencil {
    pub wheels: Vec<Quad>,
    /// Points of the fine patch.
    pub heights: Vec<Quad>,
    /// Points of the cover patch, where the height may be unknown.
    pub cover: Vec<Quad>,
    /// The same points, for what is not interpolated.
    pub nearest: Vec<Nearest>,
    pub n_heights: usize,
    /// Every cell that any of these reads.
    pub felt: Vec<CellSpan>,
}

impl PatchStencil {
    /// The stencil for a rear axle's centre at `phase` (columns, rows in [0, 1)) of its base cell.
    pub fn new(layout: &FeatureLayout, resolution_m: f64, phase: [f64; 2], yaw_rad: f64) -> Self {
        let (sin, cos) = libm::sincos(yaw_rad);
        let place = |[forward_m, left_m]: [f64; 2]| {
            let turned_m = [cos * forward_m - sin * left_m, sin * forward_m + cos * left_m];
            [0, 1].map(|axis| phase[axis] + turned_m[axis] / resolution_m)
        };
        let points = |shape: &PatchShape| -> Vec<[f64; 2]> {
            let cols = 0..shape.n_cols;
            let rows = (0..shape.n_rows).flat_map(|row| cols.clone().map(move |col| (row, col)));
            rows.map(|(row, col)| place(shape.body_point_m(row, col))).collect()
        };
        let cover = points(&layout.cover_patch);
        let nearest =
            |point: &[f64; 2]| Nearest { offset: point.map(|v| (v + EDGE).floor() as i64), delta: 0 };
        let wheels = quads(&layout.wheels.body_points_m().map(place));
        let heights = quads(&points(&layout.height_patch));
        let nearest = cover.iter().map(nearest).collect();
        let cover = quads(&cover);
        // The cell that holds a point of the cover is one of the four around it.
        let felt =
            CellSpan::of_rows(wheels.iter().chain(&heights).chain(&cover).flat_map(|quad| quad.corners()));
        Self { wheels, heights, cover, nearest, n_heights: layout.height_patch.n_samples(), felt }
    }

    /// Finds its cells in the layers of the ground, for base cells like the given one.
    pub fn lay_on(&mut self, planes: &Planes, base: [i64; 2]) {
        for quad in self.wheels.iter_mut().chain(&mut self.heights).chain(&mut self.cover) {
            quad.deltas = quad.corners().map(|corner| planes.delta(base, corner));
        }
        self.felt.iter_mut().for_each(|span| span.lay_on(planes, base));
        for nearest in &mut self.nearest {
            nearest.delta = planes.delta(base, nearest.offset);
        }
    }

    /// Smallest and largest offset that it reads, each columns, rows.
    pub fn reach(&self) -> [[i64; 2]; 2] {
        let [mut least, mut most] = [[0; 2]; 2];
        for quad in self.wheels.iter().chain(&self.heights).chain(&self.cover) {
            least = [0, 1].map(|axis| quad.offset[axis].min(least[axis]));
            most = [0, 1].map(|axis| (quad.offset[axis] + 1).max(most[axis]));
        }
        // The cell that holds a point of the cover is one of the four around it.
        [least, most]
    }
}

impl Quad {
    /// Its cells as offsets from the base cell, in the order of the weights.
    fn corners(&self) -> [[i64; 2]; 4] {
        let [east, north] = self.offset;
        [[east, north], [east + 1, north], [east, north + 1], [east + 1, north + 1]]
    }
}

/// A point within this share of a cell of an edge lies beyond it, so that rounding does not decide [cells].
const EDGE: f64 = 1e-6;

/// Points, given in cells from the base cell's corner, by the four cells around them.
fn quads(points: &[[f64; 2]]) -> Vec<Quad> {
    let mut quads: Vec<Quad> = Vec::new();
    for (index, point) in points.iter().enumerate() {
        // Cell centres lie half a cell from the corner.
        let from_centre = point.map(|v| v - 0.5);
        let offset = from_centre.map(|v| v.floor() as i64);
        let [east, north] = from_centre.map(|v| v - v.floor());
        let weights =
            [(1.0 - east) * (1.0 - north), east * (1.0 - north), (1.0 - east) * north, east * north];
        let place = [east, north].map(|v| v as f32);
        let point = Point { index, place, weights: weights.map(|weight| weight as f32) };
        match quads.iter_mut().find(|quad| quad.offset == offset) {
            Some(quad) => quad.points.push(point),
            None => quads.push(Quad { offset, deltas: [0; 4], points: vec![point] }),
        }
    }
    quads
}
