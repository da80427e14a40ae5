//! `surefoot train traversability` on small datasets: weights that can be read again, a search that goes on where it
//! was broken off, an interruption, and files that are refused.

#![allow(clippy::expect_used, reason = "helpers of tests may fail as tests do")]

use std::path::Path;

use assert_cmd::Command;
use bicycle::Geometry;
use evidential::{Checkpoint, Dataset, DatasetOrigin, Example, FeatureLayout, Selections};
use serde_json::Value;

const GEOMETRY: Geometry = Geometry {
    wheelbase_m: 2.0,
    track_m: 1.2,
    length_m: 3.0,
    width_m: 1.5,
    rear_overhang_m: 0.5,
    ground_clearance_m: 0.3,
    wheel_radius_m: 0.4,
};

/// Footprints whose first feature tells everything that is measured.
fn dataset(n: usize, phase: f32) -> Dataset {
    let layout = FeatureLayout::for_vehicle(&GEOMETRY);
    let example = |k: usize| {
        let rough = (k as f32 * 0.618 + phase).fract();
        let mut features = vec![0.1; layout.n_features()];
        features[0] = rough;
        Example {
            features,
            measured: [1.0 - rough, 0.9 - 0.8 * rough, 0.6 * rough, 0.4 * rough],
            prior: [[1.0 / 12.0; 12]; 4],
            unevenness_m: rough,
            drive: 0,
            pose: [0.0; 3],
        }
    };
    let origin = DatasetOrigin {
        vehicle: "test".to_owned(),
        layout,
        prior: physics_prior::PriorConfig::default(),
        drives: vec!["made".to_owned()],
        provenance: "made for a test".to_owned(),
    };
    Dataset { origin, examples: (0..n).map(example).collect() }
}

/// A folder with `train` and `validation`.
fn data() -> tempfile::TempDir {
    let folder = tempfile::tempdir().expect("a temporary folder");
    for (name, n, phase) in [("train", 400, 0.0), ("validation", 150, 0.3)] {
        let bytes = dataset(n, phase).to_bytes().expect("a valid dataset");
        std::fs::write(folder.path().join(name), bytes).expect("a file");
    }
    folder
}

fn words(folder: &Path, out: &str, more: &[&str]) -> Vec<String> {
    let path = |name: &str| folder.join(name).to_str().expect("UTF-8").to_owned();
    let fixed = ["train", "traversability", "--train", &path("train"), "--validation", &path("validation")];
    let words = fixed.iter().map(|word| (*word).to_owned());
    let words = words.chain(["--out".to_owned(), path(out)]);
    words.chain(more.iter().map(|word| (*word).to_owned())).collect()
}

fn surefoot(words: &[String]) -> std::process::Output {
    let mut command = Command::cargo_bin("surefoot").expect("the binary is built with its tests");
    command.args(words).output().expect("the binary starts")
}

fn refusal(words: &[String]) -> String {
    let output = surefoot(words);
    assert_eq!(output.status.code(), Some(2), "{}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8_lossy(&output.stderr).into_owned()
}

fn checkpoint(folder: &Path) -> Checkpoint {
    let read = |name: &str| std::fs::read(folder.join(name)).expect("a file of the checkpoint");
    Checkpoint::from_bytes(&read("weights.safetensors"), &read("weights.json")).expect("a checkpoint")
}

#[test]
fn weights_curves_and_numbers_are_written_and_repeat() {
    let folder = data();
    let more = ["--epochs", "3", "--unevenness-percentile", "100", "--seed", "5"];
    let outputs = ["a", "b"].map(|out| surefoot(&words(folder.path(), out, &more)));
    let told = String::from_utf8_lossy(&outputs[0].stdout);
    assert_eq!(outputs[0].status.code(), Some(0), "{}", String::from_utf8_lossy(&outputs[0].stderr));
    for part in ["pietra, seed 5: 400 examples", "linear traction", "sum", "learned weight", "50 %"] {
        assert!(told.contains(part), "{part} in {told}");
    }
    let [one, other] = ["a", "b"].map(|out| checkpoint(&folder.path().join(out)));
    assert_eq!(one, other);
    assert_eq!(one.sidecar.training["seed"], 5);
    let picture = std::fs::read(folder.path().join("a/training.png")).expect("the picture");
    assert_eq!(&picture[1..4], b"PNG");
    let text = std::fs::read(folder.path().join("a/training.json")).expect("the numbers");
    let numbers: Value = serde_json::from_slice(&text).expect("JSON");
    assert_eq!((&numbers["n_training"], &numbers["end"]), (&400.into(), &"finished".into()));
    assert_eq!(numbers["curves"][2]["epoch"], 3);
}

#[test]
fn even_ground_is_kept_for_training_unless_asked_otherwise() {
    let folder = data();
    let of = |out: &str, more: &[&str]| {
        let more = [&["--method", "vanilla", "--epochs", "1"], more].concat();
        assert_eq!(surefoot(&words(folder.path(), out, &more)).status.code(), Some(0));
        let text = std::fs::read(folder.path().join(out).join("training.json")).expect("the numbers");
        let numbers: Value = serde_json::from_slice(&text).expect("JSON");
        ["n_training", "n_validation"].map(|name| numbers[name].as_u64().expect("a count"))
    };
    // Unevenness is spread evenly over 0 to 1.
    let [n_training, n_validation] = of("half", &[]);
    assert!(n_training.abs_diff(200) <= 1 && n_validation.abs_diff(75) <= 3, "{n_training} {n_validation}");
    let [n_training, n_validation] = of("little", &["--unevenness-max", "0.25"]);
    assert!(n_training.abs_diff(100) <= 3 && n_validation.abs_diff(38) <= 3, "{n_training} {n_validation}");
}

#[test]
fn search_goes_on_where_it_was_broken_off() {
    let folder = data();
    let more = ["--sweep", "--method", "vanilla", "--seeds", "2", "--epochs", "2", "--threads", "2"];
    let words = words(folder.path(), "sweep", &more);
    let log = folder.path().join("sweep/trials.jsonl");
    let lines = || {
        let text = std::fs::read_to_string(&log).expect("the log");
        let mut lines: Vec<String> = text.lines().map(str::to_owned).collect();
        lines.sort();
        lines
    };
    let first = surefoot(&words);
    assert_eq!(first.status.code(), Some(0), "{}", String::from_utf8_lossy(&first.stderr));
    assert!(String::from_utf8_lossy(&first.stdout).contains("6/6 vanilla"));
    let whole = lines();
    assert_eq!(whole.len(), 6);
    let selections = folder.path().join("sweep/selections.json");
    let selected = std::fs::read(&selections).expect("the selections");
    let found: Selections = serde_json::from_slice(&selected).expect("selections");
    assert_eq!((found.selections.len(), found.selections[0].n_seeds), (1, 2));

    std::fs::write(&log, whole[..4].join("\n") + "\n").expect("a shorter log");
    let second = surefoot(&words);
    assert!(String::from_utf8_lossy(&second.stdout).contains("2/2 vanilla"));
    assert_eq!(lines(), whole);
    assert_eq!(std::fs::read(&selections).expect("the selections"), selected);

    std::fs::write(&log, whole[0].replace("\"data\":\"", "\"data\":\"0")).expect("a log of other data");
    assert!(refusal(&words).contains("trials.jsonl, line 1: expected a training on data"));
    std::fs::write(&log, "{}").expect("a broken log");
    assert!(refusal(&words).contains("trials.jsonl, line 1: expected a training of a search"));
}

#[cfg(unix)]
#[test]
fn interruption_leaves_the_best_weights_so_far() {
    let folder = data();
    let more = ["--method", "vanilla", "--epochs", "65536", "--patience", "65536"];
    let child = std::process::Command::new(env!("CARGO_BIN_EXE_surefoot"))
        .args(words(folder.path(), "out", &more))
        .stderr(std::process::Stdio::piped())
        .stdout(std::process::Stdio::null())
        .spawn()
        .expect("the binary starts");
    // The folder is made before the data are read, and signals are caught soon after that.
    while !folder.path().join("out").exists() {
        std::thread::yield_now();
    }
    std::thread::sleep(std::time::Duration::from_millis(500));
    let killed = std::process::Command::new("kill").args(["-INT", &child.id().to_string()]).status();
    assert!(killed.expect("kill").success());
    let output = child.wait_with_output().expect("an end");
    let told = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(1), "{told}");
    assert!(
        told.contains("interrupted after") && told.contains("the best weights so far are kept"),
        "{told}"
    );
    assert_eq!(checkpoint(&folder.path().join("out")).sidecar.vehicle, "test");
}

#[test]
fn data_that_teach_nothing_are_refused() {
    let folder = data();
    let words = words(folder.path(), "out", &["--epochs", "1"]);
    let put = |name: &str, dataset: &Dataset| {
        std::fs::write(folder.path().join(name), dataset.to_bytes().expect("a dataset")).expect("a file");
    };
    let mut changed = dataset(150, 0.3);
    changed.origin.vehicle = "another".to_owned();
    put("validation", &changed);
    let told = refusal(&words);
    assert!(told.contains("vehicle: expected that of the training data, test, found another"), "{told}");
    let mut changed = dataset(400, 0.0);
    changed.examples.iter_mut().for_each(|example| example.measured[3] = 0.01);
    put("train", &changed);
    let told = refusal(&words);
    assert!(told.contains("pitch: expected measurements in at least two bins, found all 400"), "{told}");
    std::fs::write(folder.path().join("train"), "nothing").expect("a file");
    let told = refusal(&words);
    assert!(told.contains("train: "), "{told}");
    assert!(!folder.path().join("out/weights.safetensors").exists());
}
