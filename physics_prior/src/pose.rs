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
    /// How far the ground between the wheels rises above the plane through the wheels' contacts [m].
    pub bump_m: f32,
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
    pub fn pose_ground(&self, counts: Counts, lengths: &Lengths) -> PoseGround {
        let wheels = self.wheels();
        let [east, north] = self.stencil.heading;
        let slope = |wheel: &Contact| {
            let [_, _, _, gradient_east, gradient_north, ..] = wheel.values;
            (gradient_east * east + gradient_north * north).abs()
        };
        let n_known = self.stencil.n_footprint_cells - counts.unknown;
        PoseGround {
            wheels,
            slopes: wheels.each_ref().map(slope),
            vegetation_share: counts.vegetation_255 as f32 / (255.0 * n_known.max(1) as f32),
            unknown_share: counts.unknown as f32 / self.stencil.n_footprint_cells as f32,
            bump_m: self.bump_m(&wheels, lengths),
        }
    }

    fn wheels(&self) -> [Contact; 4] {
        let contacts = self.ground.contacts();
        let n_cols = self.ground.window().n_cols;
        self.stencil.wheels.each_ref().map(|tap| {
            let south_west = self.index(tap.offset);
            let corners = [south_west, south_west + 1, south_west + n_cols, south_west + n_cols + 1];
            let mut values = [0.0; 8];
            for (corner, weight) in corners.into_iter().zip(tap.weights) {
                let corner = &contacts[corner].values;
                values.iter_mut().zip(corner).for_each(|(value, corner)| *value += weight * corner);
            }
            Contact { values }
        })
    }

    /// Highest ground under the belly above the plane that fits the four wheel contacts best.
    fn bump_m(&self, wheels: &[Contact; 4], lengths: &Lengths) -> f32 {
        let [front_left, rear_left, rear_right, front_right] =
            wheels.each_ref().map(|wheel| wheel.values[Contact::HEIGHT]);
        let (wheelbase_m, track_m) = (lengths.wheels.wheelbase_m as f32, lengths.wheels.track_m as f32);
        let rear_m = 0.5 * (rear_left + rear_right);
        let per_forward = (0.5 * (front_left + front_right) - rear_m) / wheelbase_m;
        let per_left = 0.5 * (front_left + rear_left - front_right - rear_right) / track_m;
        // The fitted plane passes the mean contact height half-way between the axles.
        let height_m = |[forward_m, left_m]: [f32; 2]| rear_m + per_forward * forward_m + per_left * left_m;
        let [cos, sin] = self.stencil.heading;
        let step_m = self.ground.window().resolution_m as f32 * (per_forward * cos - per_left * sin);
        let mut highest_m = f32::NEG_INFINITY;
        for BellySpan { span, start_m } in &self.stencil.belly {
            let start = self.index(span.start);
            let plane_m = height_m(*start_m);
            for (k, &ground_m) in self.ground.bumps_m()[start..start + span.n_cells].iter().enumerate() {
                let above_m = ground_m - (plane_m + k as f32 * step_m);
                highest_m = if above_m > highest_m { above_m } else { highest_m };
            }
        }
        highest_m
    }

    fn index(&self, offset: [i64; 2]) -> usize {
        self.ground.index([self.base[0] + offset[0], self.base[1] + offset[1]])
    }
}
