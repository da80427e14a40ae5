//! `surefoot gap ground` and `surefoot bench ground` from the command line.

#![allow(clippy::unwrap_used, reason = "a panic is how a test fails")]

use std::path::Path;
use std::process::{Command, Output};

fn surefoot(words: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_surefoot")).args(words).output().unwrap()
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8(bytes.to_vec()).unwrap()
}

fn json(path: &Path) -> serde_json::Value {
    serde_json::from_slice(&std::fs::read(path).unwrap()).unwrap()
}

#[test]
fn a_recorded_drive_is_held_against_its_own_maps() {
    let folder = tempfile::tempdir().unwrap();
    let (drive, out) = (folder.path().join("drive"), folder.path().join("out"));
    let drives = surefoot(&["drive", "--seed", "3", "--time-limit", "20", "--out", drive.to_str().unwrap()]);
    assert_eq!(drives.status.code(), Some(1), "not there yet: {}", text(&drives.stderr));
    let recording = drive.join("drive.mcap");
    let recording = recording.to_str().unwrap();
    let judged =
        surefoot(&["gap", "ground", recording, "--reference", recording, "--out", out.to_str().unwrap()]);
    assert!(judged.status.success(), "{}", text(&judged.stderr));
    let told = text(&judged.stdout);
    for part in ["Nothing has changed", "Foretold and met", "Error of every layer", "ground.html"] {
        assert!(told.contains(part), "{part} in {told}");
    }
    let report = json(&out.join("ground.json"));
    assert_eq!(report["schema_version"], 1);
    assert!(report["n_met"].as_u64().unwrap() > 50, "{report}");
    // A drive against itself: no difference at all.
    assert_eq!(report["change"]["chi_squared"], 0.0);
    assert!(report["change"]["named"].is_null());
    // The learned networks judged, and so each of the layers has something to say.
    for layer in ["prior", "networks", "posterior", "uniform"] {
        assert!(report["layers"][3][layer]["value"].as_f64().unwrap() >= 0.0, "{layer}: {report}");
    }
    let page = std::fs::read_to_string(out.join("ground.html")).unwrap();
    assert!(page.contains("data:image/png;base64,") && page.contains("Nothing has changed"));
}

#[test]
fn drives_that_nothing_can_be_said_of_are_refused_with_the_reason() {
    let folder = tempfile::tempdir().unwrap();
    let log = folder.path().join("drive.csv");
    std::fs::write(&log, "t,x,y,yaw,vx,wz,cmd_speed,cmd_steer\n0,0,0,0,1,0,1,0\n").unwrap();
    let out = folder.path().join("out");
    let told = |words: &[&str]| {
        let words = [&["gap", "ground"], words, &["--out", out.to_str().unwrap()]].concat();
        let output = surefoot(&words);
        assert_eq!(output.status.code(), Some(2), "{}", text(&output.stderr));
        text(&output.stderr)
    };
    let bare = told(&[log.to_str().unwrap()]);
    assert!(bare.contains("drive.csv: expected a recording (.mcap) with maps, or --elevation"), "{bare}");
    let missing = told(&["nowhere.mcap"]);
    assert!(missing.contains("nowhere.mcap: expected a readable file"), "{missing}");
    let truncated = folder.path().join("broken.mcap");
    std::fs::write(&truncated, b"\x89MCAP0\r\n").unwrap();
    let broken = told(&[truncated.to_str().unwrap()]);
    assert!(broken.contains("broken.mcap: expected messages on topic /drive_log"), "{broken}");
    assert!(!out.join("ground.json").exists(), "nothing half-written");
}

#[test]
fn a_sensor_that_sits_elsewhere_is_named_without_being_told() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().to_str().unwrap();
    // Of the six kinds, the fourth.
    let one = ["--vehicles", "rc_car", "--first-case", "3", "--cases", "1", "--seed", "7"];
    let output = surefoot(&[&["bench", "ground", "--out", out], &one[..]].concat());
    assert!(output.status.success(), "{}", text(&output.stderr));
    let score = json(&folder.path().join("ground_score.json"));
    let cases = score["cases"].as_array().unwrap();
    assert_eq!(cases.len(), 1);
    assert_eq!((&cases[0]["truth"], &cases[0]["answer"]), (&"height_bias".into(), &"height_bias".into()));
    assert!(folder.path().join("ground_score.png").exists());
}
