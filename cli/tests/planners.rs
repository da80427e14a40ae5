//! Planners of the user's own in `surefoot bench navigation`: processes that drive over the channels, and such as do not.
//! The planner of these tests is this program, told by a variable to be one.

#![allow(clippy::expect_used, reason = "helpers of tests may fail as tests do")]

use std::io::Write;
use std::path::Path;
use std::process::Output;
use std::time::Duration;

use assert_cmd::Command;
use bicycle::Decision;
use bus::channel::{Bus, COMMAND, IMU, MISSION, ODOMETRY, SCAN};
use bus::message::{CommandRecord, Stamp};
use serde_json::Value;

/// How the planner is to behave, and where it tells what it heard.
const MANNER: &str = "SUREFOOT_TEST_MANNER";
const LOG: &str = "SUREFOOT_TEST_LOG";

/// A planner where the variables say so, else nothing.
#[test]
fn be_a_planner_where_asked() {
    let (Ok(run), Ok(manner)) = (std::env::var("SUREFOOT_RUN"), std::env::var(MANNER)) else { return };
    let bus = Bus::join(&run.parse().expect("a name")).expect("a run");
    let (mut odometry, mut missions) =
        (bus.inlet(&ODOMETRY).expect("odometry"), bus.inlet(&MISSION).expect("missions"));
    let (mut imu, mut scans) = (bus.inlet(&IMU).expect("samples"), bus.inlet(&SCAN).expect("scans"));
    let mut commands = bus.outlet(&COMMAND, 1).expect("commands");
    let (mut drive, mut n_cycles, mut n_samples, mut n_scans) = (0, 0, 0, 0);
    loop {
        let mut told = None;
        odometry.poll(|stamp, _| told = Some(stamp.valid_at_ns));
        let Some(at_ns) = told else {
            std::thread::sleep(Duration::from_micros(200));
            continue;
        };
        imu.poll(|_, samples| n_samples += samples.len());
        scans.poll(|_, points| n_scans += usize::from(points.len() > 100));
        missions.poll(|_, records| drive = records[0].number);
        n_cycles += 1;
        let id = std::process::id();
        log(&format!("{id} {drive} {n_cycles} {n_samples} {n_scans} {at_ns}"));
        let Some(command) = command(&manner, n_cycles, at_ns) else { continue };
        commands.send_one(Stamp::default(), command, at_ns).expect("a command");
    }
}

fn command(manner: &str, n_cycles: usize, at_ns: u64) -> Option<CommandRecord> {
    let drive = |speed_mps| {
        let command = bicycle::Command { speed_mps, steering_rad: 0.0 };
        CommandRecord::from(&Decision::Drive(command)).decided_on(at_ns, 0)
    };
    match (manner, n_cycles) {
        ("slow", _) => std::thread::sleep(Duration::from_millis(150)),
        ("hangs", 3) => std::thread::sleep(Duration::from_secs(60)),
        ("dies", 3) => {
            eprintln!("out of ideas");
            std::process::exit(3);
        }
        _ => {}
    }
    Some(match manner {
        "nan" => drive(f32::NAN),
        "races" => drive(9.0),
        "dreams" => drive(0.5).decided_on(at_ns - 1, 0),
        "mute" => return None,
        _ => drive(0.5),
    })
}

fn log(line: &str) {
    let Ok(path) = std::env::var(LOG) else { return };
    let mut file = std::fs::OpenOptions::new().append(true).create(true).open(path).expect("the log");
    writeln!(file, "{line}").expect("a line");
}

/// What starts this program as a planner.
fn planner(manner: &str, log: &Path) -> String {
    let program = std::env::current_exe().expect("a program");
    let log = log.display();
    format!(
        "{MANNER}={manner} {LOG}='{log}' '{}' be_a_planner_where_asked --exact --nocapture",
        program.display()
    )
}

/// A benchmark of full traction and what else is entered, over two pairs of a map, for as long.
fn navigation(out: &Path, time_limit_s: &str, more: &[&str]) -> Output {
    let mut words = vec!["bench", "navigation", "--methods", "nominal", "--maps", "1", "--pairs", "2"];
    words.extend(["--time-limit", time_limit_s, "--isa", "portable", "--threads", "1"]);
    words.extend(["--out", out.to_str().expect("UTF-8")]);
    let mut command = Command::cargo_bin("surefoot").expect("the binary is built with its tests");
    command.args(words).args(more).output().expect("the binary starts")
}

fn table(out: &Path) -> Value {
    serde_json::from_slice(&std::fs::read(out.join("navigation.json")).expect("a table")).expect("JSON")
}

/// Numbers of the lines that the planner left.
fn heard(log: &Path) -> Vec<Vec<u64>> {
    let text = std::fs::read_to_string(log).expect("the log");
    text.lines().map(|line| line.split(' ').map(|word| word.parse().expect("a number")).collect()).collect()
}

/// A kill takes a moment, and nobody may have asked yet how an orphan ended.
fn has_ended(process: u64) -> bool {
    let status = || std::fs::read_to_string(format!("/proc/{process}/status")).unwrap_or_default();
    let is_there = || !status().is_empty() && !status().contains("State:\tZ");
    (0..50).any(|_| {
        std::thread::sleep(Duration::from_millis(100));
        !is_there()
    })
}

#[test]
fn a_planner_drives_in_lock_step_and_has_a_row() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let (out, log) = (folder.path().join("out"), folder.path().join("log"));
    let mine = format!("mine={}", planner("steady", &log));
    let output = navigation(&out, "1", &["--planner", &mine]);
    let told = String::from_utf8_lossy(&output.stdout);
    assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
    assert!(told.contains("a command [ms]") && told.contains("mine"), "{told}");

    let table = table(&out);
    assert_eq!(table["planners"], serde_json::json!(["mine"]));
    let (ours, row) = (&table["rows"][0], &table["rows"][1]);
    assert_eq!((&ours["method"], &ours["compute"]), (&"nominal".into(), &Value::Null));
    assert_eq!((&row["method"], &row["n"], &row["alpha"]), (&"mine".into(), &2.into(), &Value::Null));
    assert_eq!(row["compute"]["n_cycles"], 20, "two drives of a second");
    assert!(row["compute"]["p99_ms"].as_f64() >= row["compute"]["median_ms"].as_f64(), "{row}");
    let drive = &table["drives"][2];
    assert_eq!(
        (&drive["method"], &drive["outcome"], &drive["time_s"]),
        (&"mine".into(), &"timeout".into(), &1.0.into())
    );
    // It speeds up to half a metre per second within a second.
    assert!((0.1..0.5).contains(&drive["path_length_m"].as_f64().expect("a number")), "{drive}");

    let heard = heard(&log);
    assert_eq!(heard.len(), 20);
    assert!(heard.iter().all(|line| line[0] == heard[0][0]), "one process: {heard:?}");
    assert!(has_ended(heard[0][0]), "it ends with the benchmark");
    let drives: Vec<u64> = heard.iter().map(|line| line[1]).collect();
    assert_eq!(drives, [[1; 10], [2; 10]].concat(), "a mission of its own for every drive");
    // Ten samples of the inertial unit a cycle after the first of a drive, a scan every other cycle.
    let last = &heard[19];
    assert!(last[3] > 50 && last[4] == 10, "{last:?}");
    let periods: Vec<u64> = heard[..10].windows(2).map(|two| two[1][5] - two[0][5]).collect();
    assert_eq!(periods, [100_000_000; 9]);
    assert!(heard.windows(2).all(|two| two[0][5] < two[1][5]), "time goes on from drive to drive");

    let again = folder.path().join("again");
    let mut command = Command::cargo_bin("surefoot").expect("the binary");
    command.args(["bench", "navigation", "--merge"]).arg(&out).arg("--out").arg(&again);
    assert!(command.output().expect("the binary starts").status.success());
    let bytes = |folder: &Path| std::fs::read(folder.join("navigation.json")).expect("a table");
    assert!(bytes(&again) == bytes(&out));
}

#[test]
fn no_simulated_time_passes_while_a_planner_thinks() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let drives = ["steady", "slow"].map(|manner| {
        let (out, log) = (folder.path().join(manner), folder.path().join(format!("{manner}.log")));
        let output = navigation(&out, "0.5", &["--planner", &format!("mine={}", planner(manner, &log))]);
        assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
        table(&out)["drives"][2].clone()
    });
    let [steady, slow] = &drives;
    let ms = |drive: &Value| drive["compute"]["median_ms"].as_f64().expect("a time");
    assert!(ms(slow) >= 150.0 && ms(steady) < 150.0, "{drives:?}");
    for part in ["time_s", "path_length_m", "distance_to_goal_m", "largest_roll_deg"] {
        assert_eq!(steady[part], slow[part], "{part}");
    }
}

#[test]
fn planners_that_do_not_drive_are_told_and_leave_no_half_table() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let log = folder.path().join("log");
    for (manner, part) in [
        ("dies", "at 0.2 s: expected a command, found that the planner ended, exit status: 3: out of ideas"),
        ("hangs", "at 0.2 s: expected a command within 2 s, found none"),
        ("mute", "at 0.0 s: expected a command within 2 s, found none"),
        ("nan", "at 0.0 s: expected a command, found a message with a number that is not finite"),
        (
            "races",
            "at 0.0 s: expected a speed from -0.5 to 1 m/s and a steering angle within 0.5236 rad, found 9 m/s and 0 rad",
        ),
        (
            "dreams",
            "expected a command within 2 s, found only such as were decided on the odometry of another time",
        ),
    ] {
        let out = folder.path().join(manner);
        let mine = format!("mine={}", planner(manner, &log));
        let output = navigation(&out, "0.5", &["--planner", &mine, "--planner-timeout", "2"]);
        let told = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(1), "{told}");
        assert!(told.contains("mine, map 1, pair 1: --planner 'mine=") && told.contains(part), "{told}");
        assert_eq!(told.lines().count(), 1, "{told}");
        assert!(!out.join("navigation.json").exists());
        let journal = std::fs::read_to_string(out.join("navigation.jsonl")).expect("a journal");
        assert_eq!(journal.lines().count(), 3, "the plan and the drives of the method: {journal}");
    }
}

#[test]
fn planners_that_do_not_join_are_told_before_anything_is_written() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let out = folder.path().join("out");
    for (command, part) in [
        ("echo no such thing >&2; exit 4", ", found that it ended, exit status: 4: no such thing"),
        ("sleep 60", " within 0.5 s, found nobody"),
    ] {
        let words = ["--planner", &format!("mine={command}"), "--planner-timeout", "0.5"];
        let output = navigation(&out, "0.5", &words);
        let told = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(1), "{told}");
        assert!(told.contains("expected it to join run navigation-") && told.contains(part), "{told}");
        assert!(!out.exists());
    }
}

#[test]
fn planners_that_cannot_be_entered_are_refused() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let out = folder.path().join("out");
    for (words, part) in [
        (vec!["--planner", "truth=true"], "--planner: expected a name that no method has, found \"truth\""),
        (
            vec!["--planner", "../up=true"],
            "--planner: expected 1 to 24 letters, digits, - or _, found \"../up\"",
        ),
        (vec!["--planner", "=true"], "--planner: expected 1 to 24 letters, digits, - or _, found \"\""),
        (vec!["--planner", "mine"], "--planner: expected a command, found none"),
        (
            vec!["--planner", "mine=true", "--planner", "mine=false"],
            "--planner: expected every name once, found \"mine\" twice",
        ),
        (
            vec!["--planner", "mine=true", "--planner-timeout", "0"],
            "--planner-timeout: expected a number of seconds above 0 and up to 86400, found \"0\"",
        ),
    ] {
        let output = navigation(&out, "0.5", &words);
        let told = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{told}");
        assert!(told.contains(part) && told.lines().count() == 1, "{told}");
        assert!(!out.exists());
    }
}
