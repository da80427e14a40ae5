//! The pipeline as processes of their own: who they are, who keeps them alive, and what happens when one of them fails.
//! A part of [Surefoot](../cli/index.html).
//!
//! Every process does one of `navigator`'s parts, the same object that a closed loop in one process drives with, and
//! tells the others what it found over the channels of [`bus`]. Whoever runs the vehicle is one more process, which needs
//! nothing of this crate. How old what they say may be follows from how often they speak ([`ages`]):
//! `examples/limits_of_rates.rs`.

pub mod ages;
pub mod budget;
pub mod control;
pub mod convert;
pub mod doctor;
mod error;
mod intake;
pub mod learning;
pub mod live;
pub mod mapping;
pub mod mission;
pub mod online;
pub mod operator;
pub mod realtime;
pub mod recorder;
pub mod replay;
pub mod risk_maker;
pub mod setup;
pub mod supervisor;
pub mod timing;
pub mod usage;

pub use error::RuntimeError;
