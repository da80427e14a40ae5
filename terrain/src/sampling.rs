//! Heights between cell centres, under wheels, and in patches turned to the vehicle's yaw.

use crate::footprint::rotated;
use crate::{Cell, GridMap, Height, SurfaceCell, TerrainClass, WheelLayout};

/// Height at a place given in cells: (0, 0) is the centre of the south-west cell, columns then rows.
///
/// Bilinear over the four cells around it. Unknown ones are left out and the weights of the others are scaled
/// up; NaN when less than half of the weight is known.
pub fn bilinear_height<T: Height>(heights: &GridMap<T>, col: f32, row: f32) -> f32 {
    let geometry = heights.geometry();
    let (west, south) = (col.floor(), row.floor());
    let (to_east, to_north) = (col - west, row - south);
    let corners = [
        (0, 0, (1.0 - to_east) * (1.0 - to_north)),
        (1, 0, to_east * (1.0 - to_north)),
        (0, 1, (1.0 - to_east) * to_north),
        (1, 1, to_east * to_north),
    ];
    let (mut weight, mut sum) = (0.0, 0.0);
    for (east, north, corner_weight) in corners {
        let (col, row) = (west as i64 + east, south as i64 + north);
        if col < 0 || row < 0 || col >= geometry.n_cols as i64 || row >= geometry.n_rows as i64 {
            continue;
        }
        let height_m = heights[Cell { row: row as usize, col: col as usize }].height_m();
        if corner_weight > 0.0 && !height_m.is_nan() {
            weight += corner_weight;
            sum += corner_weight * height_m;
        }
    }
    if weight >= 0.5 { sum / weight } else { f32::NAN }
}

/// Height at a point of the map frame; see [`bilinear_height`]. NaN for a non-finite point.
pub fn height_at<T: Height>(heights: &GridMap<T>, x_m: f64, y_m: f64) -> f32 {
    let geometry = heights.geometry();
    let [west_m, south_m] = geometry.south_west_m();
    let col = (x_m - west_m) / geometry.resolution_m - 0.5;
    let row = (y_m - south_m) / geometry.resolution_m - 0.5;
    if col.is_finite() && row.is_finite() {
        bilinear_height(heights, col as f32, row as f32)
    } else {
        f32::NAN
    }
}

/// Highest ground within `radius_m` of a point: the height at the point itself and every known cell centre in
/// the disc. NaN when all of these are unknown.
pub fn envelope_height<T: Height>(heights: &GridMap<T>, x_m: f64, y_m: f64, radius_m: f64) -> f32 {
    let geometry = heights.geometry();
    let mut highest_m = height_at(heights, x_m, y_m);
    let Some(centre) = geometry.cell_at(x_m, y_m) else { return highest_m };
    let reach = (radius_m / geometry.resolution_m).ceil() as usize;
    let rows = centre.row.saturating_sub(reach)..(centre.row + reach + 1).min(geometry.n_rows);
    for row in rows {
        for col in centre.col.saturating_sub(reach)..(centre.col + reach + 1).min(geometry.n_cols) {
            let [cell_x_m, cell_y_m] = geometry.centre_m(Cell { row, col });
            if (cell_x_m - x_m).hypot(cell_y_m - y_m) <= radius_m {
                // `max` passes over NaN.
                highest_m = highest_m.max(heights[Cell { row, col }].height_m());
            }
        }
    }
    highest_m
}

/// Heights under the four wheels, front left, rear left, rear right, front right [m]; NaN where unknown.
pub fn wheel_heights_m<T: Height>(
    heights: &GridMap<T>,
    layout: &WheelLayout,
    [x_m, y_m, yaw_rad]: [f64; 3],
) -> [f32; 4] {
    layout
        .contact_points_m(x_m, y_m, yaw_rad)
        .map(|[wheel_x_m, wheel_y_m]| height_at(heights, wheel_x_m, wheel_y_m))
}

/// A rectangle of samples that turns with the vehicle: rows go forward, columns go left.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PatchShape {
    /// Samples along the vehicle.
    pub n_rows: usize,
    /// Samples across the vehicle.
    pub n_cols: usize,
    /// Distance between samples [m].
    pub spacing_m: f64,
    /// The first row lies this far behind the rear axle [m].
    pub rear_m: f64,
}

/// One sample of a patch.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PatchSample {
    /// Height above the mean height under the wheels [m]; NaN where unknown.
    pub relative_height_m: f32,
    /// Height of soft vegetation [m], zero where unknown.
    pub vegetation_height_m: f32,
    /// Probability of each [`TerrainClass`], zeros where nothing was seen.
    pub class_probability: [f32; TerrainClass::COUNT],
}

impl PatchSample {
    /// Nothing is known here.
    pub const UNKNOWN: Self = Self {
        relative_height_m: f32::NAN,
        vegetation_height_m: 0.0,
        class_probability: [0.0; TerrainClass::COUNT],
    };
}

impl PatchShape {
    /// Number of samples.
    pub fn n_samples(&self) -> usize {
        self.n_rows * self.n_cols
    }

    /// Place of a sample in the body frame: forward, left of the rear axle's centre [m].
    pub fn body_point_m(&self, row: usize, col: usize) -> [f64; 2] {
        let across = col as f64 - 0.5 * (self.n_cols as f64 - 1.0);
        [row as f64 * self.spacing_m - self.rear_m, across * self.spacing_m]
    }

    /// Samples the ground around a vehicle at (`x_m`, `y_m`, `yaw_rad`) into `samples`, row-major, rows
    /// forward and columns left; as many as fit. Heights are bilinear and relative to the mean height under
    /// the wheels that stand on known ground (all unknown when none does); the rest is the nearest cell's.
    pub fn sample(
        &self,
        surface: &GridMap<SurfaceCell>,
        layout: &WheelLayout,
        [x_m, y_m, yaw_rad]: [f64; 3],
        samples: &mut [PatchSample],
    ) {
        let reference_m = known_mean(&wheel_heights_m(surface, layout, [x_m, y_m, yaw_rad]));
        for (index, sample) in samples.iter_mut().enumerate().take(self.n_samples()) {
            let [dx_m, dy_m] = rotated(self.body_point_m(index / self.n_cols, index % self.n_cols), yaw_rad);
            let (x_m, y_m) = (x_m + dx_m, y_m + dy_m);
            *sample = surface.at(x_m, y_m).map_or(PatchSample::UNKNOWN, |cell| PatchSample {
                relative_height_m: height_at(surface, x_m, y_m) - reference_m,
                vegetation_height_m: cell.vegetation_height_m,
                class_probability: cell.class_probability,
            });
        }
    }
}

fn known_mean(heights_m: &[f32]) -> f32 {
    let known = heights_m.iter().filter(|h| !h.is_nan());
    known.clone().sum::<f32>() / known.count() as f32
}
