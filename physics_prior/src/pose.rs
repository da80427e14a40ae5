//! What the ground under neighbouring poses of one yaw is like, one lane each.
//!
//! Here and in the equations, arithmetic stands in loops and not in `map`, whose closures the compiler would leave
//! without the instructions of the lanes.

use bicycle::lanes::{Lanes, Real};

use crate::ground::Contact;
use crate::lane_ground::{LaneGround, VEGETATION_SHARES};
use crate::lengths::Lengths;
use crate::planes::span;
use crate::stencil::{BellySpan, Span, Stencil, WheelTap};

/// The ground under a wheel.
#[derive(Clone, Copy)]
pub(crate) struct WheelGround<L: Lanes> {
    pub height_m: Real<L>,
    pub variance_m2: Real<L>,
    pub vegetation_m: Real<L>,
    /// Slope along the heading, signed [-].
    pub forward_slope: Real<L>,
    /// Slope to the left of the heading, signed [-].
    pub left_slope: Real<L>,
    /// Share of it that is unknown.
    pub unknown: Real<L>,
}

/// The ground under a vehicle at one pose.
pub(crate) struct PoseGround<L: Lanes> {
    /// Front left, rear left, rear right, front right.
    pub wheels: [WheelGround<L>; 4],
    /// As [`crate::BlockPrior::obstruction`].
    pub obstruction: Real<L>,
    /// Share of vegetation in the known part of the footprint.
    pub vegetation_share: Real<L>,
    /// Share of the footprint that is unknown.
    pub unknown_share: Real<L>,
    /// Slope along the heading, signed, the mean under the wheels [-].
    pub along: Real<L>,
    /// |slope| across the heading, the mean under the wheels: the axles hold together [-].
    pub across: Real<L>,
    /// How far the ground between the axles would reach into the body, 0 where it does not [m].
    pub belly_depth_m: Real<L>,
}

/// A stencil laid on the ground: the poses in a pack begin at `offset` of the span that begins at `first`, see
/// [`Lanes::of_span`].
pub(crate) struct Placed<'a, L: Lanes> {
    pub lanes: L,
    pub ground: &'a LaneGround,
    pub stencil: &'a Stencil,
    /// Position of the span's first base cell in the layers.
    pub first: usize,
    pub offset: usize,
}

impl<L: Lanes> Placed<'_, L> {
    /// As [`crate::BlockPrior::obstruction`].
    #[inline(always)]
    pub fn obstruction(&self) -> Real<L> {
        let one = self.lanes.real(1.0);
        let near = self.count(&self.stencil.swept, &self.ground.obstacles);
        let touched = self.count(&self.stencil.footprint, &self.ground.obstacles);
        near.min(one) + touched.min(one)
    }

    /// Everything that the prior wants to know.
    #[inline(always)]
    pub fn pose_ground(&self, lengths: &Lengths) -> PoseGround<L> {
        let taps = &self.stencil.wheels;
        let wheels = [self.wheel(&taps[0]), self.wheel(&taps[1]), self.wheel(&taps[2]), self.wheel(&taps[3])];
        let n_cells = self.lanes.real_single(self.stencil.n_footprint_cells as f32);
        let n_unknown = self.count(&self.stencil.footprint, &self.ground.unknown);
        let n_known = (n_cells - n_unknown).max(self.lanes.real(1.0));
        let per_known = self.lanes.real_single(VEGETATION_SHARES) * n_known;
        let left_slopes =
            wheels[0].left_slope + wheels[1].left_slope + wheels[2].left_slope + wheels[3].left_slope;
        let forward_slopes = wheels[0].forward_slope
            + wheels[1].forward_slope
            + wheels[2].forward_slope
            + wheels[3].forward_slope;
        PoseGround {
            wheels,
            obstruction: self.obstruction(),
            vegetation_share: self.count(&self.stencil.footprint, &self.ground.vegetation) / per_known,
            unknown_share: n_unknown / n_cells,
            along: self.lanes.real_single(0.25) * forward_slopes,
            across: (self.lanes.real_single(0.25) * left_slopes).abs(),
            belly_depth_m: self.belly_depth_m(&wheels, lengths),
        }
    }

    #[inline(always)]
    fn read(&self, layer: &[f32], delta: isize) -> Real<L> {
        self.lanes.real_of_span(span(layer, self.first, delta), self.offset)
    }

    /// Sum over some spans.
    #[inline(always)]
    fn count(&self, spans: &[Span], sums: &[f32]) -> Real<L> {
        let mut count = self.lanes.real(0.0);
        for [start, end] in spans.iter().map(|span| span.deltas) {
            count = count + (self.read(sums, end) - self.read(sums, start));
        }
        count
    }

    #[inline(always)]
    fn wheel(&self, tap: &WheelTap) -> WheelGround<L> {
        let [east, north] = self.stencil.heading;
        let (east, north) = (self.lanes.real_single(east), self.lanes.real_single(north));
        let rise_east = self.interpolated(Contact::GRADIENT_EAST, tap);
        let rise_north = self.interpolated(Contact::GRADIENT_NORTH, tap);
        WheelGround {
            height_m: self.interpolated(Contact::HEIGHT, tap),
            variance_m2: self.interpolated(Contact::VARIANCE, tap),
            vegetation_m: self.interpolated(Contact::VEGETATION, tap),
            forward_slope: rise_east * east + rise_north * north,
            left_slope: rise_north * east - rise_east * north,
            unknown: self.interpolated(Contact::UNKNOWN, tap),
        }
    }

    #[inline(always)]
    fn interpolated(&self, value: usize, tap: &WheelTap) -> Real<L> {
        let layer = &self.ground.contacts[value];
        let mut sum = self.lanes.real_single(tap.weights[0]) * self.read(layer, tap.deltas[0]);
        for corner in 1..4 {
            let weight = self.lanes.real_single(tap.weights[corner]);
            sum = sum + weight * self.read(layer, tap.deltas[corner]);
        }
        sum
    }

    /// Largest height of the ground under the belly above the plane that fits the four wheel contacts best,
    /// raised by the clearance; not less than 0. A wheel over unknown ground has no height that a plane could
    /// rest on: nothing is said of the belly there.
    #[inline(always)]
    fn belly_depth_m(&self, wheels: &[WheelGround<L>; 4], lengths: &Lengths) -> Real<L> {
        let (lanes, single) = (self.lanes, |value: f32| self.lanes.real_single(value));
        let (front_left_m, rear_left_m) = (wheels[0].height_m, wheels[1].height_m);
        let (rear_right_m, front_right_m) = (wheels[2].height_m, wheels[3].height_m);
        let half = lanes.real(0.5);
        let rear_m = half * (rear_left_m + rear_right_m);
        let per_wheelbase = single((1.0 / lengths.wheels.wheelbase_m) as f32);
        let per_forward = (half * (front_left_m + front_right_m) - rear_m) * per_wheelbase;
        let across_m = front_left_m + rear_left_m - front_right_m - rear_right_m;
        let per_left = across_m * single((0.5 / lengths.wheels.track_m) as f32);
        let (cos, sin) = (single(self.stencil.heading[0]), single(self.stencil.heading[1]));
        let resolution_m = single(self.ground.planes().window().resolution_m as f32);
        let step_m = resolution_m * (per_forward * cos - per_left * sin);
        let mut depth_m = lanes.real(0.0);
        for belly in &self.stencil.belly {
            let (forward_m, left_m) = (single(belly.start_m[0]), single(belly.start_m[1]));
            let plane_m = rear_m + per_forward * forward_m + per_left * left_m;
            let start_m = plane_m + single(lengths.ground_clearance_m);
            depth_m = self.deepest_m(belly, Line { start_m, step_m }, depth_m);
        }
        let unknown = wheels[0].unknown + wheels[1].unknown + wheels[2].unknown + wheels[3].unknown;
        lanes.real(0.0).or_else(lanes.real(0.0).less(unknown), depth_m)
    }

    /// The larger of `least_m` and what any cell of a span rises above a line along it.
    #[inline(always)]
    fn deepest_m(&self, belly: &BellySpan, line: Line<L>, least_m: Real<L>) -> Real<L> {
        let stretches_m = &self.ground.bumps_m[belly.level];
        let highest_m = self.read(stretches_m, belly.stretches[0]);
        let other_m = self.read(stretches_m, belly.stretches[1]);
        let last = self.lanes.real_single((belly.span.n_cells - 1) as f32);
        let end_m = line.start_m + last * line.step_m;
        // Most rows are settled by their highest cell.
        let rises = least_m.less(highest_m.max(other_m) - line.start_m.min(end_m));
        if !self.lanes.any(rises) {
            return least_m;
        }
        let mut deepest_m = least_m;
        for (k, &delta) in belly.cells.iter().enumerate() {
            let along_m = line.start_m + self.lanes.real_single(k as f32) * line.step_m;
            deepest_m = (self.read(&self.ground.bumps_m[0], delta) - along_m).max(deepest_m);
        }
        // A neighbour whose row was settled must not tell.
        deepest_m.or_else(rises, least_m)
    }
}

/// Heights along a span: at its westmost cell and from cell to cell [m].
#[derive(Clone, Copy)]
struct Line<L: Lanes> {
    start_m: Real<L>,
    step_m: Real<L>,
}
