//! Which axle of a vehicle slides first on a slope along its heading.

use serde::{Deserialize, Serialize};

use crate::Vehicle;

/// What a slope along the heading asks of the friction where an axle's part of the pull and its part of the weight come
/// apart: `share t / (1 - unloading t)` on a slope of tangent t [-].
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct AxleDemand {
    /// The axle's part of the pull over its part of the weight on level ground.
    pub share: f64,
    /// Its loss of weight over that weight, per tangent of the slope.
    pub unloading: f64,
}

impl AxleDemand {
    /// All wheels hold alike on every slope.
    pub const EVEN: Self = Self { share: 1.0, unloading: 0.0 };

    /// Friction that a slope of this tangent asks for; infinite where the axle is off the ground [-].
    pub fn friction(&self, tangent: f64) -> f64 {
        let left = 1.0 - self.unloading * tangent;
        if left > 0.0 { self.share * tangent / left } else { f64::INFINITY }
    }
}

/// Tangent of the slope on which axles are compared (20 degrees).
const COMPARED_SLOPE: f64 = 0.364;

impl Vehicle {
    /// The axle that slides first, climbing or going down.
    ///
    /// A slope of tangent t moves h / L t of the weight to the lower axle (Wong, Theory of Ground Vehicles, section 3.1),
    /// h being the height of the centre of gravity and L the wheelbase. Motors pull by the shares of the drivetrain,
    /// brakes by the weights at rest; differentials between the axles are left out, which help.
    pub fn axle_demand(&self) -> AxleDemand {
        let wheels_kg = 4.0 * self.wheel.mass_kg;
        let mass_kg = self.body.mass_kg + wheels_kg;
        let height_m =
            (self.body.mass_kg * self.body.cog_height_m + wheels_kg * self.geometry.wheel_radius_m) / mass_kg;
        let wheelbase_m = self.geometry.wheelbase_m;
        let ahead_m = (self.body.mass_kg * self.body.cog_ahead_m + 0.5 * wheels_kg * wheelbase_m) / mass_kg;
        let (front, rear) = (ahead_m / wheelbase_m, 1.0 - ahead_m / wheelbase_m);
        let moved = height_m / wheelbase_m;
        let rear_share = self.drivetrain.rear_share;
        let climbing_front = AxleDemand { share: (1.0 - rear_share) / front, unloading: moved / front };
        let climbing_rear = AxleDemand { share: rear_share / rear, unloading: -moved / rear };
        let braking_rear = AxleDemand { share: 1.0, unloading: moved / rear };
        [climbing_rear, braking_rear].into_iter().fold(climbing_front, |worst, axle| {
            if axle.friction(COMPARED_SLOPE) > worst.friction(COMPARED_SLOPE) { axle } else { worst }
        })
    }
}
