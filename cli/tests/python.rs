//! What a robot's own programs in Python are made of, wherever there is Python.

#![allow(clippy::unwrap_used, reason = "a panic is how a test fails")]

mod tools;

use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};
use std::time::Duration;

use serde_json::Value;

/// The interpreter: `SUREFOOT_PYTHON`, or the machine's own.
fn python() -> String {
    std::env::var("SUREFOOT_PYTHON").unwrap_or_else(|_| "python3".to_owned())
}

fn example(name: &str) -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../examples/python").join(name)
}

fn run(name: &str, words: &[&str]) -> Output {
    // Without -B it would leave its bytecode beside the sources.
    Command::new(python()).arg("-B").arg(example(name)).args(words).output().unwrap()
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

/// The module asserts every size and offset when it is loaded.
#[test]
fn the_layouts_hold_where_they_are_loaded() {
    if tools::is_there(&python(), &["--version"]) {
        let loaded = run("surefoot_layout.py", &[]);
        assert!(loaded.status.success(), "{}", text(&loaded.stderr));
    }
}

/// Whether the interpreter has the only package that the examples need.
fn has_channels() -> bool {
    tools::is_there(&python(), &["-c", "import iceoryx2"])
}

#[test]
fn words_that_name_no_run_are_refused() {
    if !has_channels() {
        return;
    }
    let long = "x".repeat(33);
    for (script, first) in [("drive_robot.py", &[][..]), ("replay_log.py", &["nowhere.csv"])] {
        for name in ["../x", "a b", "", &long] {
            let output = run(script, &[first, &["--run", name]].concat());
            let told = text(&output.stderr);
            assert_eq!(output.status.code(), Some(2), "{script} --run {name:?}: {told}");
            assert!(told.contains("--run: expected 1 to 32 letters, digits, - or _, found"), "{told}");
        }
        let output = run(script, &[first, &["field"]].concat());
        let told = text(&output.stderr);
        assert!(output.status.code() == Some(2) && told.contains("unrecognized arguments: field"), "{told}");
    }
}

/// Processes of `surefoot up` that are told to end when this goes.
struct Processes(Vec<Child>);

impl Processes {
    /// Those that the robot's file beside the driver describes.
    fn of_robot(run: &str, out: &Path) -> Self {
        let mut command = Command::new(env!("CARGO_BIN_EXE_surefoot"));
        let text = std::fs::read_to_string(example("../robot.toml")).unwrap();
        let file = out.join("robot.toml");
        std::fs::write(&file, text.replace("run = \"car\"", &format!("run = \"{run}\""))).unwrap();
        command.args(["up", "--threads", "1", "--robot"]).arg(file).arg("--out").arg(out);
        Self(vec![command.stdout(Stdio::piped()).spawn().unwrap()])
    }

    fn start(run: &str, out: &Path, roles: &[&str]) -> Self {
        let start = |role: &&str| {
            let mut command = Command::new(env!("CARGO_BIN_EXE_surefoot"));
            command.args(["up", "--role", role, "--run", run, "--vehicle", "rc_car", "--method", "physics"]);
            command.args(["--threads", "1", "--out"]).arg(out).stdout(Stdio::null()).spawn().unwrap()
        };
        Self(roles.iter().map(start).collect())
    }

    /// Tells all to end, and waits for it.
    fn end(&mut self) {
        for child in &mut self.0 {
            let told = Command::new("kill").args(["-INT", &child.id().to_string()]).status();
            assert!(told.unwrap().success());
            child.wait().unwrap();
        }
        self.0.clear();
    }
}

impl Drop for Processes {
    fn drop(&mut self) {
        for child in &mut self.0 {
            drop(child.kill());
            drop(child.wait());
        }
    }
}

fn run_name(what: &str) -> String {
    format!("python-{what}-{}", std::process::id())
}

/// The last line of standard output.
fn told_json(output: &Output) -> Value {
    let told = text(&output.stdout);
    let line = told.lines().last().unwrap_or_else(|| panic!("{}", text(&output.stderr)));
    serde_json::from_str(line).unwrap()
}

#[test]
fn a_robot_of_somebodys_own_is_driven_to_its_goal_around_the_rock() {
    if !has_channels() {
        return;
    }
    let (folder, name) = (tempfile::tempdir().unwrap(), run_name("robot"));
    let mut processes = Processes::of_robot(&name, folder.path());
    let output = run("drive_robot.py", &["--run", &name]);
    // The robot's mission is over, and so is the run.
    let ended = processes.0.remove(0).wait_with_output().unwrap();
    let shown = text(&ended.stdout);
    assert!(ended.status.success() && shown.contains("goal reached"), "{shown}");
    assert!(!shown.contains("plant"), "no vehicle is simulated: {shown}");
    assert!(folder.path().join("drive-000.mcap").exists());
    let told = told_json(&output);
    assert_eq!((output.status.code(), &told["reached"]), (Some(0), &true.into()), "{told}");
    assert!(told["distance_to_goal_m"].as_f64().unwrap() <= 0.3, "{told}");
    // The rock's radius; half of the car's width of 0.25 m is what stands between.
    assert!(told["nearest_to_rock_m"].as_f64().unwrap() > 0.35, "{told}");
    // 5 m at 2 m/s at most take 25 decisions at the least.
    assert!(told["commands"].as_u64().unwrap() >= 25 && told["risk_maps"].as_u64().unwrap() > 2, "{told}");
}

/// A log of a hundred rows, 50 Hz, of which one lacks its yaw.
fn write_log(path: &Path) {
    let mut log = "t,x,y,yaw,vx,wz,cmd_speed,cmd_steer\n".to_owned();
    for row in 0..100 {
        let yaw = if row == 40 { String::new() } else { "0.1".to_owned() };
        let time_s = 0.02 * f64::from(row);
        log += &format!("{time_s},{},0.5,{yaw},1.0,0.0,1.1,0.05\n", time_s);
    }
    std::fs::write(path, log).unwrap();
}

#[test]
fn a_log_that_is_told_is_recorded_row_by_row() {
    if !has_channels() {
        return;
    }
    let (folder, name) = (tempfile::tempdir().unwrap(), run_name("log"));
    let (log, recording) = (folder.path().join("drive.csv"), folder.path().join("drive-000.mcap"));
    write_log(&log);
    let mut processes = Processes::start(&name, folder.path(), &["recorder"]);
    let has_begun = (0..6000).any(|_| {
        std::thread::sleep(Duration::from_millis(10));
        recording.exists()
    });
    assert!(has_begun, "no recording after a minute");
    let output = run("replay_log.py", &[log.to_str().unwrap(), "--run", &name]);
    assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
    let told = told_json(&output);
    assert_eq!((&told["poses"], &told["passed_over"]), (&99.into(), &1.into()), "{told}");
    processes.end();
    let inspected = folder.path().join("inspected.json");
    let mut inspect = Command::new(env!("CARGO_BIN_EXE_surefoot"));
    let output = inspect.arg("inspect").arg(&recording).arg("--json").arg(&inspected).output().unwrap();
    assert!(output.status.success(), "{}", text(&output.stderr));
    let found: Value = serde_json::from_slice(&std::fs::read(inspected).unwrap()).unwrap();
    for topic in ["/channel/odometry", "/channel/command"] {
        assert_eq!(found["topics"][topic]["messages"], 99, "{found:#}");
    }
}

#[test]
fn what_is_no_log_is_refused_in_one_line() {
    if !has_channels() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let log = folder.path().join("log.csv");
    for (content, part) in [
        ("t,x,y\n0,1,2\n", "line 1: expected the columns t, x, y, yaw, vx, wz, found no yaw, vx, wz"),
        ("t,x,y,yaw,vx,wz\nsoon,1,2,0,0,0\n", "line 2, t: expected a number, found 'soon'"),
        ("t,x,y,yaw,vx,wz\n1,1,2,0,0,0\n0,1,2,0,0,0\n", "line 3, t: expected a time not before the last"),
    ] {
        std::fs::write(&log, content).unwrap();
        let output = run("replay_log.py", &[log.to_str().unwrap(), "--run", &run_name("none")]);
        let told = text(&output.stderr);
        assert_eq!((output.status.code(), told.lines().count()), (Some(2), 1), "{told}");
        assert!(told.contains(part), "{told}");
    }
}
