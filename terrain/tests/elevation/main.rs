//! The elevation map against closed forms, a simulated sensor over known ground, and a real scan.
#![allow(clippy::unwrap_used, reason = "helpers of tests fail the test")]

mod fusion;
mod lidar;
mod points;
mod real_scan;
mod visibility;
mod window;
