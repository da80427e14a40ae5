#![allow(clippy::unwrap_used, reason = "a panic is how a test fails")]

use super::*;
use rand::{RngExt, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;

const STEP_S: f64 = 0.02;

/// What makes a drive.
#[derive(Clone, Copy)]
struct Made {
    late_s: f64,
    ahead_m: f64,
    left_m: f64,
    /// Rows over which a pose is held.
    held: usize,
    turns: f64,
    duration_s: f64,
    seed: u64,
}

const MADE: Made =
    Made { late_s: 0.0, ahead_m: 0.0, left_m: 0.0, held: 1, turns: 1.0, duration_s: 60.0, seed: 1 };

/// Pose of the rear axle every millisecond from half a second before the drive, in small steps that know no windows; it
/// slips by 0.004 v^2 times the yaw rate, its yaw rate is off by 0.01 rad/s and its speed by 3 per cent.
fn drive(made: Made) -> DriveLog {
    let rates = |t: f64| {
        let speed = 3.0 + 1.5 * (0.7 * t + made.seed as f64).sin() + (0.23 * t).cos();
        (speed, made.turns * (0.5 * (0.9 * t).sin() + 0.3 * (0.31 * t + made.seed as f64).cos()))
    };
    let mut poses = Vec::new();
    let (mut x, mut y, mut yaw) = (5.0, -2.0, 0.4_f64);
    for step in 0..((made.duration_s + 1.0) * 1000.0) as usize {
        poses.push([x, y, yaw]);
        let (speed, rate) = rates((step as f64 + 0.5) * 1e-3 - 0.5);
        let slip = -0.004 * speed * speed * rate;
        let (sine, cosine) = (yaw + 0.5e-3 * rate).sin_cos();
        x += 1e-3 * (speed * cosine - slip * sine);
        y += 1e-3 * (speed * sine + slip * cosine);
        yaw += 1e-3 * rate;
    }
    let mut random = Xoshiro256PlusPlus::seed_from_u64(made.seed);
    let mut noise = |sigma: f64| (0..12).map(|_| random.random_range(-0.5..0.5)).sum::<f64>() * sigma;
    let mut log = DriveLog::default();
    let mut pose = [0.0; 3];
    for row in 0..(made.duration_s / STEP_S) as usize {
        let t = row as f64 * STEP_S;
        if row % made.held == 0 {
            let [x, y, yaw] = poses[((t - made.late_s + 0.5) * 1000.0).round() as usize];
            let (sine, cosine) = yaw.sin_cos();
            let [dx, dy] =
                [cosine * made.ahead_m - sine * made.left_m, sine * made.ahead_m + cosine * made.left_m];
            pose = [x + dx + noise(0.02), y + dy + noise(0.02), yaw + noise(0.005)];
        }
        let (speed, rate) = rates(t);
        let measured = DriveRow::new(t)
            .with(Column::Vx, 1.03 * speed + noise(0.03))
            .with(Column::Wz, rate + 0.01 + noise(0.01));
        let measured = measured.with(Column::X, pose[0]).with(Column::Y, pose[1]);
        let yaw = (pose[2] + std::f64::consts::PI).rem_euclid(std::f64::consts::TAU) - std::f64::consts::PI;
        log.push("", &measured.with(Column::Yaw, yaw)).unwrap();
    }
    log
}

fn drives(made: Made) -> Drives {
    let logs = vec![drive(made), drive(Made { seed: made.seed + 1, ..made })];
    Drives { names: vec!["a".to_owned(), "b".to_owned()], logs }
}

const BOTH: [PoseUnknown; 2] = [PoseUnknown::TimeOffset, PoseUnknown::LeverArm];

/// Late, early or on time; ahead, behind or in place; by every row or every fifth.
#[test]
fn what_a_pose_is_late_and_off_by_is_found() {
    let mut n_inside = 0;
    let cases = [
        (0.12, 0.8, -0.3, 1),
        (0.12, 0.8, -0.3, 5),
        (-0.07, -0.4, 0.2, 1),
        (0.0, 0.0, 0.0, 5),
        (0.33, 1.5, 0.0, 1),
    ];
    for (late_s, ahead_m, left_m, held) in cases {
        let found =
            PoseSensor::estimated(&drives(Made { late_s, ahead_m, left_m, held, ..MADE }), 1.6, &BOTH)
                .unwrap();
        let estimates =
            [found.time_offset_s, found.lever_arm_ahead_m, found.lever_arm_left_m].map(Option::unwrap);
        for ((estimate, truth), allowed) in
            estimates.iter().zip([late_s, ahead_m, left_m]).zip([0.006, 0.04, 0.04])
        {
            assert!((estimate.value - truth).abs() < allowed, "{truth}: {estimate:?}");
            n_inside += usize::from((estimate.low..=estimate.high).contains(&truth));
        }
    }
    // 15 intervals of 90 %: fewer than 10 inside come out once in a thousand.
    assert!(n_inside >= 10, "{n_inside} of 15 intervals hold the truth");
}

/// What is taken out leaves poses that agree with those of a sensor that was on time and in place, but for noise.
#[test]
fn poses_are_those_of_the_rear_axle_once_it_is_taken_out() {
    let off = Made { late_s: 0.1, ahead_m: 0.8, left_m: -0.3, held: 5, ..MADE };
    let found = PoseSensor::estimated(&drives(off), 1.6, &BOTH).unwrap();
    let (corrected, right) = (found.taken_out(&drive(off)), drive(MADE));
    let [corrected, right] =
        [&corrected, &right].map(|log| log.runs().next().unwrap().drive_rows().collect::<Vec<_>>());
    let mut squares = [0.0; 2];
    let rows = 10..right.len() - 10;
    for (corrected, right) in corrected[rows.clone()].iter().zip(&right[rows.clone()]) {
        for (sum, column) in squares.iter_mut().zip([Column::X, Column::Y]) {
            *sum += (corrected.value(column) - right.value(column)).powi(2) / rows.len() as f64;
        }
        assert!((corrected.value(Column::Vx) - right.value(Column::Vx)).abs() < 1.0);
    }
    // Noise of 0.02 m in each of both, and up to 0.04 m of the lever arm.
    assert!(squares.iter().all(|square| square.sqrt() < 0.05), "{squares:?}");
}

#[test]
fn one_unknown_alone_leaves_the_other_out() {
    let made = drives(Made { ahead_m: 0.5, ..MADE });
    let found = PoseSensor::estimated(&made, 1.6, &[PoseUnknown::LeverArm]).unwrap();
    assert!(found.time_offset_s.is_none() && (found.lever_arm_ahead_m.unwrap().value - 0.5).abs() < 0.04);
    let found = PoseSensor::estimated(&drives(Made { late_s: 0.2, ..MADE }), 1.6, &[PoseUnknown::TimeOffset]);
    let found = found.unwrap();
    assert!(found.lever_arm_left_m.is_none() && (found.time_offset_s.unwrap().value - 0.2).abs() < 0.006);
}

#[test]
fn drives_that_do_not_tell_it_are_refused() {
    let told = |made: Made| PoseSensor::estimated(&drives(made), 1.6, &BOTH).unwrap_err().to_string();
    let straight = told(Made { turns: 0.0, ..MADE });
    assert!(straight.contains("expected drives that turn by 0.05 rad or more within 2 s"), "{straight}");
    let short = told(Made { duration_s: 10.0, ..MADE });
    assert_eq!(short, "pose sensor: expected at least 30 s of drives, found 20 s");
    let far = told(Made { late_s: 0.5, duration_s: 60.0, ..MADE });
    assert_eq!(far, "pose sensor: expected a time offset within 0.5 s, found none that fits best there");
    let mut blind = drives(MADE);
    let mut without = DriveLog::default();
    for row in blind.logs[1].runs().next().unwrap().drive_rows() {
        without.push("", &row.with(Column::Wz, f64::NAN)).unwrap();
    }
    blind.logs[1] = without;
    let missing = PoseSensor::estimated(&blind, 1.6, &BOTH).unwrap_err().to_string();
    assert_eq!(missing, "b: expected the column wz to tell how the pose sensor sits, found none");
}
