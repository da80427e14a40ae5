//! Input that `surefoot drive` refuses: exit code 2, one line that says what is wrong and where, nothing left behind.

#![allow(clippy::unwrap_used, reason = "a panic is how a test fails")]

use std::path::{Path, PathBuf};
use std::process::Command;

use tempfile::TempDir;
use terrain::{Cell, GridMap};

const TERRAIN: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../shared/data/terrain/");

fn terrain_file(name: &str) -> String {
    format!("{TERRAIN}{name}")
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
    let whole = std::fs::read(terrain_file("bijou_gully_5m.npz")).unwrap();
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
    let bijou = terrain_file("bijou_gully_5m.npz");
    assert_refused(&["--world", &bijou, "--goal", "9999,5"], &["goal: ", map, "found (9999.0, 5.0) m"]);
}

/// First cell with this and its neighbours in both directions, two each, as `is_wanted`; its centre [m].
fn place(map: &GridMap<f32>, is_wanted: impl Fn(f32) -> bool) -> [f64; 2] {
    let geometry = map.geometry();
    let near = |at: usize| at - 2..=at + 2;
    let found =
        (20..geometry.n_rows - 20).flat_map(|row| (20..geometry.n_cols - 20).map(move |col| (row, col)));
    let all_around = |&(row, col): &(usize, usize)| {
        near(row).all(|row| near(col).all(|col| is_wanted(map[Cell { row, col }])))
    };
    let (row, col) = found.into_iter().find(all_around).unwrap();
    geometry.centre_m(Cell { row, col })
}

#[test]
fn start_in_the_lake_is_refused() {
    let path = terrain_file("lidr_topography.npz");
    let world = formats::read_elevation(Path::new(&path)).unwrap();
    let [x_m, y_m] = place(&world.layers.water.unwrap(), |share| share > 0.0);
    let start = format!("{x_m},{y_m},0");
    assert_refused(
        &["--world", &path, "--start", &start],
        &["start: expected free ground, found an obstacle"],
    );
}

#[test]
fn start_on_a_slope_beyond_the_limits_is_refused_with_its_angle() {
    let path = terrain_file("bijou_gully_5m.npz");
    let heights = formats::read_elevation(Path::new(&path)).unwrap().elevation;
    let geometry = *heights.geometry();
    // Central differences over 10 m: where they say 35 degrees or more, no heading up or down keeps 30 degrees.
    let rise = |row: usize, col: usize| {
        let at = |row, col| f64::from(heights[Cell { row, col }]);
        let span_m = 2.0 * geometry.resolution_m;
        [(at(row, col + 1) - at(row, col - 1)) / span_m, (at(row + 1, col) - at(row - 1, col)) / span_m]
    };
    let inner =
        (10..geometry.n_rows - 10).flat_map(|row| (10..geometry.n_cols - 10).map(move |col| (row, col)));
    let steep = |&(row, col): &(usize, usize)| rise(row, col)[0].hypot(rise(row, col)[1]);
    let (row, col) = inner.max_by(|a, b| steep(a).total_cmp(&steep(b))).unwrap();
    assert!(steep(&(row, col)).atan().to_degrees() > 35.0, "the gully has walls");
    let ([east, north], [x_m, y_m]) = (rise(row, col), geometry.centre_m(Cell { row, col }));
    let start = format!("{x_m},{y_m},{}", north.atan2(east));
    let parts = ["start: expected roll and pitch up to 27 and 27 degrees, found "];
    assert_refused(&["--world", &path, "--start", &start], &parts);
}

#[test]
fn goal_without_a_way_to_it_is_refused() {
    let words = ["--world", &terrain_file("bijou_gully_5m.npz"), "--start", "200,200,0", "--goal", "240,200"];
    assert_refused(&words, &["goal: expected a way from the start", "found none"]);
}

#[test]
fn file_in_the_way_of_the_output_folder_is_told_and_kept() {
    let (_folder, path) = file("taken", b"mine");
    refuse(&path, &[], &["--out: ", "taken: expected a folder"]);
    assert_eq!(std::fs::read(&path).unwrap(), b"mine");
}
