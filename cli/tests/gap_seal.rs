//! Sealed case sets from the command line: made twice alike, kept apart from their labels, scored against them.
#![allow(clippy::unwrap_used, reason = "a panic is how a test fails")]

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Output;

use assert_cmd::Command;
use serde_json::{Value, json};

fn surefoot(words: &[&str]) -> Output {
    Command::cargo_bin("surefoot").unwrap().args(words).output().unwrap()
}

fn seal(folder: &Path, threads: &str) -> Output {
    let [out, labels] = ["set", "labels.json"].map(|name| folder.join(name).to_str().unwrap().to_owned());
    surefoot(&[
        "gap",
        "seal",
        "--cases",
        "2",
        "--seed",
        "11",
        "--out",
        &out,
        "--labels",
        &labels,
        "--threads",
        threads,
    ])
}

/// Every file below a folder with its content.
fn content(folder: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    let mut folders = vec![folder.to_owned()];
    let mut files = BTreeMap::new();
    while let Some(next) = folders.pop() {
        for entry in fs::read_dir(&next).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                folders.push(path);
            } else {
                files.insert(path.strip_prefix(folder).unwrap().to_owned(), fs::read(&path).unwrap());
            }
        }
    }
    files
}

fn told(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

#[test]
fn a_set_is_the_same_for_any_number_of_threads_and_is_scored_against_its_own_labels() {
    let [first, second] = [(); 2].map(|()| tempfile::tempdir().unwrap());
    // What an interrupted run left behind.
    fs::create_dir_all(first.path().join(".set.partial/cases/case_999")).unwrap();
    for (folder, threads) in [(&first, "1"), (&second, "2")] {
        let output = seal(folder.path(), threads);
        assert!(output.status.success(), "{}", told(&output));
    }
    let files = content(first.path());
    assert!(files == content(second.path()), "the two sets differ");
    // One machine with vehicle, two maps and four drives; two cases of four files; seal and labels.
    assert_eq!(files.len(), 7 + 2 * 4 + 2);
    assert!(!first.path().join(".set.partial").exists());
    let in_set = content(&first.path().join("set"));
    assert!(in_set.keys().all(|path| !path.to_string_lossy().contains("label")));

    let again = seal(first.path(), "1");
    assert_eq!(again.status.code(), Some(2));
    assert!(
        told(&again).contains("--out: expected a folder that does not exist or is empty"),
        "{}",
        told(&again)
    );
    score_of_answers(first.path());
}

/// Answers that somebody else has given, against the labels.
fn score_of_answers(folder: &Path) {
    let labels: Value = serde_json::from_slice(&fs::read(folder.join("labels.json")).unwrap()).unwrap();
    let answers = folder.join("answers");
    fs::create_dir(&answers).unwrap();
    for name in labels.as_object().unwrap().keys() {
        let answer = json!({
            "case": name, "verdict": "none", "effects": [], "ranking": [], "credible_set": [], "where": [],
            "shrink": {
                "metric": "", "before": null, "after": null, "floor": 1.0, "closed": null, "closed_low": null,
                "closed_high": null, "predicted_closed": null, "learned_bound_closed": null,
                "position_error_2s_m": null
            },
            "advice": []
        });
        fs::write(answers.join(format!("{name}.json")), answer.to_string()).unwrap();
    }
    let file = |name: &str| folder.join(name).to_str().unwrap().to_owned();
    let words = |labels: &str| {
        [
            "gap",
            "score",
            &file("set"),
            "--labels",
            labels,
            "--answers",
            &file("answers"),
            "--out",
            &file("score"),
        ]
        .map(str::to_owned)
    };
    let run = |labels: &str| surefoot(&words(labels).iter().map(String::as_str).collect::<Vec<_>>());
    let output = run(&file("labels.json"));
    assert!(output.status.success(), "{}", told(&output));
    let score: Value = serde_json::from_slice(&fs::read(folder.join("score/score.json")).unwrap()).unwrap();
    assert_eq!(score["n_cases"], 2);
    assert!(fs::read_to_string(folder.join("score/score.html")).unwrap().contains("case_002"));
    assert!(folder.join("score/confusion.png").is_file());

    fs::write(folder.join("other.json"), labels.to_string()).unwrap();
    let refused = run(&file("other.json"));
    assert_eq!(refused.status.code(), Some(2));
    assert!(told(&refused).contains("other.json: expected SHA-256"), "{}", told(&refused));
}

/// Killed while it drives: neither set nor labels are there, and what is left in between is no set.
#[test]
fn an_interrupted_seal_leaves_neither_set_nor_labels() {
    let folder = tempfile::tempdir().unwrap();
    let file = |name: &str| folder.path().join(name);
    let [out, labels] = ["set", "labels.json"].map(|name| file(name).to_str().unwrap().to_owned());
    let words = ["gap", "seal", "--cases", "4", "--seed", "5", "--out", &out, "--labels", &labels];
    let mut command = std::process::Command::new(env!("CARGO_BIN_EXE_surefoot"));
    let mut child = command.args(words).spawn().unwrap();
    let has_begun = (0..600).any(|_| {
        std::thread::sleep(std::time::Duration::from_millis(20));
        file(".set.partial/vehicles/veh_01/sim_1.csv").exists()
    });
    child.kill().unwrap();
    child.wait().unwrap();
    assert!(has_begun && !file("set").exists() && !file("labels.json").exists());
    let refused = surefoot(&["gap", "score", &out, "--labels", &labels]);
    assert_eq!(refused.status.code(), Some(2), "{}", told(&refused));
}

#[test]
fn bad_usage_is_refused_in_one_line() {
    let folder = tempfile::tempdir().unwrap();
    let file = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    for (cases, labels, expected) in [
        ("0", "l.json", "--cases: expected a number of cases from 1 to 10000, found \"0\""),
        ("1", "set/l.json", "--labels: expected a file outside of"),
    ] {
        let output = surefoot(&[
            "gap",
            "seal",
            "--cases",
            cases,
            "--seed",
            "1",
            "--out",
            &file("set"),
            "--labels",
            &file(labels),
        ]);
        assert_eq!(output.status.code(), Some(2));
        assert!(told(&output).contains(expected) && told(&output).lines().count() == 1, "{}", told(&output));
        assert!(!folder.path().join("set").exists());
    }
    let output = surefoot(&["gap", "score", &file("none"), "--labels", &file("none.json")]);
    assert_eq!(output.status.code(), Some(2));
    assert!(told(&output).contains("none.json: expected a readable text file"), "{}", told(&output));
}
