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
            let [dx_m, dy_m] = [cell_x_m - x_m, cell_y_m - y_m];
            if dx_m * dx_m + dy_m * dy_m <= radius_m * radius_m {
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
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{GridGeometry, Knowledge};
    use proptest::prelude::*;

    const GEOMETRY: GridGeometry =
        GridGeometry { resolution_m: 0.5, origin: [-10, -6], n_rows: 16, n_cols: 20 };
    const LAYOUT: WheelLayout = WheelLayout { wheelbase_m: 1.2, track_m: 0.8 };

    fn drawn(height_m: impl Fn(f64, f64) -> f64) -> GridMap<f32> {
        let height = |i| {
            let [x_m, y_m] = GEOMETRY.centre_m(GEOMETRY.cell(i));
            height_m(x_m, y_m) as f32
        };
        GridMap::from_values(GEOMETRY, (0..GEOMETRY.n_cells()).map(height).collect()).unwrap()
    }

    proptest! {
        #[test]
        fn bilinear_ground_is_sampled_exactly(x in -4.7..4.7_f64, y in -2.7..4.7_f64) {
            let surface = |x: f64, y: f64| 1.0 + 0.3 * x - 0.2 * y;
            let map = drawn(surface);
            prop_assert!((f64::from(height_at(&map, x, y)) - surface(x, y)).abs() < 1e-5);
            // Between two rows of centres and two columns, x y is bilinear too.
            let (x, y) = (0.25 + 0.5 * x / 9.4, 0.75 + 0.5 * y / 9.4);
            let saddle = drawn(|x, y| x * y);
            let (west, south) = ((x * 2.0 - 0.5).floor() / 2.0 + 0.25, (y * 2.0 - 0.5).floor() / 2.0 + 0.25);
            let (u, v) = ((x - west) / 0.5, (y - south) / 0.5);
            let expected = (west + 0.5 * u) * (south + 0.5 * v);
            prop_assert!((f64::from(height_at(&saddle, x, y)) - expected).abs() < 1e-5);
        }
    }

    #[test]
    fn unknown_corners_are_left_out_up_to_half_of_the_weight() {
        let mut map = drawn(|x, _| x);
        let hole = GEOMETRY.cell_at(0.6, 0.1).unwrap();
        map[hole] = f32::NAN;
        // The hole's centre is (0.75, 0.25): at its own centre nothing is known, halfway to a neighbour just half.
        assert!(height_at(&map, 0.75, 0.25).is_nan());
        assert!(height_at(&map, 0.6, 0.25).is_nan());
        assert_eq!(height_at(&map, 0.5, 0.25), 0.25);
        // In the middle between four centres, three are known: (0.25 + 0.25 + 0.75) / 3.
        assert!((height_at(&map, 0.5, 0.5) - 1.25 / 3.0).abs() < 1e-6);
    }

    #[test]
    fn outside_the_window_and_at_no_place_nothing_is_known() {
        let map = drawn(|_, _| 1.0);
        for (x_m, y_m) in [(-5.3, 0.0), (5.3, 0.0), (0.0, 5.3), (f64::NAN, 0.0), (0.0, f64::INFINITY)] {
            assert!(height_at(&map, x_m, y_m).is_nan());
            assert!(envelope_height(&map, x_m, y_m, 0.1).is_nan());
        }
        // The outermost half cell leans on its own row of centres.
        assert_eq!(height_at(&map, -4.99, 4.99 - 0.5), 1.0);
    }

    #[test]
    fn the_envelope_finds_the_rock_beside_the_wheels_centre() {
        let map = drawn(|x, y| if (x - 1.25).hypot(y - 0.25) < 0.1 { 0.4 } else { 0.0 });
        assert_eq!(envelope_height(&map, 0.25, 0.25, 0.99), 0.0);
        assert_eq!(envelope_height(&map, 0.25, 0.25, 1.01), 0.4);
        assert!(
            (envelope_height(&map, 1.0, 0.25, 0.0) - 0.2).abs() < 1e-6,
            "no disc: the height at the point"
        );
        let hole = drawn(|x, _| if x < 0.0 { 0.3 } else { f64::NAN });
        assert!((envelope_height(&hole, 0.5, 0.25, 0.8) - 0.3).abs() < 1e-6, "known cells in reach count");
    }

    #[test]
    fn wheels_on_a_plane_stand_on_it() {
        let map = drawn(|x, y| 0.2 * x - 0.1 * y);
        let pose = [0.4, -0.3, 0.7];
        let points = LAYOUT.contact_points_m(pose[0], pose[1], pose[2]);
        for (height_m, [x_m, y_m]) in wheel_heights_m(&map, &LAYOUT, pose).iter().zip(points) {
            assert!((f64::from(*height_m) - 0.2 * x_m + 0.1 * y_m).abs() < 1e-6);
        }
    }

    fn surface_of(heights: &GridMap<f32>) -> GridMap<SurfaceCell> {
        let cell = |h: &f32| {
            if h.is_nan() {
                SurfaceCell::UNKNOWN
            } else {
                SurfaceCell::certain(*h, TerrainClass::Vegetation, 0.2)
            }
        };
        GridMap::from_values(GEOMETRY, heights.values().iter().map(cell).collect()).unwrap()
    }

    const PATCH: PatchShape = PatchShape { n_rows: 5, n_cols: 4, spacing_m: 0.4, rear_m: 0.4 };

    #[test]
    fn a_patch_of_a_plane_is_the_slope_along_and_across_the_vehicle() {
        for turn in 0..12 {
            let yaw_rad = 0.5 * f64::from(turn);
            // 0.3 up forward, 0.1 up to the left, whatever the yaw.
            let (sin, cos) = yaw_rad.sin_cos();
            let plane = drawn(|x, y| 7.0 + 0.3 * (cos * x + sin * y) + 0.1 * (cos * y - sin * x));
            let mut samples = vec![PatchSample::UNKNOWN; PATCH.n_samples()];
            PATCH.sample(&surface_of(&plane), &LAYOUT, [0.3, 0.8, yaw_rad], &mut samples);
            for (index, sample) in samples.iter().enumerate() {
                let (row, col) = (index / 4, index % 4);
                let [forward_m, left_m] = [0.4 * row as f64 - 0.4, 0.4 * col as f64 - 0.6];
                // The mean wheel is 0.6 m ahead of the rear axle, in the middle.
                let expected_m = 0.3 * (forward_m - 0.6) + 0.1 * left_m;
                assert!(
                    (f64::from(sample.relative_height_m) - expected_m).abs() < 1e-5,
                    "{row} {col} {sample:?}"
                );
                assert_eq!(sample.vegetation_height_m, 0.2);
                assert_eq!(sample.class_probability, [0.0, 0.0, 1.0, 0.0]);
            }
        }
    }

    #[test]
    fn unknown_samples_are_marked_and_wheels_over_holes_do_not_count() {
        // Nothing is known ahead of the rear axle but a cell's width.
        let half = surface_of(&drawn(|x, _| if x < 0.5 { 2.0 } else { f64::NAN }));
        assert!(half.values().iter().any(|cell| cell.knowledge == Knowledge::Unknown));
        let mut samples = vec![PatchSample::UNKNOWN; PATCH.n_samples()];
        PATCH.sample(&half, &LAYOUT, [0.1, 0.3, 0.0], &mut samples);
        assert_eq!(samples[0].relative_height_m, 0.0, "the rear wheels alone set the reference");
        assert!(samples[19].relative_height_m.is_nan());
        assert_eq!(samples[19].class_probability, [0.0; 4]);
        PATCH.sample(&half, &LAYOUT, [3.0, 0.3, 0.0], &mut samples);
        assert!(
            samples.iter().all(|sample| sample.relative_height_m.is_nan()),
            "no wheel stands on known ground"
        );
    }
}
