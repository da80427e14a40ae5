//! What runs with missing columns, holes and little time give to be compared, against closed forms.

#![allow(clippy::unwrap_used, reason = "a panic is how a test fails")]

use super::testing::{log, machine};
use super::*;
use crate::comparison::{Comparison, Yardstick, rollout_error, root_mean_square};
use crate::rollout::{PER_START, Simulator};
use bicycle::effect::{RearSlip, SpeedDelay, SteerGain};
use bicycle::{Column, DriveLog, Effect};
use std::f64::consts::TAU;

fn drive(log: &DriveLog) -> Result<Drive, DriveError> {
    Drive::of(&log.runs().next().unwrap(), &machine())
}

fn predicted(drive: &Drive, effects: &[Effect]) -> Vec<Vec<f32>> {
    Simulator::new(1.0, effects).predict(&[drive]).chunks(N_QUANTITIES).map(<[f32]>::to_vec).collect()
}

/// A circle of radius 4 m at 2 m/s.
fn on_circle(column: Column, t: f64) -> f64 {
    match column {
        Column::X => 4.0 * (0.5 * t).sin(),
        Column::Y => 4.0 - 4.0 * (0.5 * t).cos(),
        Column::Yaw => 0.5 * t,
        Column::Wz => 0.5,
        Column::CmdSteer | Column::SteerMeas => 0.25_f64.atan(),
        Column::CmdWz => 0.5,
        _ => 2.0,
    }
}

const POSE: [Column; 3] = [Column::X, Column::Y, Column::Yaw];

#[test]
fn a_long_run_is_compared_at_all_horizons_from_every_start() {
    let columns = [&POSE[..], &[Column::Vx, Column::Wz, Column::CmdSpeed, Column::CmdSteer]].concat();
    let drive = drive(&log(&columns, 501, 0.02, on_circle)).unwrap();
    assert_eq!((drive.starts[0], drive.starts[1], drive.commands.len()), (75, 85, 501));
    assert_eq!(drive.starts.len(), (401_usize - 75).div_ceil(10));
    assert!(drive.measured[..VY].iter().flatten().all(|value| value.is_finite()));
}

#[test]
fn rollouts_of_a_short_run_end_with_it() {
    let columns = [&POSE[..], &[Column::Vx, Column::Wz, Column::CmdSpeed, Column::CmdSteer]].concat();
    let drive = drive(&log(&columns, 101, 0.02, on_circle)).unwrap();
    // 2 s: a fifth settles, the last start is 0.3 s before the end.
    assert_eq!((drive.starts[0], *drive.starts.last().unwrap()), (20, 80));
    let within =
        |start: usize, steps: usize| drive.outcome(start, steps)[..VY].iter().all(|value| !value.is_nan());
    assert!(within(20, 60) && !within(20, 100) && within(80, 15) && !within(80, 30));
    let residuals = Comparison::new(1.0, vec![&drive], &Yardstick::rough()).residuals(&[]);
    assert!(root_mean_square(&residuals) < 0.1, "{residuals:?}");
    let last = &residuals[residuals.len() - PER_START..];
    assert!(last[N_QUANTITIES..].iter().all(|residual| *residual == 0.0));
}

#[test]
fn every_set_of_columns_drives_the_same_circle() {
    let sets: [&[Column]; 6] = [
        &[Column::CmdSteer, Column::CmdSpeed, Column::Vx, Column::Wz],
        &[Column::SteerMeas, Column::Vx, Column::Wz, Column::Yaw],
        &[Column::SteerMeas, Column::CmdSpeed, Column::WheelSpeed, Column::Yaw],
        &[Column::CmdWz, Column::CmdSpeed, Column::X, Column::Y, Column::Yaw],
        &[Column::WheelSpeed, Column::CmdSteer, Column::X, Column::Y, Column::Yaw],
        &[Column::CmdSteer, Column::CmdSpeed, Column::Wz],
    ];
    for columns in sets {
        let drive = drive(&log(columns, 401, 0.025, on_circle)).unwrap();
        let residuals = Comparison::new(1.0, vec![&drive], &Yardstick::rough()).residuals(&[]);
        let error = root_mean_square(&residuals);
        assert!(error > 0.0 && error < 0.2, "{columns:?}: {error}");
        let wrong = Effect::SteerGain(SteerGain { ratio: 0.5 });
        let residuals = Comparison::new(1.0, vec![&drive], &Yardstick::rough()).residuals(&[wrong]);
        assert!(root_mean_square(&residuals) > 1.0, "{columns:?}");
    }
}

/// The circle with sideways speeds.
fn slipping(side_speed_mps: impl Fn(f64) -> f64) -> Drive {
    let columns = [Column::Vx, Column::Vy, Column::Wz, Column::CmdSpeed, Column::CmdSteer];
    let value = |column: Column, t: f64| match column {
        Column::Vy => side_speed_mps(t),
        // What is exactly as foretold counts as not measured.
        Column::Vx | Column::Wz => on_circle(column, t) + 1e-4 * (3.0 * t).sin(),
        _ => on_circle(column, t),
    };
    drive(&log(&columns, 501, 0.02, value)).unwrap()
}

/// Rear tyres that give way by 0.01 s2/m: on the circle by 0.01 * 2 * (2 * 0.5) = 0.02 m/s to the outside, which the error of
/// a model is not made of. A column of zeros is none.
#[test]
fn a_sideways_speed_counts_where_one_was_measured() {
    let slipping_drive = slipping(|t| -0.02 + 1e-4 * t.sin());
    let slip = Effect::RearSlip(RearSlip { compliance_s2_per_m: 0.01 });
    assert!(predicted(&slipping_drive, &[slip]).iter().all(|row| (row[VY] + 0.02).abs() < 1e-6));
    let rough = Yardstick::rough();
    let residuals = |drive: &Drive, effects: &[Effect], yardstick: &Yardstick| {
        Comparison::new(1.0, vec![drive], yardstick).residuals(effects)
    };
    let of_side =
        |residuals: &[f32]| -> Vec<f32> { residuals.chunks(N_QUANTITIES).map(|own| own[VY]).collect() };
    let without = residuals(&slipping_drive, &[], &rough);
    // 0.02 m/s in units of 0.05.
    assert!(of_side(&without).iter().all(|side| (side - 0.4).abs() < 0.01), "{without:?}");
    assert!(of_side(&residuals(&slipping_drive, &[slip], &rough)).iter().all(|side| side.abs() < 0.01));
    assert!(rollout_error(&without) < 0.01 && root_mean_square(&without) > 0.1);
    let unmeasured = slipping(|_| 0.0);
    assert!(of_side(&residuals(&unmeasured, &[slip], &rough)).iter().all(|side| *side == 0.0));
    // Of three quantities that are measured one is the speed to the left; of two none.
    let of = |drive: &Drive| Yardstick::of(&residuals(drive, &[], &rough), &rough);
    let ratio =
        |drive: &Drive, yardstick: &Yardstick| Comparison::new(1.0, vec![drive], yardstick).numbers_ratio();
    assert!((ratio(&slipping_drive, &of(&slipping_drive)) - 1.5).abs() < 1e-12);
    assert!((ratio(&unmeasured, &of(&unmeasured)) - 1.0).abs() < 1e-12);
    // Nominal drives that do not tell it are no measure of it.
    assert!(of_side(&residuals(&slipping_drive, &[], &of(&unmeasured))).iter().all(|side| *side == 0.0));
}

/// From rest at 1 m/s2 from t = 1 s on, 0.4 s late: what a commanded acceleration leads to.
#[test]
fn a_commanded_acceleration_adds_up() {
    let late_s = 0.4;
    let log =
        log(
            &[Column::CmdAccel, Column::CmdSteer, Column::Vx, Column::Wz],
            501,
            0.02,
            |column, t| match column {
                Column::CmdAccel => f64::from(u8::from(t >= 2.0 - 1e-9)),
                Column::Vx => 3.0 + (t - 2.0 - late_s).max(0.0),
                _ => 0.0,
            },
        );
    let drive = drive(&log).unwrap();
    let error = |effects: &[Effect]| {
        root_mean_square(&Comparison::new(1.0, vec![&drive], &Yardstick::rough()).residuals(effects))
    };
    assert!(error(&[]) > 0.5);
    assert!(error(&[Effect::SpeedDelay(SpeedDelay { delay_s: late_s })]) < 0.05);
}

/// No bicycle turns without driving; a skid-steered machine does.
#[test]
fn a_skid_steered_machine_turns_on_the_spot() {
    let log = log(&[Column::CmdWz, Column::CmdSpeed, Column::Vx, Column::Wz], 401, 0.02, |column, _| {
        f64::from(u8::from(matches!(column, Column::CmdWz | Column::Wz)))
    });
    let drive = drive(&log).unwrap();
    let rows = predicted(&drive, &[Effect::SteerGain(SteerGain { ratio: 0.6 })]);
    for (row, horizon) in rows.iter().zip(HORIZONS.iter().cycle()) {
        let turn = 0.6 * *horizon as f64 * STEP_S;
        assert!((f64::from(row[YAW]) - turn).abs() < 1e-5 && (row[WZ] - 0.6).abs() < 1e-6, "{row:?}");
        assert!(row[X].abs() < 1e-6);
    }
}

#[test]
fn no_rollout_starts_in_a_hole_or_runs_through_one() {
    let columns = [Column::Vx, Column::Wz, Column::CmdSpeed, Column::CmdSteer];
    let with_hole = |missing: Column| {
        log(&columns, 1001, 0.02, |column, t| {
            if column == missing && (10.0..10.5).contains(&t) { f64::NAN } else { on_circle(column, t) }
        })
    };
    let drive_with = |missing| drive(&with_hole(missing)).unwrap();
    let near = |drive: &Drive, from_s: f64, to_s: f64| {
        drive.starts.iter().any(|start| (from_s..to_s).contains(&(*start as f64 * STEP_S)))
    };
    let command = drive_with(Column::CmdSteer);
    assert!(!near(&command, 8.1, 11.9) && near(&command, 7.5, 8.1) && near(&command, 11.9, 12.3));
    let speed = drive_with(Column::Vx);
    assert!(!near(&speed, 10.0, 10.5) && near(&speed, 9.7, 10.0));
    assert!(speed.outcome(495, 15)[VX].is_nan() && speed.smooth[VX][510] == 2.0);
}

#[test]
fn what_cannot_be_compared_is_refused() {
    let columns = [Column::Vx, Column::Wz, Column::CmdSpeed, Column::CmdSteer];
    let short = drive(&log(&columns, 10, 0.1, on_circle)).unwrap_err();
    assert_eq!(short.to_string(), "run '': expected at least 1.0 s, found 0.9 s");
    let blind = drive(&log(&columns[..3], 100, 0.1, on_circle)).unwrap_err();
    assert_eq!(
        blind.to_string(),
        "run '': expected the column cmd_steer or one that stands in for it, found none"
    );
    let holes = log(&columns, 100, 0.1, |column, t| {
        if column == Column::CmdSteer && t % 1.0 < 0.15 { f64::NAN } else { (TAU * t).sin() }
    });
    let holes = drive(&holes).unwrap_err();
    assert_eq!(
        holes.to_string(),
        "run '': expected inputs and measurements without holes for 3.5 s, found none"
    );
}
