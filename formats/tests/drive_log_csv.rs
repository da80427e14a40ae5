//! Drive logs as CSV: the five real ones, and small ones that are wrong in one way each.
#![allow(clippy::unwrap_used, reason = "a test stops at the first surprise")]

use std::path::{Path, PathBuf};

use bicycle::{Column, DriveLog, DriveRow};
use formats::{DriveLogFile, OtherColumn, read_drive_log_csv, write_drive_log_csv};
use proptest::prelude::*;

fn data(name: &str) -> PathBuf {
    Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../../shared/data/logs")).join(name)
}

/// Smallest, largest and number of missing values of a column.
fn range(log: &DriveLog, column: Column) -> (f64, f64, usize) {
    let values = || log.runs().flat_map(|run| run.column(column).unwrap().iter().copied());
    let n_missing = values().filter(|value| value.is_nan()).count();
    (values().fold(f64::INFINITY, f64::min), values().fold(f64::NEG_INFINITY, f64::max), n_missing)
}

/// Rows of the note's table of ranges: column, smallest, largest.
fn noted_ranges(note: &str) -> Vec<(Column, f64, f64)> {
    let rows = note.lines().filter_map(|line| {
        let cells: Vec<_> = line.split('|').map(str::trim).collect();
        let [_, name, low, _, high, "0", _] = cells[..] else { return None };
        Some((Column::from_name(name)?, low.parse().ok()?, high.parse().ok()?))
    });
    rows.collect()
}

#[test]
#[ignore = "needs the shared data"]
fn real_logs_are_as_their_notes_say() {
    // Rows, runs, seconds over all runs, columns without a meaning.
    let cases = [
        ("drive_warthog", 13_200, 330, 643.5, 4, 18),
        ("f1tenth_steps", 4_961, 41, 123.0, 0, 7),
        ("genesis_cpg_slow_lap", 18_011, 1, 360.2, 1, 9),
        ("ikd_f110", 61_887, 7, 3094.0, 0, 4),
        ("rav4_comma2k19", 2_996, 1, 59.9, 9, 14),
    ];
    for (name, n_rows, n_runs, seconds, n_other, n_columns) in cases {
        let file = read_drive_log_csv(&data(&format!("{name}.csv"))).unwrap();
        assert_eq!(file.log.n_rows(), n_rows, "{name}");
        assert_eq!(file.log.runs().len(), n_runs, "{name}");
        assert_eq!(file.other_columns.len(), n_other, "{name}");
        assert_eq!(file.log.columns().count(), n_columns, "{name}");
        let duration_s = |time_s: &[f64]| time_s[time_s.len() - 1] - time_s[0];
        let total_s: f64 = file.log.runs().map(|run| duration_s(run.time_s())).sum();
        assert!((total_s - seconds).abs() < 0.5, "{name}: {total_s} s");
        let note = std::fs::read_to_string(data(&format!("{name}.md"))).unwrap();
        let noted = noted_ranges(&note);
        assert_eq!(noted.len(), if name == "ikd_f110" { 0 } else { n_columns }, "{name}");
        for (column, low, high) in noted {
            let (found_low, found_high, n_missing) = range(&file.log, column);
            // The notes give four digits, some logs five decimals.
            let close = |found: f64, noted: f64| (found - noted).abs() <= 6e-4 * noted.abs() + 6e-6;
            assert!(close(found_low, low) && close(found_high, high), "{name}: {}", column.name());
            assert_eq!(n_missing, 0, "{name}: {}", column.name());
        }
    }
}

#[test]
#[ignore = "needs the shared data"]
fn runs_may_be_words() {
    let file = read_drive_log_csv(&data("ikd_f110.csv")).unwrap();
    let names: Vec<_> = file.log.runs().map(|run| run.name()).collect();
    assert!(names.contains(&"loose_drift") && names.contains(&"turn_curv_1.0"), "{names:?}");
}

/// A folder for one test's file.
struct Folder(tempfile::TempDir);

impl Folder {
    fn new() -> Self {
        Self(tempfile::tempdir().unwrap())
    }

    fn path(&self) -> PathBuf {
        self.0.path().join("log.csv")
    }

    fn read(&self, text: &[u8]) -> Result<DriveLogFile, String> {
        std::fs::write(self.path(), text).unwrap();
        let folder = format!("{}/", self.0.path().display());
        read_drive_log_csv(&self.path()).map_err(|error| error.to_string().replace(&folder, ""))
    }
}

#[test]
fn columns_come_in_any_order_and_cells_may_be_missing() {
    let text = "\u{feff}note, vx ,run,t,x\na,1.5,1,0,\n\"b, c\",,1,0.1,2\n,nan,two,0,-0.5\n";
    let file = Folder::new().read(text.as_bytes()).unwrap();
    assert_eq!(file.log.columns().collect::<Vec<_>>(), [Column::X, Column::Vx]);
    let runs: Vec<_> = file.log.runs().collect();
    assert_eq!([runs[0].name(), runs[1].name()], ["1", "two"]);
    assert_eq!([runs[0].time_s(), runs[1].time_s()], [&[0.0, 0.1][..], &[0.0][..]]);
    let vx = runs[0].column(Column::Vx).unwrap();
    assert!(vx[0] == 1.5 && vx[1].is_nan() && runs[1].column(Column::Vx).unwrap()[0].is_nan());
    assert!(runs[0].column(Column::X).unwrap()[0].is_nan());
    let note = OtherColumn { name: "note".into(), cells: vec!["a".into(), "b, c".into(), String::new()] };
    assert_eq!(file.other_columns, [note]);
}

#[test]
fn refusals_name_file_line_column_expected_and_found() {
    let folder = Folder::new();
    let cases = [
        ("x,y\n1,2\n", "log.csv:1: header: expected a column 't', found only: x, y"),
        ("t,x,t\n0,1,0\n", "log.csv:1: header: expected each column once, found 't' twice"),
        ("t,x\n", "log.csv:1: row: expected at least one row below the header, found none"),
        ("t,x\n0,1\n0.1,fast\n", "log.csv:3: x: expected a number or nothing, found 'fast'"),
        ("t,x\n0,1\n\n0.1,inf\n", "log.csv:4: x: expected a finite number or nothing, found inf"),
        ("t,x\n0,1\n0.1\n", "log.csv:3: row: expected 2 cells as in the header, found 1"),
        ("t,x\n0,1\n,1\n", "log.csv:3: t: expected a time > 0 s, the row before it in run '', found NaN"),
        ("t\n-inf\n", "log.csv:2: t: expected a finite time, found -inf"),
        (
            "run,t\na,0\na,0.5\na,0.5\n",
            "log.csv:4: t: expected a time > 0.5 s, the row before it in run 'a', found 0.5",
        ),
        (
            "run,t\na,0\nb,0\na,1\n",
            "log.csv:4: run: expected the rows of a run together, found 'a' again after another run",
        ),
    ];
    for (text, message) in cases {
        assert_eq!(folder.read(text.as_bytes()).unwrap_err(), message, "{text}");
    }
    assert_eq!(
        folder.read(b"t,x\n0,\xff\n").unwrap_err(),
        "log.csv:2: row: expected UTF-8 text, found other bytes"
    );
    assert!(folder.read(b"").unwrap_err().starts_with("log.csv:1: header: expected a column 't'"));
    assert!(folder.read(&[0; 4096]).is_err());
    let absent = read_drive_log_csv(&folder.0.path().join("absent.csv")).unwrap_err().to_string();
    assert!(absent.contains("absent.csv: expected a readable text file, found: "), "{absent}");
}

/// What a robot leaves: every column that has a meaning, in the order of the names, two runs, and columns of its own.
fn robots_log() -> String {
    let names: Vec<&str> = Column::ALL.map(Column::name).to_vec();
    let mut text = format!("gear,{},t,run,\"note, or none\"\n", names.join(","));
    for row in 0..200 {
        let numbers: Vec<String> = (0..names.len())
            .map(|column| format!("{}", (0.1 * f64::from(row) + column as f64).sin()))
            .collect();
        let (run, time_s) = (["out", "home"][row as usize / 100], 0.02 * f64::from(row % 100));
        text += &format!("D{},{},{time_s},{run},\"stone, {row}\"\n", row % 3, numbers.join(","));
    }
    text
}

#[test]
fn what_was_read_is_written_again() {
    let folder = Folder::new();
    let file = folder.read(robots_log().as_bytes()).unwrap();
    assert_eq!((file.log.n_rows(), file.log.runs().len()), (200, 2));
    assert_eq!(file.log.columns().count(), Column::ALL.len());
    assert_eq!(
        file.other_columns.iter().map(|column| &column.name).collect::<Vec<_>>(),
        ["gear", "note, or none"]
    );
    assert_eq!(file.other_columns[1].cells[142], "stone, 142");
    assert_eq!(range(&file.log, Column::X).2, 0);
    write_drive_log_csv(&folder.path(), &file).unwrap();
    let again = read_drive_log_csv(&folder.path()).unwrap();
    // No value is missing in it, so that equality means equality.
    assert_eq!(again.log, file.log);
    assert_eq!(again.other_columns, file.other_columns);
    assert!(write_drive_log_csv(folder.0.path(), &file).is_err(), "a folder stands there");
}

#[test]
#[ignore = "needs the shared data"]
fn a_real_log_that_was_read_is_written_again() {
    let folder = Folder::new();
    let file = read_drive_log_csv(&data("rav4_comma2k19.csv")).unwrap();
    write_drive_log_csv(&folder.path(), &file).unwrap();
    let again = read_drive_log_csv(&folder.path()).unwrap();
    assert_eq!((again.log, again.other_columns), (file.log, file.other_columns));
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn numbers_come_back_bit_by_bit(
        rows in prop::collection::vec((any::<f64>(), any::<f64>(), 0..3_usize), 1..20),
    ) {
        let mut log = DriveLog::default();
        for (index, (x, wz, run)) in rows.iter().enumerate() {
            let finite = |value: f64| if value.is_infinite() { f64::NAN } else { value };
            let row = DriveRow::new(index as f64 * 0.1).with(Column::X, finite(*x)).with(Column::Wz, finite(*wz));
            // A run that ended cannot go on: those rows are left out on both sides.
            drop(log.push(&format!("run {run}"), &row));
        }
        let folder = Folder::new();
        write_drive_log_csv(&folder.path(), &DriveLogFile { log: log.clone(), other_columns: Vec::new() }).unwrap();
        let again = read_drive_log_csv(&folder.path()).unwrap().log;
        let bits = |log: &DriveLog| -> Vec<_> {
            let rows = log.runs().flat_map(|run| run.drive_rows().map(move |row| (run.name().to_owned(), row)));
            let value = |row: &DriveRow, column| Some(row.value(column)).filter(|v| !v.is_nan()).map(f64::to_bits);
            rows.map(|(run, row)| {
                (run, row.time_s.to_bits(), Column::ALL.map(|column| value(&row, column)))
            }).collect()
        };
        prop_assert_eq!(bits(&again), bits(&log));
    }
}
