//! `surefoot bench learning` on the measured forest and on files that are none.

#![allow(clippy::expect_used, reason = "helpers of tests may fail as tests do")]

use assert_cmd::Command;
use serde_json::Value;

fn surefoot(words: &[&str]) -> std::process::Output {
    let mut command = Command::cargo_bin("surefoot").expect("the binary is built with its tests");
    command.args(words).output().expect("the binary starts")
}

#[test]
fn traction_map_is_judged_told_and_drawn() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = |name: &str| folder.path().join(name);
    let (out, copy) = (path("out"), path("copy.json"));
    let map = concat!(env!("CARGO_MANIFEST_DIR"), "/../../shared/data/traction_maps/wp_forest.npz");
    let output = surefoot(&[
        "bench",
        "learning",
        "--traction-map",
        map,
        "--out",
        out.to_str().expect("UTF-8"),
        "--json",
        copy.to_str().expect("UTF-8"),
    ]);
    assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
    let told = String::from_utf8_lossy(&output.stdout);
    for part in ["wp_forest.npz: 3938 cells", "3.42 [", "fused with physics", "density AUROC"] {
        assert!(told.contains(part), "{part} in {told}");
    }
    let bytes = std::fs::read(out.join("traction_map.json")).expect("the numbers");
    assert_eq!(bytes, std::fs::read(&copy).expect("the copy"));
    let table: Value = serde_json::from_slice(&bytes).expect("JSON");
    assert_eq!((&table["traction_map"], &table["n_cells"]), (&"wp_forest.npz".into(), &3938.into()));
    let fused = &table["linear"]["scores"][4];
    assert_eq!(fused["source"], "fused_with_physics");
    let [low, value, high] =
        ["low", "value", "high"].map(|part| fused["emd2"][part].as_f64().expect("a number"));
    assert!(low < value && value < high, "{fused}");
    let picture = std::fs::read(out.join("traction_map.png")).expect("the picture");
    assert_eq!(&picture[1..4], b"PNG");
}

#[test]
fn what_is_no_traction_map_is_refused_before_anything_is_written() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let (map, out) = (folder.path().join("map.npz"), folder.path().join("out"));
    std::fs::write(&map, "no archive").expect("a file");
    let words = |map: &str| {
        let out = out.to_str().expect("UTF-8").to_owned();
        surefoot(&["bench", "learning", "--traction-map", map, "--out", &out])
    };
    for (path, part) in [
        (map.to_str().expect("UTF-8"), "map.npz: file: expected a complete NumPy archive"),
        ("nowhere.npz", "nowhere.npz: expected a readable file"),
    ] {
        let output = words(path);
        let told = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{told}");
        assert!(told.contains(part) && told.lines().count() == 1, "{told}");
    }
    assert!(!out.exists());
}
