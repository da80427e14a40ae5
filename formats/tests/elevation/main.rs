//! Elevation files: the real ones, and small ones written by other libraries.
#![allow(clippy::unwrap_used, reason = "a test stops at the first surprise")]

mod hill;
mod images;
mod npz;
