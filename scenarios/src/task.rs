//! What is to be driven: a world, a start, a goal.

use std::f64::consts::TAU;
use std::sync::Arc;

use bicycle::Vehicle;
use rand::RngExt;

use crate::random::stream;
use crate::{
    ARENA_GOAL_M, ARENA_START, ArenaConfig, ArenaError, Bounds, End, LayerConfig, LayersError, Pair,
    PairError, PairWish, RockFieldConfig, RockFieldError, RockMap, Split, World, WorldLayers, arena,
    feasible_pair, rock_field, world_from_layers,
};

/// Between start and goal of the rock field's drive [m] (PIETRA, section V-D).
pub const ROCK_FIELD_DISTANCE_M: f64 = 40.0;

/// Parts of a map in which a pair is looked for.
const PARTS: usize = 12;

/// Why there is no drive on measured ground.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum LayersTaskError {
    /// The layers make no world.
    #[error(transparent)]
    Layers(#[from] LayersError),
    /// Start and goal will not do.
    #[error(transparent)]
    Pair(#[from] PairError),
}

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

    /// A drive on measured ground, of which the part around start and goal is built. What `wish` leaves open is picked
    /// by the seed, from several parts of the map if need be.
    pub fn in_layers(
        name: &str,
        layers: &WorldLayers,
        vehicle: &Vehicle,
        wish: &PairWish,
        seed: u64,
    ) -> Result<Self, LayersTaskError> {
        let given_m = wish.start.map(|[x_m, y_m, _]| (End::Start, [x_m, y_m]));
        let given_m: Vec<_> =
            given_m.into_iter().chain(wish.goal_m.map(|goal_m| (End::Goal, goal_m))).collect();
        let map = layers.bounds();
        if let Some(&(end, at_m)) = given_m.iter().find(|(_, at_m)| !map.contains(at_m[0], at_m[1])) {
            return Err(PairError::OutOfMap { end, at_m, map }.into());
        }
        let mut rng = stream(seed, &[0x1A7E]);
        let mut last = PairError::NoPair { distance_m: wish.distance_m };
        for _ in 0..PARTS {
            let anywhere_m = [0, 1].map(|k| rng.random_range(map.south_west_m[k]..map.north_east_m[k]));
            let window = part(&given_m, anywhere_m, wish.distance_m, vehicle);
            let config = LayerConfig { window: Some(window), ..LayerConfig::for_vehicle(vehicle) };
            let world = Arc::new(world_from_layers(name, layers, &config, seed)?);
            match feasible_pair(&world, vehicle, wish, seed) {
                Ok(Pair { start, goal_m }) => {
                    return Ok(Self::in_world(world, start, goal_m, Self::tolerance_m(vehicle)));
                }
                Err(error) => last = error,
            }
            // Another part can help only where the part is not given.
            if !given_m.is_empty() {
                break;
            }
        }
        Err(last.into())
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

/// The part of a map that a drive needs: what is given, or the distance around a point, with room for detours.
fn part(given_m: &[(End, [f64; 2])], anywhere_m: [f64; 2], distance_m: f64, vehicle: &Vehicle) -> Bounds {
    let centre_m = given_m.first().map_or(anywhere_m, |(_, at_m)| *at_m);
    let far_m = given_m.last().map_or(anywhere_m, |(_, at_m)| *at_m);
    let away_m = (far_m[0] - centre_m[0]).hypot(far_m[1] - centre_m[1]);
    let free_m = if given_m.len() < 2 { distance_m } else { 0.0 };
    let margin_m = free_m + (0.75 * distance_m.max(away_m)).max(9.0 * vehicle.geometry.length_m);
    Bounds {
        south_west_m: [0, 1].map(|k| centre_m[k].min(far_m[k]) - margin_m),
        north_east_m: [0, 1].map(|k| centre_m[k].max(far_m[k]) + margin_m),
    }
}
