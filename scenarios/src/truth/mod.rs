//! The true traversability of a pose, by statics: how the vehicle stands there, and what slip it takes to move on.
//!
//! The plant's dynamics are the reference; this is its quasi-static limit, cheap enough to be asked a million times
//! for one map, as the upper bound that no learned or assumed traversability can beat.

mod field;
mod forces;
mod ground;
mod obstacles;
mod stand;
mod traction;

use std::sync::Arc;

use bicycle::Vehicle;

use crate::World;
pub use field::TruthField;
use ground::Ground;
use obstacles::ObstacleCount;
use stand::Statics;
use traction::Footing;

/// What the ground does to a vehicle at one pose.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Traversability {
    /// Achieved horizontal speed over the commanded one, driving forward at the vehicle's top speed, in [0, 1].
    pub linear_traction: f64,
    /// Achieved yaw rate over the commanded one, in [0, 1].
    pub angular_traction: f64,
    /// Roll, > 0 lifts the left side [rad].
    pub roll_rad: f64,
    /// Pitch, > 0 lowers the nose [rad].
    pub pitch_rad: f64,
    /// Whether the body or a wheel touches an obstacle or stands in water; traction is zero then.
    pub is_blocked: bool,
}

/// A vehicle on the true ground.
#[derive(Clone, Debug)]
pub struct Truth {
    world: Arc<World>,
    statics: Statics,
    ground: Ground,
    obstacles: ObstacleCount,
}

impl Truth {
    /// Puts a vehicle into a world. The vehicle is taken as validated.
    pub fn new(vehicle: &Vehicle, world: Arc<World>) -> Self {
        Self {
            statics: Statics::new(vehicle),
            ground: Ground::of(&world),
            obstacles: ObstacleCount::of(&world),
            world,
        }
    }

    /// Traversability with the rear axle's centre above (`x_m`, `y_m`).
    pub fn traversability(&self, x_m: f64, y_m: f64, yaw_rad: f64) -> Traversability {
        let stand = self.statics.stand(&self.ground, x_m, y_m, yaw_rad);
        let (pitch_rad, roll_rad) = (stand.pitch_rad(), stand.roll_rad());
        if self.obstacles.touches(&self.world, &self.statics.vehicle.geometry, [x_m, y_m, yaw_rad]) {
            let (linear_traction, angular_traction) = (0.0, 0.0);
            return Traversability {
                linear_traction,
                angular_traction,
                roll_rad,
                pitch_rad,
                is_blocked: true,
            };
        }
        let [linear_traction, angular_traction] = self.statics.traction(&Footing {
            stand: &stand,
            left_slope: self.left_slope(&stand, yaw_rad),
            patch: stand.contact_m.map(|[x_m, y_m]| self.world.patch(x_m, y_m)),
        });
        Traversability { linear_traction, angular_traction, roll_rad, pitch_rad, is_blocked: false }
    }

    /// Rise of the ground under the wheels across the heading, weighted by load [-].
    fn left_slope(&self, stand: &stand::Stand, yaw_rad: f64) -> f64 {
        let width_m = self.statics.vehicle.wheel.width_m;
        let (sin, cos) = yaw_rad.sin_cos();
        let step_m = [-sin * width_m, cos * width_m];
        let rise_m = |i: usize| {
            let [x_m, y_m] = stand.contact_m[i];
            let [right_m, left_m] =
                self.ground.run_m::<2>([x_m - 0.5 * step_m[0], y_m - 0.5 * step_m[1]], step_m);
            left_m - right_m
        };
        let load_n = stand.load_n;
        let rise_nm: f64 = (0..4).map(|i| load_n[i] * rise_m(i)).sum();
        rise_nm / (width_m * load_n.iter().sum::<f64>().max(f64::MIN_POSITIVE))
    }
}
