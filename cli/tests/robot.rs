//! `surefoot up --robot` as a user meets it: a file describes the robot, and whoever drives it is a program of its own.

#![allow(clippy::unwrap_used, reason = "a panic is how a test fails")]

use std::path::Path;
use std::process::{Child, Command, Output, Stdio};

use bicycle::Column;
use formats::read_drive_log_mcap;

const ROBOT: &str = "\
format = 1
vehicle = 'rc_car'
ground = { method = 'physics' }
mission = { goals_m = [[1.6, 6.4]], tolerance_m = 0.3 }
safety = { speed_max_mps = 1.0 }

[areas]
geofence_m = [[0.3, 0.3], [9.0, 0.3], [9.0, 7.7], [0.3, 7.7]]
keep_out_m = [[[1.2, 3.4], [2.0, 3.4], [2.0, 4.2], [1.2, 4.2]]]
";

fn surefoot() -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_surefoot"));
    command.stdin(Stdio::null());
    command
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8(bytes.to_vec()).unwrap()
}

/// A robot's own driver, which happens to be a simulated vehicle; it ends with this.
struct Driver(Child);

impl Driver {
    fn start(run: &str, out: &Path) -> Self {
        let mut plant = surefoot();
        plant.args(["up", "--role", "plant", "--standby", "--world", "arena", "--start", "1.6,1.2,1.57"]);
        plant.args(["--time-limit", "300", "--run", run, "--out"]).arg(out);
        Self(plant.stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap())
    }
}

impl Drop for Driver {
    fn drop(&mut self) {
        drop(self.0.kill());
        drop(self.0.wait());
    }
}

fn up(folder: &Path, robot: &str, words: &[&str]) -> Output {
    let file = folder.join("robot.toml");
    std::fs::write(&file, robot).unwrap();
    surefoot().args(["up", "--robot"]).arg(file).args(words).arg("--out").arg(folder).output().unwrap()
}

#[test]
fn a_robot_is_driven_around_where_it_may_not_be_without_a_simulator_of_its_own() {
    let folder = tempfile::tempdir().unwrap();
    let run = format!("robot-{}", std::process::id());
    let _driver = Driver::start(&run, &folder.path().join("plant"));
    let output = up(folder.path(), ROBOT, &["--threads", "1", "--run", &run]);
    let (shown, told) = (text(&output.stdout), text(&output.stderr));
    assert!(output.status.success() && shown.contains("goal reached"), "{shown}{told}");
    assert!(!shown.contains("plant"), "{shown}");
    let recording = folder.path().join("drive-000.mcap");
    let log = read_drive_log_mcap(&recording).unwrap().log;
    let rows: Vec<_> = log.runs().flat_map(|run| run.drive_rows().collect::<Vec<_>>()).collect();
    let places: Vec<[f64; 2]> = rows.iter().map(|row| [row.value(Column::X), row.value(Column::Y)]).collect();
    // The rear axle's centre; half of the car's width of 0.25 m lies between.
    let is_out =
        |[x_m, y_m]: &[f64; 2]| !((1.2 - 0.12..2.0 + 0.12).contains(x_m) && (3.4..4.2).contains(y_m));
    assert!(places.iter().all(is_out), "{places:?}");
    let northmost_m = places.iter().map(|place| place[1]).fold(0.0, f64::max);
    assert!(northmost_m > 6.0, "it came past: {northmost_m} m");
    let replayed = surefoot().arg("replay").arg(recording).output().unwrap();
    assert!(replayed.status.success(), "{}{}", text(&replayed.stdout), text(&replayed.stderr));
}

#[test]
fn robots_that_cannot_be_are_refused_before_anything_starts() {
    let folder = tempfile::tempdir().unwrap();
    let refused = |robot: &str, parts: &[&str]| {
        let output = up(folder.path(), robot, &[]);
        let told = text(&output.stderr);
        assert_eq!((output.status.code(), told.lines().count()), (Some(2), 1), "{told}");
        parts.iter().for_each(|part| assert!(told.contains(part), "{part:?} is missing in {told:?}"));
    };
    let with = |from: &str, to: &str| ROBOT.replace(from, to);
    refused(&with("[[1.6, 6.4]]", "[[1.6, 3.8]]"), &["goal: expected a place", "(1.6, 3.8) m"]);
    refused(&with("[[1.6, 6.4]]", "[[1.6, 8.4]]"), &["out of the geofence"]);
    refused(&with("[9.0, 7.7], [0.3, 7.7]]", "[9.0, 7.7], [nan, 7.7]]"), &["areas.geofence_m", "NaN"]);
    refused(
        &with("[[1.2, 3.4], [2.0, 3.4], [2.0, 4.2], [1.2, 4.2]]", "[[1.2, 3.4]]"),
        &["at least 3 corners"],
    );
    refused(&with("'rc_car'", "'mine.toml'"), &["mine.toml", "No such file", "shipped vehicles"]);
    refused(
        &format!("{ROBOT}\n[ages]\ncommand_s = 0.05\n"),
        &["ages.command_s", "expected more than 0.120 s", "found 0.05 s"],
    );
    refused(&with("format = 1", "format = 1\nrates = { scan_hz = 0.0 }"), &["rates.scan_hz", "found 0"]);
}
