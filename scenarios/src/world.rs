//! A world: the shape of the ground and what it is made of.

use terrain::{GridMap, Knowledge, TerrainClass};

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

/// What one cell of ground is made of.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Patch {
    /// What covers it.
    pub class: TerrainClass,
    /// Height of soft vegetation [m].
    pub vegetation_height_m: f32,
    /// Height of an obstacle above the ground, zero where there is none [m].
    pub obstacle_height_m: f32,
    /// Friction of the ground.
    pub friction: Stribeck,
    /// Resistance of loose or soft ground over load, beside the tyre's own [-].
    pub rolling_resistance: f32,
    /// Whether the height was measured or filled in between measurements.
    pub knowledge: Knowledge,
}

/// The whole truth about a piece of ground.
#[derive(Clone, Debug)]
pub struct World {
    /// Name, for reports.
    pub name: String,
    /// Heights at the cells' centres [m]; every value finite. Between centres each square of four is split
    /// into two triangles from south-west to north-east, so that wheels, rays and rigid contact see one surface.
    pub heights: GridMap<f32>,
    /// What the ground is made of; same geometry as `heights`.
    pub patches: GridMap<Patch>,
}
