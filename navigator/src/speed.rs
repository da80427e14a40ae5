//! How fast the ground may be driven over, of a vehicle that is fast for its size.

use bicycle::{MotionLimits, Vehicle};
use serde::{Deserialize, Serialize};
use traversability::SpeedLaw;

const GRAVITY_MPS2: f64 = 9.806_65;

/// Square of the speed over gravity and wheelbase (the Froude number) up to which a vehicle meets the ground as if it
/// stood [-]: for a wheelbase of 2.5 m, up to 1.1 m/s.
const QUASI_STATIC: f64 = 0.05;

/// Seconds that a step at twice the fastest speed that its cell allows costs a plan, as a step beyond the limits of
/// attitude does.
pub(crate) const OVERSPEED_S: f64 = 20.0;

/// What of a vehicle decides how fast it may be over uneven ground, see [`SpeedLaw`].
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SpeedConfig {
    /// Angular acceleration with which weight alone turns the body back whose wheels have left the ground on one side, or
    /// at one end [rad/s2].
    pub righting_radps2: [f64; 2],
    /// What is no slower than this is driven over as if it stood [m/s].
    pub least_mps: f64,
}

/// Any ground at any speed.
impl Default for SpeedConfig {
    fn default() -> Self {
        Self { righting_radps2: [1.0; 2], least_mps: 1e3 }
    }
}

impl SpeedConfig {
    /// Of a vehicle.
    pub fn of(vehicle: &Vehicle) -> Self {
        let least_mps = libm::sqrt(QUASI_STATIC * GRAVITY_MPS2 * vehicle.geometry.wheelbase_m);
        Self { righting_radps2: vehicle.righting_radps2(), least_mps }
    }

    /// The law for these limits, for a controller that looks at the ground every `step_s`; `None` for who is nowhere fast
    /// enough.
    pub(crate) fn law(&self, limits: &MotionLimits, step_s: f64) -> Option<SpeedLaw> {
        (limits.high[0] > self.least_mps).then(|| SpeedLaw {
            righting_radps2: self.righting_radps2.map(|value| value as f32),
            most_rad: [limits.roll_max_rad as f32, limits.pitch_max_rad as f32],
            least_mps: self.least_mps as f32,
            most_mps: limits.high[0] as f32,
            // What lies between two looks is seen by one of them.
            reach_m: 0.5 * limits.high[0] * step_s,
        })
    }

    pub(crate) fn first_invalid(&self) -> Option<(&'static str, f64)> {
        let [roll, pitch] = self.righting_radps2;
        let all = [
            ("speed.righting_radps2", roll),
            ("speed.righting_radps2", pitch),
            ("speed.least_mps", self.least_mps),
        ];
        all.into_iter().find(|(_, value)| !(value.is_finite() && *value > 0.0))
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a panic is how a test fails")]

    use super::*;
    use crate::Config;

    /// A point mass on the ground, a arms' length from the wheels that it turns about, falls as a stone does: g / a. One as
    /// high as it is far from them falls half as fast, since it is sqrt(2) times as far away and its weight pulls at 45
    /// degrees. Two wheels of half its mass each, at twice the arm, fall beside it with (m a + m 2 a) g over
    /// m a^2 + m (2 a)^2: 3/5 g / a.
    #[test]
    fn weight_turns_a_body_back_as_it_falls() {
        let mut vehicle = formats::read_vehicle("buggy_fifth").unwrap();
        let geometry = &mut vehicle.geometry;
        (geometry.track_m, geometry.wheelbase_m, vehicle.wheel.mass_kg) = (0.8, 1.4, 0.0);
        let body = &mut vehicle.body;
        (body.inertia_kgm2, body.cog_height_m, body.cog_ahead_m) = ([0.0; 3], 0.0, 0.5);
        let close =
            |found: f64, expected: f64| assert!((found / expected - 1.0).abs() < 1e-12, "{found} {expected}");
        let [side, end] = vehicle.righting_radps2();
        close(side, GRAVITY_MPS2 / 0.4);
        // Over the front axle, from which it is farther.
        close(end, GRAVITY_MPS2 / 0.9);
        vehicle.body.cog_height_m = 0.4;
        close(vehicle.righting_radps2()[0], 0.5 * GRAVITY_MPS2 / 0.4);
        (vehicle.body.cog_height_m, vehicle.wheel.mass_kg) = (0.0, 0.5 * vehicle.body.mass_kg);
        close(vehicle.righting_radps2()[0], 0.6 * GRAVITY_MPS2 / 0.4);
    }

    /// The Froude number of 1 m/s over 2.5 m is 0.041, of 1.2 m/s 0.059.
    #[test]
    fn who_is_slow_for_its_size_meets_the_ground_as_if_it_stood() {
        let mut vehicle = formats::read_vehicle("pietra_full_size").unwrap();
        for (speed_mps, is_fast) in [(1.0, false), (1.2, true)] {
            vehicle.limits.speed_max_mps = speed_mps;
            let config = Config::for_vehicle(&vehicle);
            let law = config.speed.law(&(&vehicle.limits).into(), 0.1);
            assert_eq!((law.is_some(), config.controller.costs.overspeed_s > 0.0), (is_fast, is_fast));
        }
        let mut config = Config::for_vehicle(&vehicle);
        for broken in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            config.speed = SpeedConfig { righting_radps2: [5.0, broken], least_mps: 1.0 };
            let told = config.validate().unwrap_err().to_string();
            assert!(told.contains("speed.righting_radps2") && told.contains("a finite number > 0"), "{told}");
        }
    }
}
