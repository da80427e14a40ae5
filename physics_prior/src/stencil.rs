//! What a vehicle touches and covers at one yaw, as offsets into the padded ground, so that a whole map of
//! poses costs additions only.

use terrain::{Footprint, WheelLayout};

use crate::cell_set::CellSpan;
use crate::ground_changes::Felt;
use crate::lengths::Lengths;
use crate::planes::Planes;

/// Four cells around a wheel's contact point and their bilinear weights.
#[derive(Clone, Copy, Debug)]
pub(crate) struct WheelTap {
    /// South-west cell of the four: columns, rows from the base cell.
    pub offset: [i64; 2],
    /// South-west, south-east, north-west, north-east.
    pub weights: [f32; 4],
    /// [`Planes::delta`] of the same.
    pub deltas: [isize; 4],
}

/// Adjacent cells of one row.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Span {
    /// Westmost cell: columns, rows from the base cell.
    pub start: [i64; 2],
    /// Number of cells.
    pub n_cells: usize,
    /// [`Planes::delta`] of the westmost cell and of the one after the last.
    pub deltas: [isize; 2],
}

/// Cells between the wheels, adjacent in one row.
#[derive(Clone, Debug)]
pub(crate) struct BellySpan {
    pub span: Span,
    /// Where the westmost cell's centre lies in the body frame: forward, left [m].
    pub start_m: [f32; 2],
    /// Adjacent cells, 2 to the power of this, two stretches of which cover the span.
    pub level: usize,
    /// [`Planes::delta`] of the first cells of these stretches.
    pub stretches: [isize; 2],
    /// [`Planes::delta`] of every cell.
    pub cells: Vec<isize>,
}

/// A pose relative to its base cell, the cell of the surface that holds the rear axle's centre.
#[derive(Clone, Debug)]
pub(crate) struct Stencil {
    /// Unit vector of the heading: east, north.
    pub heading: [f32; 2],
    /// Wheel order: front left, rear left, rear right, front right.
    pub wheels: [WheelTap; 4],
    /// Every cell that the footprint touches.
    pub footprint: Vec<Span>,
    /// Number of cells that the footprint touches.
    pub n_footprint_cells: u32,
    /// Every cell that the footprint touches at one of the headings that the stencil stands for.
    pub swept: Vec<Span>,
    /// Every cell whose centre lies under the belly.
    pub belly: Vec<BellySpan>,
    /// All of these.
    pub felt: Felt,
}

/// Smallest and largest offset, columns then rows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Reach {
    pub min: [i64; 2],
    pub max: [i64; 2],
}

impl Reach {
    /// The base cell alone.
    pub const BASE: Self = Self { min: [0; 2], max: [0; 2] };

    fn include(&mut self, offset: [i64; 2]) {
        self.min = std::array::from_fn(|axis| self.min[axis].min(offset[axis]));
        self.max = std::array::from_fn(|axis| self.max[axis].max(offset[axis]));
    }

    /// With a margin on every side.
    pub fn grown(self, margin: i64) -> Self {
        Self { min: self.min.map(|v| v - margin), max: self.max.map(|v| v + margin) }
    }

    /// Everything within either.
    pub fn union(mut self, other: Self) -> Self {
        self.include(other.min);
        self.include(other.max);
        self
    }
}

impl Stencil {
    /// The stencil for a rear axle's centre at `phase` (columns, rows in [0, 1)) of its base cell, and for headings
    /// that differ from `yaw_rad` by up to `half_bin_rad`.
    pub fn new(
        lengths: &Lengths,
        resolution_m: f64,
        phase: [f64; 2],
        (yaw_rad, half_bin_rad): (f64, f64),
    ) -> Self {
        let centre_m = phase.map(|share| share * resolution_m);
        let turned = (-SWEEP_STEPS..=SWEEP_STEPS).map(|step| {
            let off_rad = half_bin_rad * f64::from(step) / f64::from(SWEEP_STEPS);
            touched_spans(&lengths.footprint, centre_m, yaw_rad + off_rad, resolution_m)
        });
        let footprint = touched_spans(&lengths.footprint, centre_m, yaw_rad, resolution_m);
        let n_footprint_cells = footprint.iter().map(|span| span.n_cells as u32).sum();
        let (sine, cosine) = libm::sincos(yaw_rad);
        let wheels = wheel_taps(&lengths.wheels, centre_m, yaw_rad, resolution_m);
        let swept = union_of_rows(turned.flatten());
        let belly = belly_spans(&lengths.belly, centre_m, yaw_rad, resolution_m);
        let felt = Felt {
            wheels: wheels.iter().flat_map(|wheel| CellSpan::of_rows(wheel.corners())).collect(),
            belly: CellSpan::of_rows(belly.iter().flat_map(|belly| belly.span.ends())),
            // The footprint in the middle of the bin is one of those that are swept.
            footprint: CellSpan::of_rows(swept.iter().flat_map(Span::ends)),
        };
        let heading = [cosine as f32, sine as f32];
        Self { heading, wheels, footprint, n_footprint_cells, swept, belly, felt }
    }

    /// Finds its cells in the layers of the ground, for base cells like the given one.
    pub fn lay_on(&mut self, planes: &Planes, base: [i64; 2]) {
        self.felt.lay_on(planes, base);
        for wheel in &mut self.wheels {
            wheel.deltas = wheel.corners().map(|corner| planes.delta(base, corner));
        }
        for Span { start, n_cells, deltas } in self.footprint.iter_mut().chain(&mut self.swept) {
            let end = [start[0] + *n_cells as i64, start[1]];
            *deltas = [*start, end].map(|offset| planes.delta(base, offset));
        }
        for belly in &mut self.belly {
            let Span { start: [col, row], n_cells, .. } = belly.span;
            let cell = |k: usize| planes.delta(base, [col + k as i64, row]);
            belly.stretches = [cell(0), cell(n_cells - (1 << belly.level))];
            belly.cells = (0..n_cells).map(cell).collect();
        }
    }

    /// Which cells it reads.
    pub fn reach(&self) -> Reach {
        let mut reach = Reach::BASE;
        for tap in &self.wheels {
            reach.include(tap.offset);
            reach.include(tap.offset.map(|v| v + 1));
        }
        let belly = self.belly.iter().map(|belly| &belly.span);
        for span in self.footprint.iter().chain(&self.swept).chain(belly) {
            reach.include(span.start);
            reach.include([span.start[0] + span.n_cells as i64 - 1, span.start[1]]);
        }
        reach
    }
}

impl WheelTap {
    /// The four cells as offsets from the base cell, in the order of the weights.
    fn corners(&self) -> [[i64; 2]; 4] {
        let [east, north] = self.offset;
        [[east, north], [east + 1, north], [east, north + 1], [east + 1, north + 1]]
    }
}

impl Span {
    /// The first and the last cell.
    fn ends(&self) -> [[i64; 2]; 2] {
        let [west, row] = self.start;
        [[west, row], [west + self.n_cells as i64 - 1, row]]
    }
}

fn wheel_taps(wheels: &WheelLayout, centre_m: [f64; 2], yaw_rad: f64, resolution_m: f64) -> [WheelTap; 4] {
    wheels.contact_points_m(centre_m[0], centre_m[1], yaw_rad).map(|point_m| {
        // Cell centres lie half a cell from the base cell's corner.
        let place = point_m.map(|v| v / resolution_m - 0.5);
        let [east, north] = place.map(|v| v - v.floor());
        let weights =
            [(1.0 - east) * (1.0 - north), east * (1.0 - north), (1.0 - east) * north, east * north];
        let offset = place.map(|v| v.floor() as i64);
        WheelTap { offset, weights: weights.map(|w| w as f32), deltas: [0; 4] }
    })
}

/// Cells that share an area with the rectangle; touching at an edge only does not count.
fn touched_spans(footprint: &Footprint, centre_m: [f64; 2], yaw_rad: f64, resolution_m: f64) -> Vec<Span> {
    let corners =
        footprint.corners_m(centre_m[0], centre_m[1], yaw_rad).map(|corner| corner.map(|v| v / resolution_m));
    let fold = |pick: fn(f64, f64) -> f64| corners.iter().map(|c| c[1]).reduce(pick).unwrap_or_default();
    let (low, high) = (fold(f64::min), fold(f64::max));
    let rows = (low + EDGE).floor() as i64..=(high - EDGE).floor() as i64;
    let span = |row: i64| {
        let [west, east] = strip_extent(&corners, row as f64 + EDGE, row as f64 + 1.0 - EDGE)?;
        let start = (west + EDGE).floor() as i64;
        let n_cells = ((east - EDGE).floor() as i64 - start + 1).max(0) as usize;
        (n_cells > 0).then_some(Span { start: [start, row], n_cells, deltas: [0; 2] })
    };
    rows.filter_map(span).collect()
}

/// Headings to either side of a bin's middle at which a footprint is laid down to see what it sweeps.
const SWEEP_STEPS: i32 = 8;

/// One span a row, from the westmost to the eastmost cell of those that lie in it. Footprints about one point, turned
/// by little, overlap: there is no gap between them.
fn union_of_rows(spans: impl Iterator<Item = Span>) -> Vec<Span> {
    let mut rows = std::collections::BTreeMap::new();
    for Span { start: [west, row], n_cells, .. } in spans {
        let end = west + n_cells as i64;
        let extent = rows.entry(row).or_insert((west, end));
        *extent = (extent.0.min(west), extent.1.max(end));
    }
    let span = |(row, (west, end)): (i64, (i64, i64))| Span {
        start: [west, row],
        n_cells: (end - west) as usize,
        deltas: [0; 2],
    };
    rows.into_iter().map(span).collect()
}

/// Share of a cell that counts as nothing, so that rounding cannot add a row of cells.
const EDGE: f64 = 1e-6;

/// How far a convex polygon reaches west and east between two heights.
fn strip_extent(corners: &[[f64; 2]; 4], south: f64, north: f64) -> Option<[f64; 2]> {
    let mut extent = [f64::INFINITY, f64::NEG_INFINITY];
    let mut include = |x: f64| extent = [extent[0].min(x), extent[1].max(x)];
    for (k, &[x, y]) in corners.iter().enumerate() {
        let [next_x, next_y] = corners[(k + 1) % 4];
        if (south..=north).contains(&y) {
            include(x);
        }
        for level in [south, north] {
            if (y < level) != (next_y < level) {
                include(x + (next_x - x) * (level - y) / (next_y - y));
            }
        }
    }
    (extent[0] <= extent[1]).then_some(extent)
}

fn belly_spans(belly: &Footprint, centre_m: [f64; 2], yaw_rad: f64, resolution_m: f64) -> Vec<BellySpan> {
    let (sin, cos) = libm::sincos(yaw_rad);
    let body_m = |col: i64, row: i64| {
        let east_m = (col as f64 + 0.5) * resolution_m - centre_m[0];
        let north_m = (row as f64 + 0.5) * resolution_m - centre_m[1];
        [cos * east_m + sin * north_m, cos * north_m - sin * east_m]
    };
    let under = |col: i64, row: i64| {
        let [forward_m, left_m] = body_m(col, row);
        belly.contains(forward_m, left_m)
    };
    let mut spans = Vec::new();
    for touched in touched_spans(belly, centre_m, yaw_rad, resolution_m) {
        let [first, row] = touched.start;
        let cols = first..first + touched.n_cells as i64;
        let Some(start) = cols.clone().find(|&col| under(col, row)) else { continue };
        let n_cells = cols.filter(|&col| under(col, row)).count();
        let start_m = body_m(start, row).map(|v| v as f32);
        let span = Span { start: [start, row], n_cells, deltas: [0; 2] };
        let level = n_cells.ilog2() as usize;
        spans.push(BellySpan { span, start_m, level, stretches: [0; 2], cells: Vec::new() });
    }
    spans
}
