//! The truth that the planner never sees: worlds, the physical plant, simulated sensors, tasks and the episode loop.
//!
//! Of `bicycle` this crate uses descriptions and the drive log, never the dynamics: the model never grades itself.

mod world;

pub use world::{Patch, Stribeck, World};
