//! `surefoot drive --route` and `surefoot route --lead` as their users call them: with a map that knows nothing of a pond.

#![allow(clippy::unwrap_used, reason = "a panic is how a test fails")]
#![allow(clippy::disallowed_methods, reason = "processes are waited for")]

mod ground;

use std::io::{BufRead as _, BufReader};
use std::path::Path;
use std::process::{Child, Command, Output, Stdio};
use std::time::{Duration, Instant};

use serde_json::Value;

fn surefoot(words: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_surefoot"));
    command.args(words).stdin(Stdio::null());
    command
}

/// A plain of 20 m with a pond from 8 to 10 m east that leaves a ford between 13 and 17 m north, and the same before the
/// pond was there.
fn grounds(folder: &Path) -> [String; 2] {
    let is_pond = |x: f64, y: f64| (8.0..10.0).contains(&x) && !(13.0..17.0).contains(&y);
    ["now", "before"].map(|name| {
        let water = |x: f64, y: f64| f64::from(name == "now" && is_pond(x, y));
        let path = folder.join(name).with_extension("npz");
        ground::write(&path, 20, &[("elevation", &|_, _| 2.0), ("water", &water)]);
        path.to_str().unwrap().to_owned()
    })
}

const TASK: [&str; 6] = ["--vehicle", "rc_car", "--start", "5,8,0", "--goal", "14,8"];

fn read(path: &Path) -> Value {
    serde_json::from_slice(&std::fs::read(path).unwrap()).unwrap()
}

fn assert_refused(output: &Output, code: i32, told: &str) {
    let error = String::from_utf8_lossy(&output.stderr);
    assert_eq!((output.status.code(), error.lines().count()), (Some(code), 1), "{error}");
    assert!(error.contains(told), "{error}");
}

#[test]
fn a_route_over_a_map_of_before_is_searched_again_around_what_is_seen() {
    let folder = tempfile::tempdir().unwrap();
    let [now, before] = grounds(folder.path());
    let out = folder.path().join("out");
    let mut drive = surefoot(&["drive", "--world", &now, "--method", "physics", "--time-limit", "60"]);
    let output = drive.args(TASK).arg(format!("--route={before}")).arg("--out").arg(&out).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let told = String::from_utf8(output.stdout).unwrap();
    assert!(told.contains("expected, over before.npz"), "{told}");
    let summary = read(&out.join("summary.json"));
    // Straight on, as the map of before has it.
    let length_m = summary["route"]["length_m"].as_f64().unwrap();
    assert!((9.0..9.5).contains(&length_m), "{length_m}");
    assert!(summary["route"]["n_again"].as_u64().unwrap() >= 1, "{}", summary["route"]);
    // Through (8, 13) and (10, 13): 5.8 + 2 + 6.4.
    assert!(summary["path_length_m"].as_f64().unwrap() > 14.0, "{summary}");
}

#[test]
fn what_makes_no_route_is_told_in_one_line() {
    let folder = tempfile::tempdir().unwrap();
    let [now, _] = grounds(folder.path());
    let run = |words: &[&str]| surefoot(words).arg("--out").arg(folder.path()).output().unwrap();
    let drive = ["drive", "--method", "physics", "--route"];
    assert_refused(
        &run(&drive),
        2,
        "--route: expected --world FILE, or --route=FILE with a map of the ground",
    );
    let two = [&drive[..], &["--world", &now, "--goal", "14,10"], &TASK].concat();
    assert_refused(&run(&two), 2, "--route: expected one --goal, found 2");
    assert_refused(&run(&["drive", "--route=/nowhere.npz"]), 2, "/nowhere.npz");
    assert_refused(&run(&["up", "--route"]), 2, "--route: expected only with surefoot drive");
    assert_refused(&run(&["up", "--keep", "map"]), 2, "--keep: expected only with surefoot drive");
    let nobody = folder.path().join("nobody").to_str().unwrap().to_owned();
    std::fs::create_dir(&nobody).unwrap();
    std::fs::write(folder.path().join("nobody/resolution_m"), "7").unwrap();
    let keep = ["drive", "--method", "physics", "--world", &now, "--keep", &nobody];
    assert_refused(&run(&[&keep[..], &TASK].concat()), 2, "size of the cells [m]: expected 0.063, found 7");
    let lead = ["route", "--world", &now, "--goal", "14,8", "--lead", "nobody-is-here"];
    assert_refused(&run(&lead), 2, "--lead: expected a run that is there, found none named nobody-is-here");
    assert_refused(&run(&["route", "--world", &now, "--goal", "14,8"]), 2, "--start");
}

/// The processes of a run, which end with this.
struct Run(Child);

impl Drop for Run {
    fn drop(&mut self) {
        drop(self.0.kill());
        drop(self.0.wait());
    }
}

#[test]
fn a_run_is_led_around_what_its_map_did_not_show() {
    let folder = tempfile::tempdir().unwrap();
    let [now, before] = grounds(folder.path());
    let name = format!("guided-{}", std::process::id());
    let mut up = surefoot(&["up", "--standby", "--world", &now, "--method", "physics", "--run", &name]);
    up.args(TASK).args(["--time-limit", "300", "--out"]).arg(folder.path().join("up"));
    let _run = Run(up.stdout(Stdio::null()).spawn().unwrap());
    let (out, kept) = (folder.path().join("out"), folder.path().join("kept"));
    let words =
        ["route", "--world", &before, "--goal", "14,8", "--vehicle", "rc_car", "--lead", &name, "--out"];
    let began = Instant::now();
    let output = loop {
        let output = surefoot(&words).arg(&out).output().unwrap();
        let told = String::from_utf8_lossy(&output.stderr);
        // Its processes are still starting.
        let is_early = ["expected a run", "expected odometry within", "expected a process"];
        if !is_early.iter().any(|early| told.contains(early)) {
            break output;
        }
        assert!(began.elapsed() < Duration::from_secs(60), "{told}");
        std::thread::sleep(Duration::from_millis(200));
    };
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let told = String::from_utf8(output.stdout).unwrap();
    assert!(told.contains("goal reached; ") && !told.contains("goal reached; 0 routes again"), "{told}");
    assert!(std::fs::read(out.join("route.png")).unwrap().starts_with(b"\x89PNG"));
    listen(&name, &kept);
}

/// Keeps what the vehicle of a run sees for a few seconds, until Ctrl-C.
fn listen(run: &str, kept: &Path) {
    let mut map = surefoot(&["map", kept.to_str().unwrap(), "--listen", run, "--out"]);
    let mut listening = map.arg(kept.with_extension("out")).stdout(Stdio::piped()).spawn().unwrap();
    let mut told = BufReader::new(listening.stdout.take().unwrap());
    told.read_line(&mut String::new()).unwrap();
    std::thread::sleep(Duration::from_secs(4));
    let interrupted = Command::new("kill").args(["-INT", &listening.id().to_string()]).status().unwrap();
    let told = std::io::read_to_string(told).unwrap();
    assert!(interrupted.success() && listening.wait().unwrap().success(), "{told}");
    assert!(told.contains(&format!("run {run}: ")) && told.contains(" cells new, 0 agree"), "{told}");
    assert!(std::fs::read(kept.with_extension("out").join("map.png")).unwrap().starts_with(b"\x89PNG"));
}

/// The first mission meets a pond that no map shows; what it saw is kept, and the next one's route knows the pond.
#[test]
fn what_a_drive_saw_is_known_to_the_route_of_the_next() {
    let folder = tempfile::tempdir().unwrap();
    let [now, before] = grounds(folder.path());
    let kept = folder.path().join("kept").to_str().unwrap().to_owned();
    let drive = |out: &str, words: &[&str]| {
        let out = folder.path().join(out);
        let mut drive = surefoot(&["drive", "--world", &now, "--method", "physics", "--time-limit", "60"]);
        let output = drive.args(TASK).args(words).arg("--out").arg(&out).output().unwrap();
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        (String::from_utf8(output.stdout).unwrap(), read(&out.join("summary.json")))
    };
    let (told, first) = drive("first", &[&format!("--route={before}"), "--keep", &kept]);
    assert!(told.contains("kept in") && first["kept"]["new"].as_u64().unwrap() > 1000, "{told}");
    let (_, second) = drive("second", &[&format!("--route={kept}"), "--keep", &kept]);
    let length_m = |summary: &Value| summary["route"]["length_m"].as_f64().unwrap();
    // Straight on at first; then through (8, 13) and (10, 13): 5.8 + 2 + 6.4.
    assert!(length_m(&first) < 9.5 && length_m(&second) > 13.0, "{} {}", first["route"], second["route"]);
    assert!(second["kept"]["agreeing"].as_u64().unwrap() > 1000, "{}", second["kept"]);
}
