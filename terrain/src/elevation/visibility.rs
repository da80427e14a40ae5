//! What rays say about the cells they pass: nothing stands there above the ray.

use super::ElevationConfig;
use super::sorting::SortedPoints;
use crate::GridGeometry;

/// For each cell, the lowest height at which a ray of the last scan passed, one standard deviation of the pose's
/// error on the safe side [m]; +inf where none did.
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
        let start_m = (z_m + config.scan_noise_m) as f32;
        for &cell in &points.hit_cells {
            let Some(lowest) = points.in_cell(cell).iter().min_by(|a, b| a.height_m.total_cmp(&b.height_m))
            else {
                continue;
            };
            let [col, row] = lowest.place;
            let length_m = f64::from((col - start[0]).hypot(row - start[1])) * geometry.resolution_m;
            let slack_m = config.scan_noise_m + config.scan_tilt_rad * length_m;
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
    /// Calls `visit` with cells that the ray crosses between those of its ends, and the ray's greatest height there.
    ///
    /// Walks along the axis that the ray advances on most, and of each column (or row) visits the one cell
    /// that holds the ray's middle there: a ray that only clips a cell's corner says nothing about it.
    fn for_each_cell(&self, geometry: &GridGeometry, mut visit: impl FnMut(usize, f32)) {
        let along: [f32; 3] = std::array::from_fn(|axis| self.end[axis] - self.start[axis]);
        let major = usize::from(along[1].abs() > along[0].abs());
        let minor = 1 - major;
        let size = [geometry.n_cols, geometry.n_rows];
        let stride = [1, geometry.n_cols];
        let (first, last) = if along[major] > 0.0 {
            (self.start[major].floor() + 1.0, self.end[major].floor())
        } else {
            (self.end[major].floor() + 1.0, self.start[major].floor())
        };
        let inside = |place: f32| place.clamp(0.0, size[major] as f32) as usize;
        let per_step = 1.0 / along[major];
        let (minor_step, height_step) = (along[minor] * per_step, along[2] * per_step);
        for place in inside(first)..inside(last) {
            let middle = place as f32 + 0.5 - self.start[major];
            let aside = self.start[minor] + middle * minor_step;
            if aside >= 0.0 && aside < size[minor] as f32 {
                let height_m = self.start[2] + middle * height_step + 0.5 * height_step.abs();
                visit(place * stride[major] + aside as usize * stride[minor], height_m);
            }
        }
    }
}
