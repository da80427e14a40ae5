//! `surefoot train friction` and `surefoot route --friction` as their users call them.

#![allow(clippy::unwrap_used, reason = "a panic is how a test fails")]

mod ground;

use std::path::Path;
use std::process::{Command, Output};

fn surefoot(words: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_surefoot")).args(words).output().unwrap()
}

const HEADER: &str = "t,vx,vy,wz,wheel_speed,steer_meas";

/// Five seconds straight ahead at 5 m/s.
fn drive(header: &str, last: &str) -> String {
    let rows = (0..250).map(|row| format!("{:.2},5.0,0.0,0.0,5.0,0.0{last}\n", 0.02 * f64::from(row)));
    format!("{header}\n{}", rows.collect::<String>())
}

fn written(folder: &Path, name: &str, text: &str) -> String {
    let path = folder.join(name);
    std::fs::write(&path, text).unwrap();
    path.to_str().unwrap().to_owned()
}

#[test]
fn a_drive_straight_ahead_says_at_least_and_the_route_reads_it() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out");
    let plain = format!("{}=ice", written(folder.path(), "plain.csv", &drive(HEADER, "")));
    let named = written(folder.path(), "named.csv", &drive(&format!("{HEADER},ground"), ",grass"));
    let told = surefoot(&["train", "friction", "--train", &plain, &named, "--out", out.to_str().unwrap()]);
    let text = String::from_utf8(told.stdout).unwrap();
    assert!(told.status.success(), "{}", String::from_utf8_lossy(&told.stderr));
    assert!(text.contains("ice") && text.contains("grass"), "{text}");
    assert_eq!(text.matches("at least 0.00; never near its limit").count(), 2, "{text}");

    let table = std::fs::read_to_string(out.join("friction.toml")).unwrap();
    assert!(table.contains("kind = \"at_least\"") && table.contains("ground = \"ice\""), "{table}");
    let world = folder.path().join("plain.npz");
    ground::write(&world, 120, &[("elevation", &|_, _| 2.0)]);
    let half =
        written(folder.path(), "half.toml", &table.replace("static_friction = 0.4", "static_friction = 0.1"));
    let half = written(
        folder.path(),
        "half.toml",
        &std::fs::read_to_string(half).unwrap().replace("sliding_friction = 0.2", "sliding_friction = 0.05"),
    );
    let duration_s = |more: &[&str]| {
        let out = folder.path().join("route");
        let world = world.to_str().unwrap();
        let start = ["route", "--world", world, "--start", "20,20,0", "--goal", "90,60", "--bare", "ice"];
        let words = [&start[..], &["--speed", "9", "--out", out.to_str().unwrap()], more].concat();
        let told = surefoot(&words);
        assert!(told.status.success(), "{}", String::from_utf8_lossy(&told.stderr));
        let summary = std::fs::read(out.join("route.json")).unwrap();
        serde_json::from_slice::<serde_json::Value>(&summary).unwrap()["duration_s"].as_f64().unwrap()
    };
    let found = out.join("friction.toml");
    let published_s = duration_s(&[]);
    // A bound of nothing leaves what was published; a quarter of the grip costs time.
    assert_eq!(duration_s(&["--friction", found.to_str().unwrap()]), published_s);
    assert!(duration_s(&["--friction", &half]) > 1.3 * published_s);
}

#[test]
fn what_cannot_be_is_told_in_one_line() {
    let folder = tempfile::tempdir().unwrap();
    let file = |name: &str, text: &str| written(folder.path(), name, text);
    let good = file("good.csv", &drive(HEADER, ""));
    let no_wheels = file("no_wheels.csv", &drive(&HEADER.replace("wheel_speed", "other"), ""));
    let lava = file("lava.csv", &drive(&format!("{HEADER},ground"), ",lava"));
    let infinite = file("infinite.csv", &drive(HEADER, "").replace("2.00,5.0", "2.00,inf"));
    let parked = file("parked.csv", &drive(HEADER, "").replace("5.0", "0.0"));
    let cases: [(String, &str); 6] = [
        (good.clone(), "expected a column 'ground' or "),
        (format!("{no_wheels}=ice"), "expected the column wheel_speed, found vx, vy, wz"),
        (lava, "row 1: ground: expected asphalt, rock, dirt, grass, mud, sand, ice, found 'lava'"),
        (format!("{good}=lawa"), "found 'lawa'"),
        (format!("{infinite}=ice"), "vx: expected a finite number"),
        (format!("{parked}=ice"), "expected 25 instants of driving forward"),
    ];
    let out = folder.path().join("out");
    for (word, expected) in cases {
        let told = surefoot(&["train", "friction", "--train", &word, "--out", out.to_str().unwrap()]);
        let error = String::from_utf8(told.stderr).unwrap();
        assert_eq!(told.status.code(), Some(2), "{word}: {error}");
        assert!(error.lines().count() == 1 && error.contains(expected), "{word}: {error}");
        assert!(!out.join("friction.toml").exists(), "{word}");
    }
    let bad = file("bad.toml", "vehicle = \"x\"\nground = []\n");
    let world = folder.path().join("plain.npz");
    ground::write(&world, 40, &[("elevation", &|_, _| 2.0)]);
    let words = ["--start", "5,5,0", "--goal", "30,30", "--friction", &bad];
    let told = surefoot(&[&["route", "--world", world.to_str().unwrap()][..], &words[..]].concat());
    let error = String::from_utf8(told.stderr).unwrap();
    assert!(
        told.status.code() == Some(2)
            && error.contains("bad.toml:2: ground: expected at least one, found none"),
        "{error}"
    );
}
