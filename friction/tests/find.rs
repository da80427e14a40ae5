//! Friction found from drives, and drives that it is not found from.
//!
//! The drives of these tests are those of the reasoning itself, with noise: they show that it can be turned round and how
//! it refuses. Whether it is right is for drives of the plant to show (`surefoot bench friction`).

#![allow(clippy::unwrap_used, reason = "a panic is how a test fails")]

use std::path::Path;

use bicycle::{Column, DriveLog, DriveRow};
use friction::{
    Chassis, Controls, Drive, FindError, Found, FrictionCurve, Grip, Plane, State, find_friction,
};

const STEP_S: f64 = 1e-3;
const ROW_STEPS: usize = 20;

fn chassis() -> Chassis {
    let chassis = Chassis::of(&formats::read_vehicle("pietra_full_size").unwrap());
    // The reasoning leans no body and turns all wheels alike.
    Chassis { lean: [1.0; 2], is_locked: true, ..chassis }
}

fn coulomb(friction: f32) -> FrictionCurve {
    FrictionCurve {
        static_friction: friction,
        sliding_friction: friction,
        viscous_friction: 0.0,
        stribeck_speed_mps: 0.3,
    }
}

/// Noise without a generator: equally spread, of this standard deviation.
fn noise(seed: usize, deviation: f64) -> f64 {
    let mixed = seed.wrapping_mul(0x9E37_79B9_7F4A_7C15);
    let unit = ((mixed ^ (mixed >> 29)) % 100_000) as f64 / 50_000.0 - 1.0;
    3.0_f64.sqrt() * deviation * unit
}

/// A minute on one ground: bends to and fro up to `steering_rad`, speed up and down.
fn drive(log: &mut DriveLog, run: &str, friction: f32, steering_rad: f64) {
    let chassis = chassis();
    let plane = Plane { friction: coulomb(friction), slope_rad: 0.0 };
    let mut state =
        State { at_m: [0.0; 2], heading_rad: 0.0, velocity: [7.0, 0.0, 0.0], specific_mps2: [0.0; 2] };
    for row in 0..3000 {
        let time_s = 0.02 * row as f64;
        let steering_rad = steering_rad * (1.1 * time_s).sin();
        let wheel_mps = 7.0 + 0.5 * (0.4 * time_s).sin();
        let controls = Controls { edge_mps: [wheel_mps; 4], steering_rad };
        for _ in 0..ROW_STEPS {
            state = chassis.step(&state, &controls, &plane, STEP_S);
        }
        let next = chassis.step(&state, &controls, &plane, STEP_S);
        let turning_radps2 = (next.velocity[2] - state.velocity[2]) / STEP_S;
        let [ahead_mps, left_mps, yaw_radps] = state.velocity;
        let ahead_m = chassis.cog_ahead_m;
        let noisy = |index: usize, value: f64, deviation: f64| value + noise(row * 16 + index, deviation);
        let measured = [
            (Column::Vx, ahead_mps, 0.02),
            (Column::Vy, left_mps - yaw_radps * ahead_m, 0.02),
            (Column::Wz, yaw_radps, 0.005),
            (Column::WheelSpeed, wheel_mps, 0.02),
            (Column::SteerMeas, steering_rad, 0.002),
            (Column::Ax, next.specific_mps2[0] + yaw_radps * yaw_radps * ahead_m, 0.1),
            (Column::Ay, next.specific_mps2[1] - turning_radps2 * ahead_m, 0.1),
        ];
        let row = measured
            .into_iter()
            .enumerate()
            .fold(DriveRow::new(time_s), |row, (index, (column, value, deviation))| {
                row.with(column, noisy(index, value, deviation))
            });
        log.push(run, &row).unwrap();
    }
}

fn found(friction: [f32; 2], steering_rad: [f64; 2], chassis: &Chassis) -> Found {
    let mut log = DriveLog::default();
    drive(&mut log, "a", friction[0], steering_rad[0]);
    drive(&mut log, "b", friction[1], steering_rad[1]);
    let classes: Vec<usize> = (0..6000).map(|row| row / 3000).collect();
    let named = [("grass", FrictionCurve::GRASS), ("sand", FrictionCurve::SAND)];
    find_friction(chassis, &named, &[Drive { log: &log, classes: &classes }]).unwrap()
}

#[test]
fn friction_inertia_and_stiffness_come_back_and_gentle_driving_gives_a_bound() {
    let described = Chassis { yaw_inertia_kgm2: 1.25 * chassis().yaw_inertia_kgm2, ..chassis() };
    let found = found([0.4, 0.8], [0.25, 0.03], &described);
    let Grip::Measured { friction, low, high, .. } = found.grounds[0].grip else { panic!("{found:?}") };
    assert!((friction - 0.4).abs() < 0.04 && low < 0.4 && high > 0.4, "{found:?}");
    assert!((found.inertia_factor - 0.8).abs() < 0.12, "{found:?}");
    assert!((found.slip_stiffness[0] / 12.0 - 1.0).abs() < 0.3, "{found:?}");
    let Grip::AtLeast { friction } = found.grounds[1].grip else { panic!("{found:?}") };
    assert!((0.02..0.8).contains(&friction), "{found:?}");
    // The plan keeps what was published where nothing contradicts it.
    assert_eq!(found.grounds[1].curve, FrictionCurve::SAND);
}

/// Whatever the ground holds, driving that never asks for it finds the same bound and no number.
#[test]
fn gentle_driving_tells_no_grounds_apart() {
    let found = found([0.5, 1.1], [0.03, 0.03], &chassis());
    let bounds: Vec<f64> = found
        .grounds
        .iter()
        .map(|ground| match ground.grip {
            Grip::AtLeast { friction } => friction,
            Grip::Measured { .. } => panic!("{ground:?}"),
        })
        .collect();
    assert!((bounds[0] / bounds[1] - 1.0).abs() < 0.2 && bounds[0] < 0.5, "{bounds:?}");
}

fn refused(log: &DriveLog, classes: &[usize]) -> String {
    let named = [("ice", FrictionCurve::ICE)];
    find_friction(&chassis(), &named, &[Drive { log, classes }]).unwrap_err().to_string()
}

fn log_of(columns: &[Column], n_rows: usize, value: f64) -> DriveLog {
    let mut log = DriveLog::default();
    for row in 0..n_rows {
        let row =
            columns.iter().fold(DriveRow::new(0.02 * row as f64), |row, column| row.with(*column, value));
        log.push("", &row).unwrap();
    }
    log
}

#[test]
fn drives_that_say_nothing_are_refused() {
    let all = [Column::Vx, Column::Vy, Column::Wz, Column::WheelSpeed, Column::CmdSteer];
    let none = find_friction(&chassis(), &[], &[]).unwrap_err();
    assert_eq!(none, FindError::NoDrive);
    for (absent, expected) in [
        (Column::WheelSpeed, "wheel_speed"),
        (Column::CmdSteer, "steer_meas or cmd_steer"),
        (Column::Wz, "wz"),
        (Column::Vy, "vx and vy, or x, y and yaw"),
    ] {
        let columns: Vec<_> = all.into_iter().filter(|column| *column != absent).collect();
        let told = refused(&log_of(&columns, 100, 1.0), &[0; 100]);
        assert!(
            told.starts_with(&format!("drive 1: drive log: expected the column {expected}, found ")),
            "{told}"
        );
    }
    let parked = refused(&log_of(&all, 100, 0.0), &[0; 100]);
    assert!(
        parked.contains("expected 25 instants of driving forward") && parked.ends_with("found 0"),
        "{parked}"
    );
    let short = refused(&log_of(&all, 99, 1.0), &[0; 100]);
    assert_eq!(short, "drive 1: classes of the ground: expected one for each of 99 rows, found 100");
    let other = refused(&log_of(&all, 100, 1.0), &[1; 100]);
    assert_eq!(other, "drive 1: expected classes below 1, found 1");
    let log = log_of(&all, 100, 1.0);
    let broken = FrictionCurve { static_friction: f32::NAN, ..FrictionCurve::ICE };
    let drive = Drive { log: &log, classes: &[0; 100] };
    let told = find_friction(&chassis(), &[("ice", broken)], &[drive]).unwrap_err().to_string();
    assert!(told.starts_with("ice: expected friction coefficients within"), "{told}");
}

/// Ground that changes every half second is never alone under the vehicle.
#[test]
fn rows_near_another_ground_are_left_out() {
    let mut log = DriveLog::default();
    drive(&mut log, "a", 0.5, 0.2);
    let classes: Vec<usize> = (0..3000).map(|row| row / 25 % 2).collect();
    let named = [("grass", FrictionCurve::GRASS), ("sand", FrictionCurve::SAND)];
    let drive = Drive { log: &log, classes: &classes };
    let told = find_friction(&chassis(), &named, &[drive]).unwrap_err().to_string();
    assert!(told.ends_with("found 0"), "{told}");
}

/// A minute of traffic asks asphalt for little: no number, and a bound that dry asphalt surely holds.
#[test]
#[ignore = "needs the shared data"]
fn nothing_absurd_is_found_on_real_drives() {
    let shared = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/data/logs");
    let road = [("asphalt", FrictionCurve::ASPHALT)];
    let find = |name: &str, vehicle: &str| {
        let log = formats::read_drive_log_csv(&shared.join(name)).unwrap().log;
        let classes = vec![0; log.n_rows()];
        let chassis = Chassis::of(&formats::read_vehicle(vehicle).unwrap());
        find_friction(&chassis, &road, &[Drive { log: &log, classes: &classes }])
    };
    let traffic = find("rav4_comma2k19.csv", "sedan").unwrap();
    println!("{traffic:?}");
    let Grip::AtLeast { friction } = traffic.grounds[0].grip else { panic!("{traffic:?}") };
    assert!((0.05..0.5).contains(&friction), "{traffic:?}");
    for (name, vehicle, absent) in [
        ("f1tenth_steps.csv", "ut_automata", "wheel_speed"),
        ("genesis_cpg_slow_lap.csv", "sedan", "wheel_speed"),
        ("ikd_f110.csv", "ut_automata", "wheel_speed"),
        ("drive_warthog.csv", "pietra_full_size", "steer_meas or cmd_steer"),
    ] {
        let told = find(name, vehicle).unwrap_err().to_string();
        assert!(told.contains(&format!("expected the column {absent}")), "{name}: {told}");
    }
}
