//! One column of a run as its sensor spoke, and its value in between.

use super::{Column, Run};
use std::f64::consts::{PI, TAU};

/// A sensor that is silent for this many times its usual period has left a hole.
const LONGEST_SILENCE: f64 = 1.5;
/// Two instants this near are one [s].
const SAME_INSTANT_S: f64 = 1e-9;

/// What a column says and when, without the rows on which nothing was measured.
#[derive(Clone, Debug)]
pub struct Readings {
    column: Column,
    time_s: Vec<f64>,
    values: Vec<f64>,
    longest_s: f64,
}

impl Readings {
    /// Of a column, if it says anything.
    pub fn of(run: Run<'_>, column: Column) -> Option<Self> {
        Self::of_rows(run, column, |_| true)
    }

    /// Of the rows of a column that are wanted, if any of them says anything.
    pub fn of_rows(run: Run<'_>, column: Column, is_wanted: impl Fn(usize) -> bool) -> Option<Self> {
        let rows = run.time_s().iter().zip(run.column(column)?).enumerate();
        let spoken = rows.filter(|(row, (_, value))| !value.is_nan() && is_wanted(*row));
        let (time_s, values): (Vec<f64>, Vec<f64>) = spoken.map(|(_, (t, value))| (*t, *value)).unzip();
        (!time_s.is_empty()).then(|| Self { column, longest_s: longest_silence_s(&time_s), time_s, values })
    }

    /// First and last instant [s].
    pub fn span_s(&self) -> [f64; 2] {
        [self.time_s[0], self.time_s[self.time_s.len() - 1]]
    }

    /// The value at an instant: a command as it was in force, a measurement on the line between its neighbours, an angle
    /// the short way round. NaN in a hole, that is where the sensor is silent for longer than one and a half of its usual
    /// period; before the first reading; after the last, but for a command.
    pub fn at(&self, now_s: f64) -> f64 {
        let next = self.time_s.partition_point(|t| *t <= now_s + SAME_INSTANT_S);
        let Some(before) = next.checked_sub(1) else { return f64::NAN };
        let (since_s, value) = (now_s - self.time_s[before], self.values[before]);
        if since_s <= SAME_INSTANT_S {
            return value;
        }
        let silence_s = self.time_s.get(next).map_or(since_s, |next_s| next_s - self.time_s[before]);
        if silence_s > self.longest_s {
            return f64::NAN;
        }
        match self.values.get(next) {
            _ if self.column.is_command() => value,
            None => f64::NAN,
            Some(next) => value + since_s / silence_s * self.change(value, *next),
        }
    }

    fn change(&self, from: f64, to: f64) -> f64 {
        let change = to - from;
        let is_angle = matches!(self.column, Column::Roll | Column::Pitch | Column::Yaw);
        if is_angle && change.abs() > PI { change - (change / TAU).round() * TAU } else { change }
    }
}

fn longest_silence_s(time_s: &[f64]) -> f64 {
    let mut steps: Vec<f64> = time_s.windows(2).map(|pair| pair[1] - pair[0]).collect();
    steps.sort_unstable_by(f64::total_cmp);
    steps.get(steps.len() / 2).map_or(0.0, |usual_s| LONGEST_SILENCE * usual_s)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{DriveLog, DriveRow};

    /// A yaw of 10 Hz in a log of 50 Hz, silent once for 0.3 s, and a command of 5 Hz.
    fn log() -> DriveLog {
        let mut log = DriveLog::default();
        for row in 0..50 {
            let time_s = 0.02 * f64::from(row);
            let mut now = DriveRow::new(time_s);
            if row % 5 == 0 && !(20..30).contains(&row) {
                now = now.with(Column::Yaw, ((3.0 + time_s + PI) % TAU) - PI);
            }
            if row % 10 == 0 {
                now = now.with(Column::CmdSpeed, f64::from(row));
            }
            log.push("", &now).unwrap();
        }
        log
    }

    #[test]
    fn a_slow_sensor_is_read_between_its_readings_and_not_in_a_hole() {
        let log = log();
        let yaw = Readings::of(log.runs().next().unwrap(), Column::Yaw).unwrap();
        assert_eq!(yaw.span_s(), [0.0, 0.9]);
        for (now_s, expected) in
            [(0.0, 3.0), (0.06, 3.06), (0.3, 3.3 - TAU), (0.13, 3.13), (0.66, 3.66 - TAU)]
        {
            let turns = (yaw.at(now_s) - expected) / TAU;
            assert!((turns - turns.round()).abs() < 1e-9, "{now_s}: {} for {expected}", yaw.at(now_s));
        }
        // Readings at 0.3 and 0.6 s: more than 0.15 s apart. After 0.9 s there is none.
        assert!([0.32, 0.45, 0.58, 0.92, -0.1].iter().all(|now_s| yaw.at(*now_s).is_nan()));
    }

    #[test]
    fn a_command_stays_in_force_until_the_next() {
        let log = log();
        let speed = Readings::of(log.runs().next().unwrap(), Column::CmdSpeed).unwrap();
        assert_eq!([0.0, 0.19, 0.2, 0.95].map(|now_s| speed.at(now_s)), [0.0, 0.0, 10.0, 40.0]);
        assert!(speed.at(1.2).is_nan(), "0.4 s after the last of 5 Hz");
    }
}
