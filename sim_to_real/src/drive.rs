//! A drive made ready for comparison with rollouts: an even time axis, inputs as they were held, smooth states to
//! start from, and the ground on the way.

use crate::attitude::{Block, Rows, blocks};
use crate::evidence::{Evidence, SpeedInput};
use crate::ground::ground_on_the_way;
use crate::machine::Machine;
use crate::signals::{Signals, summed};
use bicycle::{Command, Run};

/// Time step of every comparison [s].
pub(crate) const STEP_S: f64 = 0.02;
/// Steps between the starts of rollouts.
const STRIDE: usize = 10;
/// What the actuators did before a drive's first row is not known for this long [s],
const SETTLING_S: f64 = 1.5;
/// of a short run for this share of it.
const SETTLING_SHARE: f64 = 0.2;
/// Horizons at which a rollout is compared, in steps.
pub(crate) const HORIZONS: [usize; 4] = [15, 30, 60, 100];
/// Quantities measured: of a drive as in [`Drive::measured`], of a rollout as in [`Drive::outcome`].
pub(crate) const N_QUANTITIES: usize = 6;
/// Steps of a rollout.
pub(crate) const N_STEPS: usize = HORIZONS[3];
/// Runs with room for this many steps after the settling time are compared at all horizons from every start; rollouts
/// of shorter ones end with the run.
const LONG: usize = N_STEPS + STRIDE;
/// What actuators remember of their commands in a stretch of a drive [s].
const REMEMBERED_S: f64 = 3.0;
/// The shortest run [s].
const SHORTEST_S: f64 = 1.0;

/// Why a run cannot be compared.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum DriveError {
    /// Nothing tells the speed or the turning that were asked for.
    #[error("run '{run}': expected the column {column} or one that stands in for it, found none")]
    Missing {
        /// Run.
        run: String,
        /// Column that would serve best.
        column: &'static str,
    },
    /// Too short for a rollout after the settling time.
    #[error("run '{run}': expected at least {needed_s:.1} s, found {found_s:.1} s")]
    Short {
        /// Run.
        run: String,
        /// Needed [s].
        needed_s: f64,
        /// Found [s].
        found_s: f64,
    },
    /// Inputs or measurements are missing everywhere for as long as a rollout takes.
    #[error("run '{run}': expected inputs and measurements without holes for {needed_s:.1} s, found none")]
    Holes {
        /// Run.
        run: String,
        /// Needed [s].
        needed_s: f64,
    },
}

/// One run, every [`STEP_S`]. A short one goes on after its end with states held and nothing measured, so that every
/// rollout has room.
#[derive(Clone, Debug)]
pub(crate) struct Drive {
    pub(crate) name: String,
    /// Time of the first row in the log [s].
    pub(crate) time_s: f64,
    pub(crate) evidence: Evidence,
    /// Speed [m/s] or acceleration [m/s2], and angle [rad] or yaw rate [rad/s], as the evidence says.
    pub(crate) commands: Vec<Command>,
    /// Measured: east, north [m], yaw without jumps [rad], forward speed [m/s], yaw rate [rad/s], speed to the left [m/s];
    /// NaN where not.
    pub(crate) measured: [Vec<f64>; N_QUANTITIES],
    /// The same, smoothed and never missing, to start from.
    pub(crate) smooth: [Vec<f64>; N_QUANTITIES],
    /// Rise per metre east and north.
    pub(crate) gradient: [Vec<f32>; 2],
    pub(crate) class: Vec<f32>,
    /// Way and turn from the start of the drive by the sensors of speed and yaw rate [m], [rad].
    pub(crate) travelled: [Vec<f64>; 2],
    /// Rows from which rollouts start.
    pub(crate) starts: Vec<usize>,
    /// How the body stands second by second; none where roll, pitch or the ground is not known, and none of a stretch.
    pub(crate) attitude: Vec<Block>,
}

/// Indices into [`Drive::measured`].
pub(crate) const X: usize = 0;
pub(crate) const Y: usize = 1;
pub(crate) const YAW: usize = 2;
pub(crate) const VX: usize = 3;
pub(crate) const WZ: usize = 4;
pub(crate) const VY: usize = 5;

impl Drive {
    pub(crate) fn of(run: &Run<'_>, machine: &Machine) -> Result<Self, DriveError> {
        let name = run.name().to_owned();
        let missing = |column| DriveError::Missing { run: name.clone(), column };
        let evidence = Evidence::of(run, machine).map_err(missing)?;
        let span = Span::of(run)?;
        let signals = Signals::new(run, span.n_rows);
        let mut measured = signals.measured(evidence);
        let smooth = signals.smooth(evidence, &measured);
        let inputs = signals.inputs(evidence, &smooth[VX]);
        let starts = span.whole_starts(&inputs, &measured);
        if starts.is_empty() {
            return Err(DriveError::Holes { run: name, needed_s: (span.settled + N_STEPS) as f64 * STEP_S });
        }
        let attitude = signals.attitude();
        let (gradient, class) = ground_on_the_way(&smooth, &attitude, machine);
        let attitude = attitude.filter(|_| machine.ground.is_some()).map(|attitude| {
            let (measured, smooth, gradient) = (&measured, &smooth, &gradient);
            blocks(&Rows { attitude: &attitude, measured, smooth, gradient, class: &class }, span.settled)
        });
        if evidence.speed_input == SpeedInput::Measured {
            // What drives the model is no test of it.
            measured[VX].fill(f64::NAN);
        }
        let mut drive = Self {
            name,
            time_s: run.time_s()[0],
            evidence,
            commands: commands(&inputs),
            travelled: [VX, WZ].map(|quantity| summed(&smooth[quantity])),
            measured,
            smooth,
            gradient,
            class,
            starts,
            attitude: attitude.unwrap_or_default(),
        };
        drive.extend_to(span.end + N_STEPS);
        Ok(drive)
    }

    /// Goes on to so many rows, if there are fewer.
    fn extend_to(&mut self, n: usize) {
        if self.commands.len() >= n {
            return;
        }
        self.measured.iter_mut().for_each(|values| values.resize(n, f64::NAN));
        self.smooth.iter_mut().chain(&mut self.travelled).for_each(|values| hold_last(values, n));
        self.gradient.iter_mut().chain([&mut self.class]).for_each(|values| hold_last(values, n));
        hold_last(&mut self.commands, n);
    }

    /// Twice the same drive, with the earlier and with the later half of its starts.
    pub(crate) fn halves(&self) -> Vec<Self> {
        let (earlier, later) = self.starts.split_at(self.starts.len() / 2);
        [earlier, later].map(|starts| Self { starts: starts.to_vec(), ..self.clone() }).to_vec()
    }

    /// The part of the drive that rollouts from these starts run through, with what came before them for as long as
    /// actuators remember.
    pub(crate) fn stretch(&self, starts: &[usize]) -> Self {
        let (Some(&first), Some(&last)) = (starts.first(), starts.last()) else {
            return Self { starts: Vec::new(), ..self.clone() };
        };
        let from = first.saturating_sub((REMEMBERED_S / STEP_S) as usize);
        let rows = from..(last + N_STEPS + 1).min(self.commands.len());
        Self {
            name: self.name.clone(),
            time_s: self.time_s + from as f64 * STEP_S,
            evidence: self.evidence,
            commands: self.commands[rows.clone()].to_vec(),
            measured: self.measured.each_ref().map(|values| values[rows.clone()].to_vec()),
            smooth: self.smooth.each_ref().map(|values| values[rows.clone()].to_vec()),
            gradient: self.gradient.each_ref().map(|values| values[rows.clone()].to_vec()),
            class: self.class[rows.clone()].to_vec(),
            travelled: self.travelled.each_ref().map(|values| values[rows.clone()].to_vec()),
            starts: starts.iter().map(|start| start - from).collect(),
            attitude: Vec::new(),
        }
    }

    /// Whether anything was measured at a row.
    pub(crate) fn measures(&self, row: usize) -> bool {
        self.measured.iter().any(|values| !values[row].is_nan())
    }

    /// Displacement along and across the heading at `start`, turn, speed, yaw rate and speed to the left, measured `steps`
    /// later; NaN what was not measured.
    pub(crate) fn outcome(&self, start: usize, steps: usize) -> [f64; N_QUANTITIES] {
        let [x, y, yaw, ..] = self.smooth.each_ref().map(|values| values[start]);
        seen_from([x, y, yaw], self.measured.each_ref().map(|values| values[start + steps]))
    }
}

/// A state (east, north [m], yaw [rad], and rates) from a pose: displacement along and across its heading, turn, and the
/// same rates.
pub(crate) fn seen_from(
    [x0, y0, yaw0]: [f64; 3],
    [x, y, yaw, rates @ ..]: [f64; N_QUANTITIES],
) -> [f64; N_QUANTITIES] {
    let (sine, cosine) = yaw0.sin_cos();
    let (dx, dy) = (x - x0, y - y0);
    let [vx, wz, vy] = rates;
    [dx * cosine + dy * sine, dy * cosine - dx * sine, yaw - yaw0, vx, wz, vy]
}

/// The rows of a run from which rollouts may start.
struct Span {
    n_rows: usize,
    /// Rows left out at the beginning.
    settled: usize,
    /// The first row from which no rollout may start.
    end: usize,
}

impl Span {
    fn of(run: &Run<'_>) -> Result<Self, DriveError> {
        let time_s = run.time_s();
        let found_s = time_s[time_s.len() - 1] - time_s[0];
        if found_s < SHORTEST_S {
            return Err(DriveError::Short { run: run.name().to_owned(), needed_s: SHORTEST_S, found_s });
        }
        let n_rows = (found_s / STEP_S + 1e-6).floor() as usize + 1;
        let settled = (SETTLING_S / STEP_S) as usize;
        Ok(if found_s >= SETTLING_S + LONG as f64 * STEP_S {
            Self { n_rows, settled, end: n_rows - N_STEPS }
        } else {
            let settled = settled.min((SETTLING_SHARE * n_rows as f64) as usize);
            Self { n_rows, settled, end: n_rows - HORIZONS[0] }
        })
    }

    /// Every [`STRIDE`] rows, where what a rollout starts from was measured and no input is missing around it.
    fn whole_starts(&self, inputs: &[Vec<f64>; 2], measured: &[Vec<f64>; N_QUANTITIES]) -> Vec<usize> {
        let mut missing_before = vec![0_u32; self.n_rows + 1];
        for row in 0..self.n_rows {
            let is_missing = inputs.iter().any(|input| input[row].is_nan());
            missing_before[row + 1] = missing_before[row] + u32::from(is_missing);
        }
        let is_measured = |quantity: &usize| measured[*quantity].iter().any(|value| !value.is_nan());
        let needed: Vec<usize> = [X, Y, YAW, VX].into_iter().filter(is_measured).collect();
        let is_whole = |start: &usize| {
            let (from, to) = (start.saturating_sub(self.settled), (start + N_STEPS).min(self.n_rows));
            missing_before[from] == missing_before[to]
                && needed.iter().all(|&quantity| !measured[quantity][*start].is_nan())
        };
        (self.settled..self.end).step_by(STRIDE).filter(is_whole).collect()
    }
}

fn hold_last<T: Clone>(values: &mut Vec<T>, n: usize) {
    if let Some(last) = values.last().cloned() {
        values.resize(n, last);
    }
}

/// Commands of every step; a missing one is the one before.
fn commands([speeds, turns]: &[Vec<f64>; 2]) -> Vec<Command> {
    let mut before = [0.0; 2];
    let command = |(&speed, &turn): (&f64, &f64)| {
        for (before, now) in before.iter_mut().zip([speed, turn]) {
            *before = if now.is_nan() { *before } else { now };
        }
        Command { speed_mps: before[0] as f32, steering_rad: before[1] as f32 }
    };
    speeds.iter().zip(turns).map(command).collect()
}

#[cfg(test)]
pub(crate) mod testing;
#[cfg(test)]
mod tests;
