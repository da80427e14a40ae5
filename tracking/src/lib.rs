//! Moving obstacles: what stands above the ground in a scan, where it was in the scans before, and where it will be. A part
//! of [Surefoot](../cli/index.html).
//!
//! A [`Tracker`] takes a scan, the pose it was taken at and the ground as it is known. Points that stand above the ground
//! become clusters, each with a centre and a radius; clusters are assigned to the tracks of before so that all distances
//! together are least (Kuhn and Munkres), within a gate; each track is a Kalman filter of constant velocity. A track that
//! left the place where it was first seen is one of something that moves, and [`Tracker::moving`] tells it with velocity and
//! variance; [`Track::predicted`] says where it will be and how sure that is. What stands and is no larger than people is told
//! of, too, with no velocity: it may set off. What is larger and never moves is the map's business.
//!
//! `examples/track_a_walker.rs` follows a person through scans of one's own.
//!
//! Frames: scans in the body frame, poses, tracks and the ground in the map frame. SI units.

mod assignment;
mod cluster;
mod config;
mod filter;
mod track;
mod tracker;

pub use config::{TrackingConfig, TrackingConfigError};
pub use filter::Variance;
pub use track::{Predicted, Track};
pub use tracker::{TRACKS_MAX, Tracker};
