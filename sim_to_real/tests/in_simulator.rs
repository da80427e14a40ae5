//! What a simulator decides about robots that differ from it by what is stated. The simulator here is a closure with
//! equations of its own; what is added to the robots is written here once more.

#![allow(clippy::unwrap_used, reason = "a panic is how a test fails")]

use std::cell::RefCell;
use std::convert::Infallible;

use bicycle::{Column, DriveLog, DriveRow};
use sim_to_real::{
    CauseKind, InSimulatorDiagnosis, Knob, Machine, Motion, Ranked, SimulatorDescription, SimulatorRun,
    StartState, Verdict, judge_in_simulator,
};

const WHEELBASE_M: f64 = 2.0;
const STEP_S: f64 = 0.02;
const N_ROWS: usize = 1000;

/// A car with a slow motor, which the knob names, and no slip.
fn simulate(run: &SimulatorRun) -> Motion {
    let StartState { x_m, y_m, yaw_rad, speed_mps, .. } = run.start;
    let (mut x, mut y, mut yaw, mut speed) = (x_m, y_m, yaw_rad, speed_mps);
    let mut motion = Motion {
        x_m: Vec::new(),
        y_m: Vec::new(),
        yaw_rad: Vec::new(),
        speed_mps: Vec::new(),
        yaw_rate_radps: Vec::new(),
        side_speed_mps: None,
    };
    for row in 0..run.n_rows() {
        let rate = speed * run.command_steering_rad[row].tan() / WHEELBASE_M;
        motion.x_m.push(x);
        motion.y_m.push(y);
        motion.yaw_rad.push(yaw);
        motion.speed_mps.push(speed);
        motion.yaw_rate_radps.push(rate);
        let pull = (run.command_speed_mps[row] - speed) / run.knobs["motor_s"] - 9.81 * run.slope_ahead[row];
        x += speed * yaw.cos() * STEP_S;
        y += speed * yaw.sin() * STEP_S;
        yaw += rate * STEP_S;
        speed += pull * STEP_S;
    }
    motion
}

fn run(runs: &[SimulatorRun]) -> Result<Vec<Motion>, Infallible> {
    Ok(runs.iter().map(simulate).collect())
}

fn simulator() -> SimulatorDescription {
    let knob =
        |name: &str, low, high, default| Knob { name: name.into(), unit: "s".into(), low, high, default };
    let knobs = vec![knob("motor_s", 0.05, 2.0, 0.4), knob("idle", 0.0, 1.0, 0.5)];
    SimulatorDescription { name: "slow car".to_owned(), stochastic: false, knobs }
}

/// Steps of the speed, sines of the steering.
fn command(row: usize, seed: u64) -> [f64; 2] {
    let t = row as f64 * STEP_S;
    let step = ((row as u64 / 160 + seed) * 2_654_435_761) % 7;
    let speed_mps = 2.0 + 0.6 * step as f64;
    [speed_mps, 0.25 * (0.9 * t + seed as f64).sin() + 0.1 * (2.7 * t).sin()]
}

/// Noise between -1 and 1 that is another one for every row, quantity and seed.
fn noise(row: usize, quantity: u64, seed: u64) -> f64 {
    let mut state = (row as u64) << 20 | quantity << 16 | seed;
    for _ in 0..3 {
        state = (state ^ (state >> 31)).wrapping_mul(0x7fb5_d329_728e_a185).wrapping_add(0x9e37);
    }
    (state >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
}

/// A robot: its motor, by how many rows its steering is late, and what its gyro adds.
#[derive(Clone, Copy)]
struct Robot {
    motor_s: f64,
    late_rows: usize,
    gyro_radps: f64,
}

const SOUND: Robot = Robot { motor_s: 0.4, late_rows: 0, gyro_radps: 0.0 };

fn drive(robot: Robot, seed: u64) -> DriveLog {
    let commands: Vec<[f64; 2]> = (0..N_ROWS).map(|row| command(row, seed)).collect();
    let given = |row: usize| commands[row.saturating_sub(robot.late_rows)][1];
    let moved = simulate(&SimulatorRun {
        start: StartState { x_m: 0.0, y_m: 0.0, yaw_rad: 1.0, speed_mps: 2.0, yaw_rate_radps: 0.0 },
        step_s: STEP_S,
        command_speed_mps: commands.iter().map(|command| command[0]).collect(),
        command_steering_rad: (0..N_ROWS).map(given).collect(),
        slope_ahead: vec![0.0; N_ROWS],
        slope_left: vec![0.0; N_ROWS],
        terrain_class: vec![0; N_ROWS],
        seed: 0,
        knobs: [("motor_s".to_owned(), robot.motor_s)].into(),
    });
    let mut log = DriveLog::default();
    for (row, [speed_mps, steering_rad]) in commands.into_iter().enumerate() {
        let measured = |values: &[f64], size: f64, quantity| values[row] + size * noise(row, quantity, seed);
        let row = DriveRow::new(row as f64 * STEP_S)
            .with(Column::CmdSpeed, speed_mps)
            .with(Column::CmdSteer, steering_rad)
            .with(Column::X, measured(&moved.x_m, 0.03, 0))
            .with(Column::Y, measured(&moved.y_m, 0.03, 1))
            .with(Column::Yaw, measured(&moved.yaw_rad, 0.004, 2))
            .with(Column::Vx, measured(&moved.speed_mps, 0.04, 3))
            .with(Column::Wz, measured(&moved.yaw_rate_radps, 0.01, 4) + robot.gyro_radps);
        log.push("", &row).unwrap();
    }
    log
}

fn machine() -> Machine {
    Machine {
        name: "m".to_owned(),
        wheelbase_m: WHEELBASE_M,
        steering_max_rad: 0.5,
        speed_max_mps: 8.0,
        noise: None,
        ground: None,
    }
}

fn ranking(ids: &[&str]) -> Vec<Ranked> {
    ids.iter().map(|id| Ranked { id: (*id).to_owned(), score: 0.1, support: None }).collect()
}

const SCREENED: [&str; 5] = ["steer_lag", "friction", "steer_delay", "gyro_bias", "speed_scale"];

fn judged(robot: Robot) -> InSimulatorDiagnosis {
    judged_after(&SCREENED, robot)
}

fn judged_after(screened: &[&str], robot: Robot) -> InSimulatorDiagnosis {
    let sim = [drive(SOUND, 1), drive(SOUND, 2)];
    let real = [drive(robot, 11), drive(robot, 12)];
    judge_in_simulator(&simulator(), &machine(), &ranking(screened), (&sim, &real), &run).unwrap()
}

/// Five effects, none of which is a slow motor.
const OTHERS: [&str; 5] = ["odom_scale", "gyro_bias", "yaw_misalign", "steer_bias", "backlash"];

/// The knob is off by a ninth of what it can be off by, to either side.
#[test]
fn a_small_change_is_found_among_many_that_it_could_have_been() {
    for motor_s in [0.32, 0.48] {
        let found = judged_after(&OTHERS, Robot { motor_s, ..SOUND });
        let [cause] = &found.answer.causes[..] else { panic!("{:?}", found.answer) };
        assert_eq!(cause.name, "motor_s");
        assert!((cause.found.value - motor_s).abs() < 0.02, "{cause:?}");
    }
}

#[test]
fn an_effect_that_the_model_thought_unlikely_is_found_where_no_other_explains_the_gap() {
    let screened = [&OTHERS[..], &["speed_scale", "steer_delay"]].concat();
    let found = judged_after(&screened, Robot { late_rows: 5, ..SOUND });
    let tried: Vec<&str> = found.answer.candidates.iter().map(|candidate| candidate.name.as_str()).collect();
    assert!(tried.contains(&"speed_scale"), "{tried:?}");
    assert_eq!(found.answer.causes[0].name, "steer_delay");
}

#[test]
fn a_knob_that_is_off_is_found_by_its_value_and_shrinks_the_gap() {
    let robot = Robot { motor_s: 0.7, ..SOUND };
    let found = judged(robot);
    let [cause] = &found.answer.causes[..] else { panic!("{:?}", found.answer) };
    assert_eq!((cause.name.as_str(), cause.kind, cause.nominal), ("motor_s", CauseKind::Knob, 0.4));
    assert!((cause.found.value - 0.7).abs() < 0.03, "{cause:?}");
    assert!(cause.found.low < 0.7 && 0.7 < cause.found.high, "{cause:?}");
    let verified = found.verify(&machine(), &[drive(robot, 21)], &run).unwrap();
    let closed = verified.shrink.closed.unwrap();
    assert!(verified.shrink.before.unwrap() > 2.0 && (0.9..1.1).contains(&closed), "{:?}", verified.shrink);
}

/// Five rows of 0.02 s.
#[test]
fn commands_that_come_late_are_found_by_delaying_them() {
    let found = judged(Robot { late_rows: 5, ..SOUND });
    let [cause] = &found.answer.causes[..] else { panic!("{:?}", found.answer) };
    assert_eq!((cause.name.as_str(), cause.parameter.as_str()), ("steer_delay", "delay_s"));
    assert!((cause.found.value - 0.1).abs() < 0.015, "{cause:?}");
    assert_eq!(found.answer.verdict, Verdict::Effects);
}

#[test]
fn a_sensor_that_is_off_is_found_without_touching_the_commands() {
    let found = judged(Robot { gyro_radps: 0.03, ..SOUND });
    let [cause] = &found.answer.causes[..] else { panic!("{:?}", found.answer) };
    assert_eq!(cause.name, "gyro_bias");
    assert!((cause.found.value - 0.03).abs() < 0.002, "{cause:?}");
}

#[test]
fn two_at_once_are_found_as_two() {
    let found = judged(Robot { motor_s: 0.8, late_rows: 6, gyro_radps: 0.0 });
    let names: Vec<&str> = found.answer.causes.iter().map(|cause| cause.name.as_str()).collect();
    assert!(names.len() == 2 && names.contains(&"motor_s") && names.contains(&"steer_delay"), "{names:?}");
    for cause in &found.answer.causes {
        let (expected, within) = if cause.name == "motor_s" { (0.8, 0.05) } else { (0.12, 0.02) };
        assert!((cause.found.value - expected).abs() < within, "{cause:?}");
    }
}

#[test]
fn where_nothing_is_wrong_nothing_is_named() {
    let found = judged(SOUND);
    assert_eq!((found.answer.verdict, found.answer.causes.len()), (Verdict::None, 0), "{:?}", found.answer);
    assert!((0.8..3.0).contains(&found.answer.own_drives_error), "{}", found.answer.own_drives_error);
}

/// A simulator whose motion ignores every knob and command cannot be brought nearer by any.
#[test]
fn a_gap_that_nothing_explains_is_unknown() {
    let sim = [drive(SOUND, 1), drive(SOUND, 2)];
    let brakes = |seed| {
        let mut log = DriveLog::default();
        for row in drive(SOUND, seed).runs().flat_map(|run| run.drive_rows().collect::<Vec<_>>()) {
            // Turns of its own that are in no command.
            let own = 0.4 * (1.9 * row.time_s).sin();
            let (rate, yaw) = (row.value(Column::Wz), row.value(Column::Yaw));
            log.push("", &row.with(Column::Wz, rate + own).with(Column::Yaw, yaw + own)).unwrap();
        }
        log
    };
    let real = [brakes(11), brakes(12)];
    let found =
        judge_in_simulator(&simulator(), &machine(), &ranking(&SCREENED), (&sim, &real), &run).unwrap();
    assert_eq!(
        (found.answer.verdict, found.answer.causes.len()),
        (Verdict::Unknown, 0),
        "{:?}",
        found.answer
    );
}

/// A ground that rises by a tenth ahead whatever the heading: the attitude says so, and the simulator is told.
#[test]
fn the_simulator_is_told_the_slope_below_the_robot() {
    let mut log = DriveLog::default();
    for row in drive(SOUND, 1).runs().flat_map(|run| run.drive_rows().collect::<Vec<_>>()) {
        // Nose down is positive.
        log.push("", &row.with(Column::Roll, 0.0).with(Column::Pitch, -(0.1_f64.atan()))).unwrap();
    }
    let seen = RefCell::new(Vec::new());
    let watched = |runs: &[SimulatorRun]| {
        seen.borrow_mut().extend(runs.to_vec());
        run(runs)
    };
    let sim = [log.clone(), drive(SOUND, 2)];
    judge_in_simulator(&simulator(), &machine(), &[], (&sim, &[log]), &watched).unwrap();
    let runs = seen.borrow();
    let (ahead, left) = (&runs[0].slope_ahead, &runs[0].slope_left);
    assert!(ahead.iter().all(|slope| (slope - 0.1).abs() < 1e-6), "{:?}", &ahead[..3]);
    assert!(left.iter().all(|slope| slope.abs() < 1e-6), "{:?}", &left[..3]);
    assert_eq!(runs[0].knobs["idle"], 0.5);
    let lengths = [ahead.len(), left.len(), runs[0].terrain_class.len(), runs[0].command_steering_rad.len()];
    assert!(lengths.iter().all(|length| *length == runs[0].n_rows()) && runs[0].n_rows() > 900);
}

#[test]
fn a_drive_without_the_commands_is_refused_by_set_and_run() {
    let mut log = DriveLog::default();
    for row in drive(SOUND, 1).runs().flat_map(|run| run.drive_rows().collect::<Vec<_>>()) {
        log.push("monday", &row.with(Column::CmdSpeed, f64::NAN)).unwrap();
    }
    let sim = [drive(SOUND, 1)];
    let told = judge_in_simulator(&simulator(), &machine(), &[], (&sim, &[log]), &run).unwrap_err();
    assert!(told.to_string().starts_with("real run 'monday': expected the columns cmd_speed and cmd_steer"));
}

#[test]
fn knobs_without_a_range_or_a_name_are_refused() {
    let with = |name: &str, low: f64, high: f64, default: f64| {
        let mut simulator = simulator();
        simulator.knobs[1] = Knob { name: name.to_owned(), unit: "-".to_owned(), low, high, default };
        simulator.validate().map_err(|error| error.to_string())
    };
    assert_eq!(with("other", 0.0, 1.0, 1.0), Ok(()));
    for (name, low, high, default, told) in [
        ("other", 1.0, 1.0, 1.0, "knob 'other': expected finite low < high"),
        ("other", 0.0, 1.0, 1.5, "found 0, 1 and 1.5"),
        ("other", 0.0, f64::INFINITY, 1.0, "expected finite low < high"),
        ("other", f64::NAN, 1.0, 0.5, "expected finite low < high"),
        ("motor_s", 0.0, 1.0, 0.5, "found 'motor_s' twice or empty"),
        ("", 0.0, 1.0, 0.5, "found '' twice or empty"),
    ] {
        assert!(with(name, low, high, default).unwrap_err().contains(told), "{told}");
    }
}
