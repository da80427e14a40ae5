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
            let length_m = f64::from(libm::hypotf(col - start[0], row - start[1])) * geometry.resolution_m;
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
        let places = inside(first)..inside(last);
        let per_step = 1.0 / along[major];
        let (minor_step, height_step) = (along[minor] * per_step, along[2] * per_step);
        let middle = places.start as f32 + 0.5 - self.start[major];
        let mut aside = fixed_point(self.start[minor] + middle * minor_step);
        let aside_step = fixed_point(minor_step);
        let mut height_m = self.start[2] + middle * height_step + 0.5 * height_step.abs();
        for place in places {
            let across = (aside >> FRACTION_BITS) as usize;
            // A place before the first cell wraps around to a huge one.
            if across < size[minor] {
                visit(place * stride[major] + across * stride[minor], height_m);
            }
            aside = aside.wrapping_add(aside_step);
            height_m += height_step;
        }
    }
}

/// Bits behind the point: over a thousand cells the rounding adds up to less than a ten-thousandth of a cell.
const FRACTION_BITS: u32 = 24;

/// Places in whole numbers, so that a step is an addition and a shift.
fn fixed_point(cells: f32) -> i64 {
    (f64::from(cells) * f64::from(1_u32 << FRACTION_BITS)) as i64
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::collections::BTreeMap;

    const WINDOW: GridGeometry = GridGeometry { resolution_m: 1.0, origin: [0, 0], n_rows: 12, n_cols: 17 };

    proptest! {
        #[test]
        fn visited_cells_are_crossed_at_no_more_than_the_height_told(
            start in ((-8.0..25.0_f32), (-8.0..20.0_f32), (-3.0..3.0_f32)),
            end in ((0.0..17.0_f32), (0.0..12.0_f32), (-3.0..3.0_f32)),
        ) {
            let ray = Ray { start: start.into(), end: end.into() };
            // The oracle walks in small steps and keeps the way and the heights within each cell.
            let n_steps = 4000;
            let mut crossed: BTreeMap<usize, (usize, f32)> = BTreeMap::new();
            for step in 0..=n_steps {
                let share = step as f32 / n_steps as f32;
                let at = |axis: usize| ray.start[axis] + share * (ray.end[axis] - ray.start[axis]);
                let (col, row) = (at(0), at(1));
                if (0.0..17.0).contains(&col) && (0.0..12.0).contains(&row) {
                    let entry = crossed.entry(row as usize * 17 + col as usize).or_insert((0, f32::NEG_INFINITY));
                    *entry = (entry.0 + 1, entry.1.max(at(2)));
                }
            }
            let mut visited = BTreeMap::new();
            ray.for_each_cell(&WINDOW, |index, height_m| {
                visited.insert(index, height_m);
            });
            let along = [end.0 - start.0, end.1 - start.1];
            let length = along[0].hypot(along[1]);
            let major = along[0].abs().max(along[1].abs());
            let drop_per_cell = (end.2 - start.2).abs() / major;
            let own = |place: (f32, f32, f32)| place.1.floor() as i64 * 17 + place.0.floor() as i64;
            for (index, height_m) in &visited {
                prop_assert!(crossed.contains_key(index), "cell {} is off the ray", index);
                let highest_m = crossed[index].1;
                prop_assert!(*height_m >= highest_m - 1e-3 && *height_m <= highest_m + drop_per_cell + 1e-3);
                prop_assert!(*index as i64 != own(end));
            }
            for (index, (n, _)) in &crossed {
                // Through two thirds of a column or more: the middle of the column is in the cell.
                let advance = *n as f32 / n_steps as f32 * major;
                let is_end = *index as i64 == own(end) || *index as i64 == own(start);
                let shares_a_column_with_an_end = [start, end].iter().any(|place| {
                    let (col, row) = (*index % 17, *index / 17);
                    if along[0].abs() >= along[1].abs() { place.0.floor() as i64 == col as i64 }
                    else { place.1.floor() as i64 == row as i64 }
                });
                if advance > 0.67 && length > 1.0 && !is_end && !shares_a_column_with_an_end {
                    prop_assert!(visited.contains_key(index), "cell {} was passed over", index);
                }
            }
        }
    }
}
