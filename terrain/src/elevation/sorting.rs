//! Points of a scan, brought into the map frame and sorted by cell.

use super::ElevationConfig;
use super::cell::CellPoint;
use crate::{GridGeometry, Pose, Scan};
use nalgebra::Point3;

/// The points of one scan by cell. The buffers are kept from scan to scan.
#[derive(Clone, Debug, Default)]
pub(super) struct SortedPoints {
    /// Where the rays start, in the map frame [m].
    pub origin_m: [f64; 3],
    /// Cells that were hit, in the order of their first point.
    pub hit_cells: Vec<u32>,
    pub n_rejected_non_finite: usize,
    pub n_own_body: usize,
    pub n_out_of_window: usize,
    /// Points of one cell lie together.
    points: Vec<CellPoint>,
    /// End of each cell's points in `points`; start = end - count.
    ends: Vec<u32>,
    counts: Vec<u32>,
    placed: Vec<(u32, CellPoint)>,
}

impl SortedPoints {
    /// Sorts a scan into the window; the order of points within a cell is the scan's.
    pub fn sort(&mut self, scan: &Scan, pose: &Pose, geometry: &GridGeometry, config: &ElevationConfig) {
        for &cell in &self.hit_cells {
            self.counts[cell as usize] = 0;
        }
        self.counts.resize(geometry.n_cells(), 0);
        self.ends.resize(geometry.n_cells(), 0);
        self.hit_cells.clear();
        self.place(scan, pose, geometry, config);
        let mut end = 0;
        for &cell in &self.hit_cells {
            self.ends[cell as usize] = end;
            end += self.counts[cell as usize];
        }
        let Some(&(_, filler)) = self.placed.first() else { return };
        self.points.resize(self.placed.len(), filler);
        for &(cell, point) in &self.placed {
            let end = &mut self.ends[cell as usize];
            self.points[*end as usize] = point;
            *end += 1;
        }
    }

    /// Whether a point of the scan fell into the cell.
    pub fn is_hit(&self, cell: usize) -> bool {
        self.counts[cell] > 0
    }

    /// The points of a cell that was hit.
    pub fn in_cell(&self, cell: u32) -> &[CellPoint] {
        let end = self.ends[cell as usize] as usize;
        &self.points[end - self.counts[cell as usize] as usize..end]
    }

    fn place(&mut self, scan: &Scan, pose: &Pose, geometry: &GridGeometry, config: &ElevationConfig) {
        let motion = pose.isometry();
        let origin = motion * Point3::from(scan.origin_m.map(f64::from));
        self.origin_m = [origin.x, origin.y, origin.z];
        (self.n_rejected_non_finite, self.n_own_body, self.n_out_of_window) = (0, 0, 0);
        self.placed.clear();
        let reach_m = geometry.n_rows.max(geometry.n_cols) as f64 * geometry.resolution_m;
        let ([west_m, south_m], edge_m) = (geometry.south_west_m(), geometry.resolution_m);
        for point in &scan.points {
            if !point.position_m.iter().all(|v| v.is_finite()) {
                self.n_rejected_non_finite += 1;
                continue;
            }
            let in_body_m = point.position_m.map(f64::from);
            let position = motion * Point3::from(in_body_m);
            let range_m = (position - origin).norm();
            if range_m < config.own_body_m || config.own_body.contains(in_body_m) {
                self.n_own_body += 1;
                continue;
            }
            let is_near = (position.z - origin.z).abs() <= reach_m;
            let Some(cell) = geometry.cell_at(position.x, position.y).filter(|_| is_near) else {
                self.n_out_of_window += 1;
                continue;
            };
            let cell = geometry.index(cell) as u32;
            if self.counts[cell as usize] == 0 {
                self.hit_cells.push(cell);
            }
            self.counts[cell as usize] += 1;
            let std_m = config.noise_floor_m + config.noise_per_range * range_m;
            let shared_m = config.scan_noise_m + config.scan_tilt_rad * range_m;
            let [variance_m2, shared_m2] = [std_m, shared_m].map(|std_m| (std_m * std_m) as f32);
            let place = [(position.x - west_m) / edge_m, (position.y - south_m) / edge_m].map(|v| v as f32);
            let height_m = position.z as f32;
            self.placed
                .push((cell, CellPoint { place, height_m, variance_m2, shared_m2, class: point.class }));
        }
    }
}

#[cfg(test)]
impl SortedPoints {
    /// Where the buffers lie and how much they hold.
    pub fn buffers(&self) -> [(usize, usize); 5] {
        [
            (self.hit_cells.as_ptr() as usize, self.hit_cells.capacity()),
            (self.points.as_ptr() as usize, self.points.capacity()),
            (self.ends.as_ptr() as usize, self.ends.capacity()),
            (self.counts.as_ptr() as usize, self.counts.capacity()),
            (self.placed.as_ptr() as usize, self.placed.capacity()),
        ]
    }
}
