//! Where a vehicle touches and covers the ground.

use crate::{Cell, GridGeometry};

/// Places of the wheels. Wheel order everywhere: front left, rear left, rear right, front right
/// (PIETRA's 1, 2, 3, 4).
#[derive(Clone, Copy, Debug, PartialEq)]
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
        let reach_m = corners.iter().fold(0.0_f64, |reach_m, [x_m, y_m]| reach_m.max(x_m.hypot(*y_m)));
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
    let (sin, cos) = angle_rad.sin_cos();
    [cos * x - sin * y, sin * x + cos * y]
}
