//! One drive out of several logs of it, each at a rate of its own.

use super::readings::Readings;
use super::{Column, DriveLog, DriveRow, Run};

/// Logs that are not of one drive.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum JoinError {
    /// Nothing to join.
    #[error("expected at least one log with rows, found none")]
    Nothing,
    /// Which of them is right cannot be known.
    #[error("expected {} in one of the logs, found it in several", column.name())]
    Repeated {
        /// Column.
        column: Column,
    },
    /// The runs of one log are not those of another.
    #[error("expected the runs {expected} in every log, found {found} in one")]
    Runs {
        /// Of the log with most rows.
        expected: String,
        /// Of the other.
        found: String,
    },
    /// Clocks of different origins, or logs of different drives.
    #[error(
        "expected times that overlap with [{:.3}, {:.3}] s, found {} in [{:.3}, {:.3}] s",
        expected_s[0], expected_s[1], column.name(), found_s[0], found_s[1]
    )]
    Apart {
        /// A column of the other log.
        column: Column,
        /// First and last row of the log with most rows [s].
        expected_s: [f64; 2],
        /// First and last reading of the other [s].
        found_s: [f64; 2],
    },
}

impl DriveLog {
    /// One drive out of logs of it by one clock: on the rows of the log that has most of them, every column as
    /// [`Readings`] have it. Columns that speak every few rows only are filled in between, in a single log too.
    ///
    /// # Errors
    /// No row, a column in several logs, other runs in one, times that do not overlap.
    pub fn joined(parts: &[Self]) -> Result<Self, JoinError> {
        let longest = parts.iter().rev().max_by_key(|part| part.n_rows());
        let axis = longest.filter(|axis| axis.n_rows() > 0).ok_or(JoinError::Nothing)?;
        let names = |part: &Self| part.runs().map(|run| run.name().to_owned()).collect::<Vec<_>>();
        if let Some(other) = parts.iter().find(|part| names(part) != names(axis)) {
            let listed = |part: &Self| format!("'{}'", names(part).join("', '"));
            return Err(JoinError::Runs { expected: listed(axis), found: listed(other) });
        }
        let has =
            |column: &Column| parts.iter().filter(|part| part.columns().any(|own| own == *column)).count();
        if let Some(column) = Column::ALL.into_iter().find(|column| has(column) > 1) {
            return Err(JoinError::Repeated { column });
        }
        let mut joined = Self::default();
        for (index, run) in axis.runs().enumerate() {
            let of_parts =
                parts.iter().flat_map(|part| part.runs().nth(index).into_iter().flat_map(all_readings));
            joined.append_run(run, &of_parts.collect::<Vec<_>>())?;
        }
        Ok(joined)
    }

    fn append_run(&mut self, axis: Run<'_>, readings: &[(Column, Readings)]) -> Result<(), JoinError> {
        let time_s = axis.time_s();
        let expected_s = [time_s[0], time_s[time_s.len() - 1]];
        for (column, own) in readings {
            let found_s = own.span_s();
            if found_s[0] > expected_s[1] || found_s[1] < expected_s[0] {
                return Err(JoinError::Apart { column: *column, expected_s, found_s });
            }
        }
        self.runs.push((axis.name().to_owned(), self.n_rows()));
        for now_s in time_s {
            let with = |row: DriveRow, (column, own): &(Column, Readings)| row.with(*column, own.at(*now_s));
            self.append(&readings.iter().fold(DriveRow::new(*now_s), with));
        }
        Ok(())
    }
}

fn all_readings(run: Run<'_>) -> impl Iterator<Item = (Column, Readings)> {
    Column::ALL.into_iter().filter_map(move |column| Some((column, Readings::of(run, column)?)))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// `every_s` apart from `from_s` to 4 s, the column growing by 3 a second.
    fn log(column: Column, from_s: f64, every_s: f64) -> DriveLog {
        let mut log = DriveLog::default();
        for row in 0..((4.0 - from_s) / every_s) as usize {
            let time_s = from_s + every_s * row as f64;
            log.push("", &DriveRow::new(time_s).with(column, 3.0 * time_s)).unwrap();
        }
        log
    }

    #[test]
    fn slower_logs_are_read_at_the_rows_of_the_fastest() {
        let parts = [log(Column::X, 0.03, 0.1), log(Column::Vx, 0.0, 0.02), log(Column::CmdSpeed, 0.5, 0.05)];
        let joined = DriveLog::joined(&parts).unwrap();
        assert_eq!(joined.n_rows(), 200);
        let run = joined.runs().next().unwrap();
        let [x, vx, speed] =
            [Column::X, Column::Vx, Column::CmdSpeed].map(|column| run.column(column).unwrap());
        for (row, time_s) in run.time_s().iter().enumerate() {
            assert!((vx[row] - 3.0 * time_s).abs() < 1e-12);
            let is_known = (0.03..=3.83).contains(time_s);
            assert!(
                if is_known { (x[row] - 3.0 * time_s).abs() < 1e-9 } else { x[row].is_nan() },
                "{time_s}"
            );
            let age = time_s - speed[row] / 3.0;
            assert!(
                if *time_s < 0.5 { speed[row].is_nan() } else { (-1e-9..0.05).contains(&age) },
                "{time_s}"
            );
        }
    }

    #[test]
    fn a_log_without_slow_columns_stays_as_it_is_with_its_holes() {
        let mut whole = log(Column::X, 0.0, 0.02);
        for row in 0..20 {
            let now = DriveRow::new(7.0 + 0.02 * f64::from(row));
            whole.push("b", &if row == 9 { now } else { now.with(Column::X, 1.0) }).unwrap();
        }
        let joined = DriveLog::joined(std::slice::from_ref(&whole)).unwrap();
        assert_eq!(joined, whole);
    }

    #[test]
    fn what_is_not_one_drive_is_refused() {
        let (vx, x) = (log(Column::Vx, 0.0, 0.02), log(Column::X, 0.0, 0.1));
        assert_eq!(DriveLog::joined(&[]), Err(JoinError::Nothing));
        let told = |parts: &[DriveLog]| DriveLog::joined(parts).unwrap_err().to_string();
        assert_eq!(told(&[vx.clone(), vx.clone()]), "expected vx in one of the logs, found it in several");
        let mut later = DriveLog::default();
        later.push("", &DriveRow::new(1.7e9).with(Column::X, 0.0)).unwrap();
        assert_eq!(
            told(&[vx.clone(), later]),
            "expected times that overlap with [0.000, 3.980] s, found x in [1700000000.000, 1700000000.000] s"
        );
        let mut named = DriveLog::default();
        named.push("a", &DriveRow::new(0.0).with(Column::Wz, 0.0)).unwrap();
        assert_eq!(told(&[vx, x, named]), "expected the runs '' in every log, found 'a' in one");
    }
}
