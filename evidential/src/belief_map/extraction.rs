//! From layers to features: the footprints of a row at one yaw read the same pattern of cells, each one further.
//!
//! Arithmetic stands in loops and not in `map`, whose closures the compiler would leave without the instructions.
//! Products and sums stay apart, so that every instruction set gives the same bits.

use bicycle::lanes::{Block, Lanes, OnLanes, Real, SPAN};
use physics_prior::span;

use super::patch_ground::PatchGround;
use super::patch_stencil::{PatchStencil, Point, Quad};
use crate::predictor::FEATURE_MAX;

/// Footprints of one yaw whose base cells lie [`physics_prior::ResolutionRatio::stride`] apart in one row.
#[derive(Clone, Copy)]
pub(super) struct Line<'a> {
    pub stencil: &'a PatchStencil,
    /// [`PatchStencil::reach`] of it or more.
    pub reach: [[i64; 2]; 2],
    /// Base cell of the first footprint, as lattice indices.
    pub base: [i64; 2],
    /// At most those of a block.
    pub n_lanes: usize,
}

/// What is known of the ground under the footprints of a block.
#[derive(Clone, Debug)]
pub(super) struct Grounding {
    /// Footprints of which no wheel or no sample stands on known ground have no features: 1, else 0.
    pub ungrounded: Block,
    /// Whether any wheel or sample of a footprint stands on unknown ground: 1, else 0.
    pub partly_unknown: Block,
}

impl Default for Grounding {
    fn default() -> Self {
        Self { ungrounded: Block::ZERO, partly_unknown: Block::ZERO }
    }
}

/// Extracts the features of a line from its first lane on. It writes whole spans: lines must come in the order of
/// their lanes, so that the next one overwrites what was too much.
pub(super) struct Extract<'a> {
    pub ground: &'a PatchGround,
    pub line: Line<'a>,
    pub first_lane: usize,
    /// Shape [feature].
    pub features: &'a mut [Block],
    pub grounding: &'a mut Grounding,
}

impl OnLanes for Extract<'_> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(mut self, lanes: L) {
        let n_spans = self.line.n_lanes.div_ceil(SPAN);
        // Spans without a hole below go together: what they share is read once.
        if n_spans == 3 && self.is_known(0, self.line.n_lanes) {
            return self.extract_known::<L, 3>(lanes, 0);
        }
        if n_spans == 2 && self.is_known(0, self.line.n_lanes) {
            return self.extract_known::<L, 2>(lanes, 0);
        }
        for start in (0..self.line.n_lanes).step_by(SPAN) {
            if self.is_known(start, SPAN.min(self.line.n_lanes - start)) {
                self.extract_known::<L, 1>(lanes, start);
            } else {
                self.extract_holed(lanes, start);
            }
        }
    }
}

impl Extract<'_> {
    /// Whether all the ground under some footprints is known.
    #[inline(always)]
    fn is_known(&self, start: usize, n_lanes: usize) -> bool {
        let [least, most] = self.line.reach;
        self.is_known_within(start, n_lanes, least, most)
    }

    #[inline(always)]
    fn is_known_within(&self, start: usize, n_lanes: usize, least: [i64; 2], most: [i64; 2]) -> bool {
        let [col, row] = self.line.base;
        let [first, last] = [start, start + n_lanes - 1].map(|lane| col + lane as i64 * self.ground.stride());
        self.ground.is_known([first + least[0], row + least[1]], [last + most[0], row + most[1]])
    }

    /// Features of `N` spans over ground that is all known.
    #[inline(always)]
    fn extract_known<L: Lanes, const N: usize>(&mut self, lanes: L, start: usize) {
        for offset in (0..SPAN).step_by(L::WIDTH) {
            let spans = Spans::<L, N> { lanes, first: self.first() + start, offset };
            let lane = self.first_lane + start;
            let mut sum_m = [lanes.real(0.0); N];
            for quad in &self.line.stencil.wheels {
                let corners = spans.corners(&self.ground.heights_m, quad);
                for n in 0..N {
                    let plane = Plane::through(corners[n]);
                    for point in &quad.points {
                        sum_m[n] = sum_m[n] + plane.at(lanes, point);
                    }
                }
            }
            let mut reference_m = sum_m;
            for reference_m in &mut reference_m {
                *reference_m = *reference_m * lanes.real(0.25);
            }
            let scale = Scale { per_height_m: lanes.real_single(self.ground.per_height_m()) };
            for quad in &self.line.stencil.heights {
                let corners = spans.corners(&self.ground.heights_m, quad);
                let mut planes = [Plane::level(lanes); N];
                for ((plane, corners), reference_m) in planes.iter_mut().zip(corners).zip(reference_m) {
                    *plane = Plane::through(scale.relative(corners, reference_m));
                }
                for point in &quad.points {
                    for (n, plane) in planes.iter().enumerate() {
                        let height = limited(lanes, plane.at(lanes, point));
                        write(&mut self.features[point.index], height, lane + n * SPAN, offset);
                    }
                }
            }
            spans.copy_cover(self, lane);
            for index in 0..self.line.stencil.nearest.len() {
                let unknown = self.line.stencil.n_heights + 4 * index + 3;
                for n in 0..N {
                    write(&mut self.features[unknown], lanes.real(0.0), lane + n * SPAN, offset);
                }
            }
            for n in 0..N {
                for flags in [&mut self.grounding.ungrounded, &mut self.grounding.partly_unknown] {
                    write(flags, lanes.real(0.0), lane + n * SPAN, offset);
                }
            }
        }
    }

    /// Position of the line's first base cell in the layers.
    #[inline(always)]
    fn first(&self) -> usize {
        self.ground.planes().index(self.line.base)
    }

    /// Features of a span over ground with holes. A footprint over none of them gets what
    /// [`Extract::extract_known`] gives it, bit by bit.
    #[inline(always)]
    fn extract_holed<L: Lanes>(&mut self, lanes: L, start: usize) {
        let lane = self.first_lane + start;
        for offset in (0..SPAN).step_by(L::WIDTH) {
            let spans = Spans::<L, 1> { lanes, first: self.first() + start, offset };
            let (zero, one) = (lanes.real(0.0), lanes.real(1.0));
            let mut tally = Tally { n_known: zero, n_missing: zero };
            let reference = self.reference(&spans, start, &mut tally);
            let scale = Scale { per_height_m: lanes.real_single(self.ground.per_height_m()) };
            for quad in &self.line.stencil.heights {
                let [corners] = spans.corners(&self.ground.heights_m, quad);
                let plane = Plane::through(scale.relative(corners, reference.height_m));
                let holes = self.holes(&spans, quad, start);
                for point in &quad.points {
                    let sample = Sample::of(lanes, point, &corners, holes.as_ref());
                    let relative = (sample.height_m - reference.height_m) * scale.per_height_m;
                    let whole = plane.at(lanes, point);
                    let height = limited(lanes, relative.or_else(zero.less(sample.missing), whole));
                    let counts = sample.known * reference.grounded;
                    let height = height.or_else(zero.less(counts), zero);
                    write(&mut self.features[point.index], height, lane, offset);
                    tally.add(&sample, one);
                }
            }
            spans.copy_cover(self, lane);
            for quad in &self.line.stencil.cover {
                let [corners] = spans.corners(&self.ground.heights_m, quad);
                let holes = self.holes(&spans, quad, start);
                for point in &quad.points {
                    let sample = Sample::of(lanes, point, &corners, holes.as_ref());
                    let unknown = one - sample.known * reference.grounded;
                    let feature = self.line.stencil.n_heights + 4 * point.index + 3;
                    write(&mut self.features[feature], unknown, lane, offset);
                    tally.add(&sample, one);
                }
            }
            let is_grounded = zero.less(tally.n_known * reference.grounded);
            write(&mut self.grounding.ungrounded, zero.or_else(is_grounded, one), lane, offset);
            let misses = zero.less(tally.n_missing);
            write(&mut self.grounding.partly_unknown, one.or_else(misses, zero), lane, offset);
        }
    }

    /// What the heights of a span over holes are relative to.
    #[inline(always)]
    fn reference<L: Lanes>(&self, spans: &Spans<L, 1>, start: usize, tally: &mut Tally<L>) -> Reference<L> {
        let lanes = spans.lanes;
        let (zero, one) = (lanes.real(0.0), lanes.real(1.0));
        let (mut sum_m, mut n_known) = (zero, zero);
        for quad in &self.line.stencil.wheels {
            let [corners] = spans.corners(&self.ground.heights_m, quad);
            let holes = self.holes(spans, quad, start);
            for point in &quad.points {
                let sample = Sample::of(lanes, point, &corners, holes.as_ref());
                let whole_m = Plane::through(corners).at(lanes, point);
                let height_m = sample.height_m.or_else(zero.less(sample.missing), whole_m);
                sum_m = sum_m + height_m * sample.known;
                n_known = n_known + sample.known;
                tally.n_missing = tally.n_missing + (one - sample.known);
            }
        }
        let grounded = one.or_else(zero.less(n_known), zero);
        Reference { height_m: sum_m / n_known.max(one), grounded }
    }

    /// Where the corners of a quad are unknown, 1, else 0; `None` if they are all known.
    #[inline(always)]
    fn holes<L: Lanes>(&self, spans: &Spans<L, 1>, quad: &Quad, start: usize) -> Option<[Real<L>; 4]> {
        // The lanes beyond the last one mean nothing.
        let n_lanes = SPAN.min(self.line.n_lanes - start);
        let is_known = self.is_known_within(start, n_lanes, quad.offset, quad.offset.map(|v| v + 1));
        if is_known {
            return None;
        }
        let [holes] = spans.corners(&self.ground.unknown, quad);
        Some(holes)
    }
}

/// Packs of `N` adjacent spans, each from the same offset on.
struct Spans<L: Lanes, const N: usize> {
    lanes: L,
    /// Position of the first span's base cell in the layers.
    first: usize,
    offset: usize,
}

impl<L: Lanes, const N: usize> Spans<L, N> {
    #[inline(always)]
    fn read(&self, layer: &[f32], delta: isize, n: usize) -> Real<L> {
        self.lanes.real_of_span(span(layer, self.first + n * SPAN, delta), self.offset)
    }

    #[inline(always)]
    fn corners(&self, layer: &[f32], quad: &Quad) -> [[Real<L>; 4]; N] {
        let mut corners = [[self.lanes.real(0.0); 4]; N];
        for (n, corners) in corners.iter_mut().enumerate() {
            for (corner, delta) in corners.iter_mut().zip(quad.deltas) {
                *corner = self.read(layer, delta, n);
            }
        }
        corners
    }

    /// The features of the cover that are not interpolated.
    #[inline(always)]
    fn copy_cover(&self, extract: &mut Extract<'_>, lane: usize) {
        for (index, nearest) in extract.line.stencil.nearest.iter().enumerate() {
            for (layer, values) in extract.ground.cover.iter().enumerate() {
                let feature = extract.line.stencil.n_heights + 4 * index + layer;
                for n in 0..N {
                    let value = self.read(values, nearest.delta, n);
                    write(&mut extract.features[feature], value, lane + n * SPAN, self.offset);
                }
            }
        }
    }
}

#[inline(always)]
fn write<L: Lanes>(block: &mut Block, value: Real<L>, first_lane: usize, offset: usize) {
    if let Some(span) = block.span_mut(first_lane) {
        value.0.to_span(value.1, span, offset);
    }
}

#[inline(always)]
fn limited<L: Lanes>(lanes: L, feature: Real<L>) -> Real<L> {
    feature.clamp(lanes.real_single(-FEATURE_MAX), lanes.real_single(FEATURE_MAX))
}

/// From heights to features.
#[derive(Clone, Copy)]
struct Scale<L: Lanes> {
    per_height_m: Real<L>,
}

impl<L: Lanes> Scale<L> {
    #[inline(always)]
    fn relative(&self, mut heights_m: [Real<L>; 4], reference_m: Real<L>) -> [Real<L>; 4] {
        for height_m in &mut heights_m {
            *height_m = (*height_m - reference_m) * self.per_height_m;
        }
        heights_m
    }
}

/// The bilinear surface between four corners.
#[derive(Clone, Copy)]
struct Plane<L: Lanes> {
    south_west: Real<L>,
    per_east: Real<L>,
    per_north: Real<L>,
    twist: Real<L>,
}

impl<L: Lanes> Plane<L> {
    #[inline(always)]
    fn level(lanes: L) -> Self {
        let zero = lanes.real(0.0);
        Self { south_west: zero, per_east: zero, per_north: zero, twist: zero }
    }

    #[inline(always)]
    fn through([south_west, south_east, north_west, north_east]: [Real<L>; 4]) -> Self {
        let per_east = south_east - south_west;
        Self {
            south_west,
            per_east,
            per_north: north_west - south_west,
            twist: (north_east - north_west) - per_east,
        }
    }

    #[inline(always)]
    fn at(&self, lanes: L, point: &Point) -> Real<L> {
        let (east, north) = (lanes.real_single(point.place[0]), lanes.real_single(point.place[1]));
        let per_north = self.per_north + east * self.twist;
        (self.south_west + east * self.per_east) + north * per_north
    }
}

/// What the heights of a span's footprints are relative to.
struct Reference<L: Lanes> {
    /// Mean height under the wheels on known ground.
    height_m: Real<L>,
    /// Whether there is such a wheel: 1, else 0.
    grounded: Real<L>,
}

/// Samples on known and wheels and samples on unknown ground.
struct Tally<L: Lanes> {
    n_known: Real<L>,
    n_missing: Real<L>,
}

impl<L: Lanes> Tally<L> {
    #[inline(always)]
    fn add(&mut self, sample: &Sample<L>, one: Real<L>) {
        self.n_known = self.n_known + sample.known;
        self.n_missing = self.n_missing + (one - sample.known);
    }
}

/// A height between corners that may be unknown.
struct Sample<L: Lanes> {
    /// Of the known corners, which count more for those that are missing; means nothing where none is missing.
    height_m: Real<L>,
    /// Weight of the unknown corners.
    missing: Real<L>,
    /// 1 unless more than half is missing, else 0.
    known: Real<L>,
}

impl<L: Lanes> Sample<L> {
    #[inline(always)]
    fn of(lanes: L, point: &Point, corners_m: &[Real<L>; 4], holes: Option<&[Real<L>; 4]>) -> Self {
        let (zero, one) = (lanes.real(0.0), lanes.real(1.0));
        let Some(holes) = holes else { return Self { height_m: zero, missing: zero, known: one } };
        let (mut sum_m, mut missing) = (zero, zero);
        for corner in 0..4 {
            let weight = lanes.real_single(point.weights[corner]);
            sum_m = sum_m + weight * corners_m[corner];
            missing = missing + weight * holes[corner];
        }
        let rest = one - missing;
        let is_unknown = rest.less(lanes.real(0.5));
        Self {
            height_m: zero.or_else(is_unknown, sum_m / rest),
            missing,
            known: zero.or_else(is_unknown, one),
        }
    }
}

#[cfg(test)]
mod tests {
    use bicycle::Geometry;
    use bicycle::lanes::{BLOCK, Instructions};
    use physics_prior::ResolutionRatio;
    use terrain::{Cell, GridGeometry, GridMap, SurfaceCell, TerrainClass};

    use super::*;
    use crate::FeatureLayout;

    const CAR: Geometry = Geometry {
        wheelbase_m: 0.26,
        track_m: 0.2,
        length_m: 0.33,
        width_m: 0.25,
        rear_overhang_m: 0.035,
        ground_clearance_m: 0.04,
        wheel_radius_m: 0.075,
    };
    const WINDOW: GridGeometry = GridGeometry { resolution_m: 0.1, origin: [0, 0], n_rows: 20, n_cols: 70 };
    const BASE: [i64; 2] = [8, 9];

    const HOLE: Cell = Cell { row: 10, col: 30 };

    fn stencil(layout: &FeatureLayout) -> PatchStencil {
        PatchStencil::new(layout, 0.1, [0.5, 0.5], 0.7)
    }

    /// Whether the footprint of a lane reads the hole.
    fn is_touched(stencil: &PatchStencil, lane: usize) -> bool {
        let [least, most] = stencil.reach();
        let hole = [HOLE.col, HOLE.row].map(|place| place as i64);
        let base = [BASE[0] + lane as i64, BASE[1]];
        (0..2).all(|axis| (base[axis] + least[axis]..=base[axis] + most[axis]).contains(&hole[axis]))
    }

    /// Features of a whole block of footprints over rough ground with some holes.
    fn features(holes: &[Cell], instructions: Instructions) -> Vec<Block> {
        let cell = |index: usize| {
            let Cell { row, col } = WINDOW.cell(index);
            let height_m = 0.02 * ((row * 7 + col * 13) % 11) as f32;
            let is_hole = holes.contains(&Cell { row, col });
            if is_hole {
                SurfaceCell::UNKNOWN
            } else {
                SurfaceCell::certain(height_m, TerrainClass::Open, 0.0)
            }
        };
        let values = (0..WINDOW.n_cells()).map(cell).collect();
        #[allow(clippy::unwrap_used, reason = "a panic is how a test fails")]
        let (surface, ratio) =
            (GridMap::from_values(WINDOW, values).unwrap(), ResolutionRatio::new(0.1, 0.1).unwrap());
        let layout = FeatureLayout::for_vehicle(&CAR);
        let mut stencil = stencil(&layout);
        let mut ground = PatchGround::unknown(WINDOW, ratio, layout.height_scale_m, stencil.felt.iter());
        ground.read(&surface);
        stencil.lay_on(ground.planes(), BASE);
        let mut features = vec![Block::ZERO; layout.n_features()];
        let mut grounding = Grounding::default();
        instructions.run_on_lanes(Extract {
            ground: &ground,
            line: Line { stencil: &stencil, reach: stencil.reach(), base: BASE, n_lanes: BLOCK },
            first_lane: 0,
            features: &mut features,
            grounding: &mut grounding,
        });
        features
    }

    #[test]
    fn a_hole_below_one_footprint_changes_no_bit_of_the_others() {
        let stencil = stencil(&FeatureLayout::for_vehicle(&CAR));
        let untouched: Vec<usize> = (0..BLOCK).filter(|&lane| !is_touched(&stencil, lane)).collect();
        assert!((30..BLOCK - 3).contains(&untouched.len()), "{untouched:?}");
        for instructions in Instructions::all() {
            let whole = features(&[], instructions);
            let holed = features(&[HOLE], instructions);
            let is_same = |lane: usize| {
                holed
                    .iter()
                    .zip(&whole)
                    .all(|(found, expected)| found.0[lane].to_bits() == expected.0[lane].to_bits())
            };
            assert!(untouched.iter().all(|&lane| is_same(lane)), "{instructions:?}");
            assert!((0..BLOCK).any(|lane| !is_same(lane)), "{instructions:?}: the hole is seen");
        }
    }
}
