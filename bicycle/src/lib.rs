//! The vehicle as a planner sees it: its description, its commands, the kinematic bicycle with composable effects,
//! and the drive log. A part of [Surefoot](../cli/index.html).
//!
//! A [`Vehicle`] describes the whole machine, a [`Model`] what a controller believes of it: wheelbase, [`Limits`] and
//! [`Effect`]s that the kinematic bicycle leaves out. A [`Stepper`] carries a [`State`] on under a [`Command`]; the
//! same code runs for one vehicle and for a pack of them in [`lanes`]. [`SkidSteer`] is the same for a vehicle that is
//! asked for a yaw rate, and [`MotionModel`] what both offer to a controller. A controller's answer is a [`Decision`]; what
//! was commanded and measured on a drive is a [`DriveLog`]. `examples/own_vehicle.rs` makes a model of one's own.
//!
//! ```
//! use bicycle::{Command, GroundSample, Limits, Model, State, Stepper};
//!
//! let limits = Limits {
//!     speed_max_mps: 3.0,
//!     reverse_speed_max_mps: 1.0,
//!     steering_max_rad: 0.5,
//!     steering_rate_max_radps: 1.0,
//!     acceleration_max_mps2: 2.0,
//!     lateral_acceleration_max_mps2: 4.0,
//!     roll_max_rad: 0.5,
//!     pitch_max_rad: 0.5,
//! };
//! let model = Model { wheelbase_m: 1.8, limits, effects: Vec::new() };
//! model.validate()?;
//! let stepper = Stepper::new(&model, 0.1, 1.0);
//! let ahead = Command { speed_mps: 0.2, steering_rad: 0.0 };
//! let state = stepper.step_state(&State::default(), ahead, &GroundSample::FIRM, &mut [], 0);
//! assert!((state.x_m - 0.02).abs() < 1e-9);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod applied;
mod axle_demand;
mod decision;
mod drive_log;
pub mod effect;
pub mod lanes;
mod model;
mod motion;
mod motion_model;
mod skid_steer;
mod stepper;
mod vehicle;

pub use applied::{Applied, AppliedBy};
pub use axle_demand::AxleDemand;
pub use decision::{Decision, HoldReason, StopReason};
pub use drive_log::{Column, DriveLog, DriveLogError, DriveRow, JoinError, Readings, Run};
pub use effect::{Effect, SensorModel};
pub use model::{GroundSample, Model, ModelError};
pub use motion::{Command, ImuSample, Odometry, State};
pub use motion_model::{
    Extent, MotionCommand, MotionLimits, MotionModel, MotionState, MotionStepper, StepInput, StepOutcome,
};
pub use skid_steer::{
    SkidSteer, SkidSteerCommand, SkidSteerLimits, SkidSteerState, SkidSteerStepper, SkidSteerVehicle,
};
pub use stepper::{Asked, LaneState, Rates, Stepper};
pub use vehicle::{
    Axle, Body, Differential, Drivetrain, Geometry, Limits, Servo, Suspension, Tyre, Vehicle, VehicleError,
    Wheel,
};
