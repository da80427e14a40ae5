//! What a user meets before any work is done: help that teaches, and one line for every mistake.

#![allow(clippy::expect_used, reason = "helpers of tests may fail as tests do")]

use assert_cmd::Command;

fn surefoot(words: &[&str]) -> std::process::Output {
    let mut command = Command::cargo_bin("surefoot").expect("the binary is built with its tests");
    // A narrow terminal would wrap the help elsewhere.
    command.env("COLUMNS", "120").args(words).output().expect("the binary starts")
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8(bytes.to_vec()).expect("output is UTF-8")
}

/// Exit code 2, nothing on standard output, and one line on standard error that holds every given part.
fn assert_refused(words: &[&str], parts: &[&str]) {
    let output = surefoot(words);
    let told = text(&output.stderr);
    assert_eq!(output.status.code(), Some(2), "{words:?}: {told}");
    assert_eq!(told.lines().count(), 1, "{words:?}: {told}");
    assert!(output.stdout.is_empty(), "{words:?}");
    for part in parts {
        assert!(told.contains(part), "{words:?}: {part:?} is missing in {told:?}");
    }
}

#[test]
fn help_names_every_option_of_drive_with_units_files_and_exit_codes() {
    let output = surefoot(&["drive", "--help"]);
    assert_eq!(output.status.code(), Some(0));
    let help = text(&output.stdout);
    for option in [
        "--world",
        "--bush-height",
        "--walkers",
        "--start",
        "--goal",
        "--vehicle",
        "--model",
        "--method",
        "--weights",
        "--alpha",
        "--seed",
        "--isa",
        "--threads",
        "--pace",
        "--oracle-map",
        "--json",
        "--out",
        "--config",
        "--time-limit",
    ] {
        assert!(help.contains(option), "{option}");
    }
    for taught in [
        "radians",
        "Examples:",
        "drive.png",
        "drive.mcap",
        "summary.json",
        "Exit codes:",
        "attitude_limit",
        "avx512",
    ] {
        assert!(help.contains(taught), "{taught}");
    }
    assert!(output.stderr.is_empty());
}

#[test]
fn every_command_has_help() {
    for words in [
        &["--help"][..],
        &["-h"],
        &["drive", "-h"],
        &["bench", "--help"],
        &["bench", "control", "--help"],
        &["bench", "prior-map", "--help"],
        &["bench", "crossings", "--help"],
        &["bench", "arena", "--help"],
        &["bench", "slippery", "--help"],
        &["bench", "scaling", "--help"],
        &["bench", "risk", "--help"],
        &["bench", "correction", "--help"],
    ] {
        let output = surefoot(words);
        assert_eq!(output.status.code(), Some(0), "{words:?}");
        assert!(text(&output.stdout).contains("Usage:"), "{words:?}");
    }
}

#[test]
fn version_says_the_revision() {
    let output = surefoot(&["--version"]);
    assert_eq!(output.status.code(), Some(0));
    let version = text(&output.stdout);
    assert!(version.starts_with("surefoot ") && version.contains("(revision "), "{version}");
}

#[test]
fn risk_tolerance_outside_its_range_is_refused() {
    for bad in ["0", "2", "-0.5", "NaN", "inf", "high", ""] {
        assert_refused(&["drive", "--alpha", bad], &["--alpha", "above 0 and at most 1", bad]);
    }
}

#[test]
fn threads_that_cannot_be_are_refused() {
    for bad in ["-1", "0", "257", "1.5", "many"] {
        let parts = ["--threads", "from 1 to 256", bad];
        assert_refused(&["drive", "--threads", bad], &parts);
        assert_refused(&["bench", "control", "--threads", bad], &parts);
    }
}

#[test]
fn places_with_a_wrong_shape_are_refused() {
    for bad in ["1,2", "1,2,3,4", "a,b,c", "1,2,NaN", ""] {
        assert_refused(&["drive", "--start", bad], &["--start", "X,Y,YAW", "radians", bad]);
    }
    for bad in ["1", "1,2,3", "inf,0", "here"] {
        assert_refused(&["drive", "--goal", bad], &["--goal", "X,Y", "metres", bad]);
    }
}

#[test]
fn other_bad_values_are_refused_with_what_would_do() {
    let cases: [(&[&str], &[&str]); 13] = [
        (&["drive", "--world", "moon"], &["--world", "rocks, arena", ".npz", "moon"]),
        (&["drive", "--seed", "-1"], &["--seed", "whole number", "-1"]),
        (&["drive", "--seed", "1e3"], &["--seed", "whole number", "1e3"]),
        (&["drive", "--time-limit", "0"], &["--time-limit", "seconds above 0", "0"]),
        (&["drive", "--time-limit", "inf"], &["--time-limit", "finite", "inf"]),
        (&["drive", "--world", "arena", "--bush-height", "-1"], &["--bush-height", "0 to 2 metres", "-1"]),
        (&["drive", "--bush-height", "0.1"], &["--bush-height", "--world arena"]),
        (
            &["drive", "--method", "magic"],
            &[
                "--method",
                "pietra, pietra-avoid, evora, physics-informed, vanilla, physics, nominal, truth",
                "magic",
            ],
        ),
        (&["drive", "--isa", "sse9"], &["--isa", "auto, avx512, avx2, neon, portable", "sse9"]),
        (&["drive", "--pace", "slow"], &["--pace", "fast, real", "slow"]),
        (&["bench", "control", "--updates", "0"], &["--updates", "from 1", "0"]),
        (&["drive", "--walkers", "17"], &["--walkers", "from 1 to 16", "17"]),
        (&["up", "--robot", "mine.toml", "--walkers", "1"], &["--robot", "--walkers"]),
    ];
    for (words, parts) in cases {
        assert_refused(words, parts);
    }
}

#[test]
fn unknown_words_are_refused() {
    assert_refused(&[], &["expected a command", "--help"]);
    assert_refused(&["bench"], &["expected a command", "--help"]);
    assert_refused(&["fly"], &["fly"]);
    assert_refused(&["drive", "--hurry", "3"], &["--hurry"]);
    assert_refused(&["drive", "--alpha"], &["--alpha", "value"]);
    assert_refused(&["drive", "--seed", "1", "--seed", "2"], &["--seed"]);
}

#[test]
fn folder_that_cannot_be_written_is_told_before_the_drive() {
    let scratch = tempfile::tempdir().expect("a temporary folder");
    let taken = scratch.path().join("taken");
    std::fs::write(&taken, "a file").expect("the folder is writable");
    let below = taken.join("out");
    assert_refused(&["drive", "--out", below.to_str().expect("UTF-8")], &["--out", "taken"]);
}

/// As with `surefoot ... | head`.
#[test]
fn a_reader_that_goes_away_is_no_failure_to_be_told_of() {
    let binary = assert_cmd::cargo::cargo_bin("surefoot");
    for words in [&["bench", "prior-map", "--updates", "2"][..], &["map", "--help"]] {
        let mut child = std::process::Command::new(&binary)
            .args(words)
            .stdout(std::process::Stdio::piped())
            .stderr(std::process::Stdio::piped())
            .spawn()
            .expect("the binary starts");
        drop(child.stdout.take());
        let told = child.wait_with_output().expect("the command ends");
        assert_eq!(text(&told.stderr), "", "{words:?}");
    }
}
