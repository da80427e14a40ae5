//! Friction of grounds, found from a vehicle's own drives without labels, and seen in pictures from above (AnyNav, Fu et al.
//! 2025, section 3). A part of [Surefoot](../cli/index.html).
//!
//! A [`Chassis`] reasons from friction to motion: weight on four wheels, combined slip under the Stribeck law, semi-implicit
//! Euler steps; all of it differentiable ([`Dual`]). [`find_friction`] turns that round: of the coefficients of every
//! class of ground it finds those under which the forces that were felt follow from the slip that was measured. How
//! far that can be known depends on the driving: where tyres never came near their limit a [`Grip`] says "at least".
//!
//! A [`Network`] sees the coefficients of every pixel of a [`View`]. [`train`] teaches it from [`Recording`]s: [`roll_out`]
//! says where the vehicle goes over what is seen, [`loss_gradient`] what each coefficient on the way does to the error. Where
//! nobody tells classes, [`refine`] finds what drives say of places, for the network to learn.
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
mod neighbours;
mod network;
mod reasoning;
mod recording;
mod refine;
mod roll_out;
mod samples;
mod table;
mod training;
mod view;

pub use route::FrictionCurve;

pub use chassis::{Chassis, GRAVITY_MPS2, mass_properties};
pub use dual::Dual;
pub use find::{Drive, FindError, Found, find_friction};
pub use judge::{Grip, GroundFriction, SLIDING_MPS};
pub use network::{Network, NetworkError};
pub use reasoning::{
    Coefficients, Controls, Plane, Push, State, Surface, TyreUse, Velocity, WheelInput, push, wheel_force,
};
pub use recording::{Moment, Recording, RecordingError, Window};
pub use refine::{Held, Refined, refine};
pub use roll_out::{CoefficientGradient, Ground, PERIOD_S, STEPS, SUBSTEPS, loss_gradient, roll_out};
pub use samples::DriveError;
pub use table::{FrictionTable, TableError};
pub use training::{
    Labels, Lesson, Losses, Seen, Settings, TrainingError, coefficients_of, predict, train, wheels_m,
};
pub use view::{CHANNELS, Slopes, View, ViewError};
