//! Input that `surefoot drive` refuses: exit code 2, one line that says what is wrong and where, nothing left behind.

#![allow(clippy::unwrap_used, reason = "a panic is how a test fails")]

mod ground;

use std::path::{Path, PathBuf};
use std::process::Command;

use tempfile::TempDir;

/// A terrace of 18 m above a plain, both level, with 42 degrees between them from 70 to 90 m east, from border to
/// border; on the plain a pond from (20, 80) to (35, 95) m. The file, in a folder that lives as long as the first value.
fn terrace() -> (TempDir, String) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("terrace.npz");
    let height_m = |x: f64, _: f64| 0.9 * (x - 70.0).clamp(0.0, 20.0);
    let is_pond = |x: f64, y: f64| (20.0..35.0).contains(&x) && (80.0..95.0).contains(&y);
    let water = |x: f64, y: f64| f64::from(is_pond(x, y));
    ground::write(&path, 120, &[("elevation", &height_m), ("water", &water)]);
    let path = path.to_str().unwrap().to_owned();
    (folder, path)
}

/// Drives with `--out` in a fresh folder, expects a refusal that holds every part, and that no output folder is made.
fn assert_refused(words: &[&str], parts: &[&str]) {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out");
    refuse(&out, words, parts);
    assert!(!out.exists(), "{words:?} left a folder behind");
}

fn refuse(out: &Path, words: &[&str], parts: &[&str]) {
    let mut command = Command::new(env!("CARGO_BIN_EXE_surefoot"));
    let command =
        command.args(["drive", "--threads", "1", "--time-limit", "0.1", "--out"]).arg(out).args(words);
    let output = command.output().unwrap();
    let told = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(2), "{words:?}: {told}");
    assert_eq!(told.lines().count(), 1, "{words:?}: {told}");
    assert!(output.stdout.is_empty(), "{words:?}");
    for part in parts {
        assert!(told.contains(part), "{words:?}: {part:?} is missing in {told:?}");
    }
}

/// A file with this content, in a folder that lives as long as the first value.
fn file(name: &str, content: &[u8]) -> (TempDir, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(name);
    std::fs::write(&path, content).unwrap();
    (folder, path)
}

#[test]
fn files_that_are_not_there_are_named() {
    for option in ["--world", "--vehicle", "--model", "--config"] {
        let parts = ["/nowhere/it.npz: expected a readable", "No such file"];
        assert_refused(&[option, "/nowhere/it.npz"], &parts);
    }
}

/// Who carries out commands does not plan: what says how to plan would be ignored.
#[test]
fn words_of_planning_are_refused_with_commands() {
    for words in [
        &["--goal", "9,5"][..],
        &["--method", "physics"],
        &["--weights", "nets"],
        &["--model", "model.toml"],
        &["--alpha", "0.2"],
        &["--config", "config.toml"],
        &["--oracle-map"],
        &["--threads", "2"],
        &["--isa", "portable"],
    ] {
        let mut command = Command::new(env!("CARGO_BIN_EXE_surefoot"));
        let output = command.args(["drive", "--commands", "/nowhere.csv"]).args(words).output().unwrap();
        let told = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(2), "{words:?}: {told}");
        assert!(told.contains("--commands") && told.contains(words[0]), "{words:?}: {told}");
    }
}

#[test]
fn vehicle_that_cannot_be_is_named_by_line_and_field() {
    let text = formats::shipped_vehicle_text("rc_car").unwrap();
    let line = 1 + text.lines().position(|line| line.starts_with("wheelbase_m")).unwrap();
    let at = format!("machine.toml:{line}: geometry.");
    for (instead, parts) in [
        ("wheelbase_m = 0.0", ["wheelbase_m: expected a finite number > 0", "found 0"]),
        ("wheelbase_m = -0.18", ["wheelbase_m: expected a finite number > 0", "found -0.18"]),
        ("wheelbase_m = nan", ["wheelbase_m: expected a finite number > 0", "found NaN"]),
        ("wheelbase_m = \"long\"", ["wheelbase_m: expected", "string \"long\""]),
        ("wheel_base = 0.18", ["wheel_base: expected one of wheelbase_m", "unknown key"]),
    ] {
        let (_folder, path) = file("machine.toml", text.replace("wheelbase_m = 0.18", instead).as_bytes());
        assert_refused(&["--vehicle", path.to_str().unwrap()], &[&at, parts[0], parts[1]]);
    }
}

#[test]
fn settings_that_cannot_be_are_named_with_their_file() {
    for (text, part) in [
        ("[controller]\nn_rollout = 64", "settings.toml:2: controller.n_rollout: expected one of actuation"),
        ("[controller]\nn_rollouts = \"many\"", "settings.toml:2: controller.n_rollouts: expected"),
        ("[controller]\nn_rollouts = 100", "settings.toml: n_rollouts: expected a multiple of 64, found 100"),
        (
            "[guard]\nscan_age_max_s = -1.0",
            "settings.toml: guard.scan_age_max_s: expected a finite number > 0",
        ),
        ("[controller", "settings.toml:1: expected TOML"),
    ] {
        let (_folder, path) = file("settings.toml", text.as_bytes());
        assert_refused(&["--config", path.to_str().unwrap()], &[part]);
    }
}

#[test]
fn truncated_world_is_named() {
    let (_terrace, path) = terrace();
    let whole = std::fs::read(path).unwrap();
    for n_bytes in [0, 100, whole.len() / 2, whole.len() - 1] {
        let (_folder, path) = file("half.npz", &whole[..n_bytes]);
        assert_refused(&["--world", path.to_str().unwrap()], &["half.npz: ", "expected", "found"]);
    }
}

#[test]
fn ends_outside_the_map_are_refused_with_the_maps_corners() {
    let map = "expected a point of the map from (";
    assert_refused(&["--start", "10,10,0", "--goal", "99,5"], &["goal: ", map, "found (99.0, 5.0) m"]);
    assert_refused(&["--start", "-3,10,0", "--goal", "9,5"], &["start: ", map, "found (-3.0, 10.0) m"]);
    let (_folder, path) = terrace();
    assert_refused(&["--world", &path, "--goal", "9999,5"], &["goal: ", map, "found (9999.0, 5.0) m"]);
}

#[test]
fn start_in_water_is_refused() {
    let (_folder, path) = terrace();
    let parts = ["start: expected free ground, found an obstacle"];
    assert_refused(&["--world", &path, "--start", "27,88,0"], &parts);
}

#[test]
fn start_on_a_slope_beyond_the_limits_is_refused_with_its_angle() {
    let (_folder, path) = terrace();
    let parts = ["start: expected roll and pitch up to 27 and 27 degrees, found 0.0 and 4"];
    assert_refused(&["--world", &path, "--start", "80,40,0"], &parts);
}

#[test]
fn goal_without_a_way_to_it_is_refused() {
    let (_folder, path) = terrace();
    let words = ["--world", &path, "--start", "40,40,0", "--goal", "105,40"];
    assert_refused(&words, &["goal: expected a way from the start", "found none"]);
}

#[test]
fn file_in_the_way_of_the_output_folder_is_told_and_kept() {
    let (_folder, path) = file("taken", b"mine");
    refuse(&path, &[], &["--out: ", "taken: expected a folder"]);
    assert_eq!(std::fs::read(&path).unwrap(), b"mine");
}
