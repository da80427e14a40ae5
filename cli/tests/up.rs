//! `surefoot up`, `replay` and `inspect` as a user meets them: a whole drive, a recording that breaks off, and bad input.

#![allow(clippy::unwrap_used, reason = "a panic is how a test fails")]

mod tools;

use std::collections::BTreeMap;
use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};

use bus::ages::Periods;
use formats::DriveRecorder;
use runtime::ages::{self, AskedAges};
use runtime::setup::{ClockAnchor, MachineSetup, RecordedSetup};
use serde_json::Value;

fn surefoot(words: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_surefoot"));
    command.args(words).stdin(Stdio::null());
    command
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8(bytes.to_vec()).unwrap()
}

/// A name that no other run on this machine has.
fn run_name(what: &str) -> String {
    format!("cli-{what}-{}", std::process::id())
}

/// Exit code 2, nothing on standard output, and one line on standard error that holds every given part.
fn assert_refused(words: &[&str], parts: &[&str]) {
    let output = surefoot(words).output().unwrap();
    let told = text(&output.stderr);
    assert_eq!(output.status.code(), Some(2), "{words:?}: {told}");
    assert_eq!(told.lines().count(), 1, "{words:?}: {told}");
    assert!(output.stdout.is_empty(), "{words:?}");
    for part in parts {
        assert!(told.contains(part), "{words:?}: {part:?} is missing in {told:?}");
    }
}

#[test]
fn what_up_cannot_do_is_refused_before_anything_starts() {
    assert_refused(&["up", "--role", "pilot"], &["--role", "expected all, plant", "\"pilot\""]);
    assert_refused(&["up", "--rate", "51"], &["--rate", "1 to 50 Hz", "51"]);
    assert_refused(&["up", "--run", "../x"], &["--run", "1 to 32 letters", "../x"]);
    assert_refused(&["up", "--method", "truth"], &["--method truth", "surefoot drive"]);
    assert_refused(&["up", "--oracle-map"], &["--oracle-map", "surefoot drive"]);
    assert_refused(&["up", "--commands", "/nowhere.csv"], &["--commands", "surefoot drive"]);
    assert_refused(&["up", "--deviation", "mass=nan"], &["mass.factor", "NaN"]);
    assert_refused(&["up", "--vehicle", "/nowhere.toml"], &["/nowhere.toml", "No such file"]);
}

#[test]
fn what_up_would_ignore_is_refused() {
    assert_refused(&["up", "--bush-height", "0.3"], &["--bush-height", "--world arena"]);
    assert_refused(&["up", "--role", "control", "--bush-height", "0.3"], &["--bush-height", "--world arena"]);
    assert_refused(&["up", "--pace", "fast"], &["--pace fast", "surefoot drive"]);
    assert_refused(&["up", "--realtime", "--threads", "2"], &["--threads", "expected 1", "found 2"]);
    let only = |words: &[&str], roles: &str| {
        let words: Vec<&str> = ["up"].iter().chain(words).copied().collect();
        assert_refused(&words, &[words[3], &format!("--role all or {roles}"), words[2]]);
    };
    only(&["--role", "control", "--live"], "live");
    only(&["--role", "mapping", "--learn"], "learning");
    only(&["--role", "plant", "--validation", "v.safetensors"], "learning");
    only(&["--role", "control", "--standby"], "plant, mission");
    only(&["--role", "recorder", "--json", "s.json"], "plant");
    only(&["--role", "live", "--realtime"], "plant, mapping, learning, control, recorder, mission");
}

#[test]
fn times_that_contradict_each_other_are_refused_with_the_numbers() {
    assert_refused(
        &["up", "--rate", "2", "--command-age", "0.3"],
        &["--command-age", "more than 0.520 s", "decisions every 0.5 s", "found 0.3 s"],
    );
    assert_refused(&["up", "--odometry-rate", "50", "--scan-rate", "4"], &["every 0.02 s", "every 0.25 s"]);
    let folder = tempfile::tempdir().unwrap();
    let config = folder.path().join("guard.toml");
    std::fs::write(&config, "[guard]\nscan_age_max_s = 1.0\n").unwrap();
    assert_refused(
        &["up", "--scan-rate", "2", "--config", config.to_str().unwrap()],
        &["guard.scan_age_max_s", "more than 1.500 s", "scans every 0.5 s", "found 1 s"],
    );
}

#[test]
fn files_that_are_none_are_refused_with_what_was_expected() {
    let folder = tempfile::tempdir().unwrap();
    let file = |name: &str, bytes: &[u8]| {
        let path = folder.path().join(name);
        std::fs::write(&path, bytes).unwrap();
        path.to_str().unwrap().to_owned()
    };
    let garbage = file("garbage.mcap", b"this is no recording at all, whatever its name says");
    let empty = file("empty.mcap", b"");
    let other = file("notes.txt", b"notes");
    for command in ["inspect", "replay"] {
        assert_refused(&[command, "/nowhere.mcap"], &["/nowhere.mcap", "expected", "No such file"]);
        assert_refused(&[command, &garbage], &["garbage.mcap", "expected a recording"]);
        assert_refused(&[command, &empty], &["empty.mcap", "expected a recording"]);
    }
    assert_refused(&["inspect", &other], &["notes.txt", "expected a recording"]);
    assert_refused(&["replay", &other], &["notes.txt", "expected a recording"]);
}

#[test]
fn a_run_tells_no_more_than_is_asked_for() {
    let folder = tempfile::tempdir().unwrap();
    let tell = |level: &str, limit_s: &str| {
        let words = ["up", "--method", "physics", "--log-level", level, "--time-limit", limit_s, "--run"];
        let mut up = surefoot(&words);
        let output = up.arg(run_name(level)).arg("--out").arg(folder.path().join(level)).output().unwrap();
        [&output.stdout, &output.stderr].map(|told| text(told))
    };
    let [shown, told] = tell("info", "5");
    assert!(shown.contains("  control "), "statuses are shown: {shown}");
    assert!(told.lines().any(|line| line.starts_with("surefoot: mission: driving to")), "{told}");
    let [shown, told] = tell("error", "1");
    assert!(!shown.contains("  control "), "{shown}");
    let [plant, supervisor] = told.lines().collect::<Vec<_>>()[..] else {
        panic!("expected two lines: {told}")
    };
    assert!(plant.starts_with("surefoot plant: goal not reached: time limit passed"), "{told}");
    assert!(supervisor.starts_with("surefoot: goal not reached"), "{told}");
}

#[test]
fn the_journal_is_told_the_level_of_a_line_and_nobody_else_is() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("standard_error");
    let told = |is_journal: bool| {
        let file = std::fs::File::create(&path).unwrap();
        let (device, inode) = (file.metadata().unwrap().dev(), file.metadata().unwrap().ino());
        let stream = format!("{device}:{}", inode + u64::from(!is_journal));
        let mut up = surefoot(&["up", "--world", "/nowhere.npz"]);
        let status = up.env("JOURNAL_STREAM", stream).stderr(Stdio::from(file)).status().unwrap();
        assert_eq!(status.code(), Some(2));
        std::fs::read_to_string(&path).unwrap()
    };
    // RFC 5424: 3 is an error.
    assert!(told(true).starts_with("<3>surefoot: /nowhere.npz"), "{}", told(true));
    assert!(told(false).starts_with("surefoot: /nowhere.npz"), "{}", told(false));
}

/// A recording that holds nothing but its setup, after a change of that.
fn record_setup(path: &Path, change: impl FnOnce(&mut serde_json::Map<String, Value>)) {
    let vehicle = formats::read_vehicle("rc_car").unwrap();
    let config = navigator::Config::for_vehicle(&vehicle);
    let ages = ages::limits(&Periods::default(), &config.guard, &AskedAges::default()).unwrap();
    let machine = MachineSetup { model: bicycle::Model::of(&vehicle), vehicle, config };
    let [vehicle_toml, model_toml, config_toml] = machine.texts().unwrap();
    let setup = RecordedSetup {
        format: RecordedSetup::FORMAT,
        clock: ClockAnchor::now(),
        vehicle_name: "rc_car".to_owned(),
        vehicle_toml,
        model_toml,
        config_toml,
        ages,
        method: "physics".to_owned(),
        checkpoint_sha256: String::new(),
        corrector_sha256: String::new(),
        alpha: 0.6,
        seed: "1".to_owned(),
        revision: String::new(),
    };
    let mut setup = serde_json::to_value(&setup).unwrap();
    change(setup.as_object_mut().unwrap());
    let mut recorder = DriveRecorder::create_new(path, BTreeMap::new()).unwrap();
    recorder.setup(0, &setup).unwrap();
    recorder.finish().unwrap();
}

#[test]
fn a_recording_without_a_decision_is_no_success() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("drive-000.mcap");
    record_setup(&path, |_| ());
    let (code, again, told) = look("replay", &path);
    assert_eq!((code, &again["n_decisions"]), (Some(1), &0.into()), "{again} {told}");
    assert_eq!(told.lines().count(), 1, "{told}");
    assert!(told.contains("expected decisions to make again, found none"), "{told}");
}

#[test]
fn recordings_of_another_version_are_refused_with_both_versions() {
    let folder = tempfile::tempdir().unwrap();
    let [first, later] = ["first.mcap", "later.mcap"].map(|name| folder.path().join(name));
    record_setup(&first, |setup| {
        setup.remove("format");
        setup.remove("clock");
    });
    let expected = format!("expected a recording of version {}, found version", RecordedSetup::FORMAT);
    assert_refused(&["replay", first.to_str().unwrap()], &["first.mcap", &format!("{expected} 1")]);
    record_setup(&later, |setup| drop(setup.insert("format".to_owned(), 77.into())));
    assert_refused(&["replay", later.to_str().unwrap()], &["later.mcap", &format!("{expected} 77")]);
}

/// Drives along the arena's bare floor, west of everything, with a heavier machine than the model believes in.
fn drive_arena(out: &Path) -> Output {
    let words = [
        "up",
        "--world",
        "arena",
        "--start",
        "1.6,1.2,1.57",
        "--goal",
        "1.6,6.6",
        "--method",
        "physics",
        "--threads",
        "1",
        "--deviation",
        "mass=1.1",
    ];
    let run = run_name("arena");
    let mut drive = surefoot(&words);
    drive.args(["--pace", "real", "--run", &run, "--json"]).arg(out.join("asked.json"));
    drive.arg("--out").arg(out).output().unwrap()
}

fn json(path: &Path) -> Value {
    serde_json::from_slice(&std::fs::read(path).unwrap()).unwrap()
}

/// `command FILE --json ..`: exit code, what was written, what was said on standard error.
fn look(command: &str, file: &Path) -> (Option<i32>, Value, String) {
    let folder = tempfile::tempdir().unwrap();
    let found = folder.path().join("found.json");
    let output = surefoot(&[command]).arg(file).arg("--json").arg(&found).output().unwrap();
    (output.status.code(), json(&found), text(&output.stderr))
}

/// One drive for all of this: it takes as long as the vehicle does.
#[test]
fn a_drive_of_processes_is_recorded_and_made_again_and_what_is_cut_off_is_named() {
    let folder = tempfile::tempdir().unwrap();
    let output = drive_arena(folder.path());
    // The way is short and level: a machine that has no time for it drives it with stops.
    let told = text(&output.stdout);
    assert_eq!(output.status.code(), Some(0), "{told} {}", text(&output.stderr));
    assert!(told.contains("goal reached after"), "{told}");

    let run = json(&folder.path().join("runtime.json"));
    assert!(run["control"]["n_decisions"].as_u64().unwrap() > 20, "{run}");
    assert_eq!(run["control"]["period_ms"], 100.0);
    assert_eq!(run["processes"].as_array().unwrap().len(), 6);
    assert!(run["processes"][0]["resident_max_mb"].as_f64().unwrap() > 1.0, "{run}");

    let summary = json(&folder.path().join("summary.json"));
    assert_eq!(summary, json(&folder.path().join("asked.json")), "where it was asked for, too");
    assert_eq!(summary["localisation_jumps"], 0, "{summary}");

    let recording = folder.path().join("drive-000.mcap");
    let (code, whole, _) = look("inspect", &recording);
    assert_eq!((code, &whole["complete"]), (Some(0), &Value::Bool(true)), "{whole}");
    assert_eq!(whole["topics"]["/channel/decision"]["lost"], 0);
    assert!(whole["control"]["lateness"]["p99_9_ms"].as_f64().unwrap() >= 0.0, "{whole}");
    let (code, again, told) = look("replay", &recording);
    assert_eq!((code, &again["first_difference"]), (Some(0), &Value::Null), "{again} {told}");
    assert_eq!(again["n_identical"], again["n_decisions"]);

    assert_cut(&recording, folder.path());
    assert_lost_scans_are_named(&recording, folder.path());
}

/// A gyroscope that is off by 1 rad/s: from one message to the next the heading turns 0.1 rad less than it says, give or
/// take its noise, and more than that is a jump.
#[test]
fn the_summary_of_processes_tells_how_often_the_localisation_jumped() {
    let folder = tempfile::tempdir().unwrap();
    let words = ["up", "--world", "arena", "--method", "physics", "--threads", "1", "--time-limit", "4"];
    let mut drive = surefoot(&words);
    drive
        .args(["--odometry-rate", "10", "--deviation", "gyro_bias=1", "--run", &run_name("jumps"), "--out"])
        .arg(folder.path());
    let output = drive.output().unwrap();
    assert_eq!(output.status.code(), Some(1), "{}", text(&output.stderr));
    let summary = json(&folder.path().join("summary.json"));
    assert!(summary["localisation_jumps"].as_u64().unwrap() >= 3, "{summary}");
}

/// A file that ends early says so, and gives what stands before.
fn assert_cut(recording: &Path, folder: &Path) {
    let bytes = std::fs::read(recording).unwrap();
    let cut = folder.join("cut.mcap");
    std::fs::write(&cut, &bytes[..bytes.len() / 3]).unwrap();
    let (code, found, _) = look("inspect", &cut);
    assert_eq!((code, &found["complete"]), (Some(0), &Value::Bool(false)), "{found}");
    assert!(found["ended_early"].as_str().unwrap().contains("ended"), "{found}");
    let (code, again, told) = look("replay", &cut);
    assert!(again["ended_early"].as_str().unwrap().contains("cut.mcap"), "{again}");
    assert_eq!(again["first_difference"], Value::Null, "{again}");
    assert!(again["n_identical"].as_u64().unwrap() > 5, "{again} {told}");
    // What was decided on something that lies behind the cut is not counted as made again.
    assert_eq!(code, Some(i32::from(again["n_unmade"] != 0)), "{again} {told}");
}

/// A recording without some of its scans: it is named which, and nothing that hangs on them passes as made again.
fn assert_lost_scans_are_named(recording: &Path, folder: &Path) {
    let thinned = folder.join("thinned.mcap");
    let n_left_out = leave_out(recording, &thinned, "/channel/scan", 2..4);
    assert_eq!(n_left_out, 2);
    let (code, found, _) = look("inspect", &thinned);
    assert_eq!((code, &found["topics"]["/channel/scan"]["lost"]), (Some(0), &2.into()), "{found}");
    let (code, again, told) = look("replay", &thinned);
    let missing = again["missing"].to_string();
    assert!(missing.contains("scan "), "{again}");
    assert_eq!(code, Some(1));
    assert!(told.contains("not made again, for want of"), "{told}");
    assert_eq!(again["first_difference"], Value::Null, "{again}");
}

/// Copies the beginning of a recording but for some messages of a topic, by their place in it.
fn leave_out(from: &Path, to: &Path, topic: &str, places: std::ops::Range<usize>) -> usize {
    let bytes = std::fs::read(from).unwrap();
    let mut writer = mcap::Writer::new(std::io::BufWriter::new(std::fs::File::create(to).unwrap())).unwrap();
    let (mut place, mut n_left_out) = (0, 0);
    for message in mcap::MessageStream::new(&bytes).unwrap() {
        let message = message.unwrap();
        if message.channel.topic == topic {
            place += 1;
            if places.contains(&place) {
                n_left_out += 1;
                continue;
            }
            if place > 2 * places.end {
                break;
            }
        }
        writer.write(&message).unwrap();
    }
    writer.finish().unwrap();
    n_left_out
}

#[test]
fn who_reads_only_the_first_line_has_read_enough() {
    let surefoot = env!("CARGO_BIN_EXE_surefoot");
    let script = format!("{surefoot} inspect rc_car | head -1; exit ${{PIPESTATUS[0]}}");
    let output = Command::new("bash").args(["-c", &script]).output().unwrap();
    assert_eq!((output.status.code(), text(&output.stderr)), (Some(0), String::new()));
    assert_eq!(text(&output.stdout), "{\n");
}

/// In a container with little shared memory.
#[test]
fn too_little_shared_memory_is_said_in_one_line() {
    let container = ["--user", "--map-root-user", "--mount", "sh", "-c"];
    let little = "mount -t tmpfs -o size=2m tmpfs /dev/shm";
    if !tools::is_there("unshare", &[&container[..], &[little]].concat()) {
        return;
    }
    let run = run_name("small");
    let script = format!("{little} && exec \"$0\" \"$@\"");
    let mut command = Command::new("unshare");
    command.args(container).arg(script).arg(env!("CARGO_BIN_EXE_surefoot"));
    command.args(["up", "--role", "mapping", "--method", "physics", "--run", &run]);
    let output = command.output().unwrap();
    let told = text(&output.stderr);
    assert_eq!(output.status.code(), Some(2), "{told}");
    assert_eq!(told.lines().count(), 1, "{told}");
    assert!(told.contains("/dev/shm: expected") && told.contains("MB free"), "{told}");
    // In there it was user 0, whoever that is outside.
    let folder = PathBuf::from("/tmp/surefoot-0");
    drop(std::fs::remove_dir_all(folder.join(run)));
    if folder.metadata().is_ok_and(|about| about.uid() != 0) {
        drop(std::fs::remove_dir(folder));
    }
}
