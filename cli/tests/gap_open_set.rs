//! The diagnosis of labelled cases that other people's plants made: single-track drift, multi-body, MuJoCo.
#![allow(clippy::unwrap_used, reason = "a panic is how a test fails")]

use serde_json::Value;
use std::fs;
use std::process::Command;

const OPEN: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../shared/gap/open");

/// Least shares of right answers, or most of wrong ones, for a diagnosis to be accepted.
const AT_LEAST: [(&str, f64); 6] = [
    ("single effect, first name right", 0.85),
    ("single effect made by physics, first name right", 0.75),
    ("single effect, in the credible set", 0.95),
    ("single or pair, exactly what was added announced", 0.75),
    ("pair, both announced", 5.0 / 6.0),
    ("unknown that no effect can stand for, flagged", 0.75),
];

#[test]
#[ignore = "needs the shared data"]
fn the_open_cases_are_named_and_closed() {
    let folder = tempfile::tempdir().unwrap();
    let labels = format!("{OPEN}/labels.json");
    let output = Command::new(env!("CARGO_BIN_EXE_surefoot"))
        .args(["gap", "score", OPEN, "--labels", &labels, "--out", "score"])
        .current_dir(folder.path())
        .output()
        .unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let score: Value =
        serde_json::from_slice(&fs::read(folder.path().join("score/score.json")).unwrap()).unwrap();
    assert_eq!(score["n_cases"], 34);
    let share = |name: &str| {
        let shares = score["shares"].as_array().unwrap();
        shares.iter().find(|share| share["name"] == name).unwrap()["share"].as_f64().unwrap()
    };
    for (name, least) in AT_LEAST {
        assert!(share(name) >= least, "{name}: {}", share(name));
    }
    assert_eq!(share("nothing added, an effect announced"), 0.0);
    assert!(score["closed"]["median"].as_f64().unwrap() >= 0.9, "{}", score["closed"]);
    assert!(score["closed"]["p10"].as_f64().unwrap() >= 0.6, "{}", score["closed"]);
    assert!(score["parameter_error"]["median"].as_f64().unwrap() <= 0.1, "{}", score["parameter_error"]);
}
