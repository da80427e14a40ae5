//! The ground in the layout that a million poses want: no division, runs of points at even steps.

use crate::World;

/// Heights of a world.
#[derive(Clone, Debug)]
pub(super) struct Ground {
    height_m: Vec<f32>,
    first_centre_m: [f64; 2],
    cells_per_m: f64,
    n_rows: u32,
    n_cols: u32,
    /// Column and row of the last centres.
    last: [f32; 2],
}

impl Ground {
    pub(super) fn of(world: &World) -> Self {
        let geometry = *world.geometry();
        Self {
            height_m: world.heights.values().to_vec(),
            first_centre_m: geometry.south_west_m().map(|edge_m| edge_m + 0.5 * geometry.resolution_m),
            cells_per_m: 1.0 / geometry.resolution_m,
            n_rows: geometry.n_rows as u32,
            n_cols: geometry.n_cols as u32,
            last: [(geometry.n_cols - 1) as f32, (geometry.n_rows - 1) as f32],
        }
    }

    /// The world's height at a point [m].
    #[inline]
    pub(super) fn height_m(&self, point_m: [f64; 2]) -> f64 {
        let [col, row] = self.in_cells(point_m);
        self.at_cells(col, row)
    }

    /// The same at `N` points `step_m` apart.
    #[inline]
    pub(super) fn run_m<const N: usize>(&self, first_m: [f64; 2], step_m: [f64; 2]) -> [f64; N] {
        let [col, row] = self.in_cells(first_m);
        let [col_step, row_step] = step_m.map(|step_m| step_m * self.cells_per_m);
        std::array::from_fn(|k| self.at_cells(col + k as f64 * col_step, row + k as f64 * row_step))
    }

    #[inline]
    fn in_cells(&self, [x_m, y_m]: [f64; 2]) -> [f64; 2] {
        [(x_m - self.first_centre_m[0]) * self.cells_per_m, (y_m - self.first_centre_m[1]) * self.cells_per_m]
    }

    #[inline(always)]
    fn at_cells(&self, col: f64, row: f64) -> f64 {
        let col = (col as f32).clamp(0.0, self.last[0]);
        let row = (row as f32).clamp(0.0, self.last[1]);
        let (west, south) = ((col as u32).min(self.n_cols - 2), (row as u32).min(self.n_rows - 2));
        let (u, v) = (col - west as f32, row - south as f32);
        let start = (south * self.n_cols + west) as usize;
        // One check of the bounds for all four.
        let n_cols = self.n_cols as usize;
        let square = &self.height_m[start..start + n_cols + 2];
        let (south_west, south_east) = (square[0], square[1]);
        let (north_west, north_east) = (square[n_cols], square[n_cols + 1]);
        // The fold runs from south-west to north-east; both sides are computed, a branch would miss half the time.
        let below = south_west + u * (south_east - south_west) + v * (north_east - south_east);
        let above = south_west + v * (north_west - south_west) + u * (north_east - north_west);
        f64::from(if u >= v { below } else { above })
    }
}
