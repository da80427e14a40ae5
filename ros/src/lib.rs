//! A robot's ROS 2 topics as a driver on the bus, without a ROS installation. A part of [Surefoot](../cli/index.html).
//!
//! [`bridge::run`] is a node that publishes odometry, scans and inertial samples on the bus as any vehicle's driver
//! does, and says what the bus's watchdog lets through as commands. What comes from the robot is turned into the bus's
//! messages by an [`Intake`](intake::Intake), which knows no network: frames, stamps and layouts are checked there.
//! `examples/read_a_cloud.rs` reads a point cloud with it.
//!
//! Messages are told with serde and travel as CDR over RTPS, which RustDDS speaks.

pub mod actuation;
mod alarm;
pub mod bag;
pub mod bridge;
pub mod cloud;
mod complaints;
pub mod environment;
mod errand;
pub mod globe;
pub mod goals;
pub mod intake;
pub mod message;
mod node;
pub mod odometry;
pub mod orders;
pub mod parameters;
mod quality;
pub mod rigid;
pub mod stamps;
pub mod telling;
pub mod transforms;

pub use node::NodeError;
