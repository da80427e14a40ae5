//! The ground on the way of a drive: slopes and classes, from the map or from the measured attitude.

use crate::drive::{N_QUANTITIES, X, Y, YAW};
use crate::machine::{GroundMap, Machine};
use crate::signals::filled;
use crate::smoothing::smoothed;

/// Rise per metre east and north, and class, row by row.
pub(crate) type GroundOnTheWay = ([Vec<f32>; 2], Vec<f32>);

/// From the map under the measured positions; without a map from the measured attitude; without both, level.
pub(crate) fn ground_on_the_way(
    smooth: &[Vec<f64>; N_QUANTITIES],
    attitude: &Option<[Vec<f64>; 2]>,
    machine: &Machine,
) -> GroundOnTheWay {
    let n = smooth[X].len();
    let mut gradient = [vec![0.0; n], vec![0.0; n]];
    let mut class = vec![0.0; n];
    let attitude = attitude.as_ref().map(|angles| angles.each_ref().map(|values| smoothed(&filled(values))));
    for row in 0..n {
        let yaw = smooth[YAW][row];
        let slope = match (&machine.ground, &attitude) {
            (Some(ground), _) => {
                let position = [smooth[X][row], smooth[Y][row]];
                class[row] = f32::from(ground.class_at(position));
                ground.slope(position, yaw, machine.wheelbase_m)
            }
            (None, Some([roll, pitch])) => [-pitch[row].tan(), roll[row].tan()],
            _ => [0.0; 2],
        };
        let (sine, cosine) = yaw.sin_cos();
        gradient[0][row] = (slope[0] * cosine - slope[1] * sine) as f32;
        gradient[1][row] = (slope[0] * sine + slope[1] * cosine) as f32;
    }
    (gradient, class)
}

impl GroundMap {
    fn node(&self, east: usize, north: usize) -> usize {
        east * self.n_nodes[1] + north
    }

    /// Fractional node, kept within the map.
    fn place(&self, position_m: [f64; 2]) -> [f64; 2] {
        std::array::from_fn(|axis| {
            let place = (position_m[axis] - self.origin_m[axis]) / self.resolution_m;
            place.clamp(0.0, (self.n_nodes[axis] - 1) as f64)
        })
    }

    /// Height by bilinear interpolation; beyond the map, of its border [m].
    fn height_at(&self, position_m: [f64; 2]) -> f64 {
        let [east, north] = self.place(position_m);
        let [i, j] =
            [(east, 0), (north, 1)].map(|(place, axis)| (place as usize).min(self.n_nodes[axis] - 2));
        let (u, v) = (east - i as f64, north - j as f64);
        let height = |i, j| f64::from(self.height_m[self.node(i, j)]);
        (1.0 - u) * ((1.0 - v) * height(i, j) + v * height(i, j + 1))
            + u * ((1.0 - v) * height(i + 1, j) + v * height(i + 1, j + 1))
    }

    /// Class of the nearest node.
    fn class_at(&self, position_m: [f64; 2]) -> u8 {
        let [east, north] = self.place(position_m).map(|place| place.round() as usize);
        self.class[self.node(east, north)]
    }

    /// Rise per metre ahead and to the left, between the axles and over half a wheelbase across.
    fn slope(&self, rear_m: [f64; 2], yaw_rad: f64, wheelbase_m: f64) -> [f64; 2] {
        let (sine, cosine) = yaw_rad.sin_cos();
        let at = |ahead: f64, left: f64| {
            self.height_at([
                rear_m[0] + ahead * cosine - left * sine,
                rear_m[1] + ahead * sine + left * cosine,
            ])
        };
        let (length, half_width) = (wheelbase_m, 0.25 * wheelbase_m);
        let ahead = (at(length, 0.0) - at(0.0, 0.0)) / length;
        let left = (at(0.5 * length, half_width) - at(0.5 * length, -half_width)) / (2.0 * half_width);
        [ahead, left]
    }
}
