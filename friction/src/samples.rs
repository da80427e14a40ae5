//! What a drive log says of the vehicle's motion, smoothed, at instants on ground of one class.

use bicycle::{Column, DriveLog, Run};
use nalgebra::{Matrix3, Vector3};

use crate::chassis::{Chassis, GRAVITY_MPS2};
use crate::recording::{Moment, Recording};

/// Time between instants that are used [s].
pub(crate) const SPACING_S: f64 = 0.04;
/// Half of the time over which measurements are smoothed [s].
const HALF_WINDOW_S: f64 = 0.1;
/// Measurements in a window at least.
const WINDOW_MIN: usize = 5;
/// By Froude's number, speeds below which neither rolling nor sliding says anything [-].
const SLOW_FROUDE: f64 = 0.15;
/// Instants of one class that say something.
const SAMPLES_MIN: usize = 25;

/// An instant of a drive, smoothed. Body frame, forward-left.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Sample {
    /// Index of the class of the ground.
    pub class: usize,
    /// Index of the run.
    pub run: usize,
    pub time_s: f64,
    /// Velocity of the rear axle's centre [m/s].
    pub velocity_mps: [f64; 2],
    pub yaw_radps: f64,
    /// Mean circumferential speed of the driven wheels [m/s].
    pub wheel_mps: f64,
    pub steering_rad: f64,
    /// Friction over mass at the centre of mass [m/s2].
    pub specific_mps2: [f64; 2],
    pub yaw_radps2: f64,
}

/// A drive that friction cannot be found from.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum DriveError {
    /// A column is missing.
    #[error("drive log: expected the column {expected}, found {found}")]
    Column {
        /// What would do.
        expected: &'static str,
        /// The columns there are.
        found: String,
    },
    /// Not one class for every row.
    #[error("classes of the ground: expected one for each of {n_rows} rows, found {found}")]
    Classes {
        /// Rows of the log.
        n_rows: usize,
        /// Classes given.
        found: usize,
    },
    /// The vehicle hardly drives.
    #[error(
        "drive log: expected {SAMPLES_MIN} instants of driving forward faster than {slow_mps:.1} m/s on one ground, \
         measured every 0.05 s or more often, found {found}"
    )]
    TooShort {
        /// Speed below which nothing is used [m/s].
        slow_mps: f64,
        /// Instants found.
        found: usize,
    },
}

/// The columns of a run that are needed, each as long as the run.
struct Signals<'a> {
    time_s: &'a [f64],
    wheel_mps: &'a [f64],
    steering_rad: &'a [f64],
    yaw_radps: &'a [f64],
    velocity_mps: Option<[&'a [f64]; 2]>,
    place_m: Option<[&'a [f64]; 2]>,
    yaw_rad: Option<Vec<f64>>,
    specific_mps2: Option<[&'a [f64]; 2]>,
    attitude_rad: Option<[&'a [f64]; 2]>,
}

impl<'a> Signals<'a> {
    fn of(run: &Run<'a>) -> Result<Self, DriveError> {
        let pair = |columns: [Column; 2]| Some([run.column(columns[0])?, run.column(columns[1])?]);
        let absent = |expected| {
            let all = Column::ALL.into_iter().filter(|column| run.column(*column).is_some());
            let found = all.map(Column::name).collect::<Vec<_>>().join(", ");
            DriveError::Column { expected, found }
        };
        let signals = Self {
            time_s: run.time_s(),
            wheel_mps: run.column(Column::WheelSpeed).ok_or_else(|| absent("wheel_speed"))?,
            steering_rad: run
                .column(Column::SteerMeas)
                .or_else(|| run.column(Column::CmdSteer))
                .ok_or_else(|| absent("steer_meas or cmd_steer"))?,
            yaw_radps: run.column(Column::Wz).ok_or_else(|| absent("wz"))?,
            velocity_mps: pair([Column::Vx, Column::Vy]),
            place_m: pair([Column::X, Column::Y]),
            yaw_rad: run.column(Column::Yaw).map(unwrapped),
            specific_mps2: pair([Column::Ax, Column::Ay]),
            attitude_rad: pair([Column::Roll, Column::Pitch]),
        };
        let is_placed = signals.place_m.is_some() && signals.yaw_rad.is_some();
        if signals.velocity_mps.is_none() && !is_placed {
            return Err(absent("vx and vy, or x, y and yaw"));
        }
        Ok(signals)
    }
}

fn unwrapped(yaw_rad: &[f64]) -> Vec<f64> {
    let mut last_rad = f64::NAN;
    let follow = |yaw_rad: &f64| {
        if last_rad.is_finite() {
            let turn = std::f64::consts::TAU;
            last_rad = yaw_rad + turn * ((last_rad - yaw_rad) / turn).round();
        } else {
            last_rad = *yaw_rad;
        }
        last_rad
    };
    yaw_rad.iter().map(follow).collect()
}

/// Value and slope at an instant of the parabola through the measurements around it.
struct Window<'a> {
    time_s: &'a [f64],
    rows: std::ops::Range<usize>,
    at_s: f64,
}

impl Window<'_> {
    fn smoothed(&self, values: &[f64]) -> Option<[f64; 2]> {
        let (mut normal, mut right) = (Matrix3::zeros(), Vector3::zeros());
        let mut n = 0;
        for row in self.rows.clone().filter(|row| values[*row].is_finite()) {
            let x = (self.time_s[row] - self.at_s) / HALF_WINDOW_S;
            let powers = Vector3::new(1.0, x, x * x);
            normal += powers * powers.transpose();
            right += powers * values[row];
            n += 1;
        }
        let found = (n >= WINDOW_MIN).then(|| normal.cholesky()).flatten()?.solve(&right);
        Some([found[0], found[1] / HALF_WINDOW_S])
    }
}

/// Instants at which the vehicle drives on one ground.
///
/// # Errors
/// Missing columns, classes of another number, too little driving.
pub(crate) fn samples(
    chassis: &Chassis,
    log: &DriveLog,
    classes: &[usize],
    first_run: usize,
) -> Result<Vec<Sample>, DriveError> {
    if classes.len() != log.n_rows() {
        return Err(DriveError::Classes { n_rows: log.n_rows(), found: classes.len() });
    }
    let slow_mps = SLOW_FROUDE * (GRAVITY_MPS2 * chassis.wheelbase_m).sqrt();
    let (mut all, mut first_row) = (Vec::new(), 0);
    for (index, run) in log.runs().enumerate() {
        let signals = Signals::of(&run)?;
        let n_rows = signals.time_s.len();
        let classes = &classes[first_row..first_row + n_rows];
        first_row += n_rows;
        all.extend(of_run(chassis, &signals, classes, first_run + index, slow_mps));
    }
    if all.len() < SAMPLES_MIN {
        return Err(DriveError::TooShort { slow_mps, found: all.len() });
    }
    Ok(all)
}

/// The same of a recording over a picture, as one run.
pub(crate) fn of_recording(
    chassis: &Chassis,
    recording: &Recording,
    classes: &[usize],
    run: usize,
) -> Result<Vec<Sample>, DriveError> {
    let moments = &recording.moments;
    let column = |of: fn(&Moment) -> f64| moments.iter().map(of).collect::<Vec<f64>>();
    let wheel_mps: Vec<f64> = moments.iter().map(|moment| chassis.driven_mps(&moment.edge_mps)).collect();
    let [ahead, left] = [column(|m| m.velocity_mps[0]), column(|m| m.velocity_mps[1])];
    let felt = [column(|m| m.felt[0]), column(|m| m.felt[1])];
    let signals = Signals {
        time_s: &column(|m| m.time_s),
        wheel_mps: &wheel_mps,
        steering_rad: &column(|m| m.steering_rad),
        yaw_radps: &column(|m| m.yaw_radps),
        velocity_mps: Some([&ahead, &left]),
        place_m: None,
        yaw_rad: None,
        specific_mps2: Some([&felt[0], &felt[1]]),
        attitude_rad: None,
    };
    let slow_mps = SLOW_FROUDE * (GRAVITY_MPS2 * chassis.wheelbase_m).sqrt();
    let all: Vec<Sample> = of_run(chassis, &signals, classes, run, slow_mps).collect();
    if all.len() < SAMPLES_MIN {
        return Err(DriveError::TooShort { slow_mps, found: all.len() });
    }
    Ok(all)
}

fn of_run<'a>(
    chassis: &'a Chassis,
    signals: &'a Signals<'a>,
    classes: &'a [usize],
    run: usize,
    slow_mps: f64,
) -> impl Iterator<Item = Sample> + 'a {
    let time_s = signals.time_s;
    let [first_s, last_s] = [time_s[0], time_s[time_s.len() - 1]];
    let n = ((last_s - first_s) / SPACING_S) as usize;
    (0..=n).filter_map(move |step| {
        let at_s = first_s + step as f64 * SPACING_S;
        let rows = time_s.partition_point(|t| *t < at_s - HALF_WINDOW_S - 1e-9)
            ..time_s.partition_point(|t| *t <= at_s + HALF_WINDOW_S + 1e-9);
        let window = Window { time_s, rows, at_s };
        let sample = sample(chassis, signals, &window)?;
        let moves = sample.velocity_mps[0] > slow_mps
            || (sample.velocity_mps[0] > 0.0 && sample.wheel_mps > slow_mps);
        let class = one_class(chassis, classes, &window, sample.velocity_mps[0])?;
        moves.then_some(Sample { class, run, ..sample })
    })
}

/// The class where the vehicle stands, unless another one begins within a vehicle's length.
fn one_class(chassis: &Chassis, classes: &[usize], window: &Window<'_>, speed_mps: f64) -> Option<usize> {
    let reach_s = HALF_WINDOW_S + 1.2 * chassis.wheelbase_m / speed_mps.max(0.1);
    let first = window.time_s.partition_point(|t| *t < window.at_s - reach_s);
    let end = window.time_s.partition_point(|t| *t <= window.at_s + reach_s);
    let around = &classes[first..end];
    let class = *around.first()?;
    around.iter().all(|other| *other == class).then_some(class)
}

fn sample(chassis: &Chassis, signals: &Signals<'_>, window: &Window<'_>) -> Option<Sample> {
    let [yaw_radps, yaw_radps2] = window.smoothed(signals.yaw_radps)?;
    let (velocity_mps, acceleration_mps2) = motion(signals, window, yaw_radps)?;
    let attitude_rad = match signals.attitude_rad {
        Some([roll, pitch]) => [window.smoothed(roll)?[0], window.smoothed(pitch)?[0]],
        None => [0.0; 2],
    };
    let specific_mps2 = match signals.specific_mps2 {
        Some([ahead, left]) => [window.smoothed(ahead)?[0], window.smoothed(left)?[0]],
        None => [
            acceleration_mps2[0] - GRAVITY_MPS2 * attitude_rad[1].sin(),
            acceleration_mps2[1] + GRAVITY_MPS2 * attitude_rad[0].sin(),
        ],
    };
    // From the rear axle to the centre of mass; and a body that leans out of the bend feels its weight as well.
    let ahead_m = chassis.cog_ahead_m;
    let specific_mps2 = [
        (specific_mps2[0] - yaw_radps * yaw_radps * ahead_m) / chassis.lean[1],
        (specific_mps2[1] + yaw_radps2 * ahead_m) / chassis.lean[0],
    ];
    Some(Sample {
        class: 0,
        run: 0,
        time_s: window.at_s,
        velocity_mps,
        yaw_radps,
        wheel_mps: window.smoothed(signals.wheel_mps)?[0],
        steering_rad: window.smoothed(signals.steering_rad)?[0],
        specific_mps2,
        yaw_radps2,
    })
}

/// Velocity and acceleration of the rear axle's centre, ahead and left.
fn motion(signals: &Signals<'_>, window: &Window<'_>, yaw_radps: f64) -> Option<([f64; 2], [f64; 2])> {
    let [[ahead_mps, ahead_mps2], [left_mps, left_mps2]] = match signals.velocity_mps {
        Some([ahead, left]) => [window.smoothed(ahead)?, window.smoothed(left)?],
        None => driven(signals, window)?,
    };
    let acceleration_mps2 = [ahead_mps2 - left_mps * yaw_radps, left_mps2 + ahead_mps * yaw_radps];
    Some(([ahead_mps, left_mps], acceleration_mps2))
}

/// Velocity from places, and its change over the window's two halves.
fn driven(signals: &Signals<'_>, window: &Window<'_>) -> Option<[[f64; 2]; 2]> {
    let ([x_m, y_m], yaw_rad) = (signals.place_m?, signals.yaw_rad.as_ref()?);
    let at = |at_s: f64| {
        let window = Window { at_s, rows: window.rows.clone(), time_s: window.time_s };
        let (sin, cos) = window.smoothed(yaw_rad)?[0].sin_cos();
        let [x_mps, y_mps] = [window.smoothed(x_m)?[1], window.smoothed(y_m)?[1]];
        Some([x_mps * cos + y_mps * sin, y_mps * cos - x_mps * sin])
    };
    let half_s = 0.5 * HALF_WINDOW_S;
    let [before, here, after] = [at(window.at_s - half_s)?, at(window.at_s)?, at(window.at_s + half_s)?];
    Some([0, 1].map(|axis| [here[axis], (after[axis] - before[axis]) / (2.0 * half_s)]))
}
