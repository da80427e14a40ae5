//! Drives made of closed forms.

#![allow(clippy::unwrap_used, reason = "a panic is how a test fails")]

use crate::machine::Machine;
use bicycle::{Column, DriveLog, DriveRow};

pub(crate) fn machine() -> Machine {
    Machine {
        name: "m".to_owned(),
        wheelbase_m: 1.0,
        steering_max_rad: 0.5,
        speed_max_mps: 5.0,
        noise: None,
        ground: None,
    }
}

/// One run of `n` rows with these columns, each a function of the time.
pub(crate) fn log(columns: &[Column], n: usize, step_s: f64, value: impl Fn(Column, f64) -> f64) -> DriveLog {
    let mut log = DriveLog::default();
    for k in 0..n {
        let t = k as f64 * step_s;
        let row = columns.iter().fold(DriveRow::new(t), |row, &column| row.with(column, value(column, t)));
        log.push("", &row).unwrap();
    }
    log
}
