//! `surefoot collect --teleop-random`, `train kinodynamics` and `bench kinodynamics`: small ones that end with files, and
//! what is refused.

#![allow(clippy::expect_used, reason = "helpers of tests may fail as tests do")]

use std::path::Path;

use assert_cmd::Command;
use serde_json::Value;

fn surefoot(words: &[&str], folder: &Path) -> (i32, String, String) {
    let mut command = Command::cargo_bin("surefoot").expect("the binary is built with its tests");
    let output = command.args(words).current_dir(folder).output().expect("it runs");
    let text = |bytes: Vec<u8>| String::from_utf8_lossy(&bytes).into_owned();
    (output.status.code().unwrap_or(-1), text(output.stdout), text(output.stderr))
}

fn json(path: &Path) -> Value {
    serde_json::from_slice(&std::fs::read(path).expect("it was written")).expect("it is JSON")
}

#[test]
fn random_driving_is_recorded_and_learned_from() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    let (code, told, _) =
        surefoot(&["collect", "--teleop-random", "--minutes", "2", "--out", "drive.safetensors"], here);
    assert!(code == 0 && told.contains("2400 commands and 24000 samples"), "{told}");
    let train =
        ["train", "kinodynamics", "--train", "drive.safetensors", "--epochs", "2", "--out", "weights"];
    let (code, told, failed) = surefoot(&[&train[..], &["--sensing", "blind"]].concat(), here);
    assert!(code == 0, "{failed}");
    assert!(told.contains("of 2400 commands"), "{told}");
    let written = json(&here.join("weights/kinodynamics_training.json"));
    let counts = &written["counts"];
    let sum: u64 = ["no_samples", "slow", "other_sign", "oversteer", "different", "kept"]
        .iter()
        .map(|name| counts[name].as_u64().expect("a count"))
        .sum();
    assert_eq!(sum, 2400);
    // The description's transport delay of 30 ms and response of 50 ms, and the car's own.
    let latency_s = written["latency"]["seconds"].as_f64().expect("a number");
    assert!((0.08..0.18).contains(&latency_s), "{latency_s}");
    let sidecar = json(&here.join("weights/kinodynamics.json"));
    assert_eq!((&sidecar["vehicle"]["name"], &sidecar["format"]), (&"ut_automata".into(), &3.into()));
    what_was_learned_corrects_a_drive(here);
}

fn what_was_learned_corrects_a_drive(here: &Path) {
    let drive = ["drive", "--method", "physics", "--time-limit", "3", "--threads", "1", "--vehicle"];
    let correct = ["--correct", "kinodynamics", "--kinodynamics-weights", "weights"];
    let run = |vehicle: &str, words: &[&str]| surefoot(&[&drive[..], &[vehicle], words].concat(), here);
    let (code, told, failed) = run("ut_automata", &correct);
    assert!(code == 1 && failed.contains("time limit passed"), "{failed}");
    let counts = &json(&here.join("surefoot-out/summary.json"))["correction"];
    let count = |name: &str| counts[name].as_u64().expect("a count");
    assert!(count("commands") > 10 && count("corrected") + count("bounded") > 0, "{counts}");
    assert!(told.contains(" commands, ") && told.contains("correction"), "{told}");
    let (code, _, failed) = run("rc_car", &correct);
    assert!(code == 2 && failed.contains("vehicle of the inverse model: expected"), "{failed}");
    let (code, _, failed) = run("ut_automata", &correct[..2]);
    assert!(code == 2 && failed.contains("--kinodynamics-weights"), "{failed}");
    let (code, _, failed) =
        run("ut_automata", &["--correct", "kinodynamics", "--kinodynamics-weights", "none"]);
    assert!(code == 2 && failed.contains("kinodynamics.safetensors: expected a readable file"), "{failed}");
}

#[test]
fn what_teaches_nothing_is_refused_with_what_was_found() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    let collect = ["collect", "--teleop-random", "--minutes", "1", "--out", "drive.safetensors", "--surface"];
    let (code, _, _) = surefoot(&[&collect[..], &["grass"]].concat(), here);
    assert_eq!(code, 0);
    let train = ["train", "kinodynamics", "--epochs", "1", "--train"];
    let (code, _, failed) = surefoot(&[&train[..], &["drive.safetensors"]].concat(), here);
    assert!(code == 2 && failed.trim_end().ends_with("found grass alone"), "{failed}");
    let (code, _, failed) = surefoot(&[&collect[..], &["ice"]].concat(), here);
    assert!(
        code == 2 && failed.contains("expected one of cement, dirt, grass, leaves, found ice"),
        "{failed}"
    );
    std::fs::write(here.join("cut.safetensors"), b"abc").unwrap();
    let (code, _, failed) = surefoot(&[&train[..], &["cut.safetensors"]].concat(), here);
    assert!(
        code == 2 && failed.contains("cut.safetensors: recording: expected safetensors of 3 bytes"),
        "{failed}"
    );
    let (code, _, _) = surefoot(&["collect", "--teleop-random", "--world", "rocks"], here);
    assert_eq!(code, 2);
}

#[test]
fn benchmark_drives_the_same_laps_for_any_number_of_threads() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    let run = |threads: &str| {
        let words =
            ["bench", "kinodynamics", "--rows", "paper", "--minutes", "2", "--epochs", "1", "--laps", "1"];
        let (code, told, failed) =
            surefoot(&[&words[..], &["--threads", threads, "--out", "out"]].concat(), here);
        assert!(code == 0 && told.contains("holds  baseline: failures rise with speed"), "{told}{failed}");
        json(&here.join("out/kinodynamics.json"))
    };
    let (one, two) = (run("1"), run("2"));
    for part in ["outdoor", "indoor", "probe", "grounds", "verdicts"] {
        assert_eq!(one[part], two[part], "{part}");
    }
    assert_eq!(one["outdoor"]["rows"][0]["n"], 80);
    for name in ["kinodynamics_outdoor.png", "kinodynamics_indoor.png", "kinodynamics.html"] {
        assert!(std::fs::metadata(here.join("out").join(name)).unwrap().len() > 10_000, "{name}");
    }
}
