//! `surefoot gap diagnose` on logs as people have them: several files of a drive, poses by another clock and of an
//! antenna, holes.
#![allow(clippy::unwrap_used, reason = "a panic is how a test fails")]

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Output;
use std::sync::LazyLock;

use assert_cmd::Command;
use bicycle::{Column, DriveLog, DriveRow};
use formats::{DriveLogFile, read_drive, write_drive_log_csv};
use sim_to_real::Answer;

/// A pose is so late [s],
const LATE_S: f64 = 0.12;
/// and of a point so far ahead and to the left of the rear axle [m].
const ARM_M: [f64; 2] = [0.6, -0.25];

/// A sealed case with its vehicle.
static SET: LazyLock<tempfile::TempDir> = LazyLock::new(|| {
    let folder = tempfile::tempdir().unwrap();
    let [out, labels] = ["set", "labels.json"].map(|name| folder.path().join(name).display().to_string());
    let words = ["gap", "seal", "--cases", "1", "--seed", "5", "--out", &out, "--labels", &labels];
    let output = surefoot(&words);
    assert!(output.status.success(), "{}", told(&output));
    folder
});

fn surefoot(words: &[&str]) -> Output {
    Command::cargo_bin("surefoot").unwrap().args(words).output().unwrap()
}

fn told(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

/// The only folder in one of the set's.
fn only(name: &str) -> PathBuf {
    let folder = SET.path().join("set").join(name);
    fs::read_dir(folder).unwrap().next().unwrap().unwrap().path()
}

fn drives(real: [String; 2], heldout: String, answer: &Path) -> Vec<String> {
    let vehicle = only("vehicles");
    let at = |name: &str| vehicle.join(name).display().to_string();
    let mut words = ["gap", "diagnose", "--vehicle"].map(str::to_owned).to_vec();
    words.extend([at("vehicle.toml"), "--sim".to_owned()]);
    words.extend(["sim_1.csv", "sim_2.csv", "sim_3.csv", "sim_4.csv"].map(at));
    words.push("--real".to_owned());
    words.extend(real);
    words.extend(["--heldout".to_owned(), heldout, "--json".to_owned(), answer.display().to_string()]);
    words.extend(["--baseline-cache".to_owned(), SET.path().join("cache").display().to_string()]);
    words
}

fn answered(words: &[String], answer: &Path) -> (Answer, Output) {
    let output = surefoot(&words.iter().map(String::as_str).collect::<Vec<_>>());
    assert!(output.status.success(), "{}", told(&output));
    (serde_json::from_slice(&fs::read(answer).unwrap()).unwrap(), output)
}

fn written(path: &Path, rows: impl Iterator<Item = DriveRow>) {
    let mut log = DriveLog::default();
    rows.for_each(|row| log.push("", &row).unwrap());
    write_drive_log_csv(path, &DriveLogFile { log, other_columns: Vec::new() }).unwrap();
}

fn row_of(log: &DriveLog, row: usize) -> DriveRow {
    log.runs().next().unwrap().drive_rows().nth(row).unwrap()
}

/// The poses of a drive at 10 Hz, late and of another point, in one file and the rest in another.
fn in_two_files(folder: &Path, name: &str) -> String {
    let log = read_drive(&only("cases").join(format!("{name}.csv"))).unwrap().log;
    let late_rows = (LATE_S / 0.02).round() as usize;
    let poses = (late_rows..log.n_rows()).step_by(5).map(|row| {
        let seen = row_of(&log, row - late_rows);
        let (sine, cosine) = seen.value(Column::Yaw).sin_cos();
        DriveRow::new(row_of(&log, row).time_s)
            .with(Column::X, seen.value(Column::X) + cosine * ARM_M[0] - sine * ARM_M[1])
            .with(Column::Y, seen.value(Column::Y) + sine * ARM_M[0] + cosine * ARM_M[1])
            .with(Column::Yaw, seen.value(Column::Yaw))
    });
    written(&folder.join(format!("{name}_gnss.csv")), poses);
    let without = |row: DriveRow| {
        [Column::X, Column::Y, Column::Yaw].into_iter().fold(row, |row, column| row.with(column, f64::NAN))
    };
    let rest = log.runs().flat_map(|run| run.drive_rows().map(without));
    written(&folder.join(format!("{name}_can.csv")), rest);
    folder.join(format!("{name}_gnss.csv+{name}_can.csv")).display().to_string()
}

const REAL: [&str; 2] = ["real_train_1", "real_train_2"];

/// A file of the case as it is.
fn plain(name: &str) -> String {
    only("cases").join(format!("{name}.csv")).display().to_string()
}

#[test]
fn a_pose_of_another_clock_and_place_in_a_file_of_its_own_changes_nothing_that_is_announced() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("plain.json");
    let (expected, _) = answered(&drives(REAL.map(plain), plain("real_heldout"), &path), &path);

    let split = |name: &str| in_two_files(folder.path(), name);
    let path = folder.path().join("own.json");
    let mut words = drives(REAL.map(split), split("real_heldout"), &path);
    words.extend(["--estimate".to_owned(), "time-offset,lever-arm".to_owned()]);
    let (found, output) = answered(&words, &path);
    let names = |answer: &Answer| answer.effects.iter().map(|effect| effect.id.clone()).collect::<Vec<_>>();
    assert_eq!((found.verdict, names(&found)), (expected.verdict, names(&expected)));
    let sensor = found.pose_sensor.unwrap();
    let estimates =
        [sensor.time_offset_s, sensor.lever_arm_ahead_m, sensor.lever_arm_left_m].map(Option::unwrap);
    for (estimate, (truth, within)) in
        estimates.iter().zip([(LATE_S, 0.02), (ARM_M[0], 0.1), (ARM_M[1], 0.1)])
    {
        assert!((estimate.value - truth).abs() < within, "{truth}: {estimate:?}");
    }
    let printed = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(printed.contains("The robot's pose sensor is late by 0.1"), "{printed}");
}

/// Rows of the pose and of the commands are missing: told, and the answer is the same.
#[test]
fn holes_are_told_and_nothing_is_compared_there() {
    let folder = tempfile::tempdir().unwrap();
    let holed = |name: &str| {
        let log = read_drive(&only("cases").join(format!("{name}.csv"))).unwrap().log;
        let hole = |(row, now): (usize, DriveRow)| match row {
            400..430 => now.with(Column::X, f64::NAN),
            1000..1010 => now.with(Column::CmdSpeed, f64::NAN),
            _ => now,
        };
        let path = folder.path().join(format!("{name}.csv"));
        written(&path, log.runs().flat_map(|run| run.drive_rows().enumerate().map(hole)));
        path.display().to_string()
    };
    let path = folder.path().join("holed.json");
    let (_, output) = answered(&drives(REAL.map(holed), holed("real_heldout"), &path), &path);
    let doubts = told(&output);
    assert!(doubts.contains("x: no number in 30 of 2000 rows, first in row 401"), "{doubts}");
    assert!(doubts.contains("cmd_speed: no number in 10 of 2000 rows"), "{doubts}");
}

#[test]
fn files_that_are_not_of_one_drive_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let real = plain(REAL[0]);
    let refused = |drive: String| {
        let path = folder.path().join("a.json");
        let words = drives([drive, plain(REAL[1])], plain("real_heldout"), &path);
        let output = surefoot(&words.iter().map(String::as_str).collect::<Vec<_>>());
        assert_eq!(output.status.code(), Some(2), "{}", told(&output));
        assert!(!path.exists());
        told(&output)
    };
    let later = folder.path().join("later.csv");
    written(&later, (0..10).map(|row| DriveRow::new(1000.0 + f64::from(row)).with(Column::Az, 9.8)));
    let apart = refused(format!("{real}+{}", later.display()));
    assert!(apart.contains("later.csv: expected times that overlap with [0.000, "), "{apart}");
    let twice = folder.path().join("twice.csv");
    written(&twice, (0..10).map(|row| DriveRow::new(f64::from(row)).with(Column::Vx, 1.0)));
    let repeated = refused(format!("{real}+{}", twice.display()));
    assert!(
        repeated.contains("twice.csv: expected vx in one of the logs, found it in several"),
        "{repeated}"
    );
    let none = refused(format!("{real}+none.csv"));
    assert!(none.contains("none.csv: expected a file, found none"), "{none}");
}
