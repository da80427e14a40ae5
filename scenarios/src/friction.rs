//! Friction of the grounds a world can be made of.

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
