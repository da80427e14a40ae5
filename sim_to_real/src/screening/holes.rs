//! Rows in which a sensor said nothing.

use bicycle::{Column, DriveLog, Run};

use super::signals::Signals;
use super::suspicion::{Hole, Suspicion};
use crate::signals::{filled, unwrapped};

/// Share of the rows that may be missing before a column is none.
const MISSING_MAX: f64 = 0.5;

/// Columns that a diagnosis reads.
const READ: [Column; 10] = [
    Column::X,
    Column::Y,
    Column::Yaw,
    Column::Vx,
    Column::Wz,
    Column::Roll,
    Column::Pitch,
    Column::CmdSpeed,
    Column::CmdSteer,
    Column::SteerMeas,
];

/// Columns without a number in most rows.
pub(super) fn mostly_missing(runs: &[Signals<'_>], log: &DriveLog) -> Vec<Suspicion> {
    let mostly = |hole: &Hole| hole.n_missing as f64 > MISSING_MAX * hole.n as f64;
    holes(runs, log).into_iter().filter(mostly).map(Suspicion::MostlyMissing).collect()
}

/// Columns without a number in some.
pub(super) fn some_missing(runs: &[Signals<'_>], log: &DriveLog) -> Vec<Suspicion> {
    holes(runs, log).into_iter().map(Suspicion::Missing).collect()
}

/// Columns of one sensor are missing together, and told so.
fn holes(runs: &[Signals<'_>], log: &DriveLog) -> Vec<Hole> {
    let mut holes: Vec<Hole> = Vec::new();
    for hole in READ.into_iter().filter_map(|column| hole_in(column, runs, log)) {
        match holes.last_mut() {
            Some(last) if (&last.place, last.n_missing) == (&hole.place, hole.n_missing) => {
                last.columns += ", ";
                last.columns += &hole.columns;
            }
            _ => holes.push(hole),
        }
    }
    holes
}

fn hole_in(column: Column, runs: &[Signals<'_>], log: &DriveLog) -> Option<Hole> {
    let is_missing =
        |run: &Signals<'_>, row: usize| run.run.column(column).is_some_and(|values| values[row].is_nan());
    let rows = runs.iter().flat_map(|run| (0..run.n()).map(move |row| (run, row)));
    let places: Vec<_> = rows.filter(|(run, row)| is_missing(run, *row)).collect();
    let (run, row) = places.first()?;
    let columns = column.name().to_owned();
    Some(Hole { columns, place: run.place(*row), n_missing: places.len(), n: log.n_rows() })
}

/// The drive with a straight line across every hole, so that it can be looked at.
pub(super) fn bridged(log: &DriveLog) -> DriveLog {
    let columns: Vec<Vec<(Column, Vec<f64>)>> = log.runs().map(filled_columns).collect();
    log.with_rows(|run, place, row| {
        columns[run].iter().fold(row, |row, (column, values)| row.with(*column, values[place]))
    })
}

/// The columns of a run that have holes and are not one, without them.
fn filled_columns(run: Run<'_>) -> Vec<(Column, Vec<f64>)> {
    let of = |column: Column| {
        let values = run.column(column)?;
        let n_missing = values.iter().filter(|value| value.is_nan()).count();
        let line = || filled(&if column == Column::Yaw { unwrapped(values) } else { values.to_vec() });
        (n_missing > 0 && n_missing < values.len()).then(|| (column, line()))
    };
    Column::ALL.into_iter().filter_map(of).collect()
}
