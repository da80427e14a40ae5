//! Friction of the grounds a world can be made of, and the tyre's laws that plant and truth share.

use std::f64::consts::{E, SQRT_2};

/// Friction keeps at least this share however large the load [-].
const GRIP_MIN: f64 = 0.4;

/// Coefficients of the combined-slip Stribeck friction law
/// mu(v) = sqrt(2e) (static - dynamic) exp(-(v/vS)^2) v/vS + dynamic tanh(10 sqrt2 v/vS) + viscous v
/// (AnyNav equation 1 as corrected: peak `static` at v = vS / sqrt2).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stribeck {
    /// Peak friction coefficient [-].
    pub static_friction: f32,
    /// Sliding friction coefficient [-].
    pub dynamic_friction: f32,
    /// Growth with sliding speed [s/m].
    pub viscous_friction: f32,
    /// Stribeck speed vS [m/s].
    pub stribeck_speed_mps: f32,
}

impl Stribeck {
    const fn new(statics: f32, dynamic: f32, viscous: f32, speed_mps: f32) -> Self {
        Self {
            static_friction: statics,
            dynamic_friction: dynamic,
            viscous_friction: viscous,
            stribeck_speed_mps: speed_mps,
        }
    }

    // The friction knowledge S_prior that AnyNav starts from, one row a ground.
    /// Asphalt; also smooth concrete and plywood.
    pub const ASPHALT: Self = Self::new(0.98, 0.70, 0.0, 4.5);
    /// Bare rock.
    pub const ROCK: Self = Self::new(0.93, 0.62, 0.0, 4.0);
    /// Cobblestone.
    pub const COBBLE: Self = Self::new(0.95, 0.65, 0.0, 5.0);
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

    /// The same curve with its three friction coefficients multiplied by `factor`.
    pub fn scaled(self, factor: f32) -> Self {
        Self {
            static_friction: self.static_friction * factor,
            dynamic_friction: self.dynamic_friction * factor,
            viscous_friction: self.viscous_friction * factor,
            ..self
        }
    }
}

/// The Stribeck law of a sliding speed [-].
fn sliding(ground: &Stribeck, speed_mps: f64) -> f64 {
    let Stribeck { static_friction, dynamic_friction, viscous_friction, stribeck_speed_mps } = *ground;
    let (statics, dynamic) = (f64::from(static_friction), f64::from(dynamic_friction));
    let x = speed_mps / f64::from(stribeck_speed_mps);
    let peak = (2.0 * E).sqrt() * (statics - dynamic) * (-x * x).exp() * x;
    peak + dynamic * (10.0 * SQRT_2 * x).tanh() + f64::from(viscous_friction) * speed_mps
}

/// The most that the ground holds at a slip speed [-]. The law is zero at rest, where real ground holds: up to its peak
/// static friction counts, or the law where dynamic friction lies above static; from there on the law.
pub(crate) fn holding(ground: &Stribeck, speed_mps: f64) -> f64 {
    let statics = f64::from(ground.static_friction);
    let is_slow = speed_mps < f64::from(ground.stribeck_speed_mps) / SQRT_2;
    if is_slow && ground.dynamic_friction <= ground.static_friction && ground.viscous_friction == 0.0 {
        return statics;
    }
    let sliding = sliding(ground, speed_mps);
    if is_slow { sliding.max(statics) } else { sliding }
}

/// Friction under a load over that under the reference load: one minus `sensitivity` at twice that load [-].
pub(crate) fn load_factor(sensitivity: f64, load_over_reference: f64) -> f64 {
    (1.0 - sensitivity * (load_over_reference - 1.0)).max(GRIP_MIN)
}

/// Friction of a rolling brush at a steady slip on ground that holds `friction` [-]: see the plant's tyre.
pub(crate) fn brush_friction(friction: f64, stiffness: f64, slip: f64) -> f64 {
    let share = (stiffness * slip / (3.0 * friction)).min(1.0);
    friction * (1.0 - (1.0 - share).powi(3))
}
