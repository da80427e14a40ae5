//! `surefoot drive` on networks from a folder: what it drives on, what it says of it, and what it refuses.

#![allow(clippy::unwrap_used, reason = "a panic is how a test fails")]

use std::path::Path;
use std::process::{Command, Output};

use bench::closed_loop::Method;
use bench::learned_map::{Sizes, untrained};
use cli::summary::Summary;
use evidential::Checkpoint;
use formats::read_vehicle;

/// Untrained networks of the small car, as training leaves them.
fn write_networks(folder: &Path, change: impl FnOnce(&mut Checkpoint)) {
    let geometry = read_vehicle("rc_car").unwrap().geometry;
    let sizes = Sizes { encoder_hidden: vec![8], n_latent: 4, ..Sizes::default() };
    let mut checkpoint = untrained(&geometry, "rc_car", &sizes, 1).unwrap();
    change(&mut checkpoint);
    std::fs::write(folder.join("weights.safetensors"), checkpoint.weights_bytes().unwrap()).unwrap();
    std::fs::write(folder.join("weights.json"), checkpoint.sidecar_bytes().unwrap()).unwrap();
}

fn drive(folder: &Path, words: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_surefoot"));
    command.args(["drive", "--world", "arena", "--time-limit", "1", "--threads", "1", "--weights"]);
    command.arg(folder).arg("--out").arg(folder.join("out")).args(words).output().unwrap()
}

fn summary(folder: &Path) -> Summary {
    serde_json::from_slice(&std::fs::read(folder.join("out/summary.json")).unwrap()).unwrap()
}

#[test]
fn networks_from_a_folder_are_driven_on_by_their_method_or_one_that_shares_them() {
    let folder = tempfile::tempdir().unwrap();
    write_networks(folder.path(), |_| {});
    for (words, method) in [(&[][..], Method::Pietra), (&["--method", "pietra-avoid"], Method::PietraAvoid)] {
        let output = drive(folder.path(), words);
        assert_eq!(output.status.code(), Some(1), "a second is too short: {output:?}");
        let summary = summary(folder.path());
        assert_eq!(summary.method, method);
        assert!(summary.cycles >= 9);
        assert!((0.0..=1.0).contains(&summary.unfamiliar_share.unwrap()));
        let told = String::from_utf8(output.stdout).unwrap();
        assert!(told.contains(method.name()) && told.contains("unlike the training data"), "{told}");
    }
}

#[test]
fn ground_unlike_the_training_data_is_counted() {
    let folder = tempfile::tempdir().unwrap();
    write_networks(folder.path(), |checkpoint| checkpoint.sidecar.density.as_mut().unwrap().min = -1e9);
    drive(folder.path(), &[]);
    assert_eq!(summary(folder.path()).unfamiliar_share, Some(0.0));
    write_networks(folder.path(), |checkpoint| {
        let density = checkpoint.sidecar.density.as_mut().unwrap();
        (density.min, density.max) = (1e9, 2e9);
    });
    // On the true map no footprint hangs over the unknown, which is the physics prior's and never unfamiliar.
    drive(folder.path(), &["--oracle-map"]);
    let share = summary(folder.path()).unfamiliar_share.unwrap();
    assert!(share > 0.9, "{share}");
}

/// Exit code 2 and one line that holds every part.
fn assert_refused(output: &Output, parts: &[&str]) {
    let told = String::from_utf8(output.stderr.clone()).unwrap();
    assert_eq!(output.status.code(), Some(2), "{told}");
    assert_eq!(told.lines().count(), 1, "{told}");
    assert!(parts.iter().all(|part| told.contains(part)), "{parts:?} in {told}");
}

#[test]
fn networks_that_do_not_fit_are_refused_with_what_was_expected_and_found() {
    let folder = tempfile::tempdir().unwrap();
    assert_refused(&drive(folder.path(), &[]), &["--weights", "weights.safetensors"]);
    write_networks(folder.path(), |_| {});
    let other = ["--vehicle", "buggy_fifth", "--method", "pietra"];
    assert_refused(&drive(folder.path(), &other), &["rc_car", "wheelbase_m", "expected", "found"]);
    assert_refused(&drive(folder.path(), &["--method", "evora"]), &["expected", "evora", "found pietra"]);
    assert_refused(&drive(folder.path(), &["--method", "physics"]), &["expected", "found pietra"]);
    let weights = folder.path().join("weights.safetensors");
    let whole = std::fs::read(&weights).unwrap();
    std::fs::write(&weights, &whole[..whole.len() / 2]).unwrap();
    assert_refused(&drive(folder.path(), &[]), &["--weights", "expected"]);
    assert!(!folder.path().join("out").exists(), "nothing is left behind");
}
