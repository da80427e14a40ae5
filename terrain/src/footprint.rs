//! Where a vehicle touches and covers the ground.

use crate::{Cell, GridGeometry};

/// Places of the wheels. Wheel order everywhere: front left, rear left, rear right, front right
/// (PIETRA's 1, 2, 3, 4).
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct WheelLayout {
    /// Between the axles [m].
    pub wheelbase_m: f64,
    /// Between the wheels' middle planes on an axle [m].
    pub track_m: f64,
}

impl WheelLayout {
    /// Wheel contact points in the body frame, seen from above: forward, left of the rear axle's centre [m].
    pub fn body_points_m(&self) -> [[f64; 2]; 4] {
        let (front_m, half_m) = (self.wheelbase_m, 0.5 * self.track_m);
        [[front_m, half_m], [0.0, half_m], [0.0, -half_m], [front_m, -half_m]]
    }

    /// Wheel contact points in the map frame for a rear axle's centre at (`x_m`, `y_m`) [m].
    pub fn contact_points_m(&self, x_m: f64, y_m: f64, yaw_rad: f64) -> [[f64; 2]; 4] {
        self.body_points_m().map(|point| {
            let [dx_m, dy_m] = rotated(point, yaw_rad);
            [x_m + dx_m, y_m + dy_m]
        })
    }
}

/// The rectangle that a vehicle covers, about its rear axle's centre.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Footprint {
    /// From the rear axle to the foremost point [m].
    pub front_m: f64,
    /// From the rear axle to the rearmost point, as a positive number [m].
    pub rear_m: f64,
    /// Half the width [m].
    pub half_width_m: f64,
}

impl Footprint {
    /// Corners in the map frame: front left, rear left, rear right, front right [m].
    pub fn corners_m(&self, x_m: f64, y_m: f64, yaw_rad: f64) -> [[f64; 2]; 4] {
        let Self { front_m, rear_m, half_width_m } = *self;
        [[front_m, half_width_m], [-rear_m, half_width_m], [-rear_m, -half_width_m], [front_m, -half_width_m]]
            .map(|corner| {
                let [dx_m, dy_m] = rotated(corner, yaw_rad);
                [x_m + dx_m, y_m + dy_m]
            })
    }

    /// Whether a point of the body frame lies in the rectangle, its edge included.
    pub fn contains(&self, forward_m: f64, left_m: f64) -> bool {
        forward_m <= self.front_m && -forward_m <= self.rear_m && left_m.abs() <= self.half_width_m
    }
}

/// A layout and a footprint turned to one yaw and measured in cells, so that walking over a map costs
/// additions only. It stands for a rear axle's centre in the centre of a cell.
#[derive(Clone, Debug, PartialEq)]
pub struct YawFootprint {
    /// The yaw that it was made for [rad].
    pub yaw_rad: f64,
    /// From the rear axle's cell centre to each wheel's contact point: columns eastward, rows northward [cells].
    pub wheel_offsets: [[f32; 2]; 4],
    /// Cells whose centres the rectangle covers, the rear axle's own cell always among them: columns, rows
    /// from the rear axle's cell, in row-major order.
    pub cells: Vec<[i32; 2]>,
    /// Smallest and largest offset of `cells` and of the cells that hold the wheels, each columns, rows.
    pub extent: [[i32; 2]; 2],
}

impl YawFootprint {
    /// The footprint at one yaw on cells of `resolution_m`.
    pub fn new(layout: &WheelLayout, footprint: &Footprint, resolution_m: f64, yaw_rad: f64) -> Self {
        let wheel_offsets =
            layout.contact_points_m(0.0, 0.0, yaw_rad).map(|wheel| wheel.map(|v| (v / resolution_m) as f32));
        let corners = footprint.corners_m(0.0, 0.0, yaw_rad);
        let reach_m =
            corners.iter().fold(0.0_f64, |reach_m, [x_m, y_m]| reach_m.max(libm::hypot(*x_m, *y_m)));
        let reach = (reach_m / resolution_m).ceil() as i32;
        let mut cells = Vec::new();
        for row in -reach..=reach {
            for col in -reach..=reach {
                let [x_m, y_m] = [f64::from(col) * resolution_m, f64::from(row) * resolution_m];
                let [forward_m, left_m] = rotated([x_m, y_m], -yaw_rad);
                if (row == 0 && col == 0) || footprint.contains(forward_m, left_m) {
                    cells.push([col, row]);
                }
            }
        }
        let extent = extent(&cells, &wheel_offsets);
        Self { yaw_rad, wheel_offsets, cells, extent }
    }

    /// One footprint for each of `n_yaws` yaw bins; bin k is centred at (k + 1/2) 2 pi / `n_yaws`.
    pub fn for_yaw_bins(
        layout: &WheelLayout,
        footprint: &Footprint,
        resolution_m: f64,
        n_yaws: usize,
    ) -> Vec<Self> {
        (0..n_yaws)
            .map(|bin| (bin as f64 + 0.5) * std::f64::consts::TAU / n_yaws as f64)
            .map(|yaw_rad| Self::new(layout, footprint, resolution_m, yaw_rad))
            .collect()
    }

    /// The covered cells that lie in the window when the rear axle stands on `cell`.
    pub fn cells_at<'a>(&'a self, cell: Cell, geometry: &'a GridGeometry) -> impl Iterator<Item = Cell> + 'a {
        self.cells.iter().filter_map(move |&[d_col, d_row]| {
            let row = cell.row.checked_add_signed(d_row as isize)?;
            let col = cell.col.checked_add_signed(d_col as isize)?;
            (row < geometry.n_rows && col < geometry.n_cols).then_some(Cell { row, col })
        })
    }

    /// Whether everything that is covered or rolled over lies in the window.
    pub fn is_inside(&self, cell: Cell, geometry: &GridGeometry) -> bool {
        let inside = |place: usize, axis: usize, n: usize| {
            let place = place as i64;
            place + i64::from(self.extent[0][axis]) >= 0 && place + i64::from(self.extent[1][axis]) < n as i64
        };
        inside(cell.col, 0, geometry.n_cols) && inside(cell.row, 1, geometry.n_rows)
    }
}

fn extent(cells: &[[i32; 2]], wheel_offsets: &[[f32; 2]; 4]) -> [[i32; 2]; 2] {
    // A wheel needs the four cells around it for bilinear interpolation.
    let below = wheel_offsets.iter().map(|wheel| wheel.map(|v| v.floor() as i32));
    let above = wheel_offsets.iter().map(|wheel| wheel.map(|v| v.ceil() as i32));
    let mut extent = [[i32::MAX; 2], [i32::MIN; 2]];
    for offset in cells.iter().copied().chain(below).chain(above) {
        for axis in 0..2 {
            extent[0][axis] = extent[0][axis].min(offset[axis]);
            extent[1][axis] = extent[1][axis].max(offset[axis]);
        }
    }
    extent
}

/// Turns a vector counter-clockwise.
pub(crate) fn rotated([x, y]: [f64; 2], angle_rad: f64) -> [f64; 2] {
    let (sin, cos) = libm::sincos(angle_rad);
    [cos * x - sin * y, sin * x + cos * y]
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::f64::consts::{FRAC_PI_2, PI, TAU};

    const LAYOUT: WheelLayout = WheelLayout { wheelbase_m: 2.0, track_m: 1.5 };
    const BODY: Footprint = Footprint { front_m: 2.7, rear_m: 0.7, half_width_m: 0.9 };

    fn close(a: [f64; 2], b: [f64; 2]) -> bool {
        (a[0] - b[0]).hypot(a[1] - b[1]) < 1e-12
    }

    #[test]
    fn wheels_come_in_the_order_front_left_rear_left_rear_right_front_right() {
        // Heading north: forward is north, left is west.
        let wheels = LAYOUT.contact_points_m(10.0, 20.0, FRAC_PI_2);
        let expected = [[9.25, 22.0], [9.25, 20.0], [10.75, 20.0], [10.75, 22.0]];
        assert!(wheels.iter().zip(expected).all(|(a, b)| close(*a, b)), "{wheels:?}");
    }

    proptest! {
        #[test]
        fn wheels_keep_their_distances_at_every_pose(x in -50.0..50.0_f64, y in -50.0..50.0_f64, yaw in -9.0..9.0_f64) {
            let [fl, rl, rr, fr] = LAYOUT.contact_points_m(x, y, yaw);
            let distance = |a: [f64; 2], b: [f64; 2]| (a[0] - b[0]).hypot(a[1] - b[1]);
            for (d, expected) in [
                (distance(fl, rl), 2.0), (distance(fr, rr), 2.0), (distance(fl, fr), 1.5), (distance(rl, rr), 1.5),
                (distance(fl, rr), 2.5), (distance(rl, [x, y]), 0.75), (distance(rr, [x, y]), 0.75),
            ] {
                prop_assert!((d - expected).abs() < 1e-9);
            }
            // Left of the heading means a positive cross product.
            let cross = yaw.cos() * (rl[1] - y) - yaw.sin() * (rl[0] - x);
            prop_assert!((cross - 0.75).abs() < 1e-9);
        }

        #[test]
        fn covered_cells_are_those_on_the_inner_side_of_all_four_edges(yaw in -7.0..7.0_f64, resolution in 0.1..0.5_f64) {
            let turned = YawFootprint::new(&LAYOUT, &BODY, resolution, yaw);
            let corners = BODY.corners_m(0.0, 0.0, yaw);
            let reach = (3.0 / resolution).ceil() as i32;
            for (col, row) in (-reach..=reach).flat_map(|col| (-reach..=reach).map(move |row| (col, row))) {
                let [x, y] = [f64::from(col) * resolution, f64::from(row) * resolution];
                // Corners go counter-clockwise; how far the point lies to the left of each edge.
                let inward = (0..4).map(|i| {
                    let ([ax, ay], [bx, by]) = (corners[i], corners[(i + 1) % 4]);
                    ((bx - ax) * (y - ay) - (by - ay) * (x - ax)) / (bx - ax).hypot(by - ay)
                }).fold(f64::INFINITY, f64::min);
                if inward.abs() > 1e-9 {
                    prop_assert_eq!(turned.cells.contains(&[col, row]), inward > 0.0, "{} {}", col, row);
                }
            }
        }
    }

    #[test]
    fn turning_by_half_a_turn_mirrors_the_cells_through_the_rear_axle() {
        let forward = YawFootprint::new(&LAYOUT, &BODY, 0.17, 0.4);
        let backward = YawFootprint::new(&LAYOUT, &BODY, 0.17, 0.4 + PI);
        let mut mirrored: Vec<_> = backward.cells.iter().map(|[col, row]| [-col, -row]).collect();
        mirrored.reverse();
        assert_eq!(forward.cells, mirrored);
        for (a, b) in forward.wheel_offsets.iter().zip(&backward.wheel_offsets) {
            assert!((a[0] + b[0]).abs() < 1e-5 && (a[1] + b[1]).abs() < 1e-5);
        }
    }

    #[test]
    fn the_number_of_cells_is_the_area_over_a_cells_area() {
        for turned in YawFootprint::for_yaw_bins(&LAYOUT, &BODY, 0.05, 13) {
            let area_m2 = turned.cells.len() as f64 * 0.05 * 0.05;
            assert!((area_m2 / (3.4 * 1.8) - 1.0).abs() < 0.03, "{area_m2}");
        }
    }

    #[test]
    fn yaw_bins_are_centred_at_odd_halves() {
        let bins = YawFootprint::for_yaw_bins(&LAYOUT, &BODY, 0.2, 4);
        let yaws: Vec<f64> = bins.iter().map(|bin| bin.yaw_rad / TAU).collect();
        assert_eq!(yaws, [0.125, 0.375, 0.625, 0.875]);
    }

    #[test]
    fn a_vehicle_smaller_than_a_cell_still_covers_its_own() {
        let speck = Footprint { front_m: 0.01, rear_m: 0.01, half_width_m: 0.01 };
        assert_eq!(YawFootprint::new(&LAYOUT, &speck, 0.5, 1.0).cells, [[0, 0]]);
    }

    #[test]
    fn the_extent_decides_exactly_whether_a_pose_fits_the_window() {
        let geometry = GridGeometry { resolution_m: 0.25, origin: [0, 0], n_rows: 30, n_cols: 26 };
        for turned in YawFootprint::for_yaw_bins(&LAYOUT, &BODY, 0.25, 7) {
            for index in 0..geometry.n_cells() {
                let cell = geometry.cell(index);
                let all_cells = turned.cells_at(cell, &geometry).count() == turned.cells.len();
                let all_wheels = turned.wheel_offsets.iter().all(|[d_col, d_row]| {
                    let (col, row) = (cell.col as f32 + d_col, cell.row as f32 + d_row);
                    col >= 0.0 && row >= 0.0 && col.ceil() < 26.0 && row.ceil() < 30.0
                });
                assert_eq!(turned.is_inside(cell, &geometry), all_cells && all_wheels, "{cell:?}");
            }
        }
    }
}
