//! A drive over ground that is seen from above, and its windows of two seconds.

mod file;

use crate::chassis::Chassis;
use crate::reasoning::{Controls, State};
use crate::roll_out::{PERIOD_S, STEPS, SUBSTEPS};
use crate::view::{View, ViewError};

/// Windows begin so far apart [s].
const WINDOW_EVERY_S: f64 = 0.5;
/// Slower starts are left out [m/s].
const SLOW_MPS: f64 = 2.0;
/// Numbers in a row.
pub const ROW: usize = 15;

/// One instant of a drive. The vehicle's frame lies at the middle of its rear axle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Moment {
    /// Since the begin [s].
    pub time_s: f64,
    /// East, north [m].
    pub at_m: [f64; 2],
    /// From east, counter-clockwise, without jumps [rad].
    pub yaw_rad: f64,
    /// Ahead, left [m/s].
    pub velocity_mps: [f64; 2],
    /// Turning left [rad/s].
    pub yaw_radps: f64,
    /// Circumferential speeds, front left, front right, rear left, rear right [m/s].
    pub edge_mps: [f64; 4],
    /// Of the front wheels, left positive [rad].
    pub steering_rad: f64,
    /// Specific force ahead and left, and yaw rate, as the inertial unit felt them [m/s2], [rad/s].
    pub felt: [f64; 3],
}

impl Moment {
    /// Its numbers in the order of its fields.
    pub fn row(&self) -> [f64; ROW] {
        let (at, velocity, edge, felt) = (self.at_m, self.velocity_mps, self.edge_mps, self.felt);
        [
            self.time_s,
            at[0],
            at[1],
            self.yaw_rad,
            velocity[0],
            velocity[1],
            self.yaw_radps,
            edge[0],
            edge[1],
            edge[2],
            edge[3],
            self.steering_rad,
            felt[0],
            felt[1],
            felt[2],
        ]
    }

    /// From the same numbers.
    pub fn of_row(row: &[f64; ROW]) -> Self {
        let [time_s, x, y, yaw_rad, vx, vy, yaw_radps, a, b, c, d, steering_rad, felt_x, felt_y, felt_yaw] =
            *row;
        Self {
            time_s,
            at_m: [x, y],
            yaw_rad,
            velocity_mps: [vx, vy],
            yaw_radps,
            edge_mps: [a, b, c, d],
            steering_rad,
            felt: [felt_x, felt_y, felt_yaw],
        }
    }
}

/// A drive and the ground it was on.
#[derive(Clone, Debug, PartialEq)]
pub struct Recording {
    /// The ground from above.
    pub view: View,
    /// Class of every pixel, an index into the published table, where somebody knows.
    pub classes: Option<Vec<u8>>,
    /// In the order of time, equally far apart, no farther than a step of a prediction.
    pub moments: Vec<Moment>,
}

/// A recording that nothing can be learned from.
#[derive(Debug, thiserror::Error)]
pub enum RecordingError {
    /// The picture is none.
    #[error(transparent)]
    View(#[from] ViewError),
    /// The bytes are none of safetensors.
    #[error("recording: {0}")]
    Bytes(#[from] safetensors::SafeTensorError),
    /// A part is missing or not what it should be.
    #[error("recording: {part}: expected {expected}, found {found}")]
    Part {
        /// Which.
        part: &'static str,
        /// What would do.
        expected: String,
        /// What stands there.
        found: String,
    },
}

pub(crate) fn part(part: &'static str, expected: impl ToString, found: impl ToString) -> RecordingError {
    RecordingError::Part { part, expected: expected.to_string(), found: found.to_string() }
}

/// Two seconds of a drive.
#[derive(Clone, Debug)]
pub struct Window {
    /// Index of its recording.
    pub recording: usize,
    /// Index of its first moment.
    pub first: usize,
    /// State of the centre of mass at its begin.
    pub start: State,
    /// What the wheels do in each Euler step.
    pub controls: Vec<Controls>,
    /// Measured states at the end of each step.
    pub truth: Vec<State>,
}

impl Recording {
    /// Refuses what cannot be.
    ///
    /// # Errors
    /// A view that is none, classes of another number or unknown, moments that are no numbers or out of order.
    pub fn validate(&self) -> Result<(), RecordingError> {
        self.view.validate()?;
        let n_pixels = self.view.n_rows * self.view.n_cols;
        if let Some(classes) = &self.classes {
            if classes.len() != n_pixels {
                return Err(part("classes", format!("one for each of {n_pixels} pixels"), classes.len()));
            }
            if let Some(class) = classes.iter().find(|class| usize::from(**class) >= 7) {
                return Err(part("classes", "0 to 6", class));
            }
        }
        if self.moments.len() < 2 {
            return Err(part("moments", "two at least", self.moments.len()));
        }
        if let Some(row) = self.moments.iter().position(|m| m.row().iter().any(|value| !value.is_finite())) {
            return Err(part("moments", "finite numbers", format!("others in row {}", row + 1)));
        }
        let spacing_s = self.spacing_s();
        let is_even = self
            .moments
            .windows(2)
            .all(|pair| (pair[1].time_s - pair[0].time_s - spacing_s).abs() < 0.1 * spacing_s);
        if spacing_s > PERIOD_S || !is_even {
            let expected = format!("rows equally far apart, by {PERIOD_S} s at most, in the order of time");
            return Err(part("moments", expected, format!("{spacing_s} s between the first two")));
        }
        Ok(())
    }

    /// Between moments [s].
    pub fn spacing_s(&self) -> f64 {
        (self.moments[1].time_s - self.moments[0].time_s).max(1e-9)
    }

    /// Windows of a validated recording.
    pub fn windows(&self, chassis: &Chassis, recording: usize) -> Vec<Window> {
        let spacing_s = self.spacing_s();
        let every = (WINDOW_EVERY_S / spacing_s).round().max(1.0) as usize;
        let length = (STEPS as f64 * PERIOD_S / spacing_s).ceil() as usize;
        let starts = (0..self.moments.len().saturating_sub(length)).step_by(every);
        starts
            .filter(|first| self.moments[*first].velocity_mps[0] > SLOW_MPS)
            .map(|first| self.window(chassis, recording, first))
            .collect()
    }

    /// The window that begins with a moment.
    pub fn window(&self, chassis: &Chassis, recording: usize, first: usize) -> Window {
        let begin_s = self.moments[first].time_s;
        let sub_s = PERIOD_S / SUBSTEPS as f64;
        let control = |k: usize| {
            let moment = self.at(begin_s + (k as f64 + 0.5) * sub_s);
            Controls { edge_mps: moment.edge_mps, steering_rad: moment.steering_rad }
        };
        let truth = |k: usize| state(chassis, &self.at(begin_s + (k + 1) as f64 * PERIOD_S));
        Window {
            recording,
            first,
            start: state(chassis, &self.moments[first]),
            controls: (0..STEPS * SUBSTEPS).map(control).collect(),
            truth: (0..STEPS).map(truth).collect(),
        }
    }

    /// A moment between two.
    pub(crate) fn at(&self, time_s: f64) -> Moment {
        let place = ((time_s - self.moments[0].time_s) / self.spacing_s()).max(0.0);
        let before = (place as usize).min(self.moments.len() - 2);
        let share = (place - before as f64).min(1.0);
        let [a, b] = [self.moments[before].row(), self.moments[before + 1].row()];
        Moment::of_row(&std::array::from_fn(|i| a[i] + share * (b[i] - a[i])))
    }
}

/// State of the centre of mass.
pub(crate) fn state(chassis: &Chassis, moment: &Moment) -> State {
    let (sin, cos) = moment.yaw_rad.sin_cos();
    let ahead_m = chassis.cog_ahead_m;
    let [felt_x, felt_y, _] = moment.felt;
    State {
        at_m: [moment.at_m[0] + ahead_m * cos, moment.at_m[1] + ahead_m * sin],
        heading_rad: moment.yaw_rad,
        velocity: [
            moment.velocity_mps[0],
            moment.velocity_mps[1] + moment.yaw_radps * ahead_m,
            moment.yaw_radps,
        ],
        specific_mps2: [felt_x - moment.yaw_radps * moment.yaw_radps * ahead_m, felt_y],
    }
}

impl Window {
    /// State at the begin of a step, as measured.
    pub fn before(&self, step: usize) -> &State {
        if step == 0 { &self.start } else { &self.truth[step - 1] }
    }
}
