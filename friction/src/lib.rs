//! Friction of grounds, found from a vehicle's own drives without labels or images (AnyNav, Fu et al. 2025, sections
//! 3.2 and 3.3.2). A part of [Surefoot](../cli/index.html).
//!
//! A [`Chassis`] reasons from friction to motion: weight on four wheels, combined slip under the Stribeck law, semi-implicit
//! Euler steps; all of it differentiable ([`Dual`]). [`find_friction`] turns that round: of the coefficients of every
//! class of ground it finds those under which the forces that were felt follow from the slip that was measured. How
//! far that can be known depends on the driving: where tyres never came near their limit a [`Grip`] says "at least".
//!
//! `examples/braking_distance.rs` lets locked wheels slide on three grounds.
//!
//! Frames: map and body as in the guide. SI units.

mod chassis;
mod dual;
mod find;
mod judge;
mod least_squares;
mod model;
mod reasoning;
mod samples;
mod table;

pub use route::FrictionCurve;

pub use chassis::{Chassis, GRAVITY_MPS2, mass_properties};
pub use dual::Dual;
pub use find::{Drive, FindError, Found, find_friction};
pub use judge::{Grip, GroundFriction, SLIDING_MPS};
pub use reasoning::{
    Coefficients, Controls, Plane, Push, State, TyreUse, Velocity, WheelInput, push, wheel_force,
};
pub use samples::DriveError;
pub use table::{FrictionTable, TableError};
