//! Worlds with their picture from above: seven grounds in textured patches, mixed here and wet there, and the friction
//! of each cell, which the picture shows only as well as looks tell it.
//!
//! Chosen, not measured: the textures, the size of the patches, and that wet ground holds three quarters of what dry
//! ground does. Friction is the published one times 0.9 to 1.1 for each cell.

mod noise;
mod texture;

use std::f64::consts::TAU;

use rand::RngExt;
use rand::seq::SliceRandom;
use rand_xoshiro::Xoshiro256PlusPlus;
use terrain::{Cell, GridGeometry, GridMap};

use crate::random::{seed_of, stream};
use crate::{Patch, Stribeck, World, WorldError};
use noise::{hash, noise, unit};
pub use texture::Looks;
use texture::{Colour, Light, Texture};

/// The grounds, by the names of the published table.
pub const PAINTED_GROUNDS: [(&str, Stribeck); 7] = [
    ("asphalt", Stribeck::ASPHALT),
    ("rock", Stribeck::ROCK),
    ("dirt", Stribeck::DIRT),
    ("grass", Stribeck::GRASS),
    ("mud", Stribeck::MUD),
    ("sand", Stribeck::SAND),
    ("ice", Stribeck::ICE),
];

/// Patches of ground in a world, about so many times seven.
const ROUNDS: usize = 5;
/// Patches that are mixed of two grounds, and that are wet.
const MIXED_SHARE: f64 = 0.15;
const WET_SHARE: f64 = 0.15;
/// Friction of wet ground over that of dry one, and its brightness.
const WET_FRICTION: f32 = 0.75;
const WET_COLOUR: Colour = [0.62, 0.66, 0.72];
/// Friction of a cell over what its ground holds.
const CELL_SCALES: std::ops::Range<f32> = 0.9..1.1;
/// Steepest slope [-] and distance of the hills [m].
const SLOPE: f64 = 0.04;
const HILLS_M: f64 = 90.0;
/// Deviation of the heights that a lidar measures [m].
const HEIGHT_NOISE_M: f32 = 0.004;

/// Which world to make.
#[derive(Clone, Copy, Debug)]
pub struct PaintedConfig {
    /// Which one.
    pub seed: u64,
    /// Which textures, light and season.
    pub looks: Looks,
    /// Length of a side [m].
    pub side_m: f64,
    /// Edge of a cell, and of a pixel [m].
    pub cell_m: f64,
}

/// A world and what it looks like from above; all maps lie on the cells of the world.
#[derive(Clone, Debug)]
pub struct PaintedWorld {
    /// The ground itself.
    pub world: World,
    /// Index into [`PAINTED_GROUNDS`] of what a cell is for the most part.
    pub grounds: GridMap<u8>,
    /// Red, green, blue, 0 to 1.
    pub colours: GridMap<[f32; 3]>,
    /// Heights as a lidar sees them, with blades and stones that no wheel feels [m].
    pub seen_heights_m: GridMap<f32>,
}

/// A patch of ground around a place.
struct Site {
    at_m: [f64; 2],
    ground: usize,
    /// What it is mixed with.
    other: Option<usize>,
    is_wet: bool,
}

/// What a cell is made of.
struct Blend {
    ground: usize,
    other: usize,
    /// Of the second.
    share: f32,
    is_wet: bool,
}

fn sites(side_m: f64, rng: &mut Xoshiro256PlusPlus) -> Vec<Site> {
    let mut grounds: Vec<usize> = (0..7 * ROUNDS).map(|index| index % 7).collect();
    grounds.shuffle(rng);
    let mut site = |ground| {
        let at_m = [(); 2].map(|()| 0.5 * side_m * rng.random_range(-1.0..1.0));
        let other = rng.random_bool(MIXED_SHARE).then(|| (ground + rng.random_range(1..7)) % 7);
        Site { at_m, ground, other, is_wet: rng.random_bool(WET_SHARE) }
    };
    grounds.into_iter().map(&mut site).collect()
}

/// What lies at a place: the patch whose middle is nearest, along crooked borders.
fn blend(seed: u64, sites: &[Site], at_m: [f64; 2]) -> Blend {
    let crooked_m = |key: u64| 5.0 * noise(seed ^ key, at_m, 18.0) + 1.0 * noise(seed ^ key ^ 8, at_m, 3.0);
    let [x_m, y_m] = [at_m[0] + crooked_m(11), at_m[1] + crooked_m(12)];
    let far_m = |site: &&Site| (site.at_m[0] - x_m).hypot(site.at_m[1] - y_m);
    let Some(site) = sites.iter().min_by(|a, b| far_m(a).total_cmp(&far_m(b))) else {
        return Blend { ground: 0, other: 0, share: 0.0, is_wet: false };
    };
    let share = match site.other {
        Some(_) => (0.5 + 1.2 * noise(seed ^ 13, at_m, 4.0)).clamp(0.0, 1.0) as f32,
        None => 0.0,
    };
    Blend { ground: site.ground, other: site.other.unwrap_or(site.ground), share, is_wet: site.is_wet }
}

impl Blend {
    fn main(&self) -> usize {
        if self.share > 0.5 { self.other } else { self.ground }
    }

    fn friction(&self, scale: f32) -> Stribeck {
        let wet = if self.is_wet { WET_FRICTION } else { 1.0 };
        let [a, b] = [self.ground, self.other].map(|ground| PAINTED_GROUNDS[ground].1);
        let mean = |a: f32, b: f32| a + self.share * (b - a);
        Stribeck {
            static_friction: mean(a.static_friction, b.static_friction),
            dynamic_friction: mean(a.dynamic_friction, b.dynamic_friction),
            viscous_friction: mean(a.viscous_friction, b.viscous_friction),
            stribeck_speed_mps: mean(a.stribeck_speed_mps, b.stribeck_speed_mps),
        }
        .scaled(scale * wet)
    }
}

/// Paints from what a cell is made of.
struct Painter {
    seed: u64,
    textures: [Texture; 7],
    light: Light,
}

impl Painter {
    fn colour(&self, blend: &Blend, at_m: [f64; 2], pixel: [u64; 2]) -> Colour {
        let of = |ground: usize| {
            let colour = self.textures[ground].colour(seed_of(self.seed, &[ground as u64]), at_m, pixel);
            self.light.on(ground, colour)
        };
        let (a, b) = (of(blend.ground), of(blend.other));
        let wet = if blend.is_wet { WET_COLOUR } else { [1.0; 3] };
        std::array::from_fn(|i| wet[i] * (a[i] + blend.share * (b[i] - a[i])))
    }

    fn relief_m(&self, blend: &Blend, pixel: [u64; 2]) -> f32 {
        let of = |ground: usize| self.textures[ground].relief_m(self.seed, pixel);
        let noise_m = HEIGHT_NOISE_M * 2.4 * (unit(hash(self.seed ^ 21, pixel)) - 0.5);
        of(blend.ground) + blend.share * (of(blend.other) - of(blend.ground)) + noise_m
    }
}

/// A world of seven grounds and its picture; the same for the same configuration.
///
/// # Errors
/// A side that holds fewer than two cells, or lengths that are none.
pub fn painted_world(config: &PaintedConfig) -> Result<PaintedWorld, WorldError> {
    let PaintedConfig { seed, looks, side_m, cell_m } = *config;
    let mut rng = stream(seed, &[0x9A14]);
    let sites = sites(side_m, &mut rng);
    let textures = std::array::from_fn(|ground| Texture::drawn(ground, looks, &mut rng));
    let painter = Painter { seed, textures, light: Light::drawn(looks, &mut rng) };
    let phases = [(); 2].map(|()| rng.random_range(0.0..TAU));
    let n = if cell_m > 0.0 { (side_m / cell_m) as usize } else { 0 };
    let geometry = GridGeometry::centred(cell_m, n, n, 0.0, 0.0);
    let per_m = TAU / HILLS_M;
    let height_m = |x_m: f64, y_m: f64| {
        SLOPE / per_m * (per_m * x_m + phases[0]).sin() * (per_m * y_m + phases[1]).cos()
    };
    let friction = |x_m: f64, y_m: f64| {
        let random = unit(hash(seed ^ 31, [x_m, y_m].map(f64::to_bits)));
        let scale = CELL_SCALES.start + random * (CELL_SCALES.end - CELL_SCALES.start);
        Patch::open(blend(seed, &sites, [x_m, y_m]).friction(scale))
    };
    let world = World::from_fn("painted", geometry, height_m, friction)?;
    Ok(paint(world, &painter, &sites))
}

fn paint(world: World, painter: &Painter, sites: &[Site]) -> PaintedWorld {
    let geometry = *world.geometry();
    let mut grounds = GridMap::filled(geometry, 0);
    let mut colours = GridMap::filled(geometry, [0.0; 3]);
    let mut seen_heights_m = world.heights.clone();
    for index in 0..geometry.n_cells() {
        let cell @ Cell { row, col } = geometry.cell(index);
        let (at_m, pixel) = (geometry.centre_m(cell), [col as u64, row as u64]);
        let blend = blend(painter.seed, sites, at_m);
        grounds[cell] = blend.main() as u8;
        colours[cell] = painter.colour(&blend, at_m, pixel);
        seen_heights_m[cell] += painter.relief_m(&blend, pixel);
    }
    PaintedWorld { world, grounds, colours, seen_heights_m }
}
