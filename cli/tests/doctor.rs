//! `surefoot doctor` as a user meets it, beside a vehicle that stands in another terminal.

#![allow(clippy::unwrap_used, reason = "a panic is how a test fails")]
#![allow(clippy::disallowed_methods, reason = "a process is waited for")]

use std::path::Path;
use std::process::{Child, Command, Output, Stdio};
use std::time::{Duration, Instant};

fn surefoot(words: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_surefoot"));
    command.args(words).stdin(Stdio::null());
    command
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8(bytes.to_vec()).unwrap()
}

/// A vehicle on level ground that nobody plans for; it ends with this.
struct Vehicle {
    plant: Child,
    run: String,
}

impl Vehicle {
    fn start(out: &Path) -> Self {
        let run = format!("doctor-{}", std::process::id());
        let mut plant = surefoot(&["up", "--role", "plant", "--standby", "--world", "arena"]);
        plant.args(["--start", "1.6,1.2,1.57", "--time-limit", "300", "--run", &run, "--out"]).arg(out);
        Self { plant: plant.stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap(), run }
    }

    fn examined(&self, robot: &Path) -> Output {
        let words = ["doctor", "--run", &self.run, "--seconds", "1.5", "--robot"];
        surefoot(&words).arg(robot).output().unwrap()
    }

    /// Examined again until it speaks.
    fn examined_when_there(&self, robot: &Path) -> Output {
        let began = Instant::now();
        loop {
            let output = self.examined(robot);
            if text(&output.stdout).contains("Hz, longest gap") {
                return output;
            }
            assert!(began.elapsed() < Duration::from_secs(60), "{}", text(&output.stderr));
            std::thread::sleep(Duration::from_millis(200));
        }
    }
}

impl Drop for Vehicle {
    fn drop(&mut self) {
        drop(self.plant.kill());
        drop(self.plant.wait());
    }
}

/// The line of a check, without what stands before its verdict.
fn line(shown: &str, what: &str) -> String {
    let is_of = |line: &&str| {
        line.trim_start().split_once(' ').is_some_and(|(_, rest)| rest.trim_start().starts_with(what))
    };
    shown.lines().find(is_of).unwrap_or_else(|| panic!("{what} is missing in {shown}")).trim().to_owned()
}

#[test]
fn a_run_is_held_against_its_robots_file() {
    let folder = tempfile::tempdir().unwrap();
    let vehicle = Vehicle::start(folder.path());
    let file = |name: &str, more: &str| {
        let path = folder.path().join(name);
        std::fs::write(&path, format!("format = 1\nvehicle = 'rc_car'\n{more}")).unwrap();
        path
    };
    let output = vehicle.examined_when_there(&file("robot.toml", ""));
    let shown = text(&output.stdout);
    assert!(line(&shown, "odometry ").contains("expected 50.0 Hz"), "{shown}");
    assert!(line(&shown, "velocity ").starts_with("unknown"), "it stands: {shown}");
    for what in ["scans: points ", "scans: mount ", "imu: gravity "] {
        assert!(line(&shown, what).starts_with("fine"), "{shown}");
    }

    let hasty = vehicle.examined(&file("hasty.toml", "rates = { odometry_hz = 400.0 }\n"));
    assert_eq!(hasty.status.code(), Some(1));
    let (shown, told) = (text(&hasty.stdout), text(&hasty.stderr));
    assert!(line(&shown, "odometry ").starts_with("WRONG"), "{shown}");
    assert!(
        told.lines().count() == 1 && told.contains("odometry: ") && told.contains("expected 400.0 Hz"),
        "{told}"
    );

    let sensor = "[[sensors]]\nname = 'roof'\nmount = { position_m = [0.1, 0.0, 0.3], attitude_rad = [0.0, 0.0, 0.0] }\n";
    let blind = vehicle.examined(&file("blind.toml", sensor));
    assert_eq!(blind.status.code(), Some(1));
    assert!(line(&text(&blind.stdout), "scans of sensor 1 ").starts_with("WRONG"), "{}", text(&blind.stdout));
}

#[test]
fn what_cannot_be_looked_at_is_refused() {
    let refused = |words: &[&str], parts: &[&str]| {
        let output = surefoot(words).output().unwrap();
        let told = text(&output.stderr);
        assert_eq!((output.status.code(), told.lines().count()), (Some(2), 1), "{words:?}: {told}");
        parts.iter().for_each(|part| assert!(told.contains(part), "{part:?} is missing in {told:?}"));
    };
    refused(&["doctor", "--seconds", "0"], &["--seconds", "seconds from 0.5 to 3600"]);
    refused(&["doctor", "--seconds", "nan"], &["--seconds"]);
    refused(&["doctor", "--run", "nobody-here"], &["nobody-here", "expected a run"]);
    refused(&["doctor", "--robot", "no-such.toml"], &["no-such.toml", "No such file"]);
}
