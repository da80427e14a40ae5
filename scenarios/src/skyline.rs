//! Tops of what stands in square tiles of the world, on two scales, so that rays fly where nothing can stop them.

use nalgebra::{Point3, Vector3};
use terrain::{Cell, GridGeometry};

use crate::World;

/// Cells along the side of a tile, fine and coarse.
const TILE_CELLS: [usize; 2] = [4, 20];

/// Upper bounds of ground, obstacles and plants per tile.
#[derive(Clone, Debug)]
pub(crate) struct Skyline {
    resolution_m: f64,
    south_west_m: [f64; 2],
    fine: Tiles,
    coarse: Tiles,
}

#[derive(Clone, Debug)]
struct Tiles {
    side_m: f64,
    /// Tiles per metre.
    per_m: f64,
    n_rows: usize,
    n_cols: usize,
    top_m: Vec<f32>,
}

impl Skyline {
    pub(crate) fn of(world: &World) -> Self {
        let geometry = world.geometry();
        let [fine, coarse] = TILE_CELLS.map(|side| Tiles::of(world, side));
        Self { resolution_m: geometry.resolution_m, south_west_m: geometry.south_west_m(), fine, coarse }
    }

    /// How far a ray from `point` flies above everything [m]: zero where something may stop it within a tile,
    /// `None` once it is beyond the world's border.
    pub(crate) fn free_flight_m(&self, point: &Point3<f64>, direction: &Vector3<f64>) -> Option<f64> {
        let (east_m, north_m) = (point.x - self.south_west_m[0], point.y - self.south_west_m[1]);
        // Well over the tile's edge, so that rays along an edge get on; a tile's top holds half a cell beyond it.
        let over_m = 0.4 * self.resolution_m;
        for tiles in [&self.coarse, &self.fine] {
            let (tile, top_m) = tiles.at(east_m, north_m)?;
            let exit_m = tiles.exit_m(tile, [east_m, north_m], direction) + over_m;
            let lowest_m = point.z + (direction.z * exit_m).min(0.0);
            if lowest_m > f64::from(top_m) {
                return Some(exit_m);
            }
        }
        Some(0.0)
    }
}

impl Tiles {
    fn of(world: &World, side: usize) -> Self {
        let geometry = *world.geometry();
        let [n_rows, n_cols] = [geometry.n_rows, geometry.n_cols].map(|n| n.div_ceil(side));
        let top_m = (0..n_rows * n_cols)
            .map(|tile| highest_m(world, &geometry, (tile / n_cols) * side, (tile % n_cols) * side, side))
            .collect();
        let side_m = side as f64 * geometry.resolution_m;
        Self { side_m, per_m: 1.0 / side_m, n_rows, n_cols, top_m }
    }

    /// Column and row of the tile that holds a point, and its top.
    fn at(&self, east_m: f64, north_m: f64) -> Option<([f64; 2], f32)> {
        if !(east_m >= 0.0 && north_m >= 0.0) {
            return None;
        }
        // Rounds down, as both are positive: a call to floor costs as much as all the rest on the oldest processors.
        let (col, row) = ((east_m * self.per_m) as usize, (north_m * self.per_m) as usize);
        let inside = col < self.n_cols && row < self.n_rows;
        inside.then(|| ([col as f64, row as f64], self.top_m[row * self.n_cols + col]))
    }

    /// Length of a ray's way from a point to the border of its tile [m].
    fn exit_m(&self, [col, row]: [f64; 2], [east_m, north_m]: [f64; 2], direction: &Vector3<f64>) -> f64 {
        let along = |start: f64, at_m: f64, rate: f64| {
            let border_m = if rate > 0.0 { start + 1.0 } else { start } * self.side_m;
            if rate == 0.0 { f64::INFINITY } else { (border_m - at_m) / rate }
        };
        along(col, east_m, direction.x).min(along(row, north_m, direction.y)).clamp(0.0, 4.0 * self.side_m)
    }
}

/// Top of everything in a tile [m]. Triangles reach to the neighbouring cells' centres, so these count too.
fn highest_m(world: &World, geometry: &GridGeometry, row: usize, col: usize, side: usize) -> f32 {
    let mut ground_m = f32::NEG_INFINITY;
    let mut cover_m: f32 = 0.0;
    for row in row.saturating_sub(1)..(row + side + 1).min(geometry.n_rows) {
        for col in col.saturating_sub(1)..(col + side + 1).min(geometry.n_cols) {
            let patch = &world.patches[Cell { row, col }];
            ground_m = ground_m.max(world.heights[Cell { row, col }]);
            cover_m = cover_m.max(patch.obstacle_height_m).max(patch.vegetation_height_m);
        }
    }
    ground_m + cover_m
}
