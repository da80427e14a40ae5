//! A machine without nominal drives whose faults are known: circular arcs by plain geometry, and sensors that lie a
//! little.

#![allow(clippy::unwrap_used, reason = "a panic is how a test fails")]

use bicycle::{Column, DriveLog, DriveRow};
use rand::SeedableRng;
use rand_distr::{Distribution, Normal};
use rand_xoshiro::Xoshiro256PlusPlus;
use sim_to_real::{Machine, diagnose_without_simulator, verify};

const LENGTH_M: f64 = 0.5;
const STEP_S: f64 = 0.02;
/// Shares of the commanded speed and of the commanded angle that the machine does.
const SPEED_SHARE: f64 = 0.9;
const STEERING_SHARE: f64 = 0.8;

fn machine() -> Machine {
    Machine {
        name: "car".to_owned(),
        wheelbase_m: LENGTH_M,
        steering_max_rad: 0.5,
        speed_max_mps: 3.0,
        noise: None,
        ground: None,
    }
}

/// A drive of 40 s: each second another speed and another angle, on an arc of the circle that the two amount to.
fn drive(seed: u64) -> DriveLog {
    let mut random = Xoshiro256PlusPlus::seed_from_u64(seed);
    let noise = Normal::new(0.0, 1.0).unwrap();
    let mut measured = |value: f64, std: f64| value + std * noise.sample(&mut random);
    let (mut x_m, mut y_m, mut yaw_rad) = (0.0_f64, 0.0_f64, 0.0_f64);
    let mut log = DriveLog::default();
    for row in 0..2000 {
        let second = (row / 50) as f64 + seed as f64;
        let (speed, steer) = (1.2 + 0.7 * (2.3 * second).sin(), 0.4 * (1.7 * second).cos());
        let speed_mps = SPEED_SHARE * speed;
        let yaw_rate_radps = speed_mps * (STEERING_SHARE * steer).tan() / LENGTH_M;
        let known = DriveRow::new(f64::from(row) * STEP_S)
            .with(Column::X, measured(x_m, 0.003))
            .with(Column::Y, measured(y_m, 0.003))
            .with(Column::Yaw, measured(yaw_rad, 0.003))
            .with(Column::Vx, measured(speed_mps, 0.01))
            .with(Column::Wz, measured(yaw_rate_radps, 0.01))
            .with(Column::CmdSpeed, speed)
            .with(Column::CmdSteer, steer);
        log.push("", &known).unwrap();
        // The chord of an arc points along its middle and is as long as 2 r sin(turn / 2).
        let turn_rad = yaw_rate_radps * STEP_S;
        let chord_m = if turn_rad.abs() < 1e-9 {
            speed_mps * STEP_S
        } else {
            2.0 * speed_mps / yaw_rate_radps * (0.5 * turn_rad).sin()
        };
        let (sine, cosine) = (yaw_rad + 0.5 * turn_rad).sin_cos();
        (x_m, y_m, yaw_rad) = (x_m + chord_m * cosine, y_m + chord_m * sine, yaw_rad + turn_rad);
    }
    log
}

#[test]
fn what_a_machine_does_of_its_commands_is_found_and_foretells_another_drive() {
    let found = diagnose_without_simulator(&machine(), &[drive(1)]).unwrap();
    let value = |id: &str| {
        let effect = found.diagnosis.named.iter().find(|effect| effect.id == id);
        let effect = effect.unwrap_or_else(|| panic!("no {id} in {:?}", found.diagnosis.named));
        effect.parameters.values().next().unwrap().value
    };
    let (speed, steering) = (value("speed_scale"), value("steer_gain"));
    assert!((speed - SPEED_SHARE).abs() < 0.01, "{speed}");
    assert!((steering - STEERING_SHARE).abs() < 0.01, "{steering}");
    let verified = verify(&found.baseline, &machine(), &found.diagnosis, &[drive(2)]).unwrap();
    let [before, after] = verified.errors;
    assert!(after < 0.2 * before, "{before} to {after}");
}
