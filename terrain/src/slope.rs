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
        self.gradient[0].hypot(self.gradient[1]).atan()
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
