//! The benchmarks answer on the command line with the numbers that were asked for.

#![allow(clippy::expect_used, reason = "helpers of tests may fail as tests do")]

use std::path::Path;
use std::process::Output;

use assert_cmd::Command;
use serde_json::Value;

fn surefoot(words: &[&str]) -> Output {
    let mut command = Command::cargo_bin("surefoot").expect("the binary is built with its tests");
    command.args(words).output().expect("the binary starts")
}

#[test]
fn control_prints_and_writes_the_same_report() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("new/control.json");
    let file = path.to_str().expect("UTF-8");
    let output = surefoot(&[
        "bench",
        "control",
        "--threads",
        "1",
        "--updates",
        "3",
        "--isa",
        "portable",
        "--json",
        file,
    ]);
    assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
    let printed: Value = serde_json::from_slice(&output.stdout).expect("JSON");
    let written: Value = serde_json::from_slice(&std::fs::read(&path).expect("the file")).expect("JSON");
    assert_eq!(printed, written);
    assert_eq!((&printed["threads"], &printed["updates"]), (&1.into(), &3.into()));
    assert_eq!((&printed["config"], &printed["isa"]), (&"bound".into(), &"portable".into()));
    for part in [&printed["ms"]["min"], &printed["ms"]["median"], &printed["ms"]["p99"]] {
        assert!(part.as_f64().is_some_and(|ms| ms > 0.0), "{printed}");
    }
    for part in ["rollout", "update"] {
        assert!(printed["split_ms"][part].as_f64().is_some_and(|ms| ms > 0.0), "{part} in {printed}");
    }
}

#[test]
fn prior_map_reports_whole_and_changed_maps() {
    let output = surefoot(&["bench", "prior-map", "--threads", "1", "--updates", "1", "--isa", "portable"]);
    assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
    let printed: Value = serde_json::from_slice(&output.stdout).expect("JSON");
    assert_eq!((&printed["poses"], &printed["isa"]), (&(81 * 96 * 13).into(), &"portable".into()));
    for part in ["full", "changed"] {
        assert!(printed["ms"][part]["median"].as_f64().is_some_and(|ms| ms > 0.0), "{part} in {printed}");
    }
}

#[test]
fn plant_writes_its_curves_and_labels() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let out = folder.path().join("out");
    let words = ["bench", "plant", "--vehicle", "rc_car", "--out", out.to_str().expect("UTF-8")];
    let output = surefoot(&words);
    assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
    let told = String::from_utf8_lossy(&output.stdout);
    assert!(told.contains("rc_car") && told.contains("times real time"), "{told}");
    let written: Value =
        serde_json::from_slice(&std::fs::read(out.join("plant.json")).expect("the file")).expect("JSON");
    // Up to 10 degrees: at 15 m/s that is 2.6 m/s of sliding, short of where asphalt's friction falls.
    let rows = written["cornering"].as_array().expect("rows").iter();
    for row in rows.filter(|row| row["angle_deg"].as_f64().is_some_and(|angle_deg| angle_deg <= 10.0)) {
        let expected = row["closed_form"].as_f64().expect("a number");
        for found in row["plant"].as_array().expect("one of each speed") {
            assert!((found.as_f64().expect("a number") - expected).abs() < 0.03, "{row}");
        }
    }
    assert!(written["times_real_time"].as_f64().is_some_and(|times| times > 0.0));
    assert!(std::fs::read(out.join("plant.png")).expect("the picture").starts_with(b"\x89PNG"));

    let refused = surefoot(&["bench", "plant", "--vehicle", "no_such_machine"]);
    assert_eq!(refused.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&refused.stderr).contains("no_such_machine"));
}

#[test]
fn scaling_writes_curves_and_picture() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let out = folder.path().join("out");
    let mut words = vec!["bench", "scaling", "--over", "steps,threads", "--threads", "2", "--updates", "1"];
    words.extend(["--maps", "1", "--out", out.to_str().expect("UTF-8")]);
    let output = surefoot(&words);
    assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
    let told = String::from_utf8_lossy(&output.stdout);
    assert!(told.contains("steps of the horizon") && told.contains("judged anew"), "{told}");
    let written: Value =
        serde_json::from_slice(&std::fs::read(out.join("scaling.json")).expect("the file")).expect("JSON");
    assert_eq!((&written["threads"], &written["maps"]), (&2.into(), &1.into()));
    let values = |curve: usize| -> Vec<f64> {
        let points = written["curves"][curve]["points"].as_array().expect("points").iter();
        points.map(|point| point["value"].as_f64().expect("a number")).collect()
    };
    for (curve, over) in ["steps", "controller_threads", "map_threads"].into_iter().enumerate() {
        assert_eq!(written["curves"][curve]["over"], over, "{written}");
    }
    assert_eq!(values(0), [10.0, 25.0, 50.0, 75.0, 100.0, 150.0]);
    assert_eq!((values(1), values(2)), (vec![1.0, 2.0], vec![1.0, 2.0]));
    assert_eq!(written["curves"][2]["points"][0]["judged_share"], 1.0);
    assert!(std::fs::read(out.join("scaling.png")).expect("the picture").starts_with(b"\x89PNG"));

    let refused = surefoot(&["bench", "scaling", "--over", "height"]);
    assert_eq!(refused.status.code(), Some(2));
    let told = String::from_utf8_lossy(&refused.stderr);
    assert!(told.contains("height") && told.contains("rollouts"), "{told}");
}

/// A benchmark of two methods over two pairs for one second, into a folder.
fn navigation(out: &Path, more: &[&str]) -> Output {
    let mut words =
        vec!["bench", "navigation", "--methods", "physics,nominal", "--alpha", "0.4", "--maps", "1"];
    words.extend(["--pairs", "2", "--isa", "portable"]);
    if !more.contains(&"--time-limit") {
        words.extend(["--time-limit", "1"]);
    }
    words.extend(["--out", out.to_str().expect("UTF-8")]);
    surefoot(&[words.as_slice(), more].concat())
}

fn merged(folders: &[&Path], out: &Path) -> Output {
    let folders: Vec<&str> = folders.iter().map(|folder| folder.to_str().expect("UTF-8")).collect();
    let words = ["bench", "navigation", "--merge", &folders.join(","), "--out", out.to_str().expect("UTF-8")];
    surefoot(&words)
}

fn read(out: &Path, name: &str) -> Vec<u8> {
    std::fs::read(out.join(name)).expect("a result")
}

#[test]
fn navigation_writes_table_page_and_picture() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let (out, copy) = (folder.path().join("out"), folder.path().join("copy.json"));
    let output = navigation(&out, &["--threads", "1", "--json", copy.to_str().expect("UTF-8")]);
    assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
    assert!(output.stderr.is_empty(), "no bar without a terminal");
    let told = String::from_utf8_lossy(&output.stdout);
    for part in ["0 of 2", "core-seconds a drive", "pair 2   time limit passed after 1.0 s"] {
        assert!(told.contains(part), "{part} in {told}");
    }

    let bytes = read(&out, "navigation.json");
    assert_eq!(bytes, std::fs::read(&copy).expect("the copy"));
    let table: Value = serde_json::from_slice(&bytes).expect("JSON");
    let (row, drive) = (&table["rows"][0], &table["drives"][0]);
    assert_eq!((&table["n_pairs"], &table["isa"], &row["n"]), (&2.into(), &"portable".into(), &2.into()));
    assert_eq!((&row["outcomes"]["timeout"], &row["median_time_to_goal_s"]), (&2.into(), &Value::Null));
    // z^2 / (n + z^2) with z = 1.96 and n = 2.
    assert!((row["wilson_high"].as_f64().expect("a number") - 0.6576).abs() < 1e-4, "{row}");
    assert_eq!((&drive["method"], &drive["alpha"]), (&"physics".into(), &0.4.into()));
    assert!(drive["failed_at_m"][1].is_number() && table["revision"].is_string(), "{table}");
    assert_eq!(&read(&out, "navigation.png")[..8], b"\x89PNG\r\n\x1a\n");
    let page = String::from_utf8(read(&out, "navigation.html")).expect("a page");
    assert!(page.contains("physics") && page.contains("data:image/png;base64,") && !page.contains("http"));
}

#[test]
fn a_drive_of_the_benchmark_is_driven_again() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let [table, again] = ["table", "again"].map(|name| folder.path().join(name));
    navigation(&table, &["--time-limit", "4"]);
    let words =
        ["drive", "--world", "navigation:1,2", "--method", "physics", "--alpha", "0.4", "--isa", "portable"];
    let to = ["--time-limit", "4", "--out", again.to_str().expect("UTF-8")];
    assert_eq!(surefoot(&[words.as_slice(), &to].concat()).status.code(), Some(1), "no goal in 4 s");
    let json = |out: &Path, name: &str| serde_json::from_slice::<Value>(&read(out, name)).expect("JSON");
    let (drive, summary) = (&json(&table, "navigation.json")["drives"][1], json(&again, "summary.json"));
    assert_eq!((&drive["method"], &drive["pair"]), (&"physics".into(), &1.into()));
    assert!(drive["path_length_m"].as_f64() > Some(1.0), "{drive}");
    for key in ["path_length_m", "distance_to_goal_m", "largest_roll_deg", "largest_pitch_deg"] {
        assert_eq!(drive[key], summary[key], "{key}");
    }
}

#[test]
fn navigation_goes_on_where_it_was_broken_off_and_parts_make_the_same_table() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let [whole, one, two, table] = ["whole", "one", "two", "table"].map(|name| folder.path().join(name));
    let code = |output: Output| {
        assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
    };
    code(navigation(&whole, &[]));
    code(navigation(&one, &["--shard", "1/2", "--threads", "1"]));
    code(navigation(&two, &["--shard", "2/2"]));
    code(merged(&[&two, &one], &table));
    for name in ["navigation.json", "navigation.png", "navigation.html"] {
        assert!(read(&table, name) == read(&whole, name), "{name}");
    }

    // Torn within the second drive, as by a kill.
    let journal = read(&whole, "navigation.jsonl");
    let ends: Vec<usize> = (0..journal.len()).filter(|&place| journal[place] == b'\n').collect();
    assert_eq!(ends.len(), 5, "the plan and four drives");
    std::fs::write(whole.join("navigation.jsonl"), &journal[..ends[1] + 20]).expect("a torn journal");
    code(navigation(&whole, &["--resume"]));
    assert!(read(&whole, "navigation.json") == read(&table, "navigation.json"));
    assert_eq!(read(&whole, "navigation.jsonl").iter().filter(|&&byte| byte == b'\n').count(), 5);
    // All is done: nothing is driven, and the table is the same.
    let again = navigation(&whole, &["--resume"]);
    assert!(!String::from_utf8_lossy(&again.stdout).contains("core-seconds"));
    assert!(read(&whole, "navigation.json") == read(&table, "navigation.json"));

    for (output, part) in [
        (
            navigation(&whole, &["--resume", "--seed", "2"]),
            "navigation.jsonl: expected drives with seed 2, found 1; they do not go together",
        ),
        (merged(&[folder.path()], &table), "navigation.jsonl: expected a journal of drives, found none"),
    ] {
        let told = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{told}");
        assert!(told.contains(part) && told.lines().count() == 1, "{told}");
    }
    let other = String::from_utf8(journal).expect("UTF-8").replace("\"time_s\":1", "\"time_s\":2");
    std::fs::write(one.join("navigation.jsonl"), other).expect("a journal of another course");
    let output = merged(&[&two, &one], &table);
    let told = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(1), "{told}");
    assert!(told.contains("one/navigation.jsonl: another folder has another end of physics"), "{told}");
}

/// The drives that a page's tables are made of lie beside the page: a row that they do not say is not published.
#[test]
fn published_tables_are_those_of_the_drives_beside_the_page() {
    let docs = Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs");
    let page = std::fs::read_to_string(docs.join("navigation.md")).expect("the page");
    // Six methods at three alphas and two that know none; at one alpha, in MuJoCo; one and two planners; two of them mended.
    let tables = [("", 20), ("mujoco", 8), ("peers", 3), ("mended", 2)];
    for (drives, n_rows) in tables.map(|(drives, n_rows)| (format!("navigation/{drives}"), n_rows)) {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let output = merged(&[&docs.join(&drives)], folder.path());
        assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
        let table: Value = serde_json::from_slice(&read(folder.path(), "navigation.json")).expect("JSON");
        let rows = table["rows"].as_array().expect("rows");
        assert_eq!(rows.len(), n_rows, "{drives}");
        for line in rows.iter().map(row_of_page) {
            assert!(page.contains(&line), "expected in docs/navigation.md, as {drives} says: {line}");
        }
    }
}

fn row_of_page(row: &Value) -> String {
    let number = |key: &str| row[key].as_f64().expect("a number");
    let method = row["method"].as_str().expect("a name");
    let alpha = row["alpha"].as_f64().map_or("any".to_owned(), |alpha| alpha.to_string());
    let [low, high] = ["wilson_low", "wilson_high"].map(|end| 100.0 * number(end));
    let [n_goal, n] = ["n_goal", "n"].map(|key| &row[key]);
    let time_s = number("median_time_to_goal_s");
    format!("| `{method}` | {alpha} | {n_goal} of {n} [{low:.0}, {high:.0} %] | {time_s:.1} |")
}

#[test]
fn navigation_is_driven_by_another_machine_at_another_speed_over_other_ground() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let out = folder.path().join("out");
    let output = navigation(&out, &["--vehicle", "buggy_fifth", "--speed", "3", "--ground", "fast"]);
    assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
    let table: Value = serde_json::from_slice(&read(&out, "navigation.json")).expect("JSON");
    assert_eq!((&table["vehicle"], &table["speed_mps"]), (&"buggy_fifth".into(), &3.0.into()), "{table}");
    // Boulders of the full-size field are at least 1 m high, and the buggy has a quarter of that machine's length.
    assert_eq!(table["field"]["boulders"]["height_m"][0], 0.25, "{table}");
    assert_eq!(table["drives"][0]["longest_flight_s"], 0.0, "{table}");
    for (words, part) in [
        (["--speed", "0"], "--speed: expected a speed above 0 and up to 50 m/s, found \"0\""),
        (["--speed", "nan"], "--speed: expected a speed above 0 and up to 50 m/s, found \"nan\""),
        (["--vehicle", "nobody"], "nobody"),
        (["--ground", "sand"], "--ground: expected rocks, fast, found \"sand\""),
    ] {
        let output = navigation(&folder.path().join("none"), &words);
        let told = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{told}");
        assert!(told.contains(part) && told.lines().count() == 1, "{told}");
    }
}

#[test]
fn slippery_courses_write_table_and_picture_and_refuse_what_cannot_be_driven() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let out = folder.path().join("out");
    let mut words = vec!["bench", "slippery", "--courses", "1", "--seed", "1000", "--threads", "1"];
    words.extend(["--time-limit", "1", "--isa", "portable", "--out", out.to_str().expect("UTF-8")]);
    let output = surefoot(&words);
    assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
    let told = String::from_utf8_lossy(&output.stdout);
    assert!(told.contains("cells") && told.contains("time limit passed after 1.0 s"), "{told}");
    let table: Value =
        serde_json::from_slice(&std::fs::read(out.join("slippery.json")).expect("the table")).expect("JSON");
    let rows: Vec<_> = ["nothing", "least", "cells"].iter().map(|told| serde_json::json!(told)).collect();
    let found: Vec<_> = (0..3).map(|row| table["rows"][row]["told"].clone()).collect();
    assert_eq!(found, rows);
    assert!(std::fs::read(out.join("slippery.png")).expect("the picture").starts_with(b"\x89PNG"));
    for (words, part) in [
        (["--courses", "0"], "--courses: expected a number of courses from 1 to 1000, found \"0\""),
        (["--speed", "fast"], "--speed: expected a speed from 0.5 to 15 m/s, found fast"),
        (["--speed", "nan"], "--speed: expected a speed from 0.5 to 15 m/s, found nan"),
    ] {
        let output = surefoot(&[["bench", "slippery"].as_slice(), &words].concat());
        let told = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{told}");
        assert!(told.contains(part) && told.lines().count() == 1, "{told}");
    }
}

#[test]
fn crossings_write_table_and_picture_and_refuse_what_cannot_be_driven() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let out = folder.path().join("out");
    let mut words = vec!["bench", "crossings", "--runs", "1", "--seed", "1000", "--threads", "1"];
    words.extend(["--time-limit", "1", "--isa", "portable", "--out", out.to_str().expect("UTF-8")]);
    let output = surefoot(&words);
    assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
    let told = String::from_utf8_lossy(&output.stdout);
    assert!(told.contains("tracked") && told.contains("time limit passed after 1.0 s"), "{told}");
    let table: Value =
        serde_json::from_slice(&std::fs::read(out.join("crossings.json")).expect("the table")).expect("JSON");
    for (row, handling) in ["tracked", "mapped"].into_iter().enumerate() {
        let row = &table["rows"][row];
        assert_eq!((&row["handling"], &row["n_other"]), (&handling.into(), &1.into()), "{table}");
    }
    let moment = &table["runs"][0]["trail"][0];
    assert_eq!(moment["walkers_m"].as_array().map(Vec::len), Some(2), "{moment}");
    assert!(std::fs::read(out.join("crossings.png")).expect("the picture").starts_with(b"\x89PNG"));
    for (words, part) in [
        (["--runs", "0"], "--runs: expected a number of runs from 1 to 1000, found \"0\""),
        (["--walkers", "17"], "--walkers: expected a number of walkers from 1 to 16, found \"17\""),
        (["--handling", "luck"], "--handling: expected tracked, mapped, found \"luck\""),
        (["--out", "/dev/null"], "--out: "),
    ] {
        let output = surefoot(&[["bench", "crossings"].as_slice(), &words].concat());
        let told = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{told}");
        assert!(told.contains(part) && told.lines().count() == 1, "{told}");
    }
}

#[test]
fn risk_writes_table_and_picture_and_refuses_what_cannot_be_driven() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let out = folder.path().join("out");
    let mut words =
        vec!["bench", "risk", "--densities", "0,1", "--alpha", "0.6", "--runs", "2", "--seed", "1001"];
    words.extend(["--threads", "1", "--isa", "portable", "--out", out.to_str().expect("UTF-8")]);
    let output = surefoot(&words);
    assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
    assert!(output.stderr.is_empty(), "no bar without a terminal");
    let told = String::from_utf8_lossy(&output.stdout);
    assert!(told.contains("seeds 1001 to 1002") && told.contains("22.5 (11.8)"), "{told}");
    let table: Value =
        serde_json::from_slice(&std::fs::read(out.join("risk.json")).expect("the table")).expect("JSON");
    assert!(table["revision"].is_string() && table["isa"] == "portable", "{table}");
    let [dirt, bushes] = [0, 1].map(|cell| &table["cells"][cell]);
    // Nothing is published of bare dirt, and nothing stops anybody there.
    assert_eq!((&dirt["density"], &dirt["published"]), (&0.0.into(), &Value::Null));
    for method in ["whole_bin", "exact"] {
        assert_eq!((&dirt[method]["n_hit"], &dirt[method]["n"]), (&2.into(), &2.into()), "{dirt}");
        assert_eq!(bushes[method]["times_to_goal_s"].as_array().map(Vec::len), Some(2), "{bushes}");
    }
    assert_eq!((&bushes["alpha"], &bushes["published"]["n_hit"]), (&0.6.into(), &45.into()));
    assert!(std::fs::read(out.join("risk.png")).expect("the picture").starts_with(b"\x89PNG"));
    for (words, part) in [
        (["--runs", "0"], "--runs: expected a number of runs from 1 to 1000, found \"0\""),
        (["--densities", "0.4,1.1"], "--densities: expected a number from 0 to 1, found \"1.1\""),
        (["--alpha", "0"], "--alpha: expected a number above 0 and at most 1, found \"0\""),
        (["--out", "/dev/null"], "--out: "),
    ] {
        let output = surefoot(&[["bench", "risk"].as_slice(), &words].concat());
        let told = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{told}");
        assert!(told.contains(part) && told.lines().count() == 1, "{told}");
    }
}

#[test]
fn correction_writes_table_and_picture_and_refuses_what_cannot_be_driven() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let out = folder.path().join("out");
    let mut words = vec!["bench", "correction", "--methods", "plain,adapted,plain", "--runs", "1"];
    words.extend(["--seed", "1001", "--out", out.to_str().expect("UTF-8")]);
    let output = surefoot(&words);
    assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
    assert!(output.stderr.is_empty(), "no bar without a terminal");
    let told = String::from_utf8_lossy(&output.stdout);
    assert!(told.contains("adapted model") && told.contains("leaves"), "{told}");
    let table: Value =
        serde_json::from_slice(&std::fs::read(out.join("correction.json")).expect("the table"))
            .expect("JSON");
    assert!(table["revision"].is_string(), "{table}");
    let slow = &table["speeds"][0]["rows"];
    assert_eq!(slow.as_array().map(Vec::len), Some(2), "named twice, driven once: {slow}");
    assert_eq!(slow[0]["less_plain"], Value::Null);
    assert_eq!(slow[1]["less_plain"]["n"], 1, "{slow}");
    assert_eq!(slow[1]["runs"][0]["strengths"].as_array().map(Vec::len), Some(3), "{slow}");
    assert!(std::fs::read(out.join("correction.png")).expect("the picture").starts_with(b"\x89PNG"));
    for (words, part) in [
        (["--runs", "0"], "--runs: expected a number of trials from 1 to 1000, found \"0\""),
        (
            ["--methods", "luck"],
            "--methods: expected plain, corrected-blind, corrected, adapted, found \"luck\"",
        ),
        (["--out", "/dev/null"], "--out: "),
    ] {
        let output = surefoot(&[["bench", "correction"].as_slice(), &words].concat());
        let told = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{told}");
        assert!(told.contains(part) && told.lines().count() == 1, "{told}");
    }
}

#[test]
fn navigation_refuses_what_cannot_be_driven() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let settings = |name: &str, text: &str| {
        let file = folder.path().join(name);
        std::fs::write(&file, text).expect("written");
        file.to_str().expect("UTF-8").to_owned()
    };
    let (unknown, slow) = (settings("a.toml", "[speed]\nx = 1"), settings("b.toml", "attitude_share = 2.0"));
    for (words, part) in [
        (["--config", &unknown], "a.toml:2: speed.x: expected"),
        (["--config", &slow], "attitude_share: expected a number in (0, 1], found 2"),
        (["--pairs", "0"], "--pairs: expected a number of pairs from 1 to 1000, found \"0\""),
        (["--maps", "1001"], "--maps: expected a number of maps from 1 to 1000, found \"1001\""),
        (
            ["--shard", "3/2"],
            "--shard: expected I/N, the I-th of N parts, 1 <= I <= N <= 10000, found \"3/2\"",
        ),
        (["--field", "/dev/null/none"], "/dev/null/none: "),
        (["--alpha", "0.4,2"], "--alpha: expected a number above 0 and at most 1, found \"2\""),
        (
            ["--methods", "physics,luck"],
            "--methods: expected pietra, pietra-avoid, evora, physics-informed, vanilla, physics, nominal, truth, found \"luck\"",
        ),
        (["--out", "/dev/null"], "--out: "),
    ] {
        let output = surefoot(&[["bench", "navigation"].as_slice(), &words].concat());
        let told = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{told}");
        assert!(told.contains(part) && told.lines().count() == 1, "{told}");
    }
}

#[test]
fn arena_writes_table_page_and_picture_and_refuses_what_cannot_be_driven() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let out = folder.path().join("out");
    let words = ["bench", "arena", "--runs", "1", "--methods", "physics,nominal", "--time-limit", "1"];
    let output = surefoot(&[&words[..], &["--out", out.to_str().expect("UTF-8")]].concat());
    assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
    let told = String::from_utf8_lossy(&output.stdout);
    assert!(told.contains("1 time limit passed") && told.contains("FAILS"), "{told}");
    let table: Value = serde_json::from_slice(&read(&out, "arena.json")).expect("JSON");
    assert_eq!((table["rows"].as_array().map(Vec::len), &table["training"]), (Some(4), &Value::Null));
    let (one, other) = (&table["runs"][0], &table["runs"][1]);
    assert_eq!((&one["method"], &other["method"]), (&"physics".into(), &"nominal".into()));
    assert_eq!((&one["bush_height_m"], &one["path_m"][0]), (&other["bush_height_m"], &other["path_m"][0]));
    assert!(table["runs"][2]["bush_height_m"].as_f64() > one["bush_height_m"].as_f64(), "{table}");
    assert!(read(&out, "arena.png").starts_with(b"\x89PNG"));
    let page = String::from_utf8(read(&out, "arena.html")).expect("a page");
    assert!(page.contains("nominal") && page.contains("data:image/png;base64,"));

    for (words, part) in [
        (["--runs", "0"], "runs"),
        (["--alpha", "2"], "alpha"),
        (["--methods", "physics,physics"], "--methods: expected each method once, found physics again"),
    ] {
        let output = surefoot(&[["bench", "arena"].as_slice(), &words].concat());
        let told = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{told}");
        assert!(told.contains(part), "{told}");
    }
}
