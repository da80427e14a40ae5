//! Columns of a run on an even time axis, and what stands in for those that are missing.

use crate::drive::{N_QUANTITIES, STEP_S, VX, WZ, X, Y, YAW};
use crate::evidence::{Evidence, SpeedInput, SpeedSource, TurnInput};
use crate::smoothing::smoothed;
use bicycle::{Column, Run};
use std::f64::consts::TAU;

/// Steps on either side over which a rate is taken from a path or a yaw.
const RATE_REACH: usize = 5;

/// Columns that one sensor gives together.
const POSE: [Column; 3] = [Column::X, Column::Y, Column::Yaw];

/// Columns of a run every [`STEP_S`].
pub(crate) struct Signals<'a> {
    run: &'a Run<'a>,
    /// Number of even steps.
    n: usize,
}

impl<'a> Signals<'a> {
    pub(crate) fn new(run: &'a Run<'a>, n: usize) -> Self {
        Self { run, n }
    }

    /// Speed or acceleration, and angle or yaw rate, of every step; NaN where the input is not known.
    pub(crate) fn inputs(&self, evidence: Evidence, smooth_speed: &[f64]) -> [Vec<f64>; 2] {
        let speed = match evidence.speed_input {
            SpeedInput::Commanded => self.held(Column::CmdSpeed),
            SpeedInput::CommandedAcceleration => self.held(Column::CmdAccel),
            SpeedInput::Measured => over_steps(smooth_speed),
        };
        let turn = match evidence.turn_input {
            TurnInput::CommandedAngle => self.held(Column::CmdSteer),
            TurnInput::MeasuredAngle => over_steps(&self.interpolated(Column::SteerMeas)),
            TurnInput::CommandedYawRate => self.held(Column::CmdWz),
            TurnInput::WheelYawRate => over_steps(&self.interpolated(Column::WheelWz)),
        };
        [speed, turn]
    }

    /// East, north, yaw, speed, yaw rate and speed to the left as they were measured; NaN where they were not.
    pub(crate) fn measured(&self, evidence: Evidence) -> [Vec<f64>; N_QUANTITIES] {
        let nothing = || vec![f64::NAN; self.n];
        let if_there = |is_there: bool, column| if is_there { self.interpolated(column) } else { nothing() };
        let speed = match evidence.speed_source {
            SpeedSource::Body => self.interpolated(Column::Vx),
            SpeedSource::Wheels => self.interpolated(Column::WheelSpeed),
            SpeedSource::Path | SpeedSource::Command => nothing(),
        };
        [
            if_there(evidence.pose, Column::X),
            if_there(evidence.pose, Column::Y),
            if_there(evidence.yaw, Column::Yaw),
            speed,
            if_there(evidence.yaw_rate, Column::Wz),
            if_there(evidence.side_speed, Column::Vy),
        ]
    }

    /// The same to start rollouts from: without noise and holes, derived from one another where not measured.
    pub(crate) fn smooth(
        &self,
        evidence: Evidence,
        measured: &[Vec<f64>; N_QUANTITIES],
    ) -> [Vec<f64>; N_QUANTITIES] {
        let mut smooth = measured.each_ref().map(|values| smoothed(&filled(values)));
        if !evidence.yaw {
            smooth[YAW] = summed(&smooth[WZ]);
        } else if !evidence.yaw_rate {
            smooth[WZ] = rates(&smooth[YAW]);
        }
        match evidence.speed_source {
            SpeedSource::Body | SpeedSource::Wheels => {}
            SpeedSource::Path => smooth[VX] = path_speeds(&smooth),
            SpeedSource::Command => smooth[VX] = filled(&self.held(Column::CmdSpeed)),
        }
        smooth
    }

    /// Roll and pitch, where there are both; NaN where they are missing.
    pub(crate) fn attitude(&self) -> Option<[Vec<f64>; 2]> {
        let columns = [Column::Roll, Column::Pitch];
        let are_there = columns.iter().all(|column| self.run.column(*column).is_some());
        are_there.then(|| columns.map(|column| self.interpolated(column)))
    }

    /// For each even step the last row at or before it.
    fn rows(&self) -> impl Iterator<Item = (f64, usize)> {
        let time_s = self.run.time_s();
        let mut row = 0;
        (0..self.n).map(move |k| {
            let now_s = time_s[0] + k as f64 * STEP_S;
            while row + 1 < time_s.len() && time_s[row + 1] <= now_s + 1e-6 {
                row += 1;
            }
            (now_s, row)
        })
    }

    /// A column as it was in force; NaN where it is missing.
    fn held(&self, column: Column) -> Vec<f64> {
        match self.run.column(column) {
            Some(values) => self.rows().map(|(_, row)| values[row]).collect(),
            None => vec![f64::NAN; self.n],
        }
    }

    /// Linear between rows; an angle takes the short way round and is freed of jumps.
    fn interpolated(&self, column: Column) -> Vec<f64> {
        let Some(values) = self.run.column(column) else { return vec![f64::NAN; self.n] };
        let mut continuous = if column == Column::Yaw { unwrapped(values) } else { values.to_vec() };
        let time_s = self.run.time_s();
        if POSE.contains(&column) {
            bridge(&mut continuous, time_s, &repeats_pose(*self.run));
        }
        let between = |(now_s, row): (f64, usize)| match time_s.get(row + 1) {
            None => continuous[row],
            Some(next_s) => {
                let share = (now_s - time_s[row]) / (next_s - time_s[row]);
                continuous[row] + share.clamp(0.0, 1.0) * (continuous[row + 1] - continuous[row])
            }
        };
        self.rows().map(between).collect()
    }
}

/// Whether a row repeats the pose of the row before it: a sensor slower than the log is held until it speaks again.
pub(crate) fn repeats_pose(run: Run<'_>) -> Vec<bool> {
    let columns: Vec<&[f64]> = POSE.iter().filter_map(|column| run.column(*column)).collect();
    let repeats = |row: usize| row > 0 && columns.iter().all(|values| values[row] == values[row - 1]);
    (0..run.time_s().len()).map(repeats).collect()
}

/// Puts values on a straight line between the rows around them that repeat none; at the end they stay.
fn bridge(values: &mut [f64], time_s: &[f64], repeats: &[bool]) {
    let spoken: Vec<usize> = (0..values.len()).filter(|&row| !repeats[row]).collect();
    for pair in spoken.windows(2).filter(|pair| pair[1] > pair[0] + 1) {
        let slope = (values[pair[1]] - values[pair[0]]) / (time_s[pair[1]] - time_s[pair[0]]);
        for row in pair[0] + 1..pair[1] {
            values[row] = values[pair[0]] + slope * (time_s[row] - time_s[pair[0]]);
        }
    }
}

/// Mean over each step of values at the steps' ends.
fn over_steps(values: &[f64]) -> Vec<f64> {
    let means = values.windows(2).map(|pair| 0.5 * (pair[0] + pair[1]));
    means.chain(values.last().copied()).collect()
}

/// Values with holes bridged in a straight line; before the first and after the last value, that one; without any, 0.
pub(crate) fn filled(values: &[f64]) -> Vec<f64> {
    let mut filled = values.to_vec();
    let known: Vec<usize> = (0..values.len()).filter(|&row| !values[row].is_nan()).collect();
    let (Some(&first), Some(&last)) = (known.first(), known.last()) else {
        filled.fill(0.0);
        return filled;
    };
    filled[..first].fill(values[first]);
    filled[last..].fill(values[last]);
    for pair in known.windows(2).filter(|pair| pair[1] > pair[0] + 1) {
        let slope = (values[pair[1]] - values[pair[0]]) / (pair[1] - pair[0]) as f64;
        for (step, value) in filled[pair[0]..pair[1]].iter_mut().enumerate() {
            *value = values[pair[0]] + slope * step as f64;
        }
    }
    filled
}

/// What rates add up to from the first step to each.
pub(crate) fn summed(rates: &[f64]) -> Vec<f64> {
    let mut sum = 0.0;
    let mut sums = Vec::with_capacity(rates.len());
    for pair in rates.windows(2) {
        sums.push(sum);
        sum += 0.5 * (pair[0] + pair[1]) * STEP_S;
    }
    sums.push(sum);
    sums
}

/// Change per second over [`RATE_REACH`] steps on either side, fewer at the ends.
fn rates(values: &[f64]) -> Vec<f64> {
    let last = values.len() - 1;
    let rate = |row: usize| {
        let (from, to) = (row.saturating_sub(RATE_REACH), (row + RATE_REACH).min(last));
        (values[to] - values[from]) / ((to - from).max(1) as f64 * STEP_S)
    };
    (0..=last).map(rate).collect()
}

/// Speed along the heading of a path.
fn path_speeds(smooth: &[Vec<f64>; N_QUANTITIES]) -> Vec<f64> {
    let (east, north) = (rates(&smooth[X]), rates(&smooth[Y]));
    let along = |(yaw, (east, north)): (&f64, (&f64, &f64))| east * yaw.cos() + north * yaw.sin();
    smooth[YAW].iter().zip(east.iter().zip(&north)).map(along).collect()
}

/// A missing angle leaves the count of turns as it was.
pub(crate) fn unwrapped(angles: &[f64]) -> Vec<f64> {
    let mut turns = 0.0;
    let mut before = angles.iter().copied().find(|angle| !angle.is_nan()).unwrap_or(0.0);
    let mut continuous = Vec::with_capacity(angles.len());
    for &angle in angles {
        if !angle.is_nan() {
            turns -= ((angle - before) / TAU).round();
            before = angle;
        }
        continuous.push(angle + turns * TAU);
    }
    continuous
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a panic is how a test fails")]

    use super::*;
    use crate::drive::testing::{log, machine};

    #[test]
    fn holes_are_bridged() {
        let nan = f64::NAN;
        assert_eq!(filled(&[nan, 1.0, nan, nan, 4.0, nan]), [1.0, 1.0, 2.0, 3.0, 4.0, 4.0]);
        assert_eq!(filled(&[nan, nan]), [0.0, 0.0]);
    }

    /// A pose every third row, held between: on a straight way at constant speed the line between them is the way, and a
    /// log in which every row speaks stays as it is.
    #[test]
    fn a_held_pose_is_put_on_the_line_between_those_that_were_measured() {
        let columns = [Column::X, Column::Y, Column::Yaw, Column::CmdSteer, Column::CmdSpeed];
        let at = |hold: usize| {
            let value = move |column: Column, t: f64| {
                let row = (t / 0.02).round() as usize / hold * hold;
                let t = row as f64 * 0.02;
                match column {
                    Column::X => 3.0 * t,
                    Column::Y => -t,
                    Column::Yaw => 0.1 * t,
                    _ => 1.0,
                }
            };
            states(&log(&columns, 100, 0.02, value))[1].clone()
        };
        let (held, spoken) = (at(3), at(1));
        for quantity in [X, Y, YAW] {
            // The last row speaks in both: 99 is a multiple of 3.
            for (held, spoken) in held[quantity].iter().zip(&spoken[quantity]) {
                assert!((held - spoken).abs() < 1e-9, "{held} {spoken}");
            }
        }
    }

    #[test]
    fn a_turn_across_a_hole_is_the_short_way_round() {
        let continuous = unwrapped(&[3.0, f64::NAN, -3.0]);
        assert!(continuous[1].is_nan() && (continuous[2] - (TAU - 3.0)).abs() < 1e-12);
    }

    /// A circle of radius 2 m at 1 m/s: the path gives the speed, the yaw the yaw rate, and the other way round.
    #[test]
    fn what_was_not_measured_is_derived() {
        let on_circle = |column: Column, t: f64| match column {
            Column::X => 2.0 * (0.5 * t).sin(),
            Column::Y => 2.0 - 2.0 * (0.5 * t).cos(),
            Column::Yaw => 0.5 * t,
            Column::Wz => 0.5,
            _ => 1.0,
        };
        for rate_hz in [4.0, 10.0, 40.0, 100.0] {
            let n = (10.0 * rate_hz) as usize;
            let path =
                log(&[Column::X, Column::Y, Column::Yaw, Column::CmdSteer], n, 1.0 / rate_hz, on_circle);
            let [smooth, measured] = states(&path);
            // Chords of a circle are shorter than its arcs: (dt / 2 r)^2 / 6 of the speed.
            let inside = 10..measured[X].len() - 20;
            for (vx_mps, wz_radps) in smooth[VX][inside.clone()].iter().zip(&smooth[WZ][inside]) {
                assert!((vx_mps - 1.0).abs() < 0.02, "{rate_hz} Hz: {vx_mps}");
                assert!((wz_radps - 0.5).abs() < 1e-6);
            }
            assert!(measured[VX].iter().chain(&measured[WZ]).all(|value| value.is_nan()));
            let turning = log(&[Column::Wz, Column::CmdSteer, Column::CmdSpeed], n, 1.0 / rate_hz, on_circle);
            let [smooth, _] = states(&turning);
            assert!((smooth[YAW][100] - 0.5 * 100.0 * STEP_S).abs() < 1e-9);
            assert!((smooth[VX][100] - 1.0).abs() < 1e-12, "the commanded speed");
        }
    }

    fn states(log: &bicycle::DriveLog) -> [[Vec<f64>; N_QUANTITIES]; 2] {
        let run = log.runs().next().unwrap();
        let evidence = Evidence::of(&run, &machine()).unwrap();
        let time_s = run.time_s();
        let n = ((time_s[time_s.len() - 1] - time_s[0]) / STEP_S + 1e-6) as usize + 1;
        let signals = Signals::new(&run, n);
        let measured = signals.measured(evidence);
        [signals.smooth(evidence, &measured), measured]
    }
}
