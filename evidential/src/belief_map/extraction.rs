//! From layers to features: the footprints of a row at one yaw read the same pattern of cells, each one further.

use super::patch_ground::{PatchGround, SPAN};
use super::patch_stencil::{PatchStencil, Tap};
use crate::predictor::FEATURE_MAX;

/// Footprints of one yaw whose base cells lie [`physics_prior::Ratio::stride`] apart in one row.
#[derive(Clone, Copy)]
pub(super) struct Line<'a> {
    pub stencil: &'a PatchStencil,
    /// Base cell of the first footprint, as lattice indices.
    pub base: [i64; 2],
    pub n_lanes: usize,
}

/// Features of the footprints of several lines, one lane each.
#[derive(Clone, Debug, Default)]
pub(super) struct Features {
    /// Shape [feature, lane].
    values: Vec<f32>,
    /// Footprints of which no wheel or no sample stands on known ground have no features: 1, else 0.
    pub ungrounded: Vec<f32>,
    /// Whether any wheel or sample of a footprint stands on unknown ground: 1, else 0.
    pub partly_unknown: Vec<f32>,
    n_lanes_max: usize,
}

impl Features {
    /// Makes room; nothing is kept. Features that lie far apart must not share their place in the cache, which
    /// multiples of a page would.
    pub fn reserve(&mut self, n_features: usize, n_lanes: usize) {
        self.n_lanes_max = n_lanes.next_multiple_of(2 * SPAN) + SPAN;
        self.values.resize(n_features * self.n_lanes_max, 0.0);
        self.ungrounded.resize(self.n_lanes_max, 0.0);
        self.partly_unknown.resize(self.n_lanes_max, 0.0);
    }

    /// One feature of adjacent footprints.
    #[inline(always)]
    pub fn lanes<const N: usize>(&self, feature: usize, first_lane: usize) -> Option<&[f32; N]> {
        self.values[feature * self.n_lanes_max + first_lane..].first_chunk()
    }

    /// Bytes of the buffers.
    pub fn n_bytes(&self) -> usize {
        size_of_val(&*self.values) + size_of_val(&*self.ungrounded) + size_of_val(&*self.partly_unknown)
    }
}

/// Extracts the features of a line from its first lane on. It writes whole [`SPAN`]s: lines must come in the order of
/// their lanes, so that the next one overwrites what was too much.
pub(super) struct Extract<'a> {
    pub ground: &'a PatchGround,
    pub line: Line<'a>,
    pub first_lane: usize,
    pub features: &'a mut Features,
}

impl pulp::WithSimd for Extract<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, _: S) {
        let Self { ground, line, first_lane, features } = self;
        for start in (0..line.n_lanes).step_by(SPAN) {
            let reader = Reader { ground, first: ground.index(line.base) + start };
            reader.extract(line.stencil, features, first_lane + start);
        }
    }
}

/// Reads one span of a line.
struct Reader<'a> {
    ground: &'a PatchGround,
    /// Position of the span's first base cell in the layers.
    first: usize,
}

type Span = [f32; SPAN];

/// Heights of a span, and where they are known: 1, else 0.
struct Heights {
    height_m: Span,
    known: Span,
}

/// What the heights of a span's footprints are relative to.
struct Reference {
    /// Mean height under the wheels on known ground.
    height_m: Span,
    /// Whether there is such a wheel: 1, else 0.
    grounded: Span,
    /// Wheels on unknown ground.
    n_missing: Span,
}

impl Reader<'_> {
    #[inline(always)]
    fn extract(&self, stencil: &PatchStencil, features: &mut Features, lane: usize) {
        let Reference { height_m: reference_m, grounded, mut n_missing } = self.reference(&stencil.wheels);
        let per_height_m = self.ground.per_height_m();
        let stride = features.n_lanes_max;
        let mut n_known = [0.0; SPAN];
        let mut rows = features.values.chunks_exact_mut(stride);
        let mut write = |values: &Span| {
            if let Some(row) = rows.next() {
                row[lane..lane + SPAN].copy_from_slice(values);
            }
        };
        for tap in &stencil.heights {
            let Heights { height_m, known } = self.heights(tap);
            let mut relative = [0.0; SPAN];
            for k in 0..SPAN {
                let scaled = ((height_m[k] - reference_m[k]) * per_height_m).clamp(-FEATURE_MAX, FEATURE_MAX);
                relative[k] = if known[k] * grounded[k] > 0.0 { scaled } else { 0.0 };
                n_known[k] += known[k];
                n_missing[k] += 1.0 - known[k];
            }
            write(&relative);
        }
        for tap in &stencil.cover {
            for layer in &self.ground.cover {
                write(self.span(layer, tap.nearest_delta));
            }
            let known = self.heights(&tap.height).known;
            let mut unknown = [0.0; SPAN];
            for k in 0..SPAN {
                unknown[k] = 1.0 - known[k] * grounded[k];
                n_known[k] += known[k];
                n_missing[k] += 1.0 - known[k];
            }
            write(&unknown);
        }
        let ungrounded = &mut features.ungrounded[lane..lane + SPAN];
        for k in 0..SPAN {
            ungrounded[k] = if n_known[k] * grounded[k] > 0.0 { 0.0 } else { 1.0 };
        }
        let partly_unknown = &mut features.partly_unknown[lane..lane + SPAN];
        for k in 0..SPAN {
            partly_unknown[k] = if n_missing[k] > 0.0 { 1.0 } else { 0.0 };
        }
    }

    #[inline(always)]
    fn reference(&self, wheels: &[Tap; 4]) -> Reference {
        let (mut sum_m, mut n_known) = ([0.0; SPAN], [0.0; SPAN]);
        for wheel in wheels {
            let Heights { height_m, known } = self.heights(wheel);
            for k in 0..SPAN {
                sum_m[k] += height_m[k] * known[k];
                n_known[k] += known[k];
            }
        }
        let (mut grounded, mut n_missing) = ([0.0; SPAN], [0.0; SPAN]);
        for k in 0..SPAN {
            grounded[k] = if n_known[k] > 0.0 { 1.0 } else { 0.0 };
            n_missing[k] = 4.0 - n_known[k];
            sum_m[k] /= n_known[k].max(1.0);
        }
        Reference { height_m: sum_m, grounded, n_missing }
    }

    /// Bilinear heights; unknown corners are left out and the others count more, unless less than half is known.
    #[inline(always)]
    fn heights(&self, tap: &Tap) -> Heights {
        let heights_m: [&Span; 4] = self.corners(&self.ground.heights_m, tap);
        let unknown: [&Span; 4] = self.corners(&self.ground.unknown, tap);
        let [a, b, c, d] = tap.weights;
        let (mut height_m, mut known) = ([0.0; SPAN], [0.0; SPAN]);
        for k in 0..SPAN {
            let sum_m = a * heights_m[0][k] + b * heights_m[1][k] + c * heights_m[2][k] + d * heights_m[3][k];
            let missing = a * unknown[0][k] + b * unknown[1][k] + c * unknown[2][k] + d * unknown[3][k];
            let is_known = 1.0 - missing >= 0.5;
            known[k] = if is_known { 1.0 } else { 0.0 };
            height_m[k] = if is_known { sum_m / (1.0 - missing) } else { 0.0 };
        }
        Heights { height_m, known }
    }

    #[inline(always)]
    fn corners<'a>(&self, layer: &'a [f32], tap: &Tap) -> [&'a Span; 4] {
        let [a, b, c, d] = tap.deltas;
        [self.span(layer, a), self.span(layer, b), self.span(layer, c), self.span(layer, d)]
    }

    #[inline(always)]
    fn span<'a>(&self, layer: &'a [f32], delta: isize) -> &'a Span {
        layer[self.first.wrapping_add_signed(delta)..].first_chunk().unwrap_or(&[0.0; SPAN])
    }
}
