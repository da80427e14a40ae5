//! PIETRA's hall (section VI): 9.6 x 8 m of concrete and turf with a skateboard ramp and a bed of bushes.
//!
//! South-west corner at the origin, the vehicle drives east. Across the straight way to the goal stand the bushes;
//! north of them lies the ramp between two rails, beyond it crates up to the wall; south of them crates leave a gap
//! at the wall. So there are three ways: straight through the bushes (7.2 m), over the ramp (about 8 m) or around on
//! the floor (about 10 m).

use rand::RngExt;
use serde::{Deserialize, Serialize};
use terrain::GridGeometry;

use crate::{Patch, Stribeck, World, WorldError, stream};

/// Where the vehicle starts: x [m], y [m], yaw [rad].
pub const ARENA_START: [f64; 3] = [1.2, 4.0, 0.0];
/// Where it is to go [m].
pub const ARENA_GOAL_M: [f64; 2] = [8.4, 4.0];

/// Size of the hall, east and north [m].
pub const ARENA_SIZE_M: [f64; 2] = [9.6, 8.0];
/// Wheels of the RC car are 15 cm across: 2 cm resolve the ramp's lip and sides.
const RESOLUTION_M: f64 = 0.02;
const TURF_PILE_M: f32 = 0.01;
const CRATE_HEIGHT_M: f32 = 0.6;

/// Rectangles [west, south, east, north] in metres.
const TURF: [f64; 4] = [3.6, 2.6, 6.2, 4.6];
const BUSHES: [f64; 4] = [4.3, 2.6, 5.4, 4.6];
const CRATES: [[f64; 4]; 2] = [[4.6, 6.2, 5.1, 8.0], [4.6, 1.15, 5.1, 2.6]];
const RAMP: [f64; 4] = [3.3, 4.6, 6.5, 6.2];
/// Boards along the ramp's sides: a step off its middle would tip the car.
const RAILS: [[f64; 4]; 2] = [[3.3, 4.6, 6.5, 4.66], [3.3, 6.14, 6.5, 6.2]];
const RAIL_HEIGHT_M: f32 = 0.15;

/// The bushes, the ramp's top and the crates stand at the same distance east [m].
const MIDDLE_X_M: f64 = 4.85;
/// Side of a floor to learn on [m], and of the turf on it.
const FLOOR_SIDE_M: f64 = 12.0;
/// Nothing on it is smaller than a piece of turf [m].
const FLOOR_RESOLUTION_M: f64 = 0.1;
const FLOOR_TURF_M: std::ops::Range<f64> = 2.5..6.0;
/// Pieces of turf on it.
const FLOOR_TURFS: usize = 3;

/// A way through the hall.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ArenaWay {
    /// Straight on, through the bushes.
    Bushes,
    /// Over the ramp.
    Ramp,
    /// Around on the floor, through the gap at the south wall.
    Floor,
}

/// What stands or lies in the hall.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ArenaPart {
    /// Turf.
    Turf,
    /// The bed of bushes.
    Bushes,
    /// The ramp.
    Ramp,
    /// A board along the ramp.
    Rail,
    /// Crates.
    Crates,
}

/// Everything in the hall, what lies under something before it, each as west, south, east, north [m].
pub fn arena_parts() -> impl Iterator<Item = (ArenaPart, [f64; 4])> {
    let alone = [(ArenaPart::Turf, TURF), (ArenaPart::Bushes, BUSHES), (ArenaPart::Ramp, RAMP)];
    let rails = RAILS.map(|rail| (ArenaPart::Rail, rail));
    alone.into_iter().chain(rails).chain(CRATES.map(|crates| (ArenaPart::Crates, crates)))
}

/// Which way a drive from start to goal took: where it first came past the middle of the hall; `None` for one that did
/// not get so far. `path_m` holds x, y of the rear axle's centre.
pub fn arena_way(path_m: &[[f64; 2]]) -> Option<ArenaWay> {
    let past = path_m.windows(2).find(|step| step[0][0] < MIDDLE_X_M && step[1][0] >= MIDDLE_X_M)?;
    let y_m = past[1][1];
    Some(match () {
        () if within(&BUSHES, MIDDLE_X_M, y_m) => ArenaWay::Bushes,
        () if within(&RAMP, MIDDLE_X_M, y_m) => ArenaWay::Ramp,
        () => ArenaWay::Floor,
    })
}

/// Level concrete with turf here and there, 12 x 12 m from the origin: all that PIETRA's car had driven on before it came
/// into the hall (section VI). The same seed gives the same floor.
///
/// # Errors
/// None that its constants allow.
pub fn arena_floor(seed: u64) -> Result<World, WorldError> {
    let mut rng = stream(seed, &[0xF100]);
    let turfs: [[f64; 4]; FLOOR_TURFS] = std::array::from_fn(|_| {
        let [east_m, north_m] = [(); 2].map(|()| rng.random_range(FLOOR_TURF_M));
        let [west, south] = [east_m, north_m].map(|side_m| rng.random_range(0.0..FLOOR_SIDE_M - side_m));
        [west, south, west + east_m, south + north_m]
    });
    let n = (FLOOR_SIDE_M / FLOOR_RESOLUTION_M).round() as usize;
    let geometry = GridGeometry { resolution_m: FLOOR_RESOLUTION_M, origin: [0, 0], n_rows: n, n_cols: n };
    let patch = |x_m: f64, y_m: f64| {
        if turfs.iter().any(|piece| within(piece, x_m, y_m)) {
            turf()
        } else {
            Patch::open(Stribeck::ASPHALT)
        }
    };
    World::from_fn("level concrete and turf".to_owned(), geometry, |_, _| 0.0, patch)
}

fn turf() -> Patch {
    Patch { rolling_resistance: 0.02, ..Patch::open(Stribeck::GRASS) }.overgrown(TURF_PILE_M)
}

/// What can be set of the hall.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ArenaConfig {
    /// Height of the bushes [m].
    pub bush_height_m: f64,
    /// Height of the ramp's flat top [m].
    pub ramp_height_m: f64,
    /// Length of the ramp's slopes, up and down alike [m].
    pub ramp_slope_length_m: f64,
}

impl Default for ArenaConfig {
    fn default() -> Self {
        Self { bush_height_m: 0.05, ramp_height_m: 0.2, ramp_slope_length_m: 1.3 }
    }
}

/// Why the hall cannot be built.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ArenaError {
    /// A setting is out of range.
    #[error("arena {field}: expected {expected}, found {found}")]
    Setting {
        /// Name of the setting.
        field: &'static str,
        /// The range that would do.
        expected: &'static str,
        /// The value that was given.
        found: f64,
    },
    /// The cells make no world.
    #[error(transparent)]
    World(#[from] WorldError),
}

impl ArenaConfig {
    /// Refuses settings that do not fit the hall.
    pub fn validate(&self) -> Result<(), ArenaError> {
        let settings = [
            ("bush_height_m", self.bush_height_m, 0.0..=2.0, "from 0 to 2 m"),
            ("ramp_height_m", self.ramp_height_m, 0.0..=1.0, "from 0 to 1 m"),
            ("ramp_slope_length_m", self.ramp_slope_length_m, 0.1..=1.3, "from 0.1 to 1.3 m"),
        ];
        match settings.into_iter().find(|(_, found, allowed, _)| !allowed.contains(found)) {
            Some((field, found, _, expected)) => Err(ArenaError::Setting { field, expected, found }),
            None => Ok(()),
        }
    }

    fn height_m(&self, x_m: f64, y_m: f64) -> f64 {
        if !within(&RAMP, x_m, y_m) {
            return 0.0;
        }
        let from_end_m = (x_m - RAMP[0]).min(RAMP[2] - x_m);
        self.ramp_height_m * (from_end_m / self.ramp_slope_length_m).min(1.0)
    }

    fn patch(&self, x_m: f64, y_m: f64) -> Patch {
        let floor = Patch::open(Stribeck::ASPHALT);
        if CRATES.iter().any(|crate_| within(crate_, x_m, y_m)) {
            return floor.obstructed(CRATE_HEIGHT_M);
        }
        if RAILS.iter().any(|rail| within(rail, x_m, y_m)) {
            return floor.obstructed(RAIL_HEIGHT_M);
        }
        if self.bush_height_m > 0.0 && within(&BUSHES, x_m, y_m) {
            return Patch::open(Stribeck::GRASS).overgrown(self.bush_height_m as f32);
        }
        if within(&TURF, x_m, y_m) {
            return turf();
        }
        floor
    }
}

fn within([west, south, east, north]: &[f64; 4], x_m: f64, y_m: f64) -> bool {
    (west..east).contains(&&x_m) && (south..north).contains(&&y_m)
}

/// Builds the hall.
pub fn arena(config: &ArenaConfig) -> Result<World, ArenaError> {
    config.validate()?;
    let [n_cols, n_rows] = ARENA_SIZE_M.map(|side_m| (side_m / RESOLUTION_M).round() as usize);
    let geometry = GridGeometry { resolution_m: RESOLUTION_M, origin: [0, 0], n_rows, n_cols };
    let name = format!("arena with bushes of {} m", config.bush_height_m);
    Ok(World::from_fn(name, geometry, |x, y| config.height_m(x, y), |x, y| config.patch(x, y))?)
}
