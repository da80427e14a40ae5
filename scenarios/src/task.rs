//! What is to be driven: a world, a start, a goal.

use std::f64::consts::TAU;
use std::sync::Arc;

use bicycle::Vehicle;
use rand::RngExt;

use crate::random::stream;
use crate::{
    ARENA_GOAL_M, ARENA_START, ArenaConfig, ArenaError, Bounds, RockFieldConfig, RockFieldError, RockMap,
    Split, World, arena, rock_field,
};

/// Between start and goal of the rock field's drive [m] (PIETRA, section V-D).
pub const ROCK_FIELD_DISTANCE_M: f64 = 40.0;

/// A drive to be done.
#[derive(Clone, Debug)]
pub struct Task {
    /// Where.
    pub world: Arc<World>,
    /// Rear axle's centre and heading at the start: x [m], y [m], yaw [rad].
    pub start: [f64; 3],
    /// Where the rear axle's centre is to come [m].
    pub goal_m: [f64; 2],
    /// How close counts as there [m].
    pub goal_tolerance_m: f64,
    /// What the rear axle's centre must not leave.
    pub bounds: Bounds,
}

impl Task {
    /// The default drive: [`ROCK_FIELD_DISTANCE_M`] through the middle of a test map that belongs to the seed, in a
    /// direction that belongs to it too, between two cleared pads.
    pub fn rock_field(config: &RockFieldConfig, seed: u64) -> Result<Self, RockFieldError> {
        let middle_m = 0.5 * config.side_m;
        let half_m = 0.5 * ROCK_FIELD_DISTANCE_M;
        let yaw_rad: f64 = stream(seed, &[0x7A5C]).random_range(0.0..TAU);
        let (east_m, north_m) = (half_m * yaw_rad.cos(), half_m * yaw_rad.sin());
        let start = [middle_m - east_m, middle_m - north_m, yaw_rad];
        let goal_m = [middle_m + east_m, middle_m + north_m];
        let map = RockMap { seed, split: Split::Test, index: 0 };
        let world = rock_field(config, map, &[[start[0], start[1]], goal_m])?;
        Ok(Self::in_world(Arc::new(world), start, goal_m, 1.0))
    }

    /// The arena's drive, straight at the bushes.
    pub fn arena(config: &ArenaConfig) -> Result<Self, ArenaError> {
        Ok(Self::in_world(Arc::new(arena(config)?), ARENA_START, ARENA_GOAL_M, 0.3))
    }

    /// A drive in any world, within its borders. Start and goal are taken as they are;
    /// [`check_pair`](crate::check_pair) says whether they make sense.
    pub fn in_world(world: Arc<World>, start: [f64; 3], goal_m: [f64; 2], goal_tolerance_m: f64) -> Self {
        Self { bounds: world.bounds(), world, start, goal_m, goal_tolerance_m }
    }

    /// How close to a goal counts as there for a machine of this size, where nothing else is said [m].
    pub fn tolerance_m(vehicle: &Vehicle) -> f64 {
        0.3 * vehicle.geometry.length_m
    }

    /// From a point to the goal [m].
    pub fn distance_to_goal_m(&self, x_m: f64, y_m: f64) -> f64 {
        (self.goal_m[0] - x_m).hypot(self.goal_m[1] - y_m)
    }
}
