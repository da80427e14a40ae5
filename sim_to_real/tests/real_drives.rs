//! Five real vehicles without nominal drives: what is diagnosed on some of their drives, against estimates by plain
//! arithmetic and against the drives left out.

#![allow(clippy::unwrap_used, reason = "a panic is how a test fails")]

use bicycle::{Column, DriveLog, DriveRow};
use sim_to_real::{Estimate, Machine, Verification, WithoutSimulator, diagnose_without_simulator, verify};
use std::collections::HashMap;
use std::path::Path;

/// One row of a log: its run, and every number by name.
struct Row {
    run: String,
    values: HashMap<String, f64>,
}

impl Row {
    fn get(&self, name: &str) -> f64 {
        self.values[name]
    }
}

fn rows(file: &str) -> Vec<Row> {
    let path = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../../shared/data/logs")).join(file);
    let text = std::fs::read_to_string(path).unwrap();
    let mut lines = text.lines();
    let names: Vec<&str> = lines.next().unwrap().split(',').collect();
    let row = |line: &str| {
        let cells = || names.iter().zip(line.split(','));
        let run = cells().find(|(name, _)| **name == "run").map_or("", |(_, cell)| cell).to_owned();
        let number = |(name, cell): (&&str, &str)| Some(((*name).to_owned(), cell.parse().ok()?));
        Row { run, values: cells().filter_map(number).collect() }
    };
    lines.map(row).collect()
}

/// The rows that belong to a set, with these columns.
fn log(rows: &[Row], columns: &[Column], belongs: impl Fn(&Row) -> bool) -> DriveLog {
    let mut log = DriveLog::default();
    for row in rows.iter().filter(|row| belongs(row)) {
        let known = columns.iter().fold(DriveRow::new(row.get("t")), |known, &column| {
            known.with(column, row.values.get(column.name()).copied().unwrap_or(f64::NAN))
        });
        log.push(&row.run, &known).unwrap();
    }
    log
}

fn machine(name: &str, wheelbase_m: f64) -> Machine {
    Machine {
        name: name.to_owned(),
        wheelbase_m,
        steering_max_rad: 0.6,
        speed_max_mps: 30.0,
        noise: None,
        ground: None,
    }
}

fn judged(machine: &Machine, real: DriveLog, heldout: DriveLog) -> (WithoutSimulator, Verification) {
    let found = diagnose_without_simulator(machine, &[real]).unwrap();
    let verification = verify(&found.baseline, machine, &found.diagnosis, &[heldout]).unwrap();
    (found, verification)
}

fn estimate(found: &WithoutSimulator, id: &str) -> Option<Estimate> {
    let effect = found.diagnosis.named.iter().find(|effect| effect.id == id)?;
    effect.parameters.values().next().copied()
}

/// A parameter's value, or what stands for no such effect.
fn value(found: &WithoutSimulator, id: &str, neutral: f64) -> f64 {
    estimate(found, id).map_or(neutral, |estimate| estimate.value)
}

fn advice(found: &WithoutSimulator) -> String {
    found.diagnosis.answer("").advice.join("\n")
}

/// Slope and offset of the straight line through points.
fn line(points: impl Iterator<Item = (f64, f64)>) -> [f64; 2] {
    let [n, x, y, xx, xy] =
        points.fold([0.0; 5], |s, (x, y)| [s[0] + 1.0, s[1] + x, s[2] + y, s[3] + x * x, s[4] + x * y]);
    let slope = (n * xy - x * y) / (n * xx - x * x);
    [slope, (y - slope * x) / n]
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}

use Column::{CmdAccel, CmdSpeed, CmdSteer, CmdWz, Pitch, Roll, SteerMeas, Vx, Wz, X, Y, Yaw};

/// Its pose is that of the centre of mass, which the makers' geometry puts before the rear axle.
#[test]
#[ignore = "needs the shared data"]
fn the_sedan_turns_as_its_steering_and_yaw_rate_say() {
    const LENGTH_M: f64 = 3.02;
    const REAR_TO_POSE_M: f64 = 1.4987;
    let mut rows = rows("genesis_cpg_slow_lap.csv");
    for row in &mut rows {
        let (sine, cosine) = row.get("yaw").sin_cos();
        *row.values.get_mut("x").unwrap() -= REAR_TO_POSE_M * cosine;
        *row.values.get_mut("y").unwrap() -= REAR_TO_POSE_M * sine;
    }
    let columns = [X, Y, Yaw, Vx, Wz, SteerMeas];
    let set = |first_half: bool| log(&rows, &columns, |row| (row.get("t") < 180.0) == first_half);
    let (found, verification) = judged(&machine("sedan", LENGTH_M), set(true), set(false));

    // wz = gain v tan(steering) / L + offset, over everything above walking pace.
    let fast = || rows.iter().filter(|row| row.get("vx") > 3.0 && row.get("t") < 180.0);
    let [gain, _] =
        line(fast().map(|row| (row.get("vx") * row.get("steer_meas").tan() / LENGTH_M, row.get("wz"))));
    let told = value(&found, "steer_gain", 1.0);
    assert!((told - gain).abs() < 0.03, "{told} against {gain}");
    // vy / vx = lever wz / vx less what the yaw sensor is turned by.
    let [_, slip] = line(fast().map(|row| (row.get("wz") / row.get("vx"), row.get("vy") / row.get("vx"))));
    let misalign = value(&found, "yaw_misalign", 0.0);
    assert!((misalign + slip).abs() < 0.004, "{misalign} against {}", -slip);

    let [before, after] = verification.errors;
    assert!(after < 0.7 * before, "{before} to {after}");
    let advice = advice(&found);
    assert!(advice.contains("understeer") && advice.contains("steer_meas is the input"), "{advice}");
    assert!(advice.contains("no effect on the speed"), "{advice}");
}

#[test]
#[ignore = "needs the shared data"]
fn the_small_car_answers_its_steps_as_their_steady_parts_say() {
    const LENGTH_M: f64 = 0.33;
    let rows = rows("f1tenth_steps.csv");
    let columns = [X, Y, Yaw, Vx, Wz, CmdSpeed, CmdSteer];
    let set = |odd: u32| log(&rows, &columns, |row| row.run.parse::<u32>().unwrap() % 2 == odd);
    let (found, verification) = judged(&machine("f1tenth", LENGTH_M), set(1), set(0));

    let steady: Vec<&Row> = rows.iter().filter(|row| row.get("t") > 1.5 && row.get("vx") > 0.2).collect();
    let speed = median(steady.iter().map(|row| row.get("vx") / row.get("cmd_speed")).collect());
    assert!((value(&found, "speed_scale", 1.0) - speed).abs() < 0.015, "{speed}");
    // Angles that the yaw rate amounts to where a command has stood for half a second, left and right.
    let held = |i: usize| {
        i >= 20
            && (1..=20).all(|k| {
                rows[i - k].run == rows[i].run && rows[i - k].get("cmd_steer") == rows[i].get("cmd_steer")
            })
    };
    let achieved = |side: f64| {
        let own: Vec<usize> = (0..rows.len())
            .filter(|&i| rows[i].get("cmd_steer") * side > 0.05 && rows[i].get("vx") > 0.2 && held(i))
            .collect();
        let mean =
            |of: &dyn Fn(&Row) -> f64| own.iter().map(|&i| of(&rows[i])).sum::<f64>() / own.len() as f64;
        [mean(&|row| row.get("cmd_steer")), mean(&|row| (LENGTH_M * row.get("wz") / row.get("vx")).atan())]
    };
    let (gain, bias) = (value(&found, "steer_gain", 1.0), value(&found, "steer_bias", 0.0));
    let play = value(&found, "backlash", 0.0);
    for side in [1.0, -1.0] {
        let [commanded, measured] = achieved(side);
        let told = gain * commanded - side * play + bias;
        assert!((told - measured).abs() < 0.015, "{commanded}: {told} against {measured}");
    }
    let [before, after] = verification.errors;
    assert!(after < 0.4 * before, "{before} to {after}");
}

/// A minute of gentle driving holds one delay and little else; what it holds of the grade it does not name.
#[test]
#[ignore = "needs the shared data"]
fn the_suv_follows_a_commanded_acceleration_late() {
    let rows = rows("rav4_comma2k19.csv");
    let columns = [Vx, CmdAccel, SteerMeas, Roll, Pitch];
    // The cruise control takes over after nine seconds.
    let set = |early: bool| log(&rows, &columns, |row| row.get("t") > 9.1 && (row.get("t") < 40.0) == early);
    let (found, _) = judged(&machine("rav4", 2.65), set(true), set(false));

    // The shift that correlates dv/dt with the command best.
    let own: Vec<&Row> = rows.iter().filter(|row| row.get("t") > 9.1).collect();
    let acceleration = |i: usize| (own[i + 15].get("vx") - own[i - 15].get("vx")) / 0.6;
    let command = |i: usize| (i - 15..=i + 15).map(|k| own[k].get("cmd_accel")).sum::<f64>() / 31.0;
    let miss = |shift: usize| {
        let pairs = || (60..own.len() - 15).map(|i| (command(i - shift), acceleration(i)));
        let [slope, offset] = line(pairs());
        pairs().map(|(asked, done)| (done - slope * asked - offset).powi(2)).sum::<f64>()
    };
    let shift = (0..40).min_by(|&a, &b| miss(a).total_cmp(&miss(b))).unwrap();
    let late_s = shift as f64 * 0.02;
    let delay = estimate(&found, "speed_delay").or_else(|| estimate(&found, "speed_lag")).unwrap();
    assert!(delay.low <= late_s && late_s <= delay.high, "{delay:?} against {late_s} s");
    assert!((delay.value - late_s).abs() < 0.12, "{delay:?} against {late_s} s");
    let advice = advice(&found);
    assert!(
        advice.contains("cmd_accel drives the speed") && advice.contains("the pose is missing"),
        "{advice}"
    );
}

#[test]
#[ignore = "needs the shared data"]
fn the_drifting_car_turns_less_the_faster_it_goes() {
    const LENGTH_M: f64 = 0.324;
    let rows = rows("ikd_f110.csv");
    let set = |early: bool| {
        log(&rows, &[CmdSpeed, CmdSteer, Wz], |row| {
            row.run.starts_with("turn") && (row.get("t") < 150.0) == early
        })
    };
    let (found, verification) = judged(&machine("ikd", LENGTH_M), set(true), set(false));

    let (gain, gradient) = (value(&found, "steer_gain", 1.0), value(&found, "understeer", 0.0));
    for speed in [1.0, 2.0, 3.0] {
        let near = rows.iter().filter(|row| {
            row.run.starts_with("turn")
                && row.get("t") < 150.0
                && (row.get("cmd_speed") - speed).abs() < 0.15
                && row.get("cmd_wz").abs() > 0.5
        });
        let ratio = median(near.map(|row| row.get("wz") / row.get("cmd_wz")).collect());
        let told = gain / (1.0 + gradient * speed * speed);
        assert!((told - ratio).abs() < 0.15, "{speed} m/s: {told} against {ratio}");
    }
    let [before, after] = verification.errors;
    assert!(after < 0.6 * before, "{before} to {after}");
    assert_eq!(verification.position_error_2s_m, None);
    assert!(advice(&found).contains("no speed was measured"));
}

#[test]
#[ignore = "needs the shared data"]
fn the_skid_steered_machine_turns_a_third_of_what_is_asked() {
    let rows = rows("drive_warthog.csv");
    let columns = [Vx, Wz, CmdSpeed, CmdWz, Roll, Pitch];
    // Windows in which the command has stood for two seconds and longer.
    let set = |odd: u32| {
        log(&rows, &columns, |row| row.get("steady") > 0.5 && row.get("calib_step") as u32 % 2 == odd)
    };
    let (found, verification) = judged(&machine("warthog", 1.08), set(1), set(0));

    let steady = || rows.iter().filter(|row| row.get("steady") > 0.5);
    let sum = |of: fn(&Row) -> f64| steady().map(of).sum::<f64>();
    let ratio = sum(|row| row.get("wz") * row.get("cmd_wz")) / sum(|row| row.get("cmd_wz").powi(2));
    let told = estimate(&found, "steer_gain").unwrap();
    assert!(told.low < ratio && ratio < told.high, "{told:?} against {ratio}");
    let [before, after] = verification.errors;
    assert!(after < 0.5 * before, "{before} to {after}");
    assert!(advice(&found).contains("skid-steered"));
}
