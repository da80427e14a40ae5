//! A garden like AnyNav's: seven grounds close together, with mountains and craters of ice, basins of mud and a road.

use std::f64::consts::{PI, TAU};

use rand::RngExt;
use rand_xoshiro::Xoshiro256PlusPlus;
use terrain::{CellRegion, GridGeometry, GridMap};

use super::sketch::{Cover, Sketch};
use super::{GroundKind, scattered_trees};
use crate::waves::Waves;

/// Attempts to find a free place for a feature.
const ATTEMPTS: usize = 200;

pub(super) fn garden(geometry: GridGeometry, mut rng: Xoshiro256PlusPlus) -> Sketch {
    let side_m = geometry.n_cols as f64 * geometry.resolution_m;
    let rolling = Waves::random([70.0, 220.0], &mut rng).on(geometry);
    let heights_m = rolling.values().iter().map(|value| 2.5 * value).collect();
    let heights_m = GridMap::from_values(geometry, heights_m);
    let mut sketch = Sketch::new(heights_m.unwrap_or(GridMap::filled(geometry, 0.0)), GroundKind::Grass);
    cover_with_patches(&mut sketch, &mut rng);
    sketch.build_road(&ring(side_m, &mut rng));
    for kind in [Feature::Crater, Feature::Mountain, Feature::Crater, Feature::Mountain] {
        kind.place(&mut sketch, &mut rng);
    }
    for kind in [Feature::Basin, Feature::Sand, Feature::Pond] {
        (0..3).for_each(|_| kind.place(&mut sketch, &mut rng));
    }
    scattered_trees(&mut sketch, 250.0, &mut rng);
    fence(&mut sketch);
    sketch
}

/// A hedge along the border.
fn fence(sketch: &mut Sketch) {
    let geometry = *sketch.geometry();
    let is_border = |place: usize, n: usize| place < 2 || place + 2 >= n;
    let cells = CellRegion::whole(&geometry).cells();
    for cell in
        cells.filter(|cell| is_border(cell.row, geometry.n_rows) || is_border(cell.col, geometry.n_cols))
    {
        sketch.covers[cell] = Cover::Tree;
    }
}

/// Dirt and rock in patches as large as a house.
fn cover_with_patches(sketch: &mut Sketch, rng: &mut Xoshiro256PlusPlus) {
    let geometry = *sketch.geometry();
    let patches = Waves::random([25.0, 90.0], rng).on(geometry);
    let bumps = Waves::random([2.5, 8.0], rng).on(geometry);
    for cell in CellRegion::whole(&geometry).cells() {
        let (ground, bump_m) = match patches[cell] {
            value if value > 1.2 => (GroundKind::Rock, 0.05),
            value if value > 0.3 => (GroundKind::Dirt, 0.02),
            _ => (GroundKind::Grass, 0.015),
        };
        sketch.grounds[cell] = ground;
        sketch.heights_m[cell] += bump_m * bumps[cell];
    }
}

/// A road around the middle.
fn ring(side_m: f64, rng: &mut Xoshiro256PlusPlus) -> Vec<[f64; 2]> {
    let waves: Vec<(f64, f64)> =
        (2..5).map(|_| (rng.random_range(0.0..0.1), rng.random_range(0.0..TAU))).collect();
    let n = (6.0 * side_m) as usize;
    let point = |index: usize| {
        let angle = TAU * index as f64 / n as f64;
        let sway: f64 =
            waves.iter().zip(2..).map(|((sway, phase), k)| sway * (f64::from(k) * angle + phase).sin()).sum();
        let radius_m = 0.3 * side_m * (1.0 + sway);
        [0.5 * side_m + radius_m * angle.cos(), 0.5 * side_m + radius_m * angle.sin()]
    };
    (0..=n).map(point).collect()
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Feature {
    /// A ring of ice with a ramp of rock.
    Crater,
    /// A hill under ice with a side of rock.
    Mountain,
    /// A hollow of mud.
    Basin,
    /// Dunes.
    Sand,
    /// Water.
    Pond,
}

impl Feature {
    fn radius_m(self, rng: &mut Xoshiro256PlusPlus) -> f64 {
        rng.random_range(match self {
            Self::Crater | Self::Mountain => 34.0..44.0,
            Self::Basin => 20.0..32.0,
            Self::Sand => 25.0..45.0,
            Self::Pond => 12.0..20.0,
        })
    }

    fn place(self, sketch: &mut Sketch, rng: &mut Xoshiro256PlusPlus) {
        let side_m = sketch.geometry().n_cols as f64 * sketch.geometry().resolution_m;
        for _ in 0..ATTEMPTS {
            let radius_m = self.radius_m(rng);
            let centre_m = [0, 1].map(|_| rng.random_range(0.0..side_m));
            if sketch.is_free(centre_m, radius_m + 3.0) && !self.is_taken(sketch, centre_m, radius_m) {
                return self.build(sketch, centre_m, radius_m, rng.random_range(-PI..PI));
            }
        }
    }

    /// Ice, mud and sand keep apart.
    fn is_taken(self, sketch: &Sketch, centre_m: [f64; 2], radius_m: f64) -> bool {
        let natural = [GroundKind::Grass, GroundKind::Dirt, GroundKind::Rock];
        sketch
            .disc(centre_m, radius_m + 3.0)
            .iter()
            .any(|(cell, _)| !natural.contains(&sketch.grounds[*cell]))
    }

    fn build(self, sketch: &mut Sketch, centre_m: [f64; 2], radius_m: f64, ramp_rad: f64) {
        let geometry = *sketch.geometry();
        for (cell, away_m) in sketch.disc(centre_m, radius_m) {
            let [x_m, y_m] = geometry.centre_m(cell);
            let bearing_rad = (y_m - centre_m[1]).atan2(x_m - centre_m[0]);
            let off_rad = ((bearing_rad - ramp_rad + PI).rem_euclid(TAU) - PI).abs();
            let is_ramp = off_rad < 0.55;
            let share = away_m / radius_m;
            let bell = 0.5 * (1.0 + (PI * share).cos());
            let icy = if is_ramp { GroundKind::Rock } else { GroundKind::Ice };
            let (rise_m, ground) = match self {
                // Highest at three fifths of the radius, and half as high inside.
                Self::Crater => (0.2 * radius_m * crater(share), icy),
                Self::Mountain => (0.24 * radius_m * bell, icy),
                Self::Basin => (-0.1 * radius_m * bell, GroundKind::Mud),
                Self::Sand => (0.6 * bell * (0.35 * x_m).sin(), GroundKind::Sand),
                Self::Pond => (-0.6 * bell, GroundKind::Mud),
            };
            sketch.heights_m[cell] += rise_m;
            sketch.grounds[cell] = ground;
            if self == Self::Pond {
                sketch.covers[cell] = Cover::Water;
            }
        }
    }
}

/// Height of a crater over its rim's, by the share of the radius.
fn crater(share: f64) -> f64 {
    let smooth = |t: f64| 0.5 * (1.0 - (PI * t.clamp(0.0, 1.0)).cos());
    if share > 0.6 { smooth((1.0 - share) / 0.4) } else { 0.5 + 0.5 * smooth(share / 0.6) }
}
