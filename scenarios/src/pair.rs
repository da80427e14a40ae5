//! Start and goal: whether a vehicle can stand there and get from one to the other.

mod way;

use std::f64::consts::TAU;
use std::sync::Arc;

use bicycle::Vehicle;
use rand::RngExt;
use rand_xoshiro::Xoshiro256PlusPlus;

use crate::random::stream;
use crate::{Bounds, Plant, Traversability, Truth, World};
use way::{Way, heading_rad};

/// Share of the attitude limits that counts as safe to stand on.
const LIMIT_SHARE: f64 = 0.9;
/// Traction below which a place counts as one the vehicle cannot leave.
const TRACTION_MIN: f64 = 0.1;
/// A parked vehicle is watched for this long, and may move by this share of its length.
const REST_S: f64 = 2.0;
const REST_SHARE: f64 = 0.01;
/// The search reaches this far around start and goal: a share of their distance, and never less than this [m].
const DETOUR_SHARE: f64 = 0.75;
const DETOUR_MIN_LENGTHS: f64 = 5.0;
/// Pairs that are drawn, and pairs between which a way is searched, before none is found.
const ATTEMPTS: usize = 400;
const SEARCHES: usize = 12;

/// One end of a drive.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum End {
    /// Where it begins.
    Start,
    /// Where it is to end.
    Goal,
}

impl std::fmt::Display for End {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        formatter.write_str(match self {
            Self::Start => "start",
            Self::Goal => "goal",
        })
    }
}

/// Why a pair of start and goal will not do.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum PairError {
    /// Not inside the map.
    #[error(
        "{end}: expected a point of the map from ({:.1}, {:.1}) to ({:.1}, {:.1}) m, found ({:.1}, {:.1}) m",
        map.south_west_m[0], map.south_west_m[1], map.north_east_m[0], map.north_east_m[1], at_m[0], at_m[1]
    )]
    OutOfMap {
        /// Which end.
        end: End,
        /// Where it is [m].
        at_m: [f64; 2],
        /// The map.
        map: Bounds,
    },
    /// The vehicle would touch an obstacle.
    #[error("{end}: expected free ground, found an obstacle below the vehicle at ({:.1}, {:.1}) m", at_m[0], at_m[1])]
    OnObstacle {
        /// Which end.
        end: End,
        /// Where it is [m].
        at_m: [f64; 2],
    },
    /// The vehicle would stand too steep.
    #[error(
        "{end}: expected roll and pitch up to {roll_max_deg:.0} and {pitch_max_deg:.0} degrees, found {roll_deg:.1} \
         and {pitch_deg:.1} degrees at ({:.1}, {:.1}) m", at_m[0], at_m[1]
    )]
    TooSteep {
        /// Which end.
        end: End,
        /// Where it is [m].
        at_m: [f64; 2],
        /// |roll| there [degrees].
        roll_deg: f64,
        /// |pitch| there [degrees].
        pitch_deg: f64,
        /// Largest |roll| that counts as safe to stand on [degrees].
        roll_max_deg: f64,
        /// Largest |pitch| that counts as safe to stand on [degrees].
        pitch_max_deg: f64,
    },
    /// The wheels find no hold, or the vehicle hangs on its belly.
    #[error("{end}: expected ground to drive on, found no traction at ({:.1}, {:.1}) m", at_m[0], at_m[1])]
    NoTraction {
        /// Which end.
        end: End,
        /// Where it is [m].
        at_m: [f64; 2],
    },
    /// The parked vehicle slides away.
    #[error(
        "start: expected ground on which the parked vehicle stays, found that it moves {moved_m:.2} m in {REST_S:.0} s at \
         ({:.1}, {:.1}) m", at_m[0], at_m[1]
    )]
    Slides {
        /// Where it starts [m].
        at_m: [f64; 2],
        /// How far it comes [m].
        moved_m: f64,
    },
    /// There is no way that keeps the limits.
    #[error(
        "goal: expected a way from the start on which the vehicle keeps its limits, found none within {within_m:.0} m \
         of the two ends"
    )]
    Unreachable {
        /// How far around the straight line was searched [m].
        within_m: f64,
    },
    /// No pair was found.
    #[error(
        "expected a start and a goal {distance_m:.0} m apart with a way between them, found none in {ATTEMPTS} tries"
    )]
    NoPair {
        /// Distance asked for [m].
        distance_m: f64,
    },
}

/// A start and a goal.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pair {
    /// Rear axle's centre and heading: x [m], y [m], yaw [rad].
    pub start: [f64; 3],
    /// Where the rear axle's centre is to come [m].
    pub goal_m: [f64; 2],
}

/// Whether the vehicle can stand at the start as it heads, where the plant stays parked, stand at the goal in some
/// heading, and get there: by a search over poses in which it keeps nine tenths of its attitude limits, touches no
/// obstacle and finds traction. It turns as its front wheels steer, forwards and backwards. The poses are those of a
/// lattice, at rest and one by one: who gets there all the same drives well.
pub fn check_pair(world: &Arc<World>, vehicle: &Vehicle, pair: &Pair) -> Result<(), PairError> {
    Checker::new(world, vehicle).check(pair)
}

/// What is known of a pair beforehand.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PairWish {
    /// The start, if it is given: x [m], y [m], yaw [rad].
    pub start: Option<[f64; 3]>,
    /// The goal, if it is given [m].
    pub goal_m: Option<[f64; 2]>,
    /// How far apart the two shall be where one of them is free [m].
    pub distance_m: f64,
}

/// Picks by the seed what of a pair is not given, so that it passes [`check_pair`]. A start that is picked heads for
/// the goal.
pub fn feasible_pair(
    world: &Arc<World>,
    vehicle: &Vehicle,
    wish: &PairWish,
    seed: u64,
) -> Result<Pair, PairError> {
    let checker = Checker::new(world, vehicle);
    if let (Some(start), Some(goal_m)) = (wish.start, wish.goal_m) {
        let pair = Pair { start, goal_m };
        return checker.check(&pair).map(|()| pair);
    }
    if let Some([x_m, y_m, yaw_rad]) = wish.start {
        checker.check_end(End::Start, [x_m, y_m], &[yaw_rad])?;
    }
    if let Some(goal_m) = wish.goal_m {
        checker.check_end(End::Goal, goal_m, &std::array::from_fn::<_, 8, _>(heading_rad))?;
    }
    let mut rng = stream(seed, &[0x9A12]);
    let candidates = std::iter::repeat_with(|| candidate(wish, &checker.map, &mut rng)).take(ATTEMPTS);
    // To see that there is no way takes a search of everything around; to see that there is one does not.
    let standing = candidates.filter(|pair| checker.check_ends(pair).is_ok()).take(SEARCHES);
    let none = PairError::NoPair { distance_m: wish.distance_m };
    standing.into_iter().find(|pair| checker.check_way(pair).is_ok()).ok_or(none)
}

fn candidate(wish: &PairWish, map: &Bounds, rng: &mut Xoshiro256PlusPlus) -> Pair {
    let anywhere_m = [0, 1].map(|k| {
        let share: f64 = rng.random();
        map.south_west_m[k] + (map.north_east_m[k] - map.south_west_m[k]) * share
    });
    let yaw_rad: f64 = rng.random_range(0.0..TAU);
    let away_m = [wish.distance_m * yaw_rad.cos(), wish.distance_m * yaw_rad.sin()];
    match (wish.start, wish.goal_m) {
        (Some(start), _) => Pair { start, goal_m: [start[0] + away_m[0], start[1] + away_m[1]] },
        (None, goal_m) => {
            let goal_m = goal_m.unwrap_or(anywhere_m);
            Pair { start: [goal_m[0] - away_m[0], goal_m[1] - away_m[1], yaw_rad], goal_m }
        }
    }
}

struct Checker<'a> {
    world: Arc<World>,
    truth: Truth,
    vehicle: &'a Vehicle,
    /// Where the rear axle's centre may be: the vehicle's reach inside the world.
    map: Bounds,
    spacing_m: f64,
}

impl<'a> Checker<'a> {
    fn new(world: &Arc<World>, vehicle: &'a Vehicle) -> Self {
        let geometry = &vehicle.geometry;
        let reach_m = geometry.length_m - geometry.rear_overhang_m;
        let Bounds { south_west_m, north_east_m } = world.bounds();
        let map = Bounds {
            south_west_m: south_west_m.map(|v| v + reach_m),
            north_east_m: north_east_m.map(|v| v - reach_m),
        };
        let spacing_m = (geometry.track_m.min(geometry.wheelbase_m) / 3.0).max(world.geometry().resolution_m);
        let truth = Truth::new(vehicle, Arc::clone(world));
        Self { world: Arc::clone(world), truth, vehicle, map, spacing_m }
    }

    fn check(&self, pair: &Pair) -> Result<(), PairError> {
        self.check_ends(pair)?;
        self.check_way(pair)
    }

    fn check_ends(&self, pair: &Pair) -> Result<(), PairError> {
        let [x_m, y_m, yaw_rad] = pair.start;
        self.check_end(End::Start, [x_m, y_m], &[yaw_rad])?;
        self.check_end(End::Goal, pair.goal_m, &std::array::from_fn::<_, 8, _>(heading_rad))?;
        self.check_rest(pair.start)
    }

    /// Whether the plant, which finds its own balance, stays where it is parked and keeps the limits there. What is
    /// wrong with the vehicle itself is not for a pair to tell.
    fn check_rest(&self, start: [f64; 3]) -> Result<(), PairError> {
        let at_m = [start[0], start[1]];
        let Ok(mut plant) = Plant::new(self.vehicle, Arc::clone(&self.world), start) else { return Ok(()) };
        let before = plant.pose();
        plant.advance(REST_S);
        let after = plant.pose();
        let moved_m = (after.x_m - before.x_m).hypot(after.y_m - before.y_m);
        // False for a place that is no number, too.
        let stays = moved_m <= REST_SHARE * self.vehicle.geometry.length_m;
        if !stays {
            return Err(PairError::Slides { at_m, moved_m });
        }
        let stand = [after.roll_rad, after.pitch_rad];
        if self.keeps_limits(stand) { Ok(()) } else { Err(self.too_steep(End::Start, at_m, stand)) }
    }

    fn keeps_limits(&self, [roll_rad, pitch_rad]: [f64; 2]) -> bool {
        let limits = &self.vehicle.limits;
        roll_rad.abs() <= LIMIT_SHARE * limits.roll_max_rad
            && pitch_rad.abs() <= LIMIT_SHARE * limits.pitch_max_rad
    }

    fn too_steep(&self, end: End, at_m: [f64; 2], [roll_rad, pitch_rad]: [f64; 2]) -> PairError {
        let limits = &self.vehicle.limits;
        PairError::TooSteep {
            end,
            at_m,
            roll_deg: roll_rad.abs().to_degrees(),
            pitch_deg: pitch_rad.abs().to_degrees(),
            roll_max_deg: (LIMIT_SHARE * limits.roll_max_rad).to_degrees(),
            pitch_max_deg: (LIMIT_SHARE * limits.pitch_max_rad).to_degrees(),
        }
    }

    fn check_way(&self, pair: &Pair) -> Result<(), PairError> {
        let distance_m = (pair.goal_m[0] - pair.start[0]).hypot(pair.goal_m[1] - pair.start[1]);
        let within_m = (DETOUR_SHARE * distance_m).max(DETOUR_MIN_LENGTHS * self.vehicle.geometry.length_m);
        let geometry = &self.vehicle.geometry;
        let way = Way {
            spacing_m: self.spacing_m,
            radius_m: geometry.wheelbase_m / self.vehicle.limits.steering_max_rad.tan(),
            within_m,
        };
        let passes = |x_m: f64, y_m: f64, yaw_rad: f64| {
            self.map.contains(x_m, y_m) && self.is_safe(&self.truth.traversability(x_m, y_m, yaw_rad))
        };
        if way.connects(pair, passes) { Ok(()) } else { Err(PairError::Unreachable { within_m }) }
    }

    /// Whether the vehicle can stand at a point in one of the headings; else what is wrong with the best of them.
    fn check_end(&self, end: End, at_m: [f64; 2], headings_rad: &[f64]) -> Result<(), PairError> {
        if !self.map.contains(at_m[0], at_m[1]) {
            return Err(PairError::OutOfMap { end, at_m, map: self.map });
        }
        let stands: Vec<_> =
            headings_rad.iter().map(|yaw| self.truth.traversability(at_m[0], at_m[1], *yaw)).collect();
        if stands.iter().any(|stand| self.is_safe(stand)) {
            return Ok(());
        }
        let limits = &self.vehicle.limits;
        let steepness = |stand: &Traversability| {
            (stand.roll_rad.abs() / limits.roll_max_rad).max(stand.pitch_rad.abs() / limits.pitch_max_rad)
        };
        let free = stands.iter().filter(|stand| !stand.is_blocked);
        let Some(best) = free.min_by(|a, b| steepness(a).total_cmp(&steepness(b))) else {
            return Err(PairError::OnObstacle { end, at_m });
        };
        if steepness(best) <= LIMIT_SHARE {
            return Err(PairError::NoTraction { end, at_m });
        }
        Err(self.too_steep(end, at_m, [best.roll_rad, best.pitch_rad]))
    }

    fn is_safe(&self, stand: &Traversability) -> bool {
        !stand.is_blocked
            && self.keeps_limits([stand.roll_rad, stand.pitch_rad])
            && stand.linear_traction >= TRACTION_MIN
    }
}
