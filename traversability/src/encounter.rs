//! What was foretold of a footprint, and what was met there.

use terrain::TerrainClass;

use crate::Pmf;

/// Distributions of linear traction, angular traction, |roll| and |pitch| that each layer of the belief gave.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Foretold {
    /// The physics prior.
    pub prior: [Pmf; 4],
    /// The networks; `None` without networks, and on ground that they cannot judge.
    pub networks: Option<[Pmf; 4]>,
    /// Share of the networks in the posterior, in [0, 1].
    pub learned_share: [f32; 4],
    /// What was driven on: the mean of the posterior (PIETRA, equation 11).
    pub posterior: [Pmf; 4],
}

/// What the map showed under the vehicle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GroundShown {
    /// The likeliest class under the four wheels together.
    pub class: TerrainClass,
    /// Mean height of the plants under the four wheels [m].
    pub vegetation_height_m: f32,
    /// Rise along the heading from the rear to the front wheels, per metre; climbing is positive.
    pub slope_along: f64,
    /// Rise from the right to the left wheels, per metre.
    pub slope_across: f64,
    /// Standard deviation of elevation under the footprint [m].
    pub unevenness_m: f32,
    /// Height of the map under the rear axle, with a wheel's radius on it, less the measured height of the axle [m]; NaN
    /// where the drive has no heights.
    pub height_error_m: f64,
}

/// One footprint: what the map showed, what was foretold of it, what was met.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Encounter {
    /// Which drive, from 0.
    pub drive: u32,
    /// When it was met, since the drive began [s].
    pub time_s: f64,
    /// Rear axle's centre and heading in the map frame: x [m], y [m], yaw [rad].
    pub pose: [f64; 3],
    /// How far away the vehicle was when the map was made [m].
    pub distance_m: f64,
    /// Measured speed over ground [m/s].
    pub speed_mps: f64,
    /// Speed of the wheels over the speed that was asked for, as far as the command had arrived [-]; NaN where the drive
    /// has no speed of wheels.
    pub wheel_share: f64,
    /// Share of the wheels' way that was lost to slip, 1 - speed over ground / speed of the wheels [-]; NaN likewise.
    pub slip: f64,
    /// Linear traction, angular traction, |roll| [rad], |pitch| [rad]; NaN where the measurement means nothing.
    pub measured: [f32; 4],
    /// What the map showed.
    pub ground: GroundShown,
    /// What was foretold from it.
    pub foretold: Foretold,
}
