//! A drive made ready for comparison with rollouts: an even time axis, commands as they were held, smooth states to
//! start from, and the ground on the way.

use crate::machine::{GroundMap, Machine};
use crate::smoothing::smoothed;
use bicycle::{Column, Command, Run};
use std::f64::consts::TAU;

/// Time step of every comparison [s].
pub(crate) const STEP_S: f64 = 0.02;
/// Steps between the starts of rollouts.
const STRIDE: usize = 10;
/// What the actuators did before a drive's first row is not known for this long [s].
const SETTLING_S: f64 = 1.5;
/// Horizons at which a rollout is compared, in steps.
pub(crate) const HORIZONS: [usize; 4] = [15, 30, 60, 100];
/// Steps of a rollout.
pub(crate) const N_STEPS: usize = HORIZONS[3];

/// Why a run cannot be compared.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum DriveError {
    /// A column is needed and absent.
    #[error("run '{run}': expected the column {column}, found none")]
    Missing {
        /// Run.
        run: String,
        /// Column.
        column: &'static str,
    },
    /// Nothing is left after the settling time and one rollout.
    #[error("run '{run}': expected at least {needed_s:.1} s, found {found_s:.1} s")]
    Short {
        /// Run.
        run: String,
        /// Needed [s].
        needed_s: f64,
        /// Found [s].
        found_s: f64,
    },
}

/// One run, every [`STEP_S`].
#[derive(Clone, Debug)]
pub(crate) struct Drive {
    pub(crate) name: String,
    /// Time of the first row in the log [s].
    pub(crate) time_s: f64,
    pub(crate) commands: Vec<Command>,
    /// Measured: east, north [m], yaw without jumps [rad], forward speed [m/s], yaw rate [rad/s].
    pub(crate) measured: [Vec<f64>; 5],
    /// The same, smoothed, to start from.
    pub(crate) smooth: [Vec<f64>; 5],
    /// Rise per metre east and north.
    pub(crate) gradient: [Vec<f32>; 2],
    pub(crate) class: Vec<f32>,
    /// Way and turn from the start of the drive by the sensors of speed and yaw rate [m], [rad].
    pub(crate) travelled: [Vec<f64>; 2],
    /// Rows from which rollouts start.
    pub(crate) starts: Vec<usize>,
}

/// Indices into [`Drive::measured`].
pub(crate) const X: usize = 0;
pub(crate) const Y: usize = 1;
pub(crate) const YAW: usize = 2;
pub(crate) const VX: usize = 3;
pub(crate) const WZ: usize = 4;

impl Drive {
    pub(crate) fn of(run: &Run<'_>, machine: &Machine) -> Result<Self, DriveError> {
        let name = run.name().to_owned();
        let time_s = run.time_s();
        let needed_s = SETTLING_S + (N_STEPS + STRIDE) as f64 * STEP_S;
        let found_s = time_s[time_s.len() - 1] - time_s[0];
        if found_s < needed_s {
            return Err(DriveError::Short { run: name, needed_s, found_s });
        }
        let n = (found_s / STEP_S + 1e-6).floor() as usize + 1;
        let read = |column: Column| {
            let values =
                run.column(column).ok_or(DriveError::Missing { run: name.clone(), column: column.name() })?;
            Ok(Axis { time_s, n }.interpolated(values, column == Column::Yaw))
        };
        let held = |column: Column| {
            let values =
                run.column(column).ok_or(DriveError::Missing { run: name.clone(), column: column.name() })?;
            Ok(Axis { time_s, n }.held(values))
        };
        let (speeds, steerings) = (held(Column::CmdSpeed)?, held(Column::CmdSteer)?);
        let command = |(&speed, &steering): (&f64, &f64)| Command {
            speed_mps: speed as f32,
            steering_rad: steering as f32,
        };
        let measured =
            [read(Column::X)?, read(Column::Y)?, read(Column::Yaw)?, read(Column::Vx)?, read(Column::Wz)?];
        let smooth = measured.each_ref().map(|values| smoothed(values));
        let attitude = [run.column(Column::Roll), run.column(Column::Pitch)]
            .map(|values| values.map(|values| Axis { time_s, n }.interpolated(values, false)));
        let (gradient, class) = ground_on_the_way(&smooth, attitude, machine);
        let settled = (SETTLING_S / STEP_S) as usize;
        Ok(Self {
            name,
            time_s: time_s[0],
            commands: speeds.iter().zip(&steerings).map(command).collect(),
            travelled: [VX, WZ].map(|quantity| summed(&smooth[quantity])),
            measured,
            smooth,
            gradient,
            class,
            starts: (settled..n - N_STEPS).step_by(STRIDE).collect(),
        })
    }

    /// Twice the same drive, with the earlier and with the later half of its starts.
    pub(crate) fn halves(&self) -> Vec<Self> {
        let (earlier, later) = self.starts.split_at(self.starts.len() / 2);
        [earlier, later].map(|starts| Self { starts: starts.to_vec(), ..self.clone() }).to_vec()
    }

    /// Displacement along and across the heading at `start`, turn, speed and yaw rate, measured `steps` later.
    pub(crate) fn outcome(&self, start: usize, steps: usize) -> [f64; 5] {
        let [x, y, yaw, vx, wz] = &self.measured;
        let [x0, y0, yaw0, ..] = self.smooth.each_ref().map(|values| values[start]);
        let (sine, cosine) = yaw0.sin_cos();
        let end = start + steps;
        let (dx, dy) = (x[end] - x0, y[end] - y0);
        [dx * cosine + dy * sine, dy * cosine - dx * sine, yaw[end] - yaw0, vx[end], wz[end]]
    }
}

fn summed(rates: &[f64]) -> Vec<f64> {
    let mut sum = 0.0;
    let mut sums = Vec::with_capacity(rates.len());
    for pair in rates.windows(2) {
        sums.push(sum);
        sum += 0.5 * (pair[0] + pair[1]) * STEP_S;
    }
    sums.push(sum);
    sums
}

/// A log's time axis, and the number of even steps over it.
#[derive(Clone, Copy)]
struct Axis<'a> {
    time_s: &'a [f64],
    n: usize,
}

impl Axis<'_> {
    /// For each even step the last row at or before it.
    fn rows(self) -> impl Iterator<Item = (f64, usize)> {
        let mut row = 0;
        (0..self.n).map(move |k| {
            let now_s = self.time_s[0] + k as f64 * STEP_S;
            while row + 1 < self.time_s.len() && self.time_s[row + 1] <= now_s + 1e-6 {
                row += 1;
            }
            (now_s, row)
        })
    }

    fn held(self, values: &[f64]) -> Vec<f64> {
        self.rows().map(|(_, row)| values[row]).collect()
    }

    /// Linear between rows; an angle takes the short way round and is freed of jumps.
    fn interpolated(self, values: &[f64], is_angle: bool) -> Vec<f64> {
        let continuous = if is_angle { unwrapped(values) } else { values.to_vec() };
        let between = |(now_s, row): (f64, usize)| match self.time_s.get(row + 1) {
            None => continuous[row],
            Some(next_s) => {
                let share = (now_s - self.time_s[row]) / (next_s - self.time_s[row]);
                continuous[row] + share.clamp(0.0, 1.0) * (continuous[row + 1] - continuous[row])
            }
        };
        self.rows().map(between).collect()
    }
}

fn unwrapped(angles: &[f64]) -> Vec<f64> {
    let mut turns = 0.0;
    let mut before = angles[0];
    let mut continuous = Vec::with_capacity(angles.len());
    for &angle in angles {
        turns -= ((angle - before) / TAU).round();
        before = angle;
        continuous.push(angle + turns * TAU);
    }
    continuous
}

type GroundOnTheWay = ([Vec<f32>; 2], Vec<f32>);

/// From the map under the measured positions; without a map from the measured attitude; without both, level.
fn ground_on_the_way(
    smooth: &[Vec<f64>; 5],
    attitude: [Option<Vec<f64>>; 2],
    machine: &Machine,
) -> GroundOnTheWay {
    let n = smooth[X].len();
    let mut gradient = [vec![0.0; n], vec![0.0; n]];
    let mut class = vec![0.0; n];
    let attitude = attitude.map(|values| values.map(|values| smoothed(&values)));
    for row in 0..n {
        let yaw = smooth[YAW][row];
        let slope = match (&machine.ground, &attitude) {
            (Some(ground), _) => {
                let position = [smooth[X][row], smooth[Y][row]];
                class[row] = f32::from(ground.class_at(position));
                ground.slope(position, yaw, machine.wheelbase_m)
            }
            (None, [Some(roll), Some(pitch)]) => [-pitch[row].tan(), roll[row].tan()],
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
    pub(crate) fn height_at(&self, position_m: [f64; 2]) -> f64 {
        let [east, north] = self.place(position_m);
        let [i, j] =
            [(east, 0), (north, 1)].map(|(place, axis)| (place as usize).min(self.n_nodes[axis] - 2));
        let (u, v) = (east - i as f64, north - j as f64);
        let height = |i, j| f64::from(self.height_m[self.node(i, j)]);
        (1.0 - u) * ((1.0 - v) * height(i, j) + v * height(i, j + 1))
            + u * ((1.0 - v) * height(i + 1, j) + v * height(i + 1, j + 1))
    }

    /// Class of the nearest node.
    pub(crate) fn class_at(&self, position_m: [f64; 2]) -> u8 {
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
