//! What rays say about the cells they pass: nothing stands there above the ray.

use super::ElevationConfig;
use super::sorting::SortedPoints;
use crate::GridGeometry;

/// A ray that runs through less of a cell than this says nothing about it [cells].
const SHORTEST_CHORD: f32 = 0.5;
/// Standard deviations of a ray's height that its bound stays on the safe side.
const RAY_SAFETY: f64 = 2.0;

/// For each cell, the lowest height at which a ray of the last scan passed [m]; +inf where none did.
#[derive(Clone, Debug, Default)]
pub(super) struct RayFloor {
    pub floors_m: Vec<f32>,
}

/// A straight line over the window: columns, rows from the south-west corner [cells] and height [m].
#[derive(Clone, Copy, Debug)]
struct Ray {
    start: [f32; 3],
    end: [f32; 3],
}

impl RayFloor {
    /// Follows the ray to the lowest point of every cell that was hit; the others end higher up and say less.
    pub fn cast(&mut self, points: &SortedPoints, geometry: &GridGeometry, config: &ElevationConfig) {
        self.floors_m.clear();
        self.floors_m.resize(geometry.n_cells(), f32::INFINITY);
        let [west_m, south_m] = geometry.south_west_m();
        let [x_m, y_m, z_m] = points.origin_m;
        let start = [(x_m - west_m) / geometry.resolution_m, (y_m - south_m) / geometry.resolution_m]
            .map(|place| place as f32);
        let start_m = (z_m + RAY_SAFETY * config.scan_noise_m) as f32;
        for &cell in &points.hit_cells {
            let Some(lowest) = points.in_cell(cell).iter().min_by(|a, b| a.height_m.total_cmp(&b.height_m))
            else {
                continue;
            };
            let [col, row] = lowest.place;
            let length_m = f64::from((col - start[0]).hypot(row - start[1])) * geometry.resolution_m;
            let slack_m = RAY_SAFETY * (config.scan_noise_m + config.noise_per_range * length_m);
            let ray = Ray {
                start: [start[0], start[1], start_m],
                end: [col, row, lowest.height_m + slack_m as f32],
            };
            ray.for_each_cell(geometry, |index, height_m| {
                self.floors_m[index] = self.floors_m[index].min(height_m);
            });
        }
    }
}

impl Ray {
    /// Calls `visit` with each cell that the ray crosses and the ray's greatest height there, but not with
    /// the cell in which it ends. The end lies in the window, the start may lie outside.
    fn for_each_cell(&self, geometry: &GridGeometry, mut visit: impl FnMut(usize, f32)) {
        let size = [geometry.n_cols, geometry.n_rows];
        let along: [f32; 3] = std::array::from_fn(|axis| self.end[axis] - self.start[axis]);
        let length = along[0].hypot(along[1]);
        let mut entry =
            (0..2).map(|axis| self.share_outside(axis, along[axis], size[axis])).fold(0.0, f32::max);
        let mut cell = [0_usize; 2];
        let mut next_crossing = [f32::INFINITY; 2];
        let per_cell = along.map(|a| 1.0 / a.abs());
        for axis in 0..2 {
            let place = self.start[axis] + entry * along[axis];
            cell[axis] = (place.max(0.0) as usize).min(size[axis] - 1);
            let border = cell[axis] as f32 + if along[axis] > 0.0 { 1.0 } else { 0.0 };
            if along[axis] != 0.0 {
                next_crossing[axis] = (border - self.start[axis]) / along[axis];
            }
        }
        loop {
            let axis = usize::from(next_crossing[1] < next_crossing[0]);
            let exit = next_crossing[axis];
            if exit >= 1.0 {
                return;
            }
            if (exit - entry) * length >= SHORTEST_CHORD {
                let share = if along[2] > 0.0 { exit } else { entry };
                visit(cell[1] * size[0] + cell[0], self.start[2] + share * along[2]);
            }
            let stepped = cell[axis].checked_add_signed(if along[axis] > 0.0 { 1 } else { -1 });
            match stepped.filter(|&place| place < size[axis]) {
                Some(place) => cell[axis] = place,
                None => return,
            }
            entry = exit;
            next_crossing[axis] += per_cell[axis];
        }
    }

    /// Share of the ray that lies before the window along one axis.
    fn share_outside(&self, axis: usize, along: f32, size: usize) -> f32 {
        let start = self.start[axis];
        let outside = if along > 0.0 { -start } else { start - size as f32 };
        if outside > 0.0 { outside / along.abs() } else { 0.0 }
    }
}
