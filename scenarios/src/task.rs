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

/// Between the border of a rock field and the starts and goals of [`Task::on_rock_map`] [m].
pub const BORDER_M: f64 = 4.0;

/// Maps up to so many cells a side are built whole.
const WHOLE_MAP_CELLS: f64 = 3500.0;
/// What of a larger map is built around its start and goal, beyond the distance between them, at least [m].
const WINDOW_MARGIN_M: f64 = 30.0;
/// The same as a share of the way between the two where both are given and a map that is built whole has the cells for it:
/// no way leads straight on for long.
const WINDOW_MARGIN_SHARE: f64 = 0.25;
/// Places of a large map that are searched for a start and a goal.
const WINDOWS_TRIED: u64 = 8;

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

    /// One of the drives over a map of the testbed: [`ROCK_FIELD_DISTANCE_M`] between two cleared pads that lie, with the
    /// direction, anywhere in the map but within [`BORDER_M`] of its border (PIETRA, section V-D, where the pairs are not
    /// published).
    ///
    /// # Errors
    /// A field that cannot be, or that has no room for such a drive.
    pub fn on_rock_map(config: &RockFieldConfig, map: RockMap, pair: u32) -> Result<Self, RockFieldError> {
        config.validate()?;
        let free_m = config.side_m - 2.0 * BORDER_M;
        if free_m < ROCK_FIELD_DISTANCE_M {
            let expected = "room for a drive of 40 m between borders of 4 m";
            return Err(RockFieldError::Setting {
                field: "side_m".to_owned(),
                expected,
                found: config.side_m,
            });
        }
        let key = [0x9A12, map.split as u64, u64::from(map.index), u64::from(pair)];
        let mut rng = stream(map.seed, &key);
        let (start, goal_m) = loop {
            let start_m = [(); 2].map(|()| BORDER_M + free_m * rng.random::<f64>());
            let yaw_rad: f64 = rng.random_range(0.0..TAU);
            let goal_m = [
                start_m[0] + ROCK_FIELD_DISTANCE_M * yaw_rad.cos(),
                start_m[1] + ROCK_FIELD_DISTANCE_M * yaw_rad.sin(),
            ];
            if goal_m.iter().all(|at_m| (BORDER_M..=BORDER_M + free_m).contains(at_m)) {
                break ([start_m[0], start_m[1], yaw_rad], goal_m);
            }
        };
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

    /// A drive on measured ground: all of a small map, of a large one the part around start and goal. What `wish`
    /// leaves open is picked by the seed, from several parts of a large map if need be.
    ///
    /// # Errors
    /// Layers that make no world; an end off the map, or on which the vehicle cannot stand; ends with no way between.
    pub fn in_layers(
        name: &str,
        layers: &WorldLayers,
        vehicle: &Vehicle,
        wish: &PairWish,
        seed: u64,
    ) -> Result<Self, LayersTaskError> {
        let map = layers.bounds();
        if let Some((end, at_m)) = given(wish).find(|(_, at_m)| !map.contains(at_m[0], at_m[1])) {
            return Err(PairError::OutOfMap { end, at_m, map }.into());
        }
        let whole_m = WHOLE_MAP_CELLS * LayerConfig::for_vehicle(vehicle).resolution_m;
        let mut last = PairError::NoPair { distance_m: wish.distance_m };
        for window in windows(&map, wish, seed, whole_m) {
            let config = LayerConfig { window, ..LayerConfig::for_vehicle(vehicle) };
            let world = Arc::new(world_from_layers(name, layers, &config, seed)?);
            match feasible_pair(&world, vehicle, wish, seed) {
                Ok(Pair { start, goal_m }) => {
                    return Ok(Self::in_world(world, start, goal_m, Self::tolerance_m(vehicle)));
                }
                Err(error) => last = error,
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

/// The ends that are given, with their places [m].
fn given(wish: &PairWish) -> impl Iterator<Item = (End, [f64; 2])> {
    let start = wish.start.map(|[x_m, y_m, _]| (End::Start, [x_m, y_m]));
    start.into_iter().chain(wish.goal_m.map(|goal_m| (End::Goal, goal_m)))
}

/// The parts of a map to build and look for a pair in, one after the other: all of a map of up to `whole_m` a side; of
/// a larger one what lies around the ends that are given, or places by the seed.
fn windows(map: &Bounds, wish: &PairWish, seed: u64, whole_m: f64) -> Vec<Option<Bounds>> {
    let side_m = [0, 1].map(|k| map.north_east_m[k] - map.south_west_m[k]);
    if side_m[0].max(side_m[1]) <= whole_m {
        return vec![None];
    }
    let given_m: Vec<[f64; 2]> = given(wish).map(|(_, at_m)| at_m).collect();
    match given_m[..] {
        [start_m, goal_m] => return vec![Some(around(&given_m, room_m(start_m, goal_m, whole_m)))],
        [end_m] => return vec![Some(around(&[end_m], WINDOW_MARGIN_M + wish.distance_m))],
        _ => {}
    }
    // The fractional parts of multiples of the plastic number's powers spread evenly over a square.
    let place = |try_: u64| {
        let turn = (seed.wrapping_mul(WINDOWS_TRIED).wrapping_add(try_) % (1 << 32)) as f64;
        [(0, 0.754_877_666_246_693), (1, 0.569_840_290_998_053)]
            .map(|(k, step)| map.south_west_m[k] + side_m[k] * (turn * step).fract())
    };
    (0..WINDOWS_TRIED).map(|try_| Some(around(&[place(try_)], WINDOW_MARGIN_M + wish.distance_m))).collect()
}

/// Room around a start and a goal, so that all of it takes no more cells than a square of `whole_m` [m].
fn room_m(start_m: [f64; 2], goal_m: [f64; 2], whole_m: f64) -> f64 {
    let [east_m, north_m] = [0, 1].map(|k| (goal_m[k] - start_m[k]).abs());
    // (east + 2 room) (north + 2 room) = whole^2.
    let (sum_m, difference_m) = (east_m + north_m, east_m - north_m);
    let most_m = 0.25 * (difference_m.hypot(2.0 * whole_m) - sum_m);
    (WINDOW_MARGIN_SHARE * east_m.hypot(north_m)).min(most_m).max(WINDOW_MARGIN_M)
}

/// What lies within a distance of places, and between them.
fn around(places_m: &[[f64; 2]], within_m: f64) -> Bounds {
    let bound = |k: usize, pick: fn(f64, f64) -> f64| {
        places_m.iter().map(|place_m| place_m[k]).fold(places_m[0][k], pick)
    };
    Bounds {
        south_west_m: [0, 1].map(|k| bound(k, f64::min) - within_m),
        north_east_m: [0, 1].map(|k| bound(k, f64::max) + within_m),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_room_around_a_long_way_takes_no_more_than_a_map_that_is_built_whole() {
        let room_m =
            |east_m: f64, north_m: f64| room_m([10.0, 500.0], [10.0 + east_m, 500.0 - north_m], 630.0);
        assert_eq!(room_m(100.0, 0.0), 30.0);
        assert!((room_m(240.0, 320.0) - 100.0).abs() < 1e-9, "a quarter of 400 m");
        let most_m = room_m(1000.0, 0.0);
        assert!(((1000.0 + 2.0 * most_m) * 2.0 * most_m - 630.0 * 630.0).abs() < 1e-6, "{most_m}");
        assert_eq!(room_m(600.0, 600.0), 30.0, "of 660 x 660 m, which it cannot be less than");
    }
}
