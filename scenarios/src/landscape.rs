//! Landscapes of mixed ground to plan routes over: a garden and an island, after those of AnyNav (Fu et al. 2025, section
//! 5.3.1), each made of a seed.

mod garden;
mod island;
mod kind;
mod sketch;
mod tasks;

use std::sync::Arc;

use rand::RngExt;
use rand_xoshiro::Xoshiro256PlusPlus;
use terrain::{CellRegion, GridGeometry, GridMap};

use crate::random::stream;
use crate::waves::Waves;
use crate::{Patch, World, WorldError};
pub use kind::GroundKind;
use sketch::{Cover, Sketch};
pub use tasks::RouteTask;

/// Edge of a cell [m].
const CELL_M: f64 = 1.0;
/// Height of a tree [m].
const TREE_M: f32 = 4.0;
/// How far a ground's friction may lie from the published one, everywhere and from place to place [-].
const OFF: f64 = 0.1;
const PATCHY: f64 = 0.05;

/// Which landscape.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, serde::Serialize)]
#[serde(rename_all = "snake_case")]
pub enum LandscapeKind {
    /// 400 x 400 m of seven grounds close together: mountains and craters of ice with ramps of rock, basins of mud, dunes,
    /// ponds, trees, a road around the middle and a hedge.
    Garden,
    /// 1,000 x 1,000 m: mountains, cliffs of rock, dirt and meadows with trees, beaches, the sea and few roads.
    Island,
}

impl LandscapeKind {
    /// Both.
    pub const ALL: [Self; 2] = [Self::Garden, Self::Island];

    /// Its name in tables.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Garden => "garden",
            Self::Island => "island",
        }
    }

    /// Cells along a side.
    const fn n_cells(self) -> usize {
        match self {
            Self::Garden => 400,
            Self::Island => 1000,
        }
    }

    /// Shortest and longest straight way from a start to its goal [m].
    const fn distance_m(self) -> [f64; 2] {
        match self {
            Self::Garden => [150.0, 280.0],
            Self::Island => [220.0, 420.0],
        }
    }
}

/// A world, and what an eye would call the ground of each cell.
#[derive(Clone, Debug)]
pub struct Landscape {
    /// Which one.
    pub kind: LandscapeKind,
    /// Heights, and friction that is up to a tenth off the published one for each ground, and by 5 % from place to place.
    pub world: Arc<World>,
    /// The ground of each cell; under trees and water, too.
    pub grounds: GridMap<GroundKind>,
    seed: u64,
}

/// Why there is no landscape with its tasks.
#[derive(Debug, thiserror::Error)]
pub enum LandscapeError {
    /// It makes no world.
    #[error(transparent)]
    World(#[from] WorldError),
    /// Starts and goals are hard to find on it.
    #[error("{kind} of seed {seed}: expected {expected} starts and goals, found {found}")]
    NoTasks {
        /// Which landscape.
        kind: &'static str,
        /// Its seed.
        seed: u64,
        /// As many as were asked for.
        expected: usize,
        /// As many as were found.
        found: usize,
    },
}

impl Landscape {
    /// The landscape of a seed, its south-west corner at the origin.
    ///
    /// # Errors
    /// A world that is none.
    pub fn new(kind: LandscapeKind, seed: u64) -> Result<Self, LandscapeError> {
        let n = kind.n_cells();
        let geometry = GridGeometry { resolution_m: CELL_M, origin: [0, 0], n_rows: n, n_cols: n };
        let rng = |part: u64| stream(seed, &[0x1A_4D5C, kind as u64, part]);
        let sketch = match kind {
            LandscapeKind::Garden => garden::garden(geometry, rng(0)),
            LandscapeKind::Island => island::island(geometry, rng(0)),
        };
        let patches = patches(&sketch, rng(1));
        let heights = sketch.heights_m.values().iter().map(|height_m| *height_m as f32).collect();
        let heights = GridMap::from_values(geometry, heights).unwrap_or(GridMap::filled(geometry, 0.0));
        let world = World::new(format!("{} of seed {seed}", kind.name()), heights, patches)?;
        Ok(Self { kind, world: Arc::new(world), grounds: sketch.grounds, seed })
    }
}

fn patches(sketch: &Sketch, mut rng: Xoshiro256PlusPlus) -> GridMap<Patch> {
    let geometry = *sketch.geometry();
    let factors = GroundKind::ALL.map(|_| 1.0 + rng.random_range(-OFF..OFF));
    let patchy = Waves::random([2.5, 25.0], &mut rng).on(geometry);
    let mut patches = GridMap::filled(geometry, GroundKind::Grass.patch(1.0));
    for cell in CellRegion::whole(&geometry).cells() {
        let ground = sketch.grounds[cell];
        let factor = factors[ground as usize] * (1.0 + (PATCHY * patchy[cell]).clamp(-0.2, 0.2));
        let bare = ground.patch(factor as f32);
        patches[cell] = match sketch.covers[cell] {
            Cover::Nothing => bare,
            Cover::Tree => bare.obstructed(TREE_M),
            Cover::Water => bare.obstructed(0.0),
        };
    }
    patches
}

/// Trees on grass and dirt, one in `area_m2` on the average and more of them in woods.
fn scattered_trees(sketch: &mut Sketch, area_m2: f64, rng: &mut Xoshiro256PlusPlus) {
    let geometry = *sketch.geometry();
    let woods = Waves::random([40.0, 120.0], rng).on(geometry);
    let share = geometry.resolution_m * geometry.resolution_m / area_m2;
    for cell in CellRegion::whole(&geometry).cells() {
        let density = share * (1.2 * woods[cell]).exp() / 2.05;
        let is_grown = rng.random_bool(density.min(1.0));
        let is_soil = [GroundKind::Grass, GroundKind::Dirt].contains(&sketch.grounds[cell]);
        if is_grown && is_soil && !sketch.is_road[cell] && sketch.covers[cell] == Cover::Nothing {
            sketch.covers[cell] = Cover::Tree;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::HashSet;

    fn landscape(kind: LandscapeKind) -> Landscape {
        Landscape::new(kind, 3).unwrap()
    }

    #[test]
    fn a_garden_has_every_ground_water_trees_and_icy_slopes_that_nobody_climbs() {
        let Landscape { world, grounds, .. } = landscape(LandscapeKind::Garden);
        let found: HashSet<GroundKind> = grounds.values().iter().copied().collect();
        assert_eq!(found.len(), GroundKind::ALL.len());
        let patches = world.patches.values();
        assert!(patches.iter().any(Patch::is_water));
        assert!(patches.iter().any(|patch| patch.obstacle_height_m > 1.0));
        let cells =
            CellRegion::whole(world.geometry()).cells().filter(|cell| grounds[*cell] == GroundKind::Ice);
        let slopes: Vec<f64> = cells
            .map(|cell| {
                let [x_m, y_m] = world.geometry().centre_m(cell);
                let [east, north] = world.gradient(x_m, y_m);
                east.hypot(north)
            })
            .collect();
        // Ice slides with 0.2 from half a metre per second on.
        let n_steep = slopes.iter().filter(|slope| **slope > 0.25).count();
        assert!(n_steep * 4 > slopes.len(), "{n_steep} of {}", slopes.len());
    }

    #[test]
    fn an_island_lies_in_the_sea_and_has_roads_that_cars_climb_and_cliffs_that_they_do_not() {
        let Landscape { world, grounds, .. } = landscape(LandscapeKind::Island);
        let side = world.geometry().n_cols;
        let border = (0..side).flat_map(|k| [(0, k), (side - 1, k), (k, 0), (k, side - 1)]);
        let mut border = border.map(|(row, col)| &world.patches[terrain::Cell { row, col }]);
        assert!(border.all(Patch::is_water));
        let slope = |cell| {
            let [x_m, y_m] = world.geometry().centre_m(cell);
            let [east, north] = world.gradient(x_m, y_m);
            east.hypot(north)
        };
        let cells = || CellRegion::whole(world.geometry()).cells();
        let roads: Vec<f64> =
            cells().filter(|cell| grounds[*cell] == GroundKind::Asphalt).map(slope).collect();
        let n_gentle = roads.iter().filter(|slope| **slope < 0.35).count();
        assert!(n_gentle * 10 > roads.len() * 9, "{n_gentle} of {}", roads.len());
        assert!(cells().map(slope).filter(|slope| *slope > 0.6).count() > 2000);
    }

    #[test]
    fn friction_is_off_the_published_one_by_little_and_by_another_share_for_each_ground() {
        let Landscape { world, grounds, .. } = landscape(LandscapeKind::Garden);
        let means = GroundKind::ALL.map(|kind| {
            let of_kind = grounds.values().iter().zip(world.patches.values());
            let shares: Vec<f64> = of_kind
                .filter(|(ground, _)| **ground == kind)
                .map(|(_, patch)| f64::from(patch.friction.static_friction / kind.friction().static_friction))
                .collect();
            assert!(shares.iter().all(|share| (0.7..=1.32).contains(share)), "{kind:?}");
            shares.iter().sum::<f64>() / shares.len() as f64
        });
        assert!(means.iter().all(|mean| (mean - 1.0).abs() < 0.12), "{means:?}");
        assert!(means.windows(2).any(|pair| (pair[0] - pair[1]).abs() > 0.02), "{means:?}");
    }

    #[test]
    fn the_same_seed_makes_the_same_and_another_one_another() {
        let heights = |seed: u64| Landscape::new(LandscapeKind::Garden, seed).unwrap().world.heights.clone();
        assert_eq!(heights(1), heights(1));
        assert!(heights(1) != heights(2));
    }
}
