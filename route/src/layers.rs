//! From measured elevation and what stands on it to the map that a route is searched on.

use crate::config::check;
use crate::{FrictionCurve, GroundCell};
use rayon::prelude::*;
use terrain::{Cell, GridGeometry, GridMap, SettingError, slope_at};

/// Measured ground; every layer has the elevation's geometry.
#[derive(Clone, Copy, Debug)]
pub struct GroundLayers<'a> {
    /// Height of the ground [m]; NaN where nothing was measured.
    pub elevation_m: &'a GridMap<f32>,
    /// Share of returns from low plants [-].
    pub low_vegetation_fraction: Option<&'a GridMap<f32>>,
    /// Open water where above zero.
    pub water: Option<&'a GridMap<f32>>,
    /// Distance to the nearest measurement of the ground [m].
    pub ground_gap_m: Option<&'a GridMap<f32>>,
    /// Friction of ground without plants, as far as the layers do not tell.
    pub bare: FrictionCurve,
    /// Friction of ground under low plants.
    pub grass: FrictionCurve,
}

/// Share of returns from low plants above which ground counts as grass.
const GRASS_FROM: f32 = 0.2;
/// Roughness of ground below plants that give every return [m]: what stands in them is not seen.
const HIDDEN_ROUGHNESS_M: f32 = 0.1;
/// Farther than this from any measurement of the ground nothing is known of it [m]: lidar returns nothing from water.
const GAP_MAX_M: f32 = 8.0;
/// Cells that a map may have: what fits into two gigabytes with its edges.
const CELLS_MAX: f64 = 16e6;

impl GroundLayers<'_> {
    /// The map in cells of `resolution_m`.
    ///
    /// Where the layers' cells are smaller, a cell holds the mean height of those in it and their deviation about the
    /// plane through them; where they are larger, heights lie on the surface between their centres, and the roughness
    /// is the deviation of nine of them.
    ///
    /// # Errors
    /// A resolution out of range, or one that makes too many cells.
    pub fn ground(&self, resolution_m: f64) -> Result<GridMap<GroundCell>, SettingError> {
        check("resolution_m", resolution_m, 0.05..=100.0, "0.05 to 100 m")?;
        let from = *self.elevation_m.geometry();
        let per_cell = from.resolution_m / resolution_m;
        let [n_rows, n_cols] = [from.n_rows, from.n_cols].map(|n| (n as f64 * per_cell).floor().max(1.0));
        check("cells", n_rows * n_cols, 1.0..=CELLS_MAX, "at most 16 million; choose a larger resolution")?;
        let origin = from.south_west_m().map(|corner_m| (corner_m / resolution_m).round() as i64);
        let geometry =
            GridGeometry { resolution_m, origin, n_rows: n_rows as usize, n_cols: n_cols as usize };
        let is_coarser = resolution_m > 1.5 * from.resolution_m;
        let cells = (0..geometry.n_cells()).into_par_iter().map(|index| {
            let centre_m = geometry.centre_m(geometry.cell(index));
            let (height_m, roughness_m) =
                if is_coarser { self.merged(centre_m, resolution_m) } else { self.between(centre_m) };
            self.cell(centre_m, height_m, roughness_m)
        });
        let values: Vec<GroundCell> = cells.collect();
        GridMap::from_values(geometry, values).ok_or(SettingError {
            field: "cells",
            expected: "as many as the map has",
            found: geometry.n_cells() as f64,
        })
    }

    fn cell(&self, [x_m, y_m]: [f64; 2], height_m: f32, roughness_m: f32) -> GroundCell {
        let layer = |layer: Option<&GridMap<f32>>| {
            layer
                .and_then(|layer| layer.at(x_m, y_m))
                .copied()
                .filter(|value| value.is_finite())
                .unwrap_or(0.0)
        };
        let plants = layer(self.low_vegetation_fraction).clamp(0.0, 1.0);
        let is_guessed = layer(self.ground_gap_m) > GAP_MAX_M;
        GroundCell {
            height_m: if is_guessed { f32::NAN } else { height_m },
            friction: if plants > GRASS_FROM { self.grass } else { self.bare },
            roughness_m: libm::hypotf(roughness_m, plants * HIDDEN_ROUGHNESS_M),
            is_obstacle: layer(self.water) > 0.0,
        }
    }

    /// Height and roughness at a point of cells that are about as large or larger.
    fn between(&self, [x_m, y_m]: [f64; 2]) -> (f32, f32) {
        let height_m = terrain::height_at(self.elevation_m, x_m, y_m);
        let cell = self.elevation_m.geometry().cell_at(x_m, y_m);
        let roughness_m = cell.map_or(f32::NAN, |cell| slope_at(self.elevation_m, cell, 1).roughness_m);
        (height_m, if roughness_m.is_finite() { roughness_m } else { 0.0 })
    }

    /// Mean height of the cells in a larger one, and their deviation about their plane.
    fn merged(&self, [x_m, y_m]: [f64; 2], edge_m: f64) -> (f32, f32) {
        let geometry = self.elevation_m.geometry();
        let Some(middle) = geometry.cell_at(x_m, y_m) else { return (f32::NAN, 0.0) };
        let reach = (0.5 * edge_m / geometry.resolution_m).round().max(1.0) as usize;
        let around = terrain::CellRegion::of_cell(middle).grown(reach, geometry);
        let cells = around.rows.flat_map(|row| around.cols.clone().map(move |col| Cell { row, col }));
        let (mut sum_m, mut n_known) = (0.0_f64, 0_usize);
        for height_m in cells.map(|cell| self.elevation_m[cell]).filter(|height_m| !height_m.is_nan()) {
            sum_m += f64::from(height_m);
            n_known += 1;
        }
        if n_known == 0 {
            return (f32::NAN, 0.0);
        }
        let roughness_m = slope_at(self.elevation_m, middle, reach).roughness_m;
        let mean_m = (sum_m / n_known as f64) as f32;
        (mean_m, if roughness_m.is_finite() { roughness_m } else { 0.0 })
    }
}
