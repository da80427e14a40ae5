//! `surefoot gap diagnose` and `apply` from the outside: a case whose cause is known, what is written, and what is
//! refused.

#![allow(clippy::unwrap_used, reason = "a panic is how a test fails")]

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};
use std::sync::LazyLock;

use bicycle::{Column, DriveLog};
use formats::{DriveLogFile, GapGround, GapNoise, GapVehicle};
use scenarios::{Deviation, Style, TestMachine, World, test_drive};
use sim_to_real::{Answer, Division};
use terrain::TerrainClass;

/// By this the servo of the robot answers later than that of its simulator [s].
const LATE_S: f64 = 0.35;

/// A machine on its hills, nominal drives of the rigid-body plant, and drives of it with a late servo, as files.
static DRIVES: LazyLock<tempfile::TempDir> = LazyLock::new(|| {
    let folder = tempfile::tempdir().unwrap();
    let machine = TestMachine::draw(&formats::read_vehicle("sedan").unwrap(), "machine", 4).unwrap();
    formats::write_gap_vehicle(folder.path(), &described(&machine)).unwrap();
    let late = [Deviation::SteeringResponse { added_s: LATE_S }];
    let drives: [(&str, &[Deviation]); 5] = [
        ("sim_1.csv", &[]),
        ("sim_2.csv", &[]),
        ("real_train_1.csv", &late),
        ("real_heldout.csv", &late),
        ("real_sound.csv", &[]),
    ];
    for (seed, (file, deviations)) in drives.into_iter().enumerate() {
        let log = test_drive(&machine, deviations, Style::Rich, seed as u64).unwrap();
        let file = folder.path().join(file);
        formats::write_drive_log_csv(&file, &DriveLogFile { log, other_columns: Vec::new() }).unwrap();
    }
    folder
});

/// What the owner of the simulator would say of the machine.
fn described(machine: &TestMachine) -> GapVehicle {
    let sensors = &machine.sensors;
    GapVehicle {
        name: machine.vehicle.name.clone(),
        wheelbase_m: machine.vehicle.geometry.wheelbase_m,
        steering_max_rad: Some(machine.steering_max_rad),
        speed_max_mps: Some(machine.speeds_mps[1]),
        noise: GapNoise {
            x: Some(sensors.position_noise_m),
            y: Some(sensors.position_noise_m),
            yaw: Some(sensors.attitude_noise_rad),
            vx: Some(sensors.velocity_noise_mps),
            wz: Some(sensors.yaw_rate_noise_radps),
        },
        ground: Some(ground(&machine.world)),
    }
}

/// The hills with a node at every cell's centre, columns of the world as rows.
fn ground(world: &World) -> GapGround {
    let geometry = *world.geometry();
    let [n_east, n_north] = [geometry.n_cols, geometry.n_rows];
    let cells: Vec<usize> = (0..n_east * n_north).map(|k| k % n_north * n_east + k / n_north).collect();
    let class = |cell: &usize| match world.patches.values()[*cell].class {
        TerrainClass::Open | TerrainClass::Obstacle => 0,
        TerrainClass::Loose => 1,
        TerrainClass::Vegetation => 2,
    };
    GapGround {
        origin_m: geometry.centre_m(geometry.cell(0)),
        resolution_m: geometry.resolution_m,
        n_nodes: [n_east, n_north],
        height_m: cells.iter().map(|&cell| world.heights.values()[cell]).collect(),
        class: cells.iter().map(class).collect(),
    }
}

fn drive(file: &str) -> String {
    DRIVES.path().join(file).to_str().unwrap().to_owned()
}

fn surefoot(folder: &Path, words: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_surefoot"));
    command.current_dir(folder).arg("gap").args(words).output().unwrap()
}

fn succeed(folder: &Path, words: &[&str]) -> String {
    let output = surefoot(folder, words);
    let told = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(output.status.success(), "{words:?}: {told}");
    String::from_utf8(output.stdout).unwrap()
}

fn refuse(folder: &Path, words: &[&str]) -> String {
    let output = surefoot(folder, words);
    let told = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(2), "{words:?}: {told}");
    assert!(told.lines().count() == 1 && output.stdout.is_empty(), "{words:?}: {told}");
    told
}

fn names(folder: &Path) -> Vec<String> {
    let mut names: Vec<_> = fs::read_dir(folder)
        .unwrap()
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .collect();
    names.sort();
    names
}

/// A case of two nominal drives and one real one.
fn write_case(folder: &Path, name: &str, heldout: &str) -> String {
    let [vehicle, first, second, real] =
        ["vehicle.toml", "sim_1.csv", "sim_2.csv", "real_train_1.csv"].map(drive);
    let text = format!(
        "name = '{name}'\nvehicle = '{vehicle}'\nsim = ['{first}', '{second}']\nreal = ['{real}']\n\
         heldout = ['{heldout}']\n"
    );
    let path = folder.join(format!("{name}.toml"));
    fs::write(&path, text).unwrap();
    path.to_str().unwrap().to_owned()
}

/// Keeps the calibration of [`write_case`]'s nominal drives for all tests.
static CACHE: LazyLock<tempfile::TempDir> = LazyLock::new(|| {
    let folder = tempfile::tempdir().unwrap();
    let case = write_case(folder.path(), "first", &drive("real_heldout.csv"));
    succeed(folder.path(), &["diagnose", &case, "--json", "a.json", "--baseline-cache", "cache"]);
    folder
});

fn cache() -> String {
    CACHE.path().join("cache").to_str().unwrap().to_owned()
}

/// Root mean square distance after two seconds, from the predictions' file and the drive alone.
fn position_error_2s_m(predictions: &str, drive: &DriveLog, model: &str) -> f64 {
    let run = drive.runs().next().unwrap();
    let [x, y] = [Column::X, Column::Y].map(|column| run.column(column).unwrap());
    let square = |line: &str| {
        let cells: Vec<&str> = line.split(',').collect();
        let number = |cell: usize| cells[cell].parse::<f64>().unwrap();
        let is_meant = cells[3] == model && number(2) == 2.0;
        // Rows are 0.02 s apart.
        let row = ((number(1) + 2.0) / 0.02).round() as usize;
        is_meant.then(|| (number(4) - x[row]).powi(2) + (number(5) - y[row]).powi(2))
    };
    let squares: Vec<f64> = predictions.lines().skip(1).filter_map(square).collect();
    assert!(squares.len() > 150, "{}", squares.len());
    (squares.iter().sum::<f64>() / squares.len() as f64).sqrt()
}

#[test]
fn a_case_is_diagnosed_verified_written_and_applied() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    let case = write_case(folder.path(), "late", &drive("real_heldout.csv"));
    let words = [
        "diagnose",
        &case,
        "--out",
        "r",
        "--json",
        "a.json",
        "--predictions",
        "p.csv",
        "--baseline-cache",
        &cache(),
    ];
    let told = succeed(folder.path(), &words);
    let answer: Answer = serde_json::from_slice(&fs::read(path("a.json")).unwrap()).unwrap();
    assert_eq!(answer.case, "late");
    assert_eq!(answer.effects[0].id, "steer_lag", "{:?}", answer.effects);
    let lag = answer.effects[0].parameters["time_constant_s"];
    assert!((lag.value - LATE_S).abs() < 0.07 && lag.low <= lag.value && lag.value <= lag.high, "{lag:?}");
    let quarters: Vec<f64> = answer
        .by_part
        .iter()
        .filter(|part| part.division == Division::Time)
        .map(|part| part.estimate.value)
        .collect();
    assert!(quarters.len() == 4 && quarters.iter().all(|lag_s| (lag_s - LATE_S).abs() < 0.1), "{quarters:?}");
    assert!(
        told.contains("The gap comes from steer_lag") && told.contains("position error after 2 s"),
        "{told}"
    );

    assert_eq!(fs::read(path("a.json")).unwrap(), fs::read(path("r/answer.json")).unwrap());
    let pictures =
        ["ground.png", "heldout.png", "places.png", "ranking.png", "residuals.png", "throughout.png"];
    let mut written = [&["answer.json", "prediction.json", "report.html"][..], &pictures].concat();
    written.sort_unstable();
    assert_eq!(names(&path("r")), written);
    let html = fs::read_to_string(path("r/report.html")).unwrap();
    assert_eq!(html.matches("data:image/png;base64,").count(), pictures.len());
    assert_eq!(names(Path::new(&cache())).len(), 1, "calibrated once");

    let heldout = formats::read_drive(Path::new(&drive("real_heldout.csv"))).unwrap().log;
    let predictions = fs::read_to_string(path("p.csv")).unwrap();
    let told = answer.shrink.position_error_2s_m.unwrap();
    for (model, told) in [("nominal", told.before), ("repaired", told.after)] {
        let found = position_error_2s_m(&predictions, &heldout, model);
        assert!((found / told - 1.0).abs() < 0.01, "{model}: {found} against {told}");
    }

    succeed(folder.path(), &["apply", "a.json", "--model", "rc_car", "--out", "m.toml"]);
    let model = formats::read_model(&path("m.toml")).unwrap();
    let measured = answer.controller_model.unwrap();
    assert_eq!(model.effects, measured.effects());
    let [before, after] = measured.foretold_losses.unwrap();
    assert!(after < 0.5 * before, "{before} {after}");
    let own = measured.causes.iter().find(|cause| cause.description().id == "steer_lag").unwrap();
    assert!((own.values()[0] - LATE_S).abs() < 0.1, "{own:?}");
}

/// Beside a model that has most of the lag already, the rest of it is found, and nothing that was calibrated comes in.
#[test]
fn a_diagnosis_begins_with_the_users_own_model() {
    let folder = tempfile::tempdir().unwrap();
    let case = write_case(folder.path(), "late", &drive("real_heldout.csv"));
    let mut model = bicycle::Model::of(&formats::read_vehicle("sedan").unwrap());
    model.effects = vec![bicycle::Effect::from_values("steer_lag", [0.2, 0.0, 0.0, 0.0]).unwrap()];
    fs::write(folder.path().join("own.toml"), formats::model_text(&model).unwrap()).unwrap();
    let words = ["diagnose", &case, "--model", "own.toml", "--json", "a.json", "--baseline-cache", &cache()];
    succeed(folder.path(), &words);
    let answer: Answer = serde_json::from_slice(&fs::read(folder.path().join("a.json")).unwrap()).unwrap();
    let measured = answer.controller_model.unwrap();
    let lags: Vec<f64> = measured.effects().iter().map(|own| own.values()[0]).collect();
    assert!((1..=2).contains(&lags.len()), "{measured:?}");
    assert!(lags.iter().sum::<f64>() > 0.25, "{measured:?}");
    let told = refuse(folder.path(), &["diagnose", &case, "--model", "none.toml"]);
    assert!(told.contains("none.toml: expected a readable text file"), "{told}");
}

#[test]
fn the_prediction_stands_before_the_held_out_drives_are_opened() {
    let folder = tempfile::tempdir().unwrap();
    let run = |heldout: &str, out: &str| {
        let case = write_case(folder.path(), "case", heldout);
        surefoot(folder.path(), &["diagnose", &case, "--out", out, "--baseline-cache", &cache()])
    };
    let file = |name: &str| fs::read(folder.path().join(name)).unwrap();
    assert!(run(&drive("real_heldout.csv"), "one").status.success());
    assert!(run(&drive("real_sound.csv"), "two").status.success());
    assert_eq!(file("one/prediction.json"), file("two/prediction.json"));
    assert_ne!(file("one/answer.json"), file("two/answer.json"));
    // A held-out drive that nobody can read does not keep the prediction from standing.
    fs::write(folder.path().join("broken.csv"), "t,x\n0,a\n").unwrap();
    assert_eq!(run("broken.csv", "three").status.code(), Some(2));
    assert_eq!(file("one/prediction.json"), file("three/prediction.json"));
    assert!(!folder.path().join("three/answer.json").exists());
    // Under another name the same drive is still one that was used before.
    fs::copy(drive("real_train_1.csv"), folder.path().join("copy.csv")).unwrap();
    let told = String::from_utf8(run("copy.csv", "four").stderr).unwrap();
    assert!(told.contains("copy.csv: expected a drive not used before, found the drive of"), "{told}");
}

/// A real drive of the case with a column changed, as a file.
fn changed(folder: &Path, name: &str, column: Column, change: impl Fn(f64) -> f64) -> PathBuf {
    let mut file = formats::read_drive_log_csv(Path::new(&drive("real_train_1.csv"))).unwrap();
    let mut log = DriveLog::default();
    for run in file.log.runs() {
        for row in run.drive_rows() {
            log.push(run.name(), &row.with(column, change(row.value(column)))).unwrap();
        }
    }
    file.log = log;
    let path = folder.join(name);
    formats::write_drive_log_csv(&path, &file).unwrap();
    path
}

#[test]
fn drives_that_would_be_misread_are_refused_with_the_suspicion() {
    let folder = tempfile::tempdir().unwrap();
    let vehicle = drive("vehicle.toml");
    let sim = drive("sim_1.csv");
    let diagnose = |real: &str| {
        let words = ["diagnose", "--vehicle", &vehicle, "--sim", &sim, "--real", real, "--json", "a.json"];
        refuse(folder.path(), &words)
    };
    let degrees = |value: f64| value.to_degrees();
    changed(folder.path(), "yaw.csv", Column::Yaw, degrees);
    changed(folder.path(), "steer.csv", Column::CmdSteer, degrees);
    changed(folder.path(), "mirrored.csv", Column::CmdSteer, |angle| -angle);
    changed(folder.path(), "kmh.csv", Column::Vx, |speed| 3.6 * speed);
    changed(folder.path(), "nan.csv", Column::Wz, |rate| if rate > -0.3 { f64::NAN } else { rate });
    let text = fs::read_to_string(drive("real_train_1.csv")).unwrap();
    let lines: Vec<&str> = text.lines().collect();
    fs::write(folder.path().join("short.csv"), lines[..101].join("\n")).unwrap();
    let backwards = [&lines[..1000], &lines[500..600]].concat().join("\n");
    fs::write(folder.path().join("backwards.csv"), backwards).unwrap();
    let cases = [
        ("yaw.csv", "yaw.csv: yaw: expected radians, found degrees? "),
        ("steer.csv", "steer.csv: cmd_steer: expected radians, found degrees? "),
        ("mirrored.csv", "mirrored.csv: cmd_steer: expected left positive, found mirrored? "),
        ("kmh.csv", "kmh.csv: vx: expected SI units, found km/h? "),
        ("nan.csv", "nan.csv: wz: expected a number in half of the rows at least, found none in "),
        ("short.csv", "short.csv: expected at least 8 s of driving, found 1.98 s"),
        ("backwards.csv", "backwards.csv:1001: t: expected a time > "),
        ("none.csv", "none.csv: expected a file, found none"),
    ];
    for (file, expected) in cases {
        let told = diagnose(file);
        assert!(told.contains(expected), "{told}");
    }
    assert!(!folder.path().join("a.json").exists());
}

#[test]
fn what_cannot_be_asked_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    write_case(folder.path(), "case", &drive("real_heldout.csv"));
    let case = folder.path().to_str().unwrap();
    let cases: [(&[&str], &str); 6] = [
        (&["diagnose"], "CASE"),
        (&["diagnose", "nowhere"], "nowhere: expected a readable text file"),
        (&["diagnose", case, "--real", "a.csv"], "cannot be used with"),
        (
            &["apply", "none.json", "--model", "rc_car", "--out", "m.toml"],
            "none.json: expected a readable file",
        ),
        (
            &[
                "diagnose",
                "--vehicle",
                "sedan",
                "--sim",
                &drive("real_heldout.csv"),
                "--real",
                &drive("sim_1.csv"),
            ],
            "found them swapped?",
        ),
        (&["diagnose", case, "--json", "."], "--json: expected a file, found the folder"),
    ];
    for (words, expected) in cases {
        let told = refuse(folder.path(), words);
        assert!(told.contains(expected), "{told}");
    }
    assert!(names(folder.path()).iter().all(|name| name == "surefoot-out" || name == "case.toml"));
}

/// Whether a file is as its writer meant it to end.
fn is_whole(path: &Path) -> bool {
    let bytes = fs::read(path).unwrap();
    match path.extension().and_then(|extension| extension.to_str()) {
        Some("json") => serde_json::from_slice::<Answer>(&bytes).is_ok(),
        Some("png") => bytes.ends_with(b"IEND\xaeB`\x82"),
        Some("html") => bytes.ends_with(b"</html>\n"),
        Some("csv") => bytes.ends_with(b"\n"),
        _ => panic!("{}", path.display()),
    }
}

/// Killed in the middle of calibrating, naming, bounding or writing: every file is not there yet or whole, and the next
/// run over what was left behind succeeds.
#[test]
fn an_interrupted_run_leaves_nothing_half_written() {
    let folder = tempfile::tempdir().unwrap();
    let case = write_case(folder.path(), "late", &drive("real_heldout.csv"));
    let kept = cache();
    let words = |cache: &'static str| {
        let cache = if cache.is_empty() { kept.clone() } else { cache.to_owned() };
        let words = ["gap", "diagnose", &case, "--out", "r", "--json", "a.json", "--predictions", "p.csv"];
        [&words.map(str::to_owned)[..], &["--baseline-cache".to_owned(), cache]].concat()
    };
    for (cache, after_ms) in [("empty", 700), ("", 300), ("", 900), ("", 1500), ("", 2100), ("", 2700)] {
        let mut command = Command::new(env!("CARGO_BIN_EXE_surefoot"));
        command.current_dir(folder.path()).args(words(cache));
        let mut child = command.stdout(Stdio::null()).spawn().unwrap();
        std::thread::sleep(std::time::Duration::from_millis(after_ms));
        child.kill().unwrap();
        child.wait().unwrap();
        let report = fs::read_dir(folder.path().join("r")).into_iter().flatten();
        let files = report.map(|entry| entry.unwrap().path());
        let others = ["a.json", "p.csv"].map(|name| folder.path().join(name));
        for path in files.chain(others).filter(|path| path.extension().is_some() && path.exists()) {
            assert!(is_whole(&path), "{} after {after_ms} ms", path.display());
        }
    }
    let output = surefoot(folder.path(), &words("").iter().skip(1).map(String::as_str).collect::<Vec<_>>());
    assert!(output.status.success());
    assert!(is_whole(&folder.path().join("r/report.html")) && is_whole(&folder.path().join("p.csv")));
}

/// The page in the docs is the one that the program writes, and names every effect with its equation.
#[test]
fn the_catalogue_in_the_docs_is_the_programs() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("new");
    succeed(folder.path(), &["effects", "--out", "new"]);
    let written = fs::read_to_string(out.join("effects.md")).unwrap();
    let docs = Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/effects.md");
    assert!(written == fs::read_to_string(docs).unwrap(), "run `surefoot gap effects --out docs`");
    assert!(fs::metadata(out.join("effects.png")).unwrap().len() > 50_000);
    let told = succeed(folder.path(), &["effects"]);
    for description in bicycle::effect::CATALOGUE {
        assert!(told.contains(description.id) && told.contains(description.meaning), "{}", description.id);
    }
}

/// The held-out drive of the late servo is far from the simulator; the sound one is not.
#[test]
fn a_gap_above_the_limit_ends_with_a_code_of_its_own_once_all_is_written() {
    let folder = tempfile::tempdir().unwrap();
    let case = write_case(folder.path(), "gate", &drive("real_heldout.csv"));
    let cache = cache();
    let words =
        |limit| ["diagnose", &case, "--json", "a.json", "--baseline-cache", &cache, "--fail-above", limit];
    let output = surefoot(folder.path(), &words("1.2"));
    let told = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(3), "{told}");
    let answer: Answer = serde_json::from_slice(&fs::read(folder.path().join("a.json")).unwrap()).unwrap();
    let ratio = answer.shrink.before.unwrap() / answer.shrink.floor;
    assert!(ratio > 1.2 && answer.schema_version == sim_to_real::SCHEMA_VERSION, "{answer:?}");
    let expected = format!(
        "surefoot: --fail-above: expected at most 1.2 times the simulator's error on its own drives, found {ratio:.2}"
    );
    assert_eq!(told.lines().last(), Some(expected.as_str()));
    succeed(folder.path(), &words("50"));

    let told = refuse(folder.path(), &words("0"));
    assert!(told.contains("--fail-above: expected a finite number above 0, found \"0\""), "{told}");
    let text = fs::read_to_string(&case).unwrap();
    let without = text.lines().filter(|line| !line.starts_with("heldout")).collect::<Vec<_>>().join("\n");
    fs::write(&case, without).unwrap();
    let told = refuse(folder.path(), &words("2"));
    assert!(told.contains("--fail-above: expected held-out drives to measure, found none"), "{told}");
}

#[test]
fn a_part_that_is_unknown_is_applied_only_by_force() {
    let folder = tempfile::tempdir().unwrap();
    let case = write_case(folder.path(), "part", &drive("real_heldout.csv"));
    succeed(folder.path(), &["diagnose", &case, "--json", "a.json", "--baseline-cache", &cache()]);
    let path = folder.path().join("a.json");
    let text = fs::read_to_string(&path).unwrap().replace("\"effects\",", "\"effects_and_unknown\",");
    fs::write(&path, &text).unwrap();
    let words = ["apply", "a.json", "--model", "rc_car", "--out", "m.toml"];
    let told = refuse(folder.path(), &words);
    assert!(told.contains("verdict: expected 'effects', or --force, found 'effects_and_unknown'"), "{told}");
    assert!(!folder.path().join("m.toml").exists());
    succeed(folder.path(), &[&words[..], &["--force"]].concat());
    assert!(fs::read_to_string(folder.path().join("m.toml")).unwrap().contains("steer_lag"));

    let newer = text.replace("\"schema_version\": 1", "\"schema_version\": 2");
    fs::write(&path, newer).unwrap();
    let told = refuse(folder.path(), &words);
    assert!(told.contains("schema_version: expected at most 1, found 2"), "{told}");
}
