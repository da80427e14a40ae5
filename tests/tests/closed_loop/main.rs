//! World, plant, sensors and planner in one loop, on courses small enough to be driven in a moment.

#![allow(clippy::unwrap_used, reason = "a panic is how a test fails")]

mod course;
mod faults;
mod goals;
mod missions;
mod repeats;
mod sensors;
mod skid_steer;
mod speeds;
mod walkers;
