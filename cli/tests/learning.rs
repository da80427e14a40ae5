//! `surefoot bench learning`: the tables of a small testbed, the measured forest, and what is refused.

#![allow(clippy::expect_used, reason = "helpers of tests may fail as tests do")]

use std::path::Path;

use assert_cmd::Command;
use ndarray::{Array2, Array3, arr0, arr1};
use ndarray_npy::NpzWriter;
use serde_json::Value;
use traversability::Bins;

fn surefoot(words: &[&str]) -> std::process::Output {
    let mut command = Command::cargo_bin("surefoot").expect("the binary is built with its tests");
    command.args(words).output().expect("the binary starts")
}

/// What `--traction-map` says of a file, and the numbers that it writes; the picture is one.
fn judged(map: &Path) -> (String, Value) {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = |name: &str| folder.path().join(name);
    let (out, copy) = (path("out"), path("copy.json"));
    let [map, out_word, copy_word] = [map, &out, &copy].map(|path| path.to_str().expect("UTF-8"));
    let words = ["bench", "learning", "--traction-map", map, "--out", out_word, "--json", copy_word];
    let output = surefoot(&words);
    assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
    let bytes = std::fs::read(out.join("traction_map.json")).expect("the numbers");
    assert_eq!(bytes, std::fs::read(&copy).expect("the copy"));
    let picture = std::fs::read(out.join("traction_map.png")).expect("the picture");
    assert_eq!(&picture[1..4], b"PNG");
    let told = String::from_utf8(output.stdout).expect("UTF-8");
    (told, serde_json::from_slice(&bytes).expect("JSON"))
}

/// A level meadow of 10 x 10 m where the machine always had the traction of bin 8 and a network foretold bin 11, surer
/// of itself in the north.
fn write_meadow(path: &Path) {
    let shape = (20, 20);
    let certain =
        |of: usize| Array3::from_shape_fn((12, 20, 20), |(bin, _, _)| f32::from(u8::from(bin == of)));
    let density = Array2::from_shape_fn(shape, |(row, _)| -0.5 + 0.1 * row as f32);
    let mut npz = NpzWriter::new(std::fs::File::create(path).expect("a file"));
    let mut add = |name: &str, of: usize| npz.add_array(name, &certain(of)).expect("an array");
    add("measured_linear_pmf", 8);
    add("measured_angular_pmf", 8);
    add("predicted_linear_pmf", 11);
    add("predicted_angular_pmf", 11);
    npz.add_array("bin_values", &arr1(Bins::TRACTION.values())).expect("an array");
    npz.add_array("cell", &arr0(0.5_f64)).expect("an array");
    npz.add_array("elevation", &Array2::<f32>::zeros(shape)).expect("an array");
    npz.add_array("semantic_id", &Array2::<u8>::zeros(shape)).expect("an array");
    npz.add_array("unknown", &Array2::from_elem(shape, false)).expect("an array");
    npz.add_array("predicted_normalised_density", &density).expect("an array");
    npz.finish().expect("an archive");
}

#[test]
fn traction_map_is_judged_told_and_drawn() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let map = folder.path().join("meadow.npz");
    write_meadow(&map);
    let (told, table) = judged(&map);
    for part in ["meadow.npz: 400 cells", "3.00 [3.00, 3.00]", "fused with physics", "- less prior alone"] {
        assert!(told.contains(part), "{part} in {told}");
    }
    assert_eq!((&table["traction_map"], &table["n_cells"]), (&"meadow.npz".into(), &400.into()));
    // Cumulative probabilities of twelve equal bins are k / 12, those of what was measured 0 below bin 8 and then 1.
    let uniform = ((1..=8).map(|k| k * k).sum::<i32>() + 9 + 4 + 1) as f64 / 144.0;
    for head in ["linear", "angular"] {
        let error =
            |source: usize| table[head]["scores"][source]["emd2"]["value"].as_f64().expect("a number");
        assert!((error(0) - 3.0).abs() < 1e-5 && (error(1) - uniform).abs() < 1e-5, "{table}");
    }
}

#[test]
#[ignore = "needs the shared data"]
fn measured_traction_is_judged_told_and_drawn() {
    let map = concat!(env!("CARGO_MANIFEST_DIR"), "/../../shared/data/traction_maps/wp_forest.npz");
    let (told, table) = judged(Path::new(map));
    for part in
        ["wp_forest.npz: 3938 cells", "3.42 [", "fused with physics", "- less prior alone", "density AUROC"]
    {
        assert!(told.contains(part), "{part} in {told}");
    }
    assert_eq!((&table["traction_map"], &table["n_cells"]), (&"wp_forest.npz".into(), &3938.into()));
    let fused = &table["linear"]["scores"][4];
    assert_eq!(fused["source"], "fused_with_physics");
    let [low, value, high] =
        ["low", "value", "high"].map(|part| fused["emd2"][part].as_f64().expect("a number"));
    assert!(low < value && value < high, "{fused}");
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

#[test]
fn small_testbed_is_driven_trained_and_judged() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = |name: &str| folder.path().join(name).to_str().expect("UTF-8").to_owned();
    let words = ["bench", "learning", "--seeds", "1", "--maps", "2", "--trials", "2", "--epochs", "2"];
    let (out, copy) = (path("out"), path("copy.json"));
    let output = surefoot(&[words.as_slice(), &["--threads", "2", "--out", &out, "--json", &copy]].concat());
    assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
    assert!(output.stderr.is_empty(), "no bar without a terminal");
    let told = String::from_utf8_lossy(&output.stdout);
    for part in ["Table I:", "Table II:", "Figure 6:", "PIETRA: weight", "Rules: ", "trainings, 2 at a time"]
    {
        assert!(told.contains(part), "{part} in {told}");
    }
    let widest = told.lines().max_by_key(|line| line.chars().count()).expect("lines");
    assert!(widest.chars().count() <= 110, "{widest}");

    let bytes = std::fs::read(folder.path().join("out/learning.json")).expect("the numbers");
    assert_eq!(bytes, std::fs::read(folder.path().join("copy.json")).expect("the copy"));
    let report: Value = serde_json::from_slice(&bytes).expect("JSON");
    let number = |value: &Value| value.as_f64().expect("a number");
    let testbed = &report["testbed"];
    assert_eq!(
        (&testbed["n_maps"], &testbed["n_trials"], &report["n_seeds"]),
        (&2.into(), &2.into(), &1.into())
    );
    let rows = report["rows"].as_array().expect("rows");
    assert_eq!((rows.len(), &rows[0]["row"]), (9, &"pietra".into()));
    for row in rows {
        let ood = &row["out_of_distribution"];
        let heads = ood["heads"].as_array().expect("heads").iter().map(|head| number(&head["mean"]));
        assert!((heads.sum::<f64>() - number(&ood["total"]["mean"])).abs() < 1e-9, "{row}");
        // Worst and best that a distribution can do against one of twelve bins.
        assert!((0.0..44.0).contains(&number(&ood["total"]["mean"])), "{row}");
        assert_eq!(row["curve"].as_array().expect("a curve").len(), 9);
    }
    let uniform = &rows[8]["out_of_distribution"];
    assert!((number(&uniform["ratio_to_uniform"]) - 1.0).abs() < 1e-12, "{uniform}");
    // Each parameter of the uniform distribution lies between 146/144 and 506/144.
    assert!(
        uniform["heads"]
            .as_array()
            .expect("heads")
            .iter()
            .all(|head| { (1.0138..3.5139).contains(&number(&head["mean"])) })
    );
    let evidence = report["evidence"].as_array().expect("evidence");
    assert_eq!((evidence.len(), evidence[0]["grounds"].as_array().map(Vec::len)), (4, Some(17)));
    let verdicts = report["verdicts"].as_array().expect("verdicts");
    let n_passed = verdicts.iter().filter(|verdict| verdict["is_passed"] == true).count();
    assert!(told.contains(&format!("Rules: {n_passed} of {} hold", verdicts.len())), "{told}");
    for key in ["drives_s", "trainings_s", "trainings_estimated_s"] {
        assert!(number(&report["took"][key]) > 0.0, "{key}");
    }

    let picture = std::fs::read(folder.path().join("out/learning.png")).expect("the picture");
    assert_eq!(&picture[1..4], b"PNG");
    let page = std::fs::read_to_string(folder.path().join("out/learning.html")).expect("the page");
    assert!(page.contains("<svg") && page.contains("<td>PIETRA</td>") && page.ends_with("</html>\n"));
    let links = ["src=", "href=", "url(h", "@import"];
    assert!(links.iter().all(|link| !page.contains(link)), "the page needs nothing else");
}

#[test]
fn tables_of_nothing_are_refused() {
    for (words, part) in [
        (
            ["--maps", "1", "--trials", "3"].as_slice(),
            "maps times trials: expected at least 4 drives, found 3",
        ),
        (&["--seeds", "0"], "--seeds: expected a number of seeds from 1 to 1000, found \"0\""),
        (&["--seed", "-1"], "--seed: expected a whole number from 0 to"),
        (&["--maps", "many"], "--maps: expected a number of maps from 1 to 1000, found \"many\""),
        (&["--epochs", "0"], "--epochs: expected a number of passes from 1 to 65536, found \"0\""),
        (&["--threads", "300"], "--threads: expected a number of threads from 1 to 256, found \"300\""),
        (&["--out", "/dev/null"], "--out: "),
        (&["--traction-map", "forest.npz", "--seeds", "2"], "cannot be used with"),
    ] {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let out = folder.path().join("out");
        let mut command = ["bench", "learning"].to_vec();
        if !words.contains(&"--out") {
            command.extend(["--out", out.to_str().expect("UTF-8")]);
        }
        let output = surefoot(&[command.as_slice(), words].concat());
        let told = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{told}");
        assert!(told.contains(part) && told.lines().count() == 1, "{told}");
    }
}
