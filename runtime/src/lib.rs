//! The pipeline as processes of their own: channels without copies, a clock, health, and what happens when one of them
//! fails.
//!
//! Every process does one of `navigator`'s parts, the same object that a closed loop in one process drives with, and
//! tells the others what it found over [`channel`]s. Whoever runs the vehicle is one more process.

pub mod budget;
pub mod channel;
mod choice;
pub mod clock;
pub mod control;
mod error;
pub mod frame;
pub mod layout;
pub mod learning;
pub mod live;
pub mod mapping;
pub mod message;
pub mod online;
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
