//! An island like AnyNav's: mountains, cliffs of rock, dirt with trees, beaches, and few roads.

use std::f64::consts::TAU;

use rand::RngExt;
use rand_xoshiro::Xoshiro256PlusPlus;
use terrain::{CellRegion, GridGeometry, GridMap};

use super::sketch::{Cover, Sketch};
use super::{GroundKind, scattered_trees};
use crate::waves::Waves;

/// Mean distance of the coast from the middle over half of the side.
const COAST_SHARE: f64 = 0.8;
/// Height of the mountains [m].
const MOUNTAIN_M: f64 = 55.0;
/// Width of the beach [m].
const BEACH_M: f64 = 18.0;

/// How far the coast is from the middle, by direction.
struct Coast {
    half_side_m: f64,
    waves: Vec<(f64, f64)>,
}

impl Coast {
    fn random(half_side_m: f64, rng: &mut Xoshiro256PlusPlus) -> Self {
        let wave = |_| (rng.random_range(0.0..0.07), rng.random_range(0.0..TAU));
        Self { half_side_m, waves: (0..5).map(wave).collect() }
    }

    fn radius_m(&self, angle: f64) -> f64 {
        let sway: f64 = self
            .waves
            .iter()
            .zip(2..)
            .map(|((sway, phase), k)| sway * (f64::from(k) * angle + phase).sin())
            .sum();
        COAST_SHARE * self.half_side_m * (1.0 + sway)
    }

    /// Way inland from the coast, negative in the sea [m].
    fn inland_m(&self, at_m: [f64; 2]) -> f64 {
        let [east_m, north_m] = at_m.map(|place_m| place_m - self.half_side_m);
        self.radius_m(north_m.atan2(east_m)) - east_m.hypot(north_m)
    }

    /// A road at a distance inland.
    fn ring(&self, inland_m: f64) -> Vec<[f64; 2]> {
        let n = (8.0 * self.half_side_m) as usize;
        let point = |index: usize| self.place(TAU * index as f64 / n as f64, inland_m);
        (0..=n).map(point).collect()
    }

    fn place(&self, angle: f64, inland_m: f64) -> [f64; 2] {
        let radius_m = self.radius_m(angle) - inland_m;
        [angle.cos(), angle.sin()].map(|part| self.half_side_m + radius_m * part)
    }
}

pub(super) fn island(geometry: GridGeometry, mut rng: Xoshiro256PlusPlus) -> Sketch {
    let half_side_m = 0.5 * geometry.n_cols as f64 * geometry.resolution_m;
    let coast = Coast::random(half_side_m, &mut rng);
    let ridges = Waves::random([180.0, 420.0], &mut rng).on(geometry);
    let rough = Waves::random([25.0, 90.0], &mut rng).on(geometry);
    let heights = CellRegion::whole(&geometry).cells().map(|cell| {
        let inland_m = coast.inland_m(geometry.centre_m(cell));
        // Zero at the coast, and the full height of the mountains far inland.
        let t = (inland_m / 160.0).clamp(0.0, 1.0);
        let rise = t * t * (3.0 - 2.0 * t);
        let ridge = (1.0 - ridges[cell].abs()).max(0.0);
        (0.06 * inland_m).clamp(-3.0, 4.0) + rise * (MOUNTAIN_M * ridge * ridge + 1.2 * rough[cell])
    });
    let heights_m = GridMap::from_values(geometry, heights.collect());
    let mut sketch = Sketch::new(heights_m.unwrap_or(GridMap::filled(geometry, 0.0)), GroundKind::Dirt);
    sketch.build_road(&coast.ring(45.0));
    (0..2).for_each(|_| sketch.build_road(&crossing(&coast, &mut rng)));
    cover(&mut sketch, &coast, &mut rng);
    scattered_trees(&mut sketch, 220.0, &mut rng);
    sketch
}

/// A road from one side of the island to about the other, in two gentle bends.
fn crossing(coast: &Coast, rng: &mut Xoshiro256PlusPlus) -> Vec<[f64; 2]> {
    let from_rad = rng.random_range(0.0..TAU);
    let across_rad = from_rad + rng.random_range(2.4..3.6);
    let [from_m, to_m] = [from_rad, across_rad].map(|angle| coast.place(angle, 45.0));
    let sway_m = coast.half_side_m * rng.random_range(-0.18..0.18);
    let way_m = [to_m[0] - from_m[0], to_m[1] - from_m[1]];
    let length_m = way_m[0].hypot(way_m[1]);
    let n = length_m.ceil() as usize;
    let point = |index: usize| {
        let t = index as f64 / n as f64;
        let aside = sway_m * (TAU * t).sin() / length_m;
        [from_m[0] + t * way_m[0] - aside * way_m[1], from_m[1] + t * way_m[1] + aside * way_m[0]]
    };
    (0..=n).map(point).collect()
}

/// Sea, beaches, rock where it is steep, meadows and mud.
fn cover(sketch: &mut Sketch, coast: &Coast, rng: &mut Xoshiro256PlusPlus) {
    let geometry = *sketch.geometry();
    let patches = Waves::random([40.0, 140.0], rng).on(geometry);
    let bumps = Waves::random([3.0, 10.0], rng).on(geometry);
    for cell in CellRegion::whole(&geometry).cells() {
        let inland_m = coast.inland_m(geometry.centre_m(cell));
        if inland_m < 0.0 {
            sketch.covers[cell] = Cover::Water;
        }
        if sketch.is_road[cell] {
            continue;
        }
        let (ground, bump_m) = match patches[cell] {
            _ if inland_m < BEACH_M => (GroundKind::Sand, 0.02),
            _ if sketch.slope(cell) > 0.42 => (GroundKind::Rock, 0.06),
            value if value > 0.6 => (GroundKind::Grass, 0.02),
            value if value < -1.5 => (GroundKind::Mud, 0.01),
            _ => (GroundKind::Dirt, 0.04),
        };
        sketch.grounds[cell] = ground;
        sketch.heights_m[cell] += bump_m * bumps[cell];
    }
}
