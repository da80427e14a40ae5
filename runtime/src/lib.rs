//! The pipeline as processes of their own: channels without copies, a clock, health, and what happens when one of them
//! fails. A part of [Surefoot](../cli/index.html).
//!
//! Every process does one of `navigator`'s parts, the same object that a closed loop in one process drives with, and
//! tells the others what it found over [`channel`]s. Whoever runs the vehicle is one more process.
//!
//! A [`Bus`](channel::Bus) joins a run by its name, [`Outlet`](channel::Outlet)s and [`Inlet`](channel::Inlet)s are the
//! two ends of a channel, [`message`] holds every record as it lies in memory, and a [`Watchdog`](watchdog::Watchdog)
//! has the last word before the actuators. `examples/publish_and_read.rs` shows both ends in one process.

pub mod ages;
pub mod budget;
pub mod channel;
mod choice;
pub mod clock;
pub mod control;
mod error;
mod intake;
pub mod layout;
pub mod learning;
pub mod live;
pub mod mapping;
pub mod message;
pub mod mission;
pub mod online;
pub mod operator;
pub mod payload;
pub mod plant;
pub mod realtime;
pub mod recorder;
pub mod replay;
pub mod risk_maker;
pub mod setup;
pub mod status;
pub mod supervisor;
pub mod timing;
pub mod usage;
pub mod watchdog;

pub use error::RuntimeError;
