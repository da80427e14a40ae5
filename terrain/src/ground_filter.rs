//! The ground below what stands and hangs over it, from heights of the highest thing in each cell.
//!
//! A progressive morphological filter (Zhang et al. 2003, "A progressive morphological filter for removing nonground
//! measurements from airborne LIDAR data"): the surface is opened with windows that grow; what an opening lowers by
//! more than a slope could is an object. Planes through the cells that are left are the ground and its gradient.

use crate::plane::PlaneSums;
use crate::{GridGeometry, GridMap, SettingError};

/// What counts as an object, and over what length the ground counts as flat.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GroundFilter {
    /// Windows grow until they are at least this wide: wider objects pass for ground [m].
    pub widest_object_m: f64,
    /// Steepest ground; a steeper rise is an object, in (0, pi/2) [rad].
    pub slope_max_rad: f64,
    /// Lower objects pass for ground: noise or step of the heights, >= 0 [m].
    pub height_tolerance_m: f64,
    /// Whatever the window, what is lowered by more than this is an object, > 0 [m].
    pub step_max_m: f64,
    /// Radius of the disc of ground through which a plane is laid, > 0 [m].
    pub plane_radius_m: f64,
}

/// The ground. All maps have the surface's geometry.
#[derive(Clone, Debug)]
pub struct FilteredGround {
    /// Height of the ground [m]; NaN exactly where the surface is.
    pub height_m: GridMap<f32>,
    /// Change of height to the east and to the north [-]; zero where too little ground lies around, NaN where unknown.
    pub gradient: GridMap<[f32; 2]>,
    /// Whether the surface itself is ground; false where something stands or hangs above it, or nothing is known.
    pub is_ground: GridMap<bool>,
}

impl GroundFilter {
    fn validate(&self) -> Result<(), SettingError> {
        let steepest_rad = std::f64::consts::FRAC_PI_2;
        let checks = [
            ("widest_object_m", self.widest_object_m, "a finite number > 0", self.widest_object_m > 0.0),
            (
                "height_tolerance_m",
                self.height_tolerance_m,
                "a finite number >= 0",
                self.height_tolerance_m >= 0.0,
            ),
            ("step_max_m", self.step_max_m, "a finite number > 0", self.step_max_m > 0.0),
            ("plane_radius_m", self.plane_radius_m, "a finite number > 0", self.plane_radius_m > 0.0),
            (
                "slope_max_rad",
                self.slope_max_rad,
                "an angle in radians above 0 and below pi/2",
                self.slope_max_rad > 0.0 && self.slope_max_rad < steepest_rad,
            ),
        ];
        match checks.into_iter().find(|(_, found, _, allowed)| !(found.is_finite() && *allowed)) {
            Some((field, found, expected, _)) => Err(SettingError { field, expected, found }),
            None => Ok(()),
        }
    }

    /// Radii of the windows in cells: 1, 2, 4, ... up to the first that is wide enough.
    fn radii(&self, cell_m: f64) -> impl Iterator<Item = usize> {
        let widest_m = self.widest_object_m;
        let width_m = move |radius: usize| (2 * radius + 1) as f64 * cell_m;
        (0..31).map(|k| 1_usize << k).take_while(move |&radius| radius == 1 || width_m(radius / 2) < widest_m)
    }

    /// How much an opening may lower the ground, given by how much the radius has grown: at the edge of what is
    /// known, a slope along the window's diagonal loses its rise over half of that diagonal.
    fn threshold_m(&self, growth_cells: usize, cell_m: f64) -> f64 {
        let rise_m = libm::tan(self.slope_max_rad) * std::f64::consts::SQRT_2 * growth_cells as f64 * cell_m;
        (rise_m + self.height_tolerance_m).min(self.step_max_m)
    }
}

/// Separates the ground from what stands and hangs over it. `surface_m` holds the highest point of each cell [m], NaN
/// where nothing is known; infinities count as unknown.
///
/// # Errors
/// A parameter of the filter is outside its range.
pub fn filter_ground(
    surface_m: &GridMap<f32>,
    filter: &GroundFilter,
) -> Result<FilteredGround, SettingError> {
    filter.validate()?;
    let geometry = *surface_m.geometry();
    let surface_m = &only_finite(surface_m);
    let known: Vec<bool> = surface_m.values().iter().map(|height| height.is_finite()).collect();
    let (is_ground, opened) = ground_cells(surface_m, &known, filter);
    let disc = disc(filter.plane_radius_m / geometry.resolution_m);
    let mut ground = FilteredGround {
        height_m: GridMap::filled(geometry, f32::NAN),
        gradient: GridMap::filled(geometry, [f32::NAN; 2]),
        is_ground: GridMap::filled(geometry, false),
    };
    for index in (0..known.len()).filter(|&index| known[index]) {
        let around = plane_around(surface_m, &is_ground, &disc, index);
        let (height_m, gradient) = around.unwrap_or((opened[index], [0.0; 2]));
        ground.height_m.values_mut()[index] = height_m;
        ground.gradient.values_mut()[index] = gradient;
    }
    ground.is_ground.values_mut().copy_from_slice(&is_ground);
    Ok(ground)
}

/// NaN is what no minimum and no maximum takes over; an infinity would win one of them wherever the window reaches.
fn only_finite(surface_m: &GridMap<f32>) -> GridMap<f32> {
    let mut finite_m = surface_m.clone();
    finite_m
        .values_mut()
        .iter_mut()
        .filter(|height| height.is_infinite())
        .for_each(|height| *height = f32::NAN);
    finite_m
}

/// The finest step of the known heights [m], the resolution of a map that was built of voxels; `None` when all are one
/// height.
pub fn height_step_m(heights_m: &GridMap<f32>) -> Option<f32> {
    let mut heights: Vec<f32> = heights_m.values().iter().copied().filter(|h| h.is_finite()).collect();
    heights.sort_by(f32::total_cmp);
    heights.windows(2).map(|pair| pair[1] - pair[0]).filter(|&step| step > 0.0).min_by(f32::total_cmp)
}

/// Which cells are ground, and the surface after the last opening.
fn ground_cells(surface_m: &GridMap<f32>, known: &[bool], filter: &GroundFilter) -> (Vec<bool>, Vec<f32>) {
    let geometry = surface_m.geometry();
    let mut is_ground = known.to_vec();
    let mut surface = surface_m.values().to_vec();
    let mut last_radius = 0;
    for radius in filter.radii(geometry.resolution_m) {
        let threshold_m = filter.threshold_m(radius - last_radius, geometry.resolution_m);
        let opened = open(&surface, known, geometry, radius);
        for (index, ground) in is_ground.iter_mut().enumerate() {
            *ground &= f64::from(surface[index]) - f64::from(opened[index]) <= threshold_m;
        }
        (surface, last_radius) = (opened, radius);
    }
    (is_ground, surface)
}

/// Erosion and then dilation with a square window over the known cells: never above the surface, and a plane inside.
fn open(surface: &[f32], known: &[bool], geometry: &GridGeometry, radius: usize) -> Vec<f32> {
    let only_known = |values: Vec<f32>| -> Vec<f32> {
        values.into_iter().zip(known).map(|(value, &known)| if known { value } else { f32::NAN }).collect()
    };
    let eroded = only_known(square(surface, geometry, radius, f32::min));
    only_known(square(&eroded, geometry, radius, f32::max))
}

/// The extreme of the values in a square around each cell. NaN never wins over a number in `f32::min` and `max`.
fn square(values: &[f32], geometry: &GridGeometry, radius: usize, extreme: fn(f32, f32) -> f32) -> Vec<f32> {
    let (n_rows, n_cols) = (geometry.n_rows, geometry.n_cols);
    let reach = |at: usize, n: usize| at.saturating_sub(radius)..(at + radius + 1).min(n);
    let over = |cells: &mut dyn Iterator<Item = f32>| cells.fold(f32::NAN, extreme);
    let rows: Vec<f32> = (0..values.len())
        .map(|i| over(&mut reach(i % n_cols, n_cols).map(|col| values[i / n_cols * n_cols + col])))
        .collect();
    (0..values.len())
        .map(|i| over(&mut reach(i / n_cols, n_rows).map(|row| rows[row * n_cols + i % n_cols])))
        .collect()
}

/// Offsets (column, row) within a radius, in cells.
fn disc(radius: f64) -> Vec<[i64; 2]> {
    let reach = radius.floor() as i64;
    let offsets = (-reach..=reach).flat_map(|row| (-reach..=reach).map(move |col| [col, row]));
    offsets.filter(|[col, row]| libm::hypot(*col as f64, *row as f64) <= radius).collect()
}

/// Height and gradient of the plane through the ground around a cell.
fn plane_around(
    surface_m: &GridMap<f32>,
    is_ground: &[bool],
    disc: &[[i64; 2]],
    index: usize,
) -> Option<(f32, [f32; 2])> {
    let geometry = surface_m.geometry();
    let centre = geometry.cell(index);
    let mut sums = PlaneSums::default();
    for &[col, row] in disc {
        let (Some(at_row), Some(at_col)) =
            (centre.row.checked_add_signed(row as isize), centre.col.checked_add_signed(col as isize))
        else {
            continue;
        };
        if at_row < geometry.n_rows
            && at_col < geometry.n_cols
            && is_ground[at_row * geometry.n_cols + at_col]
        {
            let height_m = surface_m.values()[at_row * geometry.n_cols + at_col];
            sums.add(col as f64 * geometry.resolution_m, row as f64 * geometry.resolution_m, height_m.into());
        }
    }
    match sums.fit() {
        Some(plane) => Some((plane.height as f32, plane.gradient.map(|slope| slope as f32))),
        None => (sums.n() > 0).then(|| (sums.mean() as f32, [0.0; 2])),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const FILTER: GroundFilter = GroundFilter {
        widest_object_m: 4.0,
        slope_max_rad: 0.6,
        height_tolerance_m: 0.15,
        step_max_m: 2.5,
        plane_radius_m: 1.5,
    };

    fn grid(height_m: impl Fn(usize, usize) -> f32) -> GridMap<f32> {
        let geometry = GridGeometry { resolution_m: 0.5, origin: [0, 0], n_rows: 30, n_cols: 40 };
        let heights = (0..geometry.n_cells()).map(|i| height_m(geometry.cell(i).row, geometry.cell(i).col));
        GridMap::from_values(geometry, heights.collect()).unwrap()
    }

    fn plane(row: usize, col: usize) -> f32 {
        1.0 + 0.2 * 0.5 * col as f32 - 0.1 * 0.5 * row as f32
    }

    fn assert_is_plane(ground: &FilteredGround) {
        for (index, height) in ground.height_m.values().iter().enumerate() {
            let cell = ground.height_m.geometry().cell(index);
            assert!((height - plane(cell.row, cell.col)).abs() < 1e-4, "{cell:?}: {height}");
            let [east, north] = ground.gradient.values()[index];
            assert!((east - 0.2).abs() < 1e-4 && (north + 0.1).abs() < 1e-4, "{cell:?}: {east}, {north}");
        }
    }

    #[test]
    fn spikes_leave_the_plane_they_stand_on() {
        let spike = |row: usize, col: usize| row % 5 == 2 && col % 7 == 3;
        let surface = grid(|row, col| plane(row, col) + if spike(row, col) { 3.0 } else { 0.0 });
        let ground = filter_ground(&surface, &FILTER).unwrap();
        assert_is_plane(&ground);
        for (index, is_ground) in ground.is_ground.values().iter().enumerate() {
            assert_eq!(*is_ground, !spike(index / 40, index % 40), "{index}");
        }
    }

    #[test]
    fn a_crown_as_wide_as_the_window_is_removed_and_a_wider_one_stays() {
        // 3.5 m across, and 10 m across.
        let crown = |n: usize| {
            grid(move |row, col| {
                plane(row, col) + if row.abs_diff(15).max(col.abs_diff(20)) <= n { 4.0 } else { 0.0 }
            })
        };
        let ground = filter_ground(&crown(3), &GroundFilter { plane_radius_m: 3.0, ..FILTER }).unwrap();
        assert_is_plane(&ground);
        assert_eq!(ground.is_ground.values().iter().filter(|ground| !**ground).count(), 49);
        let wide = filter_ground(&crown(10), &FILTER).unwrap();
        assert!(wide.is_ground.values()[15 * 40 + 20]);
    }

    #[test]
    fn a_steep_slope_is_kept_up_to_the_steepest() {
        // The rise runs along the window's diagonal: 0.64 and then 2.4 per metre; the limit is tan 0.6 = 0.684.
        let slope = |per_cell: f32| grid(move |row, col| per_cell * (row + col) as f32);
        let ground = filter_ground(&slope(0.226), &FILTER).unwrap();
        assert!(ground.is_ground.values().iter().all(|ground| *ground));
        let [east, north] = ground.gradient.values()[600];
        assert!((east - 0.452).abs() < 1e-4 && (north - 0.452).abs() < 1e-4);
        let cliff = filter_ground(&slope(0.85), &FILTER).unwrap();
        assert!(cliff.is_ground.values().iter().any(|ground| !ground));
    }

    #[test]
    fn unknown_stays_unknown_and_tells_nothing() {
        let hole = |row: usize, col: usize| (row + 2 * col).is_multiple_of(3);
        let surface = grid(|row, col| if hole(row, col) { f32::NAN } else { plane(row, col) });
        let ground = filter_ground(&surface, &FILTER).unwrap();
        for (index, height) in ground.height_m.values().iter().enumerate() {
            let (row, col) = (index / 40, index % 40);
            assert_eq!(height.is_nan(), hole(row, col));
            assert_eq!(ground.is_ground.values()[index], !hole(row, col));
            assert!(hole(row, col) || (height - plane(row, col)).abs() < 1e-4);
        }
    }

    #[test]
    fn infinities_are_unknown_and_tell_nothing() {
        let odd = |row: usize, col: usize| match (row + 2 * col) % 11 {
            0 => Some(f32::INFINITY),
            5 => Some(f32::NEG_INFINITY),
            _ => None,
        };
        let ground =
            filter_ground(&grid(|row, col| odd(row, col).unwrap_or(plane(row, col))), &FILTER).unwrap();
        let unknown =
            filter_ground(&grid(|row, col| odd(row, col).map_or(plane(row, col), |_| f32::NAN)), &FILTER);
        assert_eq!(ground.is_ground, unknown.unwrap().is_ground);
        for (index, height) in ground.height_m.values().iter().enumerate() {
            let (row, col) = (index / 40, index % 40);
            assert_eq!(height.is_nan(), odd(row, col).is_some(), "{row} {col}");
            assert!(height.is_nan() || (height - plane(row, col)).abs() < 1e-4, "{row} {col}: {height}");
            assert_eq!(ground.is_ground.values()[index], odd(row, col).is_none());
        }
    }

    #[test]
    fn the_slope_of_a_staircase_of_voxels_is_that_of_the_ground() {
        let surface = grid(|_, col| (0.2 * 0.5 * col as f32 / 0.5).round() * 0.5);
        assert_eq!(height_step_m(&surface), Some(0.5));
        let filter = GroundFilter { height_tolerance_m: 0.5, plane_radius_m: 3.0, ..FILTER };
        let ground = filter_ground(&surface, &filter).unwrap();
        for row in 0..30 {
            let [east, north] = ground.gradient.values()[row * 40 + 20];
            assert!((east - 0.2).abs() < 0.06 && north.abs() < 1e-6, "{east}, {north}");
        }
        assert_eq!(height_step_m(&grid(|_, _| 2.0)), None);
    }

    #[test]
    fn a_lone_cell_is_level_ground() {
        let surface = grid(|row, col| if (row, col) == (3, 4) { 7.0 } else { f32::NAN });
        let ground = filter_ground(&surface, &FILTER).unwrap();
        assert_eq!(ground.height_m.values()[124], 7.0);
        assert_eq!(ground.gradient.values()[124], [0.0; 2]);
    }

    #[test]
    fn a_filter_without_sense_is_refused() {
        let surface = grid(|_, _| 0.0);
        let wrong = [
            (GroundFilter { widest_object_m: f64::NAN, ..FILTER }, "widest_object_m"),
            (GroundFilter { slope_max_rad: 1.6, ..FILTER }, "slope_max_rad"),
            (GroundFilter { height_tolerance_m: -0.1, ..FILTER }, "height_tolerance_m"),
            (GroundFilter { step_max_m: 0.0, ..FILTER }, "step_max_m"),
            (GroundFilter { plane_radius_m: f64::INFINITY, ..FILTER }, "plane_radius_m"),
        ];
        for (filter, field) in wrong {
            assert_eq!(filter_ground(&surface, &filter).unwrap_err().field, field);
        }
    }
}
