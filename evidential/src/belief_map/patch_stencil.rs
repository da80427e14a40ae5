//! Where a footprint's features lie relative to the cell under its rear axle.

use terrain::PatchShape;

use super::patch_ground::PatchGround;
use crate::FeatureLayout;

/// Four cells around a point and their bilinear weights.
#[derive(Clone, Copy, Debug)]
pub(super) struct Tap {
    /// South-west cell of the four: columns, rows from the base cell.
    offset: [i64; 2],
    /// South-west, south-east, north-west, north-east.
    pub weights: [f32; 4],
    /// [`PatchGround::delta`] of the same.
    pub deltas: [isize; 4],
}

/// A sample of the cover patch.
#[derive(Clone, Copy, Debug)]
pub(super) struct CoverTap {
    /// The height there, which may be unknown.
    pub height: Tap,
    /// The cell that holds the point: columns, rows from the base cell.
    nearest: [i64; 2],
    /// [`PatchGround::delta`] of the same.
    pub nearest_delta: isize,
}

/// Everything that [`FeatureLayout`] samples, for one yaw and one place within the base cell.
#[derive(Clone, Debug)]
pub(super) struct PatchStencil {
    pub wheels: [Tap; 4],
    pub heights: Vec<Tap>,
    pub cover: Vec<CoverTap>,
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
        let cover = |point: [f64; 2]| CoverTap {
            height: tap(point),
            nearest: point.map(|v| (v + EDGE).floor() as i64),
            nearest_delta: 0,
        };
        Self {
            wheels: layout.wheels.body_points_m().map(|point| tap(place(point))),
            heights: points(&layout.height_patch).into_iter().map(tap).collect(),
            cover: points(&layout.cover_patch).into_iter().map(cover).collect(),
        }
    }

    /// Finds its cells in the layers of the ground, for base cells like the given one.
    pub fn lay_on(&mut self, ground: &PatchGround, base: [i64; 2]) {
        let heights = self.wheels.iter_mut().chain(&mut self.heights);
        for tap in heights.chain(self.cover.iter_mut().map(|cover| &mut cover.height)) {
            let [east, north] = tap.offset;
            let corners = [[east, north], [east + 1, north], [east, north + 1], [east + 1, north + 1]];
            tap.deltas = corners.map(|corner| ground.delta(base, corner));
        }
        for cover in &mut self.cover {
            cover.nearest_delta = ground.delta(base, cover.nearest);
        }
    }

    /// Smallest and largest offset that it reads, each columns, rows.
    pub fn reach(&self) -> [[i64; 2]; 2] {
        let taps =
            self.wheels.iter().chain(&self.heights).chain(self.cover.iter().map(|cover| &cover.height));
        let [mut least, mut most] = [[0; 2]; 2];
        for tap in taps {
            least = [0, 1].map(|axis| tap.offset[axis].min(least[axis]));
            most = [0, 1].map(|axis| (tap.offset[axis] + 1).max(most[axis]));
        }
        // The cell that holds a point of the cover is one of the four around it.
        [least, most]
    }
}

/// A point within this share of a cell of an edge lies beyond it, so that rounding does not decide [cells].
const EDGE: f64 = 1e-6;

/// The four cells around a point that is given in cells from the base cell's corner.
fn tap(point: [f64; 2]) -> Tap {
    // Cell centres lie half a cell from the corner.
    let place = point.map(|v| v - 0.5);
    let [east, north] = place.map(|v| v - v.floor());
    let weights = [(1.0 - east) * (1.0 - north), east * (1.0 - north), (1.0 - east) * north, east * north];
    Tap {
        offset: place.map(|v| v.floor() as i64),
        weights: weights.map(|weight| weight as f32),
        deltas: [0; 4],
    }
}
