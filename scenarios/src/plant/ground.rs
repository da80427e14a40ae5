//! The surface that wheels and body touch: the ground, raised by the height of obstacles.

use std::sync::Arc;

use crate::world::height_on_triangles;
use crate::{Patch, World};

/// Heights that stop a vehicle, in the layout that the wheels' many lookups want.
pub(crate) struct Ground {
    surface_m: Vec<f32>,
    first_centre_m: [f64; 2],
    cells_per_m: f64,
    n_rows: usize,
    n_cols: usize,
    /// Whether anything stands on the ground.
    has_obstacles: bool,
    world: Arc<World>,
}

/// A cell in fixed point.
const ONE_CELL: f64 = 4_294_967_296.0;
/// A surface raised by more than this belongs to an obstacle [m].
const RAISED_MIN_M: f64 = 1e-3;

impl Ground {
    pub(crate) fn new(world: Arc<World>) -> Self {
        let geometry = *world.geometry();
        let raised = |(height_m, patch): (&f32, &Patch)| height_m + patch.obstacle_height_m;
        Self {
            surface_m: world.heights.values().iter().zip(world.patches.values()).map(raised).collect(),
            first_centre_m: geometry.south_west_m().map(|edge_m| edge_m + 0.5 * geometry.resolution_m),
            cells_per_m: 1.0 / geometry.resolution_m,
            n_rows: geometry.n_rows,
            n_cols: geometry.n_cols,
            has_obstacles: world.patches.values().iter().any(|patch| patch.obstacle_height_m > 0.0),
            world,
        }
    }

    /// Height of the surface [m]; beyond the border that of the nearest edge.
    #[inline]
    pub(crate) fn height_m(&self, x_m: f64, y_m: f64) -> f64 {
        let place = |value_m: f64, first_m: f64, n: usize| {
            let place = ((value_m - first_m) * self.cells_per_m).max(0.0).min((n - 1) as f64);
            let index = (place as usize).min(n - 2);
            (index, place - index as f64)
        };
        let (col, u) = place(x_m, self.first_centre_m[0], self.n_cols);
        let (row, v) = place(y_m, self.first_centre_m[1], self.n_rows);
        self.in_square(row, col, u, v)
    }

    /// The same at points `step_m` apart.
    #[inline]
    pub(crate) fn run_m(&self, first_m: [f64; 2], step_m: [f64; 2], heights_m: &mut [f64]) {
        let first = [0, 1].map(|axis| (first_m[axis] - self.first_centre_m[axis]) * self.cells_per_m);
        let step = step_m.map(|step_m| step_m * self.cells_per_m);
        let n = heights_m.len() as f64 - 1.0;
        let is_inside = |start: f64, step: f64, n_centres: usize| {
            let [low, high] = [start.min(start + n * step), start.max(start + n * step)];
            low >= 0.0 && high < (n_centres - 1) as f64
        };
        if !(is_inside(first[0], step[0], self.n_cols) && is_inside(first[1], step[1], self.n_rows)) {
            for (k, height_m) in heights_m.iter_mut().enumerate() {
                let [x_m, y_m] = [0, 1].map(|axis| first_m[axis] + k as f64 * step_m[axis]);
                *height_m = self.height_m(x_m, y_m);
            }
            return;
        }
        // Whole numbers of 2^-32 cells, so that no step converts or checks a number.
        let [mut col, mut row] = first.map(|first| (first * ONE_CELL) as i64);
        let [col_step, row_step] = step.map(|step| (step * ONE_CELL) as i64);
        for height_m in heights_m {
            let share = |place: i64| f64::from(place as u32) * (1.0 / ONE_CELL);
            *height_m = self.in_square((row >> 32) as usize, (col >> 32) as usize, share(col), share(row));
            col += col_step;
            row += row_step;
        }
    }

    /// Height in the square whose south-west corner is this centre, at these shares of the way east and north.
    #[inline(always)]
    fn in_square(&self, row: usize, col: usize, u: f64, v: f64) -> f64 {
        let start = row * self.n_cols + col;
        // One check of the bounds for all four.
        let square = &self.surface_m[start..start + self.n_cols + 2];
        let corners = [square[0], square[1], square[self.n_cols], square[self.n_cols + 1]];
        height_on_triangles(corners.map(f64::from), [u, v])
    }

    /// Whether the surface there is that of an obstacle.
    pub(crate) fn is_obstacle(&self, x_m: f64, y_m: f64) -> bool {
        self.has_obstacles && self.height_m(x_m, y_m) > self.world.height_m(x_m, y_m) + RAISED_MIN_M
    }

    /// What the ground is made of.
    #[inline]
    pub(crate) fn patch(&self, x_m: f64, y_m: f64) -> &Patch {
        self.world.patch(x_m, y_m)
    }

    /// Whether any of it gives way under shear.
    pub(crate) fn gives_way(&self) -> bool {
        self.world.patches.values().iter().any(|patch| patch.shear_deformation_m > 0.0)
    }

    /// Place of the cell that holds a point, or of the nearest one, row-major from the south-west.
    pub(crate) fn cell(&self, x_m: f64, y_m: f64) -> usize {
        let place = |value_m: f64, first_m: f64, n: usize| {
            (((value_m - first_m) * self.cells_per_m).round().max(0.0) as usize).min(n - 1)
        };
        place(y_m, self.first_centre_m[1], self.n_rows) * self.n_cols
            + place(x_m, self.first_centre_m[0], self.n_cols)
    }

    /// Whether the point lies between cell centres, where the surface is given and not continued.
    pub(crate) fn contains(&self, x_m: f64, y_m: f64) -> bool {
        let inside = |value_m: f64, first_m: f64, n: usize| {
            let place = (value_m - first_m) * self.cells_per_m;
            place >= 0.0 && place <= (n - 1) as f64
        };
        inside(x_m, self.first_centre_m[0], self.n_cols) && inside(y_m, self.first_centre_m[1], self.n_rows)
    }

    /// South-west and north-east end of the surface [m].
    pub(crate) fn extent_m(&self) -> [[f64; 2]; 2] {
        let [x_m, y_m] = self.first_centre_m;
        let cell_m = 1.0 / self.cells_per_m;
        let far_m = [x_m + (self.n_cols - 1) as f64 * cell_m, y_m + (self.n_rows - 1) as f64 * cell_m];
        [[x_m, y_m], far_m]
    }

    /// Number of rows and columns.
    pub(crate) fn size(&self) -> [usize; 2] {
        [self.n_rows, self.n_cols]
    }

    /// All heights, row-major from the south-west [m].
    pub(crate) fn surface_m(&self) -> &[f32] {
        &self.surface_m
    }

    /// Whether anything stands on the ground.
    pub(crate) fn has_obstacles(&self) -> bool {
        self.has_obstacles
    }

    /// Edge of a cell [m].
    pub(crate) fn resolution_m(&self) -> f64 {
        1.0 / self.cells_per_m
    }
}
