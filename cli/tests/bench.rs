//! The benchmarks answer on the command line with the numbers that were asked for.

#![allow(clippy::expect_used, reason = "helpers of tests may fail as tests do")]

use assert_cmd::Command;
use serde_json::Value;

fn surefoot(words: &[&str]) -> std::process::Output {
    let mut command = Command::cargo_bin("surefoot").expect("the binary is built with its tests");
    command.args(words).output().expect("the binary starts")
}

#[test]
fn control_prints_and_writes_the_same_report() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("new/control.json");
    let file = path.to_str().expect("UTF-8");
    let output = surefoot(&[
        "bench",
        "control",
        "--threads",
        "1",
        "--updates",
        "3",
        "--isa",
        "portable",
        "--json",
        file,
    ]);
    assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
    let printed: Value = serde_json::from_slice(&output.stdout).expect("JSON");
    let written: Value = serde_json::from_slice(&std::fs::read(&path).expect("the file")).expect("JSON");
    assert_eq!(printed, written);
    assert_eq!((&printed["threads"], &printed["updates"]), (&1.into(), &3.into()));
    assert_eq!((&printed["config"], &printed["isa"]), (&"bound".into(), &"portable".into()));
    for part in [&printed["ms"]["min"], &printed["ms"]["median"], &printed["ms"]["p99"]] {
        assert!(part.as_f64().is_some_and(|ms| ms > 0.0), "{printed}");
    }
    for part in ["noise", "rollout", "update"] {
        assert!(printed["split_ms"][part].as_f64().is_some_and(|ms| ms > 0.0), "{part} in {printed}");
    }
}

#[test]
fn prior_map_reports_whole_and_changed_maps() {
    let output = surefoot(&["bench", "prior-map", "--threads", "1", "--updates", "1"]);
    assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
    let printed: Value = serde_json::from_slice(&output.stdout).expect("JSON");
    assert_eq!(printed["poses"], 81 * 96 * 13);
    for part in ["full", "changed"] {
        assert!(printed["ms"][part]["median"].as_f64().is_some_and(|ms| ms > 0.0), "{part} in {printed}");
    }
}
