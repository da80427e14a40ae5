//! How much a ground holds at a speed of sliding.

use serde::{Deserialize, Serialize};
use std::f32::consts::{E, SQRT_2};

/// Coefficients of the Stribeck curve (AnyNav, equation 1, whose peak is `static_friction` at a sliding speed of
/// `stribeck_speed_mps` / sqrt 2).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FrictionCurve {
    /// Largest friction coefficient [-].
    pub static_friction: f32,
    /// Friction coefficient of fast sliding [-].
    pub sliding_friction: f32,
    /// Growth with the speed of sliding [s/m].
    pub viscous_friction: f32,
    /// Stribeck speed [m/s].
    pub stribeck_speed_mps: f32,
}

impl FrictionCurve {
    const fn new(statics: f32, sliding: f32, viscous: f32, speed_mps: f32) -> Self {
        Self {
            static_friction: statics,
            sliding_friction: sliding,
            viscous_friction: viscous,
            stribeck_speed_mps: speed_mps,
        }
    }

    // What AnyNav knows of grounds before it learns.
    /// Asphalt.
    pub const ASPHALT: Self = Self::new(0.98, 0.70, 0.0, 4.5);
    /// Bare rock.
    pub const ROCK: Self = Self::new(0.93, 0.62, 0.0, 4.0);
    /// Dirt.
    pub const DIRT: Self = Self::new(0.68, 0.76, 0.009, 8.0);
    /// Grass.
    pub const GRASS: Self = Self::new(0.61, 0.65, 0.005, 4.0);
    /// Mud.
    pub const MUD: Self = Self::new(0.55, 0.55, 0.01, 6.0);
    /// Sand.
    pub const SAND: Self = Self::new(0.60, 0.60, 0.02, 6.0);
    /// Ice.
    pub const ICE: Self = Self::new(0.40, 0.20, 0.0, 0.5);

    /// The seven by name.
    pub const PUBLISHED: [(&'static str, Self); 7] = [
        ("asphalt", Self::ASPHALT),
        ("rock", Self::ROCK),
        ("dirt", Self::DIRT),
        ("grass", Self::GRASS),
        ("mud", Self::MUD),
        ("sand", Self::SAND),
        ("ice", Self::ICE),
    ];

    /// The one of that name.
    pub fn published(name: &str) -> Option<Self> {
        Self::PUBLISHED.into_iter().find(|(known, _)| *known == name).map(|(_, curve)| curve)
    }

    /// Their names, for messages.
    pub fn names() -> String {
        Self::PUBLISHED.map(|(name, _)| name).join(", ")
    }

    /// The same curve with its friction coefficients multiplied by `factor`.
    pub fn scaled(self, factor: f32) -> Self {
        Self {
            static_friction: self.static_friction * factor,
            sliding_friction: self.sliding_friction * factor,
            viscous_friction: self.viscous_friction * factor,
            ..self
        }
    }

    /// Friction coefficient at a speed of sliding [-].
    pub fn at(&self, sliding_mps: f32) -> f32 {
        let x = sliding_mps / self.stribeck_speed_mps;
        let rise = (self.static_friction - self.sliding_friction) * (2.0 * E).sqrt();
        rise * x * libm::expf(-x * x)
            + self.sliding_friction * libm::tanhf(10.0 * SQRT_2 * x)
            + self.viscous_friction * sliding_mps
    }

    /// The curve whose coefficients lie half way between two others'.
    pub fn between(&self, other: &Self) -> Self {
        Self::new(
            0.5 * (self.static_friction + other.static_friction),
            0.5 * (self.sliding_friction + other.sliding_friction),
            0.5 * (self.viscous_friction + other.viscous_friction),
            0.5 * (self.stribeck_speed_mps + other.stribeck_speed_mps),
        )
    }

    /// What [`FrictionCurve::is_valid`] asks for.
    pub const EXPECTED: &'static str =
        "friction coefficients within 0.01 and 3, 0 to 1 s/m of viscous and 0.01 to 100 m/s of Stribeck";

    /// Whether every coefficient is a number that a ground can have.
    pub fn is_valid(&self) -> bool {
        let frictions = [self.static_friction, self.sliding_friction];
        frictions.iter().all(|friction| (0.01..=3.0).contains(friction))
            && (0.0..=1.0).contains(&self.viscous_friction)
            && (0.01..=100.0).contains(&self.stribeck_speed_mps)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_peak_is_the_static_friction_and_fast_sliding_is_the_sliding_one() {
        for curve in [FrictionCurve::ASPHALT, FrictionCurve::ROCK, FrictionCurve::ICE] {
            let peak = curve.at(curve.stribeck_speed_mps / SQRT_2);
            // tanh(10) is 1 to 4e-9.
            assert!((peak - curve.static_friction).abs() < 1e-5, "{curve:?}: {peak}");
            let fast = curve.at(6.0 * curve.stribeck_speed_mps);
            assert!((fast - curve.sliding_friction).abs() < 1e-5, "{curve:?}: {fast}");
        }
        let dirt = FrictionCurve::DIRT;
        let fast_mps = 6.0 * dirt.stribeck_speed_mps;
        assert!((dirt.at(fast_mps) - (0.76 + 0.009 * fast_mps)).abs() < 1e-4);
        assert!(dirt.at(0.0).abs() < 1e-9);
    }
}
