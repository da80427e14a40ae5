//! Seconds of a drive: how the body stands, on what, and what it does.

use crate::drive::{N_QUANTITIES, STEP_S, VX, WZ, X, YAW};

/// Rows of a second.
const ROWS: usize = 50;
/// Class of vegetation.
const VEGETATION: f32 = 2.0;

/// Indices into pairs of angles: nose down, left side up.
pub(super) const PITCH: usize = 0;
pub(super) const ROLL: usize = 1;
/// Numbers that an angle is foretold from.
pub(super) const N_REGRESSORS: usize = 3;

/// Means of a second.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Block {
    /// Pitch, roll [rad].
    pub(super) body: [f64; 2],
    /// Of the ground under the wheels [rad].
    pub(super) ground: [f64; 2],
    /// Ahead, to the left [m/s2].
    pub(super) acceleration_mps2: [f64; 2],
    pub(super) speed_mps: f64,
    /// v |v|.
    pub(super) speed_squared_m2ps2: f64,
    /// Sign of the speed.
    pub(super) direction: f64,
    /// The same in vegetation, elsewhere 0.
    pub(super) in_vegetation: f64,
    /// Cosine and sine of the yaw.
    pub(super) heading: [f64; 2],
}

impl Block {
    pub(super) fn regressors(&self, axis: usize) -> [f64; N_REGRESSORS] {
        [1.0, self.ground[axis], self.acceleration_mps2[axis]]
    }
}

/// Rows of a drive, of which the attitude and the pose may be missing.
pub(crate) struct Rows<'a> {
    /// Roll and pitch [rad].
    pub(crate) attitude: &'a [Vec<f64>; 2],
    /// As they were measured.
    pub(crate) measured: &'a [Vec<f64>; N_QUANTITIES],
    pub(crate) smooth: &'a [Vec<f64>; N_QUANTITIES],
    /// Rise per metre of the ground east and north.
    pub(crate) gradient: &'a [Vec<f32>; 2],
    pub(crate) class: &'a [f32],
}

/// The seconds of a drive from a row on in which nothing is missing.
pub(crate) fn blocks(rows: &Rows<'_>, from: usize) -> Vec<Block> {
    let last = rows.class.len().saturating_sub(ROWS + 1);
    let is_whole = |first: &usize| {
        let second = *first..first + ROWS + 1;
        let needed = rows.attitude.iter().chain([X, YAW, VX].map(|quantity| &rows.measured[quantity]));
        needed.clone().all(|values| values[second.clone()].iter().all(|value| value.is_finite()))
    };
    (from..=last).step_by(ROWS).filter(is_whole).map(|first| rows.second(first)).collect()
}

impl Rows<'_> {
    fn second(&self, first: usize) -> Block {
        let mean = |of: &dyn Fn(usize) -> f64| (first..first + ROWS).map(of).sum::<f64>() / ROWS as f64;
        let smooth = |quantity: usize, row: usize| self.smooth[quantity][row];
        let direction = |row: usize| smooth(VX, row).signum();
        let in_vegetation =
            |row: usize| if (self.class[row] - VEGETATION).abs() < 0.5 { direction(row) } else { 0.0 };
        let gained_mps = smooth(VX, first + ROWS) - smooth(VX, first);
        Block {
            body: [1, 0].map(|column| mean(&|row| self.attitude[column][row])),
            ground: [PITCH, ROLL].map(|axis| mean(&|row| self.ground(row)[axis])),
            acceleration_mps2: [
                gained_mps / (ROWS as f64 * STEP_S),
                mean(&|row| smooth(VX, row) * smooth(WZ, row)),
            ],
            speed_mps: mean(&|row| smooth(VX, row)),
            speed_squared_m2ps2: mean(&|row| smooth(VX, row) * smooth(VX, row).abs()),
            direction: mean(&direction),
            in_vegetation: mean(&in_vegetation),
            heading: [mean(&|row| smooth(YAW, row).cos()), mean(&|row| smooth(YAW, row).sin())],
        }
    }

    /// Pitch and roll of the ground.
    fn ground(&self, row: usize) -> [f64; 2] {
        let (sine, cosine) = self.smooth[YAW][row].sin_cos();
        let [east, north] = [0, 1].map(|axis| f64::from(self.gradient[axis][row]));
        let (ahead, left) = (east * cosine + north * sine, north * cosine - east * sine);
        [-ahead.atan(), left.atan()]
    }
}
