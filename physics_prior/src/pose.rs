//! What the ground under one pose is like.

use crate::ground::{Contact, ContactGround, Counts};
use crate::lengths::Lengths;
use crate::stencil::{BellySpan, Span, Stencil};

/// The ground under a vehicle at one pose.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PoseGround {
    /// Interpolated ground under each wheel: front left, rear left, rear right, front right.
    pub wheels: [Contact; 4],
    /// |slope| along the heading under each wheel [-].
    pub slopes: [f32; 4],
    /// Share of vegetation in the known part of the footprint.
    pub vegetation_share: f32,
    /// Share of the footprint that is unknown.
    pub unknown_share: f32,
    /// How far the ground between the axles would reach into the body, 0 where it does not [m].
    pub belly_depth_m: f32,
}

/// A stencil laid on the ground at a base cell.
#[derive(Clone, Copy)]
pub(crate) struct Placed<'a> {
    pub ground: &'a ContactGround,
    pub stencil: &'a Stencil,
    /// Lattice indices of the base cell.
    pub base: [i64; 2],
}

impl Placed<'_> {
    /// Counts over every cell that the footprint touches.
    #[inline(always)]
    pub fn counts(&self) -> Counts {
        let [west, south] = self.ground.window().origin;
        let place = |span: &Span| {
            let row = self.base[1] + span.start[1] - south;
            let col = self.base[0] + span.start[0] - west;
            (row as usize, col as usize, span.n_cells)
        };
        self.ground.counts(self.stencil.footprint.iter().map(place))
    }

    /// Everything that the prior wants to know.
    #[inline(always)]
    pub fn pose_ground(&self, counts: Counts, lengths: &Lengths) -> PoseGround {
        let wheels = self.wheels();
        let [east, north] = self.stencil.heading;
        let mut slopes = [0.0; 4];
        for (slope, wheel) in slopes.iter_mut().zip(&wheels) {
            let gradient = &wheel.values;
            *slope =
                (gradient[Contact::GRADIENT_EAST] * east + gradient[Contact::GRADIENT_NORTH] * north).abs();
        }
        let n_known = self.stencil.n_footprint_cells - counts.unknown;
        PoseGround {
            wheels,
            slopes,
            vegetation_share: counts.vegetation_255 as f32 / (255.0 * n_known.max(1) as f32),
            unknown_share: counts.unknown as f32 / self.stencil.n_footprint_cells as f32,
            belly_depth_m: self.belly_depth_m(&wheels, lengths),
        }
    }

    #[inline(always)]
    fn wheels(&self) -> [Contact; 4] {
        let contacts = self.ground.contacts();
        let n_cols = self.ground.window().n_cols;
        let mut wheels = [Contact { values: [0.0; 8] }; 4];
        for (wheel, tap) in wheels.iter_mut().zip(&self.stencil.wheels) {
            let south_west = self.index(tap.offset);
            let (south, north) =
                (&contacts[south_west..south_west + 2], &contacts[south_west + n_cols..][..2]);
            let corners = [&south[0].values, &south[1].values, &north[0].values, &north[1].values];
            for k in 0..8 {
                wheel.values[k] = tap.weights[0] * corners[0][k]
                    + tap.weights[1] * corners[1][k]
                    + tap.weights[2] * corners[2][k]
                    + tap.weights[3] * corners[3][k];
            }
        }
        wheels
    }

    /// Largest height of the ground under the belly above the plane that fits the four wheel contacts best,
    /// raised by the clearance; not less than 0. A wheel over unknown ground has no height that a plane could
    /// rest on: nothing is said of the belly there.
    #[inline(always)]
    fn belly_depth_m(&self, wheels: &[Contact; 4], lengths: &Lengths) -> f32 {
        if wheels.iter().any(|wheel| wheel.values[Contact::UNKNOWN] > 0.0) {
            return 0.0;
        }
        let height_m = |wheel: usize| wheels[wheel].values[Contact::HEIGHT];
        let (front_left_m, rear_left_m, rear_right_m, front_right_m) =
            (height_m(0), height_m(1), height_m(2), height_m(3));
        let (wheelbase_m, track_m) = (lengths.wheels.wheelbase_m as f32, lengths.wheels.track_m as f32);
        let rear_m = 0.5 * (rear_left_m + rear_right_m);
        let per_forward = (0.5 * (front_left_m + front_right_m) - rear_m) / wheelbase_m;
        let per_left = 0.5 * (front_left_m + rear_left_m - front_right_m - rear_right_m) / track_m;
        let [cos, sin] = self.stencil.heading;
        let step_m = self.ground.window().resolution_m as f32 * (per_forward * cos - per_left * sin);
        let mut depth_m = 0.0;
        for BellySpan { span, start_m: [forward_m, left_m] } in &self.stencil.belly {
            let plane_m = rear_m + per_forward * forward_m + per_left * left_m;
            let belly = Line { start_m: plane_m + lengths.ground_clearance_m, step_m };
            depth_m = self.deepest_m(span, belly, depth_m);
        }
        depth_m
    }

    /// The larger of `least_m` and what any cell of a span rises above a line along it.
    #[inline(always)]
    fn deepest_m(&self, span: &Span, line: Line, least_m: f32) -> f32 {
        let start = self.index(span.start);
        let end_m = line.start_m + (span.n_cells - 1) as f32 * line.step_m;
        // Most rows are settled by their highest cell.
        if self.ground.highest_m(start, span.n_cells) - line.start_m.min(end_m) <= least_m {
            return least_m;
        }
        let mut deepest_m = least_m;
        for (k, bump_m) in self.ground.bumps_m()[start..start + span.n_cells].iter().enumerate() {
            let depth_m = bump_m - (line.start_m + k as f32 * line.step_m);
            deepest_m = if depth_m > deepest_m { depth_m } else { deepest_m };
        }
        deepest_m
    }

    #[inline(always)]
    fn index(&self, offset: [i64; 2]) -> usize {
        self.ground.index([self.base[0] + offset[0], self.base[1] + offset[1]])
    }
}

/// Heights along a span: at its westmost cell and from cell to cell [m].
#[derive(Clone, Copy)]
struct Line {
    start_m: f32,
    step_m: f32,
}
