//! The contract between a vehicle and whoever plans for it: messages without copies, channels, a clock, ages, health, and
//! the watchdog that has the last word. A part of [Surefoot](../cli/index.html).
//!
//! A [`Bus`](channel::Bus) joins a run by its name, [`Outlet`](channel::Outlet)s and [`Inlet`](channel::Inlet)s are the
//! two ends of a channel, [`message`] holds every record as it lies in memory, and a [`Watchdog`](watchdog::Watchdog)
//! has the last word before the actuators. `examples/publish_and_read.rs` shows both ends in one process.
//!
//! Whoever runs a vehicle needs this crate and no other: it publishes [`ODOMETRY`](channel::ODOMETRY),
//! [`SCAN`](channel::SCAN) and, where it has one, [`IMU`](channel::IMU), and follows [`COMMAND`](channel::COMMAND) by
//! way of the watchdog. The simulated vehicle is one such driver, and not known here.

pub mod ages;
pub mod channel;
pub mod clock;
pub mod layout;
pub mod message;
pub mod payload;
pub mod status;
pub mod watchdog;
