//! The grounds that landscapes are made of.

use crate::{Patch, Stribeck};

/// A ground that an eye tells from others, in the order of AnyNav's table.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, serde::Serialize)]
#[serde(rename_all = "snake_case")]
pub enum GroundKind {
    /// A road.
    Asphalt,
    /// Bare rock.
    Rock,
    /// Dirt.
    Dirt,
    /// Grass.
    Grass,
    /// Mud.
    Mud,
    /// Sand.
    Sand,
    /// Ice.
    Ice,
}

impl GroundKind {
    /// All of them.
    pub const ALL: [Self; 7] =
        [Self::Asphalt, Self::Rock, Self::Dirt, Self::Grass, Self::Mud, Self::Sand, Self::Ice];

    /// Its name in tables.
    pub const fn name(self) -> &'static str {
        ["asphalt", "rock", "dirt", "grass", "mud", "sand", "ice"][self as usize]
    }

    /// Its friction before what a landscape makes of it.
    pub const fn friction(self) -> Stribeck {
        [
            Stribeck::ASPHALT,
            Stribeck::ROCK,
            Stribeck::DIRT,
            Stribeck::GRASS,
            Stribeck::MUD,
            Stribeck::SAND,
            Stribeck::ICE,
        ][self as usize]
    }

    /// Resistance over load, beside the tyre's own [-].
    const fn rolling_resistance(self) -> f32 {
        [0.0, 0.01, 0.02, 0.03, 0.08, 0.08, 0.0][self as usize]
    }

    /// Bare ground of this kind, its friction multiplied by `factor`.
    pub fn patch(self, factor: f32) -> Patch {
        Patch { rolling_resistance: self.rolling_resistance(), ..Patch::open(self.friction().scaled(factor)) }
    }
}
