//! The ground in the layout that a million poses want: no division, runs of points at even steps.

use crate::World;
use crate::world::height_on_triangles;

/// Heights of a world.
#[derive(Clone, Debug)]
pub(super) struct Ground {
    height_m: Vec<f32>,
    first_centre_m: [f64; 2],
    cells_per_m: f64,
    n_rows: usize,
    n_cols: usize,
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
            n_rows: geometry.n_rows,
            n_cols: geometry.n_cols,
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
        let first = self.in_cells(first_m);
        let step = step_m.map(|step_m| step_m * self.cells_per_m);
        let end = [first[0] + (N - 1) as f64 * step[0], first[1] + (N - 1) as f64 * step[1]];
        let inside = |[col, row]: [f64; 2]| {
            col >= 0.0 && row >= 0.0 && col < f64::from(self.last[0]) && row < f64::from(self.last[1])
        };
        if !(inside(first) && inside(end)) {
            return std::array::from_fn(|k| {
                let k = k as f64;
                self.at_cells(first[0] + k * step[0], first[1] + k * step[1])
            });
        }
        self.run_inside(first, step)
    }

    /// A run whose ends lie inside: whole numbers of 1/65536 cells, so that no step converts or checks a number.
    #[inline]
    fn run_inside<const N: usize>(&self, first: [f64; 2], step: [f64; 2]) -> [f64; N] {
        const ONE: f64 = 65536.0;
        let [mut col, mut row] = first.map(|first| (first * ONE) as i64);
        let [col_step, row_step] = step.map(|step| (step * ONE) as i64);
        let mut heights_m = [0.0; N];
        for height_m in &mut heights_m {
            let share = |place: i64| (place & 0xFFFF) as f32 * (1.0 / ONE as f32);
            *height_m = self.in_square((row >> 16) as usize, (col >> 16) as usize, share(col), share(row));
            col += col_step;
            row += row_step;
        }
        heights_m
    }

    #[inline]
    fn in_cells(&self, [x_m, y_m]: [f64; 2]) -> [f64; 2] {
        [(x_m - self.first_centre_m[0]) * self.cells_per_m, (y_m - self.first_centre_m[1]) * self.cells_per_m]
    }

    #[inline]
    fn at_cells(&self, col: f64, row: f64) -> f64 {
        let place = |place: f64, n: usize, last: f32| {
            let place = (place as f32).max(0.0).min(last);
            let index = (place as usize).min(n - 2);
            (index, place - index as f32)
        };
        let (west, u) = place(col, self.n_cols, self.last[0]);
        let (south, v) = place(row, self.n_rows, self.last[1]);
        self.in_square(south, west, u, v)
    }

    /// Height in the square whose south-west corner is this centre, at these shares of the way east and north.
    #[inline(always)]
    fn in_square(&self, south: usize, west: usize, u: f32, v: f32) -> f64 {
        let start = south * self.n_cols + west;
        // One check of the bounds for all four.
        let square = &self.height_m[start..start + self.n_cols + 2];
        let corners = [square[0], square[1], square[self.n_cols], square[self.n_cols + 1]];
        f64::from(height_on_triangles(corners, [u, v]))
    }
}
