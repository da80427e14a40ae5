//! What a run says of its motion, by whichever columns it has.

use std::f64::consts::TAU;

use bicycle::{Column, DriveLog, Run};

use super::statistics::quantile;
use super::suspicion::Place;

/// Time over which motion is compared: long against noise, short against a turn [s].
const WINDOW_S: f64 = 0.3;

/// A column and its values.
#[derive(Clone, Copy, Debug)]
pub(super) struct Signal<'a> {
    pub column: Column,
    pub values: &'a [f64],
}

impl Signal<'_> {
    pub(super) fn name(&self) -> &'static str {
        self.column.name()
    }
}

/// One run.
#[derive(Clone, Copy, Debug)]
pub(super) struct Signals<'a> {
    pub run: Run<'a>,
    /// Rows of the log before this run.
    pub first_row: usize,
    /// Median step of the whole log [s].
    pub step_s: f64,
    pub time_s: &'a [f64],
    /// East and north.
    pub position_m: Option<[&'a [f64]; 2]>,
    pub yaw: Option<Signal<'a>>,
    pub yaw_rate: Option<Signal<'a>>,
    /// Measured forward speed: of the body, else of the wheels.
    pub speed: Option<Signal<'a>>,
    /// Angle of the front wheels: commanded, else measured.
    pub steering: Option<Signal<'a>>,
    pub commanded_speed: Option<Signal<'a>>,
}

impl<'a> Signals<'a> {
    pub(super) fn of(log: &'a DriveLog) -> Vec<Self> {
        let steps = log.runs().flat_map(|run| run.time_s().windows(2).map(|pair| pair[1] - pair[0]));
        let step_s = quantile(steps.collect(), 0.5);
        let mut first_row = 0;
        let mut of_run = |run: Run<'a>| {
            let signals = Self::of_run(run, first_row, step_s);
            first_row += run.time_s().len();
            signals
        };
        log.runs().map(&mut of_run).collect()
    }

    fn of_run(run: Run<'a>, first_row: usize, step_s: f64) -> Self {
        let signal = |column: Column| run.column(column).map(|values| Signal { column, values });
        let either = |columns: [Column; 2]| columns.into_iter().find_map(signal);
        Self {
            run,
            first_row,
            step_s,
            time_s: run.time_s(),
            position_m: run.column(Column::X).zip(run.column(Column::Y)).map(|(x, y)| [x, y]),
            yaw: signal(Column::Yaw),
            yaw_rate: signal(Column::Wz),
            speed: either([Column::Vx, Column::WheelSpeed]),
            steering: either([Column::CmdSteer, Column::SteerMeas]),
            commanded_speed: signal(Column::CmdSpeed),
        }
    }

    pub(super) fn n(&self) -> usize {
        self.time_s.len()
    }

    pub(super) fn duration_s(&self) -> f64 {
        self.time_s[self.n() - 1] - self.time_s[0]
    }

    pub(super) fn place(&self, row: usize) -> Place {
        Place { run: self.run.name().to_owned(), row: self.first_row + row + 1, time_s: self.time_s[row] }
    }

    /// First and last rows of all stretches of about [`WINDOW_S`].
    pub(super) fn windows(&self) -> impl Iterator<Item = (usize, usize)> + use<> {
        let length = ((WINDOW_S / self.step_s).round() as usize).max(1);
        (length..self.n()).map(move |end| (end - length, end))
    }

    /// What the values add up to from the first row to each row.
    pub(super) fn summed(&self, values: &[f64]) -> Vec<f64> {
        let mut sum = 0.0;
        let steps = self.time_s.windows(2).zip(values.windows(2));
        let sums = steps.map(|(time_s, pair)| {
            sum += 0.5 * (pair[0] + pair[1]) * (time_s[1] - time_s[0]);
            sum
        });
        std::iter::once(0.0).chain(sums).collect()
    }

    /// Straight distance between two rows [m].
    pub(super) fn moved_m(&self, from: usize, to: usize) -> Option<f64> {
        self.position_m.map(|[x, y]| (x[to] - x[from]).hypot(y[to] - y[from]))
    }

    /// The same along the yaw half way [m].
    pub(super) fn moved_ahead_m(&self, from: usize, to: usize) -> Option<f64> {
        let (sine, cosine) = self.yaw?.values[usize::midpoint(from, to)].sin_cos();
        self.position_m.map(|[x, y]| ((x[to] - x[from]) * cosine + (y[to] - y[from]) * sine).abs())
    }

    /// Velocity across the yaw half way, to the left [m/s].
    pub(super) fn moved_left_mps(&self, from: usize, to: usize) -> Option<f64> {
        let (sine, cosine) = self.yaw?.values[usize::midpoint(from, to)].sin_cos();
        let duration_s = self.time_s[to] - self.time_s[from];
        self.position_m.map(|[x, y]| ((y[to] - y[from]) * cosine - (x[to] - x[from]) * sine) / duration_s)
    }

    /// Yaw rate, measured or from the yaw over windows of a fifth of a second.
    pub(super) fn turning_radps(&self) -> Option<Vec<f64>> {
        if let Some(yaw_rate) = self.yaw_rate {
            return Some(yaw_rate.values.to_vec());
        }
        let yaw = unwrapped(self.yaw?.values, TAU);
        let half = ((0.1 / self.step_s).round() as usize).max(1);
        let last = self.n() - 1;
        let slope = |row: usize| {
            let (from, to) = (row.saturating_sub(half), (row + half).min(last));
            (yaw[to] - yaw[from]) / (self.time_s[to] - self.time_s[from])
        };
        (last > 0).then(|| (0..=last).map(slope).collect())
    }

    /// Speed, measured or commanded.
    pub(super) fn any_speed(&self) -> Option<Signal<'a>> {
        self.speed.or(self.commanded_speed)
    }

    /// Yaw rate of the kinematic bicycle at every row [rad/s].
    pub(super) fn kinematic_radps(&self, wheelbase_m: f64) -> Option<Vec<f64>> {
        let (speed, steering) = (self.any_speed()?.values, self.steering?.values);
        let rate = |(speed, steering): (&f64, &f64)| speed * steering.tan() / wheelbase_m;
        Some(speed.iter().zip(steering).map(rate).collect())
    }
}

/// An angle freed of its leaps of a whole turn.
pub(super) fn unwrapped(angles: &[f64], turn: f64) -> Vec<f64> {
    let mut turns = 0.0;
    let mut before = angles.first().copied().unwrap_or(0.0);
    let unwrap = |&angle: &f64| {
        turns -= ((angle - before) / turn).round();
        before = angle;
        angle + turns * turn
    };
    angles.iter().map(unwrap).collect()
}
