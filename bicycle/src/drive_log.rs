//! A drive as a time series: what was commanded and what was measured, run by run.

mod joined;
mod readings;

use crate::Odometry;

pub use joined::JoinError;
pub use readings::Readings;

/// A quantity that a drive log may hold. Body frame forward-left-up, map frame x east, y north, z up.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[repr(u8)]
pub enum Column {
    /// Position east [m].
    X,
    /// Position north [m].
    Y,
    /// Position up [m].
    Z,
    /// Roll, left side up positive [rad].
    Roll,
    /// Pitch, nose down positive [rad].
    Pitch,
    /// Yaw, counter-clockwise from east; may or may not be unwrapped [rad].
    Yaw,
    /// Forward velocity in the body frame [m/s].
    Vx,
    /// Leftward velocity in the body frame [m/s].
    Vy,
    /// Yaw rate [rad/s].
    Wz,
    /// Forward acceleration in the body frame [m/s2].
    Ax,
    /// Leftward acceleration in the body frame [m/s2].
    Ay,
    /// Upward acceleration in the body frame [m/s2].
    Az,
    /// Commanded speed [m/s].
    CmdSpeed,
    /// Commanded angle of the front wheels, left positive [rad].
    CmdSteer,
    /// Commanded acceleration [m/s2].
    CmdAccel,
    /// Commanded throttle [-].
    CmdThrottle,
    /// Commanded brake [-].
    CmdBrake,
    /// Circumferential speed of the driven wheels [m/s].
    WheelSpeed,
    /// Measured angle of the front wheels, left positive [rad].
    SteerMeas,
    /// Commanded yaw rate of a skid-steered machine [rad/s].
    CmdWz,
    /// Yaw rate that the wheel speeds of a skid-steered machine amount to [rad/s].
    WheelWz,
    /// Commanded speed of the left wheels of a skid-steered machine [m/s].
    CmdLeft,
    /// Commanded speed of the right wheels of a skid-steered machine [m/s].
    CmdRight,
}

impl Column {
    /// Number of columns.
    pub const COUNT: usize = 23;

    /// All columns in the order in which they are written.
    pub const ALL: [Self; Self::COUNT] = [
        Self::X,
        Self::Y,
        Self::Z,
        Self::Roll,
        Self::Pitch,
        Self::Yaw,
        Self::Vx,
        Self::Vy,
        Self::Wz,
        Self::Ax,
        Self::Ay,
        Self::Az,
        Self::CmdSpeed,
        Self::CmdSteer,
        Self::CmdAccel,
        Self::CmdThrottle,
        Self::CmdBrake,
        Self::WheelSpeed,
        Self::SteerMeas,
        Self::CmdWz,
        Self::WheelWz,
        Self::CmdLeft,
        Self::CmdRight,
    ];

    const NAMES: [&str; Self::COUNT] = [
        "x",
        "y",
        "z",
        "roll",
        "pitch",
        "yaw",
        "vx",
        "vy",
        "wz",
        "ax",
        "ay",
        "az",
        "cmd_speed",
        "cmd_steer",
        "cmd_accel",
        "cmd_throttle",
        "cmd_brake",
        "wheel_speed",
        "steer_meas",
        "cmd_wz",
        "wheel_wz",
        "cmd_left",
        "cmd_right",
    ];

    /// Name of the column in files.
    pub fn name(self) -> &'static str {
        Self::NAMES[self as usize]
    }

    /// Whether it is what was asked for and no measurement.
    pub fn is_command(self) -> bool {
        self.name().starts_with("cmd_")
    }

    /// The column of that name in files.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|column| column.name() == name)
    }
}

/// One instant of a drive. A value that was not measured is NaN.
#[derive(Clone, Copy, Debug)]
pub struct DriveRow {
    /// Time since the run began [s].
    pub time_s: f64,
    values: [f64; Column::COUNT],
}

impl DriveRow {
    /// An instant of which nothing is known yet.
    pub fn new(time_s: f64) -> Self {
        Self { time_s, values: [f64::NAN; Column::COUNT] }
    }

    /// With a value set.
    pub fn with(mut self, column: Column, value: f64) -> Self {
        self.values[column as usize] = value;
        self
    }

    /// With what a localisation says of the motion.
    pub fn with_odometry(self, odometry: &Odometry) -> Self {
        let [x_m, y_m, z_m] = odometry.position_m;
        let [roll_rad, pitch_rad, yaw_rad] = odometry.attitude_rad;
        let [vx_mps, vy_mps] = odometry.velocity_mps;
        [
            (Column::X, x_m),
            (Column::Y, y_m),
            (Column::Z, z_m),
            (Column::Roll, roll_rad),
            (Column::Pitch, pitch_rad),
            (Column::Yaw, yaw_rad),
            (Column::Vx, vx_mps),
            (Column::Vy, vy_mps),
            (Column::Wz, odometry.yaw_rate_radps),
            (Column::WheelSpeed, odometry.wheel_speed_mps),
            (Column::SteerMeas, odometry.steering_rad),
        ]
        .into_iter()
        .fold(self, |row, (column, value)| row.with(column, value))
    }

    /// The value of a column, NaN when it was not measured.
    pub fn value(&self, column: Column) -> f64 {
        self.values[column as usize]
    }
}

/// A row that does not continue the log.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum DriveLogError {
    /// Time must be finite and grow strictly within a run.
    #[error("t: expected a finite time > {before_s} s within run '{run}', found {found_s}")]
    Time {
        /// Run.
        run: String,
        /// The previous row's time, minus infinity for the first row [s].
        before_s: f64,
        /// The time given [s].
        found_s: f64,
    },
    /// A value is infinite.
    #[error("{}: expected a finite number or nothing, found {found}", column.name())]
    Infinite {
        /// Column.
        column: Column,
        /// The value given.
        found: f64,
    },
    /// The rows of a run must stand together.
    #[error("run: expected the rows of run '{run}' to stand together, found it again after another run")]
    RunSplit {
        /// Run.
        run: String,
    },
}

/// A drive log in memory: one or several runs, each with its own time axis, and the columns that were measured.
#[derive(Clone, Debug, Default)]
pub struct DriveLog {
    /// Name and first row of each run.
    runs: Vec<(String, usize)>,
    time_s: Vec<f64>,
    /// Empty when the column is absent, otherwise one value per row.
    columns: [Vec<f64>; Column::COUNT],
}

/// What is missing in both is the same.
impl PartialEq for DriveLog {
    fn eq(&self, other: &Self) -> bool {
        let same = |own: &Vec<f64>, other: &Vec<f64>| {
            let mut pairs = own.iter().zip(other);
            own.len() == other.len()
                && pairs.all(|(own, other)| own == other || (own.is_nan() && other.is_nan()))
        };
        let mut columns = self.columns.iter().zip(&other.columns);
        self.runs == other.runs && self.time_s == other.time_s && columns.all(|(own, other)| same(own, other))
    }
}

impl DriveLog {
    /// Appends a row; another name than the previous row's begins a new run.
    ///
    /// Errors: time not finite or not after the previous row of the run, an infinite value, a run that ended before.
    /// The log is unchanged then.
    pub fn push(&mut self, run: &str, row: &DriveRow) -> Result<(), DriveLogError> {
        let continues = self.runs.last().is_some_and(|(name, _)| name == run);
        if !continues && self.runs.iter().any(|(name, _)| name == run) {
            return Err(DriveLogError::RunSplit { run: run.to_owned() });
        }
        let before_s = if continues { self.time_s[self.n_rows() - 1] } else { f64::NEG_INFINITY };
        if !(row.time_s.is_finite() && row.time_s > before_s) {
            return Err(DriveLogError::Time { run: run.to_owned(), before_s, found_s: row.time_s });
        }
        if let Some(column) = Column::ALL.into_iter().find(|column| row.value(*column).is_infinite()) {
            return Err(DriveLogError::Infinite { column, found: row.value(column) });
        }
        if !continues {
            self.runs.push((run.to_owned(), self.n_rows()));
        }
        self.append(row);
        Ok(())
    }

    fn append(&mut self, row: &DriveRow) {
        let n_before = self.n_rows();
        self.time_s.push(row.time_s);
        for (values, value) in self.columns.iter_mut().zip(row.values) {
            if values.is_empty() && !value.is_nan() {
                values.resize(n_before, f64::NAN);
            }
            if !value.is_nan() || !values.is_empty() {
                values.push(value);
            }
        }
    }

    /// The log with other values in its rows; of each the number of its run and its place there are told. Times stay.
    pub fn with_rows(&self, mut change: impl FnMut(usize, usize, DriveRow) -> DriveRow) -> Self {
        let mut changed = Self { runs: self.runs.clone(), ..Self::default() };
        for (run, own) in self.runs().enumerate() {
            for (place, row) in own.drive_rows().enumerate() {
                changed.append(&DriveRow { time_s: row.time_s, ..change(run, place, row) });
            }
        }
        changed
    }

    /// Number of rows over all runs.
    pub fn n_rows(&self) -> usize {
        self.time_s.len()
    }

    /// The columns of which at least one value is known.
    pub fn columns(&self) -> impl Iterator<Item = Column> + '_ {
        Column::ALL.into_iter().filter(|column| !self.columns[*column as usize].is_empty())
    }

    /// The runs in their order.
    pub fn runs(&self) -> impl ExactSizeIterator<Item = Run<'_>> {
        (0..self.runs.len()).map(|index| Run { log: self, index })
    }
}

/// One run of a drive log.
#[derive(Clone, Copy, Debug)]
pub struct Run<'a> {
    log: &'a DriveLog,
    index: usize,
}

impl<'a> Run<'a> {
    /// Name, a word or a number; empty when the log has but one and does not name it.
    pub fn name(&self) -> &'a str {
        &self.log.runs[self.index].0
    }

    /// Time axis, strictly increasing [s].
    pub fn time_s(&self) -> &'a [f64] {
        &self.log.time_s[self.rows()]
    }

    /// Values of a column, one per instant of the time axis, NaN where nothing was measured; `None` when the log
    /// does not have the column at all.
    pub fn column(&self, column: Column) -> Option<&'a [f64]> {
        let values = &self.log.columns[column as usize];
        (!values.is_empty()).then(|| &values[self.rows()])
    }

    /// The rows with all their values.
    pub fn drive_rows(self) -> impl ExactSizeIterator<Item = DriveRow> + 'a {
        let log = self.log;
        self.rows().map(move |row| DriveRow {
            time_s: log.time_s[row],
            values: std::array::from_fn(|column| log.columns[column].get(row).copied().unwrap_or(f64::NAN)),
        })
    }

    fn rows(&self) -> std::ops::Range<usize> {
        let end = self.log.runs.get(self.index + 1).map_or(self.log.n_rows(), |(_, start)| *start);
        self.log.runs[self.index].1..end
    }
}

#[cfg(test)]
mod tests;
