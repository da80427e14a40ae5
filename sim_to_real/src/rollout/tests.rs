//! Rollouts in lanes against the same steps one by one.
#![allow(clippy::unwrap_used, reason = "a panic is how a test fails")]

use super::{Simulator, UNLIMITED};
use crate::drive::testing::{log, machine};
use crate::drive::{Drive, HORIZONS, N_QUANTITIES, N_STEPS, STEP_S, VX, VY, WZ, YAW};
use bicycle::lanes::{Real, Scalar};
use bicycle::{Column, Effect, GroundSample, LaneState, Model, Stepper};
use std::f64::consts::TAU;

const WHEELBASE_M: f64 = 1.2;

fn effect(id: &str, values: [f64; 4]) -> Effect {
    Effect::from_values(id, values).unwrap()
}

/// A delay, a servo, a controller with an integral on a hill, and tyres that give way.
fn effects() -> Vec<Effect> {
    vec![
        effect("steer_delay", [0.05, 0.0, 0.0, 0.0]),
        effect("steer_servo", [0.1, 1.0, 0.0, 0.0]),
        effect("speed_loop", [0.4, 0.0, 0.0, 0.0]),
        effect("speed_integral", [0.8, 0.0, 0.0, 0.0]),
        effect("slope_gravity", [1.0, 0.0, 0.0, 0.0]),
        effect("rear_slip", [0.01, 0.0, 0.0, 0.0]),
    ]
}

/// A drive of so many seconds whose speed and steering swing, on a ground that tilts.
fn drive(duration_s: f64, period_s: f64) -> Drive {
    let columns = [Column::CmdSpeed, Column::CmdSteer, Column::Vx, Column::Wz, Column::Roll, Column::Pitch];
    let log = log(&columns, (duration_s / STEP_S) as usize + 1, STEP_S, |column, t| {
        let swing = (TAU * t / period_s).sin();
        match column {
            Column::CmdSpeed => 2.0 + 0.5 * swing,
            Column::Vx => 1.9 + 0.4 * swing,
            Column::CmdSteer => 0.2 * swing,
            Column::Wz => 0.3 * swing,
            Column::Pitch => 0.1 * (TAU * t / 9.0).sin(),
            _ => 0.05,
        }
    });
    Drive::of(&log.runs().next().unwrap(), &machine()).unwrap()
}

#[test]
fn drives_side_by_side_are_foretold_as_each_alone() {
    let drives = [drive(12.0, 3.0), drive(20.0, 5.0), drive(7.0, 4.0)];
    let simulator = Simulator::new(WHEELBASE_M, &effects());
    let together = simulator.predict(&drives.each_ref());
    let alone: Vec<f32> = drives.iter().flat_map(|drive| simulator.predict(&[drive])).collect();
    assert_eq!(together, alone);
}

/// Speed, yaw rate and sideways speed at every horizon of a start, in double precision.
fn stepped(stepper: &Stepper, drive: &Drive, start: usize) -> Vec<[f64; 3]> {
    let real = |value: f64| Real(Scalar, value);
    let at = |row: usize| {
        let ground = GroundSample {
            linear_traction: real(1.0),
            angular_traction: real(1.0),
            gradient: [0, 1].map(|axis| real(f64::from(drive.gradient[axis][row]))),
            class: real(0.0),
        };
        let command = drive.commands[row];
        ([command.speed_mps, command.steering_rad].map(|value| real(f64::from(value))), ground)
    };
    let standing = |row: usize| LaneState {
        x: real(0.0),
        y: real(0.0),
        turns: real(drive.smooth[YAW][row] / TAU).wrap_turns(),
        speed: real(drive.smooth[VX][row]),
        steering: real(0.0),
    };
    let mut memory = vec![0.0; stepper.n_slots()];
    stepper.fill_steady_state(drive.commands[0], &mut memory);
    for row in 0..start {
        let (command, ground) = at(row);
        let mut state = standing(row);
        stepper.step(&mut state, command, &ground, &mut memory, row);
        stepper.correct_held(&mut memory, real(drive.smooth[VX][row + 1]) - state.speed);
    }
    // The commands go on as they were driven, at the speeds that were reached then.
    let mut asked_memory = memory.clone();
    let mut state = standing(start);
    let mut told = Vec::new();
    for step in 0..N_STEPS {
        let (command, ground) = at(start + step);
        let reached = real(drive.smooth[VX][start + step]);
        let asked = stepper.asked(command, reached, &mut asked_memory, start + step);
        let rates = stepper.follow(&mut state, asked, &ground, &mut memory);
        if HORIZONS.contains(&(step + 1)) {
            told.push([rates.speed.1, rates.yaw_rate.1, rates.side_speed.1]);
        }
    }
    told
}

/// What is held moves through single precision over the whole drive.
#[test]
fn lanes_foretell_what_single_steps_do() {
    let drive = drive(20.0, 5.0);
    let model = Model { wheelbase_m: WHEELBASE_M, limits: UNLIMITED, effects: effects() };
    let stepper = Stepper::new(&model, STEP_S, 1.0).with_instant_actuators();
    let predicted = Simulator::new(WHEELBASE_M, &effects()).predict(&[&drive]);
    let starts = drive.starts.iter().zip(predicted.chunks(HORIZONS.len() * N_QUANTITIES));
    for (&start, outcomes) in starts.step_by(13) {
        for (own, expected) in outcomes.chunks(N_QUANTITIES).zip(stepped(&stepper, &drive, start)) {
            let found = [VX, WZ, VY].map(|quantity| f64::from(own[quantity]));
            let is_near = found.iter().zip(expected).all(|(found, expected)| (found - expected).abs() < 2e-5);
            assert!(is_near, "from row {start}: {found:?} {expected:?}");
        }
    }
}

/// Rolling straight on at 2 m/s and sliding to the left at w = 9 - M g t, as friction leaves of it: a rollout from where w is
/// 4 m/s and more goes on sliding, 0.3 s ahead slower by 0.3 M g; one that has to begin without, where nothing tells the
/// sideways speed, never slides.
#[test]
fn a_rollout_goes_on_with_the_slide_that_it_begins_in() {
    let (mu, thrown_mps, seconds) = (0.3, 9.0, 12.0);
    let slowing_mps2 = mu * 9.80665;
    let sliding = [Column::CmdSpeed, Column::CmdSteer, Column::Vx, Column::Wz, Column::Vy];
    let drive = |columns: &[Column]| {
        let log = log(columns, (seconds / STEP_S) as usize + 1, STEP_S, |column, t| match column {
            Column::CmdSpeed | Column::Vx => 2.0,
            Column::Vy => (thrown_mps - slowing_mps2 * t).max(0.0),
            _ => 0.0,
        });
        Drive::of(&log.runs().next().unwrap(), &machine()).unwrap()
    };
    let simulator = Simulator::new(WHEELBASE_M, &[effect("tyre_slide", [mu, 1.0, 0.0, 0.0])]);
    let foretold = |drive: &Drive| {
        let start = drive.starts[0];
        let predicted = simulator.predict(&[drive]);
        (drive.smooth[VY][start], f64::from(predicted[VY]), f64::from(predicted[1]))
    };
    let drive_that_tells = drive(&sliding);
    let (begun_mps, found_mps, across_m) = foretold(&drive_that_tells);
    assert!(begun_mps > 4.0, "{begun_mps}");
    let (ahead_s, expected_mps) = (0.3, begun_mps - 0.3 * slowing_mps2);
    assert!((found_mps - expected_mps).abs() < 0.02, "{found_mps} {expected_mps}");
    let expected_m = (begun_mps - 0.5 * slowing_mps2 * ahead_s) * ahead_s;
    assert!((across_m - expected_m).abs() < 0.05, "{across_m} {expected_m}");
    let (_, found_mps, across_m) = foretold(&drive(&sliding[..4]));
    assert!(found_mps == 0.0 && across_m.abs() < 1e-6, "{found_mps} {across_m}");
}
