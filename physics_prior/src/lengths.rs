//! The vehicle as the prior sees it.

use bicycle::Geometry;
use terrain::{Footprint, WheelLayout};

use crate::PriorConfig;

/// Where the vehicle touches, covers and overhangs the ground.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Lengths {
    pub wheels: WheelLayout,
    /// Must not touch an obstacle.
    pub footprint: Footprint,
    /// Between the wheels, where the ground may not rise above the clearance: from axle to axle and half a
    /// wheel's radius beyond them, and as far short of the wheels' middle planes, about a tyre's half width.
    pub belly: Footprint,
    /// How far the ground under the belly may rise above the plane of the wheels' contacts [m].
    pub ground_clearance_m: f32,
    pub wheel_radius_m: f64,
    /// Radius of the ball that stands for a wheel where it touches the ground [m].
    pub envelope_radius_m: f64,
}

impl Lengths {
    pub fn new(geometry: &Geometry, prior: &PriorConfig) -> Self {
        let obstacle_margin_m = prior.obstacle_margin_m;
        Self {
            wheels: WheelLayout { wheelbase_m: geometry.wheelbase_m, track_m: geometry.track_m },
            footprint: Footprint {
                front_m: geometry.length_m - geometry.rear_overhang_m + obstacle_margin_m,
                rear_m: geometry.rear_overhang_m + obstacle_margin_m,
                half_width_m: 0.5 * geometry.width_m + obstacle_margin_m,
            },
            belly: Footprint {
                front_m: geometry.wheelbase_m + 0.5 * geometry.wheel_radius_m,
                rear_m: 0.5 * geometry.wheel_radius_m,
                half_width_m: (0.5 * (geometry.track_m - geometry.wheel_radius_m)).max(0.0),
            },
            ground_clearance_m: geometry.ground_clearance_m as f32,
            wheel_radius_m: geometry.wheel_radius_m,
            envelope_radius_m: prior.wheel_envelope * geometry.wheel_radius_m,
        }
    }

    /// From the rear axle's centre to the farthest point that it asks about [m].
    pub fn reach_m(&self) -> f64 {
        let Footprint { front_m, rear_m, half_width_m } = self.footprint;
        let of_body_m = libm::hypot(front_m.max(rear_m), half_width_m);
        of_body_m.max(libm::hypot(self.belly.front_m, self.wheels.track_m)) + self.envelope_radius_m
    }

    /// Longest straight line under the belly [m].
    pub fn belly_diagonal_m(&self) -> f64 {
        libm::hypot(self.belly.front_m + self.belly.rear_m, 2.0 * self.belly.half_width_m)
    }
}
