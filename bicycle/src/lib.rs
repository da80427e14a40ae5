//! The vehicle as a planner sees it: its description, its commands, the kinematic bicycle with composable effects,
//! and the drive log.

mod decision;
mod drive_log;
pub mod effect;
pub mod lanes;
mod model;
mod motion;
mod stepper;
mod vehicle;

pub use decision::{Decision, HoldReason, StopReason};
pub use drive_log::{Column, DriveLog, DriveLogError, DriveRow, Run};
pub use effect::{Effect, SensorModel};
pub use model::{GroundSample, Model, ModelError};
pub use motion::{Command, ImuSample, Odometry, State};
pub use stepper::{Asked, LaneState, Rates, Stepper};
pub use vehicle::{
    Axle, Body, Drivetrain, Geometry, Limits, Servo, Suspension, Tyre, Vehicle, VehicleError, Wheel,
};
