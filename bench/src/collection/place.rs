//! Where data are gathered.

use std::fmt;

use rand::RngExt;
use scenarios::{
    ArenaConfig, ArenaError, RockFieldConfig, RockFieldError, RockMap, Split, World, WorldError, arena,
    arena_floor, rock_field, seed_of, stream,
};

/// A family of worlds.
#[allow(clippy::large_enum_variant, reason = "there is one of it in a collection")]
#[derive(Clone, Debug, PartialEq)]
pub enum Place {
    /// PIETRA's rock testbed; map k is the k-th of its split.
    Rocks {
        /// What the fields look like.
        field: RockFieldConfig,
        /// Which third of the testbed.
        split: Split,
    },
    /// PIETRA's hall, with bushes of another height in every map.
    Arena {
        /// Which third of the heights.
        split: Split,
    },
    /// Level concrete and turf.
    Floor {
        /// Which third of the floors.
        split: Split,
    },
}

/// Why a world cannot be made.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum PlaceError {
    /// The rock field.
    #[error(transparent)]
    Field(#[from] RockFieldError),
    /// The hall.
    #[error(transparent)]
    Arena(#[from] ArenaError),
    /// The floor.
    #[error(transparent)]
    Floor(#[from] WorldError),
}

/// Lowest and highest bushes of the hall [m].
const BUSH_HEIGHTS_M: [f64; 2] = [0.02, 0.3];

impl Place {
    /// The world of a number: the same seed, split and number give the same world.
    pub fn world(&self, seed: u64, index: u32) -> Result<World, PlaceError> {
        match self {
            Self::Rocks { field, split } => {
                Ok(rock_field(field, RockMap { seed, split: *split, index }, &[])?)
            }
            Self::Arena { split } => {
                let key = [0xA12E, *split as u64, u64::from(index)];
                let bush_height_m = stream(seed, &key).random_range(BUSH_HEIGHTS_M[0]..BUSH_HEIGHTS_M[1]);
                Ok(arena(&ArenaConfig { bush_height_m, ..ArenaConfig::default() })?)
            }
            Self::Floor { split } => {
                Ok(arena_floor(seed_of(seed, &[0xF100, *split as u64, u64::from(index)]))?)
            }
        }
    }
}

impl fmt::Display for Place {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Rocks { field, split: Split::Test } => {
                write!(formatter, "rock fields, Test, heights times {}", field.test_height_scale)
            }
            Self::Rocks { split, .. } => write!(formatter, "rock fields, {split:?}"),
            Self::Arena { split } => write!(formatter, "arena, {split:?}"),
            Self::Floor { split } => write!(formatter, "level concrete and turf, {split:?}"),
        }
    }
}
