//! Slope, roughness and unevenness of a height map.

use crate::plane::PlaneSums;
use crate::{Cell, CellRegion, GridMap, SurfaceCell, YawFootprint};

/// Something with a height; NaN where there is none.
pub trait Height {
    /// Height of the ground [m].
    fn height_m(&self) -> f32;
}

impl Height for f32 {
    fn height_m(&self) -> f32 {
        *self
    }
}

impl Height for SurfaceCell {
    fn height_m(&self) -> f32 {
        self.height_m
    }
}

/// The tilt and the roughness of the ground around a cell.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Slope {
    /// Height change per metre east and north [-]; NaN while unknown.
    pub gradient: [f32; 2],
    /// Standard deviation of the heights about the plane [m], with n - 3 degrees of freedom; NaN while unknown.
    pub roughness_m: f32,
}

impl Slope {
    /// Too little is known for a plane.
    pub const UNKNOWN: Self = Self { gradient: [f32::NAN; 2], roughness_m: f32::NAN };

    /// Angle between the plane and the horizontal [rad].
    pub fn angle_rad(&self) -> f32 {
        libm::atanf(libm::hypotf(self.gradient[0], self.gradient[1]))
    }
}

/// Plane of least squares through the known cells of the square of 2 `radius` + 1 cells around `cell`.
/// [`Slope::UNKNOWN`] when the cell itself is unknown or the known cells lie on a line.
pub fn slope_at<T: Height>(heights: &GridMap<T>, cell: Cell, radius: usize) -> Slope {
    let geometry = heights.geometry();
    let centre_m = heights[cell].height_m();
    if centre_m.is_nan() {
        return Slope::UNKNOWN;
    }
    let around = CellRegion::of_cell(cell).grown(radius, geometry);
    let mut sums = PlaneSums::default();
    let west = around.cols.start as f64 - cell.col as f64;
    for row in around.rows {
        let (dy, mut dx) = (row as f64 - cell.row as f64, west - 1.0);
        for value in &heights.values()[row * geometry.n_cols..][around.cols.clone()] {
            dx += 1.0;
            let height_m = value.height_m();
            if !height_m.is_nan() {
                // Relative to the centre, so that no digits are lost on a map far above the sea.
                sums.add(dx, dy, f64::from(height_m - centre_m));
            }
        }
    }
    let Some(plane) = sums.fit() else { return Slope::UNKNOWN };
    let per_metre = 1.0 / geometry.resolution_m;
    let freedom = plane.n.saturating_sub(3).max(1) as f64;
    Slope {
        gradient: plane.gradient.map(|g| (g * per_metre) as f32),
        roughness_m: (plane.residual_sum / freedom).sqrt() as f32,
    }
}

/// Brings `slopes` up to date inside `region` of the same window; `region` should be the changed cells grown
/// by `radius`.
pub fn update_slopes<T: Height>(
    heights: &GridMap<T>,
    radius: usize,
    region: &CellRegion,
    slopes: &mut GridMap<Slope>,
) {
    for row in region.rows.clone() {
        for col in region.cols.clone() {
            let cell = Cell { row, col };
            slopes[cell] = slope_at(heights, cell, radius);
        }
    }
}

/// Standard deviation of elevation under a footprint whose rear axle stands on `cell` (PIETRA's measure of
/// how hard ground is); NaN when fewer than two cells under it are known.
pub fn footprint_unevenness<T: Height>(heights: &GridMap<T>, cell: Cell, footprint: &YawFootprint) -> f32 {
    let mut sums = PlaneSums::default();
    let mut reference_m = f32::NAN;
    for under in footprint.cells_at(cell, heights.geometry()) {
        let height_m = heights[under].height_m();
        if !height_m.is_nan() {
            reference_m = if reference_m.is_nan() { height_m } else { reference_m };
            sums.add(0.0, 0.0, f64::from(height_m) - f64::from(reference_m));
        }
    }
    sums.deviation().map_or(f32::NAN, |deviation| deviation as f32)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Footprint, GridGeometry, WheelLayout};
    use std::f64::consts::{PI, TAU};

    fn drawn(resolution_m: f64, n: usize, height_m: impl Fn(f64, f64) -> f64) -> GridMap<f32> {
        let geometry = GridGeometry { resolution_m, origin: [-(n as i64) / 2; 2], n_rows: n, n_cols: n };
        let height = |i| {
            let [x_m, y_m] = geometry.centre_m(geometry.cell(i));
            height_m(x_m, y_m) as f32
        };
        GridMap::from_values(geometry, (0..n * n).map(height).collect()).unwrap()
    }

    #[test]
    fn a_plane_has_its_own_slope_in_every_direction_even_with_holes_and_at_the_border() {
        for k in 0..16 {
            let (east, north) =
                (0.6 * (TAU * f64::from(k) / 16.0).cos(), 0.6 * (TAU * f64::from(k) / 16.0).sin());
            let mut plane = drawn(0.25, 9, |x, y| 40.0 + east * x + north * y);
            for hole in [3, 17, 40, 41, 60] {
                plane.values_mut()[hole] = f32::NAN;
            }
            for index in (0..81).filter(|index| !plane.values()[*index].is_nan()) {
                let slope = slope_at(&plane, plane.geometry().cell(index), 1);
                assert!((f64::from(slope.gradient[0]) - east).abs() < 1e-4, "{slope:?}");
                assert!((f64::from(slope.gradient[1]) - north).abs() < 1e-4, "{slope:?}");
                assert!((slope.angle_rad() - 0.6_f32.atan()).abs() < 1e-4);
                // Heights near 40 m are rounded to 2e-6 m.
                assert!(slope.roughness_m < 1e-5, "{slope:?}");
            }
        }
    }

    #[test]
    fn unknown_cells_and_lonely_lines_have_no_slope() {
        let mut map = drawn(0.25, 5, |_, _| f64::NAN);
        let middle = Cell { row: 2, col: 2 };
        let has_slope = |map: &GridMap<f32>| !slope_at(map, middle, 1).gradient[0].is_nan();
        assert!(!has_slope(&map));
        for col in 0..5 {
            map[Cell { row: 2, col }] = 1.0;
        }
        assert!(!has_slope(&map), "a line does not determine a tilt");
        map[Cell { row: 3, col: 2 }] = 1.0;
        assert!(has_slope(&map));
        map[middle] = f32::NAN;
        assert!(!has_slope(&map));
    }

    #[test]
    fn a_sine_has_the_slope_of_its_least_squares_plane() {
        let (k, amplitude_m, radius) = (1.3, 0.4, 2);
        let sine = drawn(0.2, 31, |x, _| amplitude_m * (k * x).sin());
        // sin(k (x + d)) = sin(kx) cos(kd) + cos(kx) sin(kd), and only the odd part tilts the plane:
        // g = a cos(kx) sum d sin(kd) / sum d^2 over d = -0.4 .. 0.4 in steps of 0.2.
        let offsets = [-0.4, -0.2, 0.0, 0.2, 0.4_f64];
        let odd: f64 = offsets.iter().map(|d| d * (k * d).sin()).sum();
        let squares: f64 = offsets.iter().map(|d| d * d).sum();
        for col in 2..29 {
            let cell = Cell { row: 15, col };
            let [x_m, _] = sine.geometry().centre_m(cell);
            let expected = amplitude_m * (k * x_m).cos() * odd / squares;
            let slope = slope_at(&sine, cell, radius);
            assert!((f64::from(slope.gradient[0]) - expected).abs() < 1e-5);
            assert!(slope.gradient[1].abs() < 1e-5);
        }
    }

    #[test]
    fn a_step_tilts_by_half_its_height_and_leaves_the_rest_as_roughness() {
        let step = drawn(1.0, 9, |x, _| if x > 0.0 { 1.0 } else { 0.0 });
        // Columns 0, 1, 1 at -1, 0, 1: tilt 1/2; fitted 1/6, 2/3, 7/6; residuals -1/6, 1/3, -1/6, squares 1/6 a row;
        // three rows: 1/2 over 9 - 3 degrees of freedom.
        let cell = step.geometry().cell_at(0.5, 0.5).unwrap();
        let slope = slope_at(&step, cell, 1);
        assert!((slope.gradient[0] - 0.5).abs() < 1e-6 && slope.gradient[1].abs() < 1e-6);
        assert!((slope.roughness_m - (0.5_f32 / 6.0).sqrt()).abs() < 1e-6);
    }

    #[test]
    fn slopes_change_only_inside_the_region() {
        let plane = drawn(0.5, 6, |x, _| 0.2 * x);
        let mut slopes = GridMap::filled(*plane.geometry(), Slope::UNKNOWN);
        let region = CellRegion { rows: 1..3, cols: 2..5 };
        update_slopes(&plane, 1, &region, &mut slopes);
        let n_known = slopes.values().iter().filter(|slope| !slope.roughness_m.is_nan()).count();
        assert_eq!(n_known, region.n_cells());
        assert!((slopes[Cell { row: 2, col: 4 }].gradient[0] - 0.2).abs() < 1e-6);
    }

    #[test]
    fn unevenness_of_a_slope_is_that_of_a_uniform_distribution() {
        let layout = WheelLayout { wheelbase_m: 2.0, track_m: 1.0 };
        let footprint = Footprint { front_m: 3.0, rear_m: 1.0, half_width_m: 1.0 };
        for yaw_rad in [0.0, 0.7, PI / 2.0, 4.0] {
            let (sin, cos) = yaw_rad.sin_cos();
            let map = drawn(0.05, 201, |x, y| 0.3 * (cos * x + sin * y));
            let turned = YawFootprint::new(&layout, &footprint, 0.05, yaw_rad);
            let unevenness_m = footprint_unevenness(&map, Cell { row: 100, col: 100 }, &turned);
            // A length of 4 m at slope 0.3 along the heading: 0.3 x 4 / sqrt(12); cells of 5 cm blur it by 2 %.
            assert!((f64::from(unevenness_m) / (1.2 / 12.0_f64.sqrt()) - 1.0).abs() < 0.02, "{unevenness_m}");
        }
        let hole = drawn(0.05, 201, |_, _| f64::NAN);
        let turned = YawFootprint::new(&layout, &footprint, 0.05, 0.0);
        assert!(footprint_unevenness(&hole, Cell { row: 100, col: 100 }, &turned).is_nan());
    }
}
