//! Whether a rectangle on the ground touches an obstacle.

use bicycle::Geometry;
use terrain::{Cell, GridGeometry, TerrainClass};

use crate::World;

/// Counts of obstacle cells south-west of each lattice corner, so that any rectangle of cells is counted by four reads.
#[derive(Clone, Debug)]
pub(super) struct ObstacleCount {
    geometry: GridGeometry,
    /// Shape [n_rows + 1, n_cols + 1].
    south_west: Vec<u32>,
}

impl ObstacleCount {
    pub(super) fn of(world: &World) -> Self {
        let geometry = *world.geometry();
        let width = geometry.n_cols + 1;
        let mut south_west = vec![0; width * (geometry.n_rows + 1)];
        for row in 0..geometry.n_rows {
            let mut in_row = 0;
            for col in 0..geometry.n_cols {
                in_row += u32::from(world.patches[Cell { row, col }].class == TerrainClass::Obstacle);
                south_west[(row + 1) * width + col + 1] = south_west[row * width + col + 1] + in_row;
            }
        }
        Self { geometry, south_west }
    }

    /// Whether the vehicle's outline, body frame at (`x_m`, `y_m`, `yaw_rad`), covers a cell of an obstacle.
    pub(super) fn touches(&self, world: &World, vehicle: &Geometry, [x_m, y_m, yaw_rad]: [f64; 3]) -> bool {
        let reach_m = (vehicle.length_m - vehicle.rear_overhang_m)
            .max(vehicle.rear_overhang_m)
            .hypot(0.5 * vehicle.width_m);
        if self.count([x_m - reach_m, y_m - reach_m], [x_m + reach_m, y_m + reach_m]) == 0 {
            return false;
        }
        let (sin, cos) = yaw_rad.sin_cos();
        // Dense enough that no cell, nor a twentieth of the outline, slips through.
        let spacing_m = self.geometry.resolution_m.min(vehicle.width_m).max(vehicle.width_m / 20.0);
        let steps = |side_m: f64| (side_m / spacing_m).ceil().max(1.0) as usize;
        let (along, across) = (steps(vehicle.length_m), steps(vehicle.width_m));
        (0..=along).any(|i| {
            let ahead_m = vehicle.length_m * i as f64 / along as f64 - vehicle.rear_overhang_m;
            (0..=across).any(|j| {
                let left_m = vehicle.width_m * (j as f64 / across as f64 - 0.5);
                let patch =
                    world.patch(x_m + cos * ahead_m - sin * left_m, y_m + sin * ahead_m + cos * left_m);
                patch.class == TerrainClass::Obstacle
            })
        })
    }

    /// Obstacle cells in the cells that a rectangle along the axes touches.
    fn count(&self, south_west_m: [f64; 2], north_east_m: [f64; 2]) -> u32 {
        let geometry = &self.geometry;
        let corner = |value_m: f64, origin: i64, n: usize| {
            let place = value_m / geometry.resolution_m - origin as f64;
            (place.max(0.0) as usize).min(n)
        };
        let cols = [south_west_m[0], north_east_m[0] + geometry.resolution_m]
            .map(|x_m| corner(x_m, geometry.origin[0], geometry.n_cols));
        let rows = [south_west_m[1], north_east_m[1] + geometry.resolution_m]
            .map(|y_m| corner(y_m, geometry.origin[1], geometry.n_rows));
        let at = |row: usize, col: usize| self.south_west[row * (geometry.n_cols + 1) + col];
        at(rows[1], cols[1]) + at(rows[0], cols[0]) - at(rows[0], cols[1]) - at(rows[1], cols[0])
    }
}
