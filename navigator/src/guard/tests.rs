use std::f64::consts::{PI, TAU};

use proptest::prelude::*;

use super::*;

const CYCLE_NS: u64 = 100_000_000;

fn driving(cycle: u64) -> Odometry {
    // 1 m/s along x: 0.1 m per cycle.
    Odometry {
        valid_at_ns: cycle * CYCLE_NS,
        position_m: [0.1 * cycle as f64, 0.0, 0.0],
        velocity_mps: [1.0, 0.0],
        ..Odometry::default()
    }
}

fn guard_after(n_cycles: u64) -> Guard {
    let mut guard = Guard::new(GuardConfig::default());
    for cycle in 0..n_cycles {
        assert_eq!(guard.admit_odometry(&driving(cycle)), Ok(Admitted::Onward));
        guard.note_scan(cycle * CYCLE_NS);
        guard.note_command(1.0);
    }
    guard
}

#[test]
fn steady_driving_passes() {
    assert_eq!(guard_after(20).check(19 * CYCLE_NS), Ok(()));
}

#[test]
fn non_finite_odometry_is_refused_and_not_remembered() {
    let mut guard = guard_after(5);
    let broken = Odometry { yaw_rate_radps: f64::NAN, ..driving(5) };
    assert_eq!(guard.admit_odometry(&broken), Err(StopReason::NonFiniteInput));
    assert_eq!(guard.admit_odometry(&driving(6)), Ok(Admitted::Onward));
}

#[test]
fn old_odometry_and_old_scans_stop_the_vehicle() {
    let mut guard = guard_after(5);
    assert_eq!(guard.check(4 * CYCLE_NS + 310_000_000), Err(StopReason::StaleOdometry));
    for cycle in 5..15 {
        guard.admit_odometry(&driving(cycle)).unwrap();
    }
    // The last scan came at 0.4 s, it is now 1.4 s: exactly at the limit; a cycle later it is too old.
    assert_eq!(guard.check(14 * CYCLE_NS), Ok(()));
    guard.admit_odometry(&driving(15)).unwrap();
    assert_eq!(guard.check(15 * CYCLE_NS), Err(StopReason::StaleScan));
}

#[test]
fn first_scan_must_come_within_its_age_limit() {
    let mut guard = Guard::new(GuardConfig::default());
    for cycle in 3..14 {
        guard.admit_odometry(&driving(cycle)).unwrap();
        // The first odometry came at 0.3 s, at 1.3 s it is exactly the limit of 1 s ago.
        assert_eq!(guard.check(cycle * CYCLE_NS), Ok(()));
    }
    guard.admit_odometry(&driving(14)).unwrap();
    assert_eq!(guard.check(14 * CYCLE_NS), Err(StopReason::StaleScan));
    guard.note_scan(14 * CYCLE_NS);
    assert_eq!(guard.check(14 * CYCLE_NS), Ok(()));
}

#[test]
fn odometry_that_repeats_while_moving_is_frozen_until_it_changes() {
    let mut guard = guard_after(5);
    for cycle in 5..11 {
        // The wheels' own sensor still counts.
        let wheel_speed_mps = 1.0 + 0.01 * cycle as f64;
        let frozen = Odometry { valid_at_ns: cycle * CYCLE_NS, wheel_speed_mps, ..driving(4) };
        guard.admit_odometry(&frozen).unwrap();
        guard.note_scan(cycle * CYCLE_NS);
    }
    // Last change at 0.4 s, now 1.0 s: 0.6 s > 0.5 s.
    assert_eq!(guard.check(10 * CYCLE_NS), Err(StopReason::StaleOdometry));
    guard.note_command(0.0);
    guard.admit_odometry(&Odometry { valid_at_ns: 11 * CYCLE_NS, ..driving(4) }).unwrap();
    assert_eq!(guard.check(11 * CYCLE_NS), Err(StopReason::StaleOdometry), "standing still does not thaw it");
    guard.admit_odometry(&Odometry { valid_at_ns: 12 * CYCLE_NS, ..driving(5) }).unwrap();
    guard.note_scan(12 * CYCLE_NS);
    assert_eq!(guard.check(12 * CYCLE_NS), Ok(()));
}

#[test]
fn repeating_odometry_at_rest_is_no_fault() {
    let mut guard = Guard::new(GuardConfig::default());
    for cycle in 0..30 {
        guard.admit_odometry(&Odometry { valid_at_ns: cycle * CYCLE_NS, ..Odometry::default() }).unwrap();
        guard.note_scan(cycle * CYCLE_NS);
    }
    assert_eq!(guard.check(29 * CYCLE_NS), Ok(()));
}

#[test]
fn a_correction_of_the_localisation_is_told_from_motion() {
    let mut guard = guard_after(5);
    let mut jumped = driving(5);
    jumped.position_m[0] += 0.6;
    jumped.position_m[1] -= 0.8;
    let Ok(Admitted::Jumped(jump)) = guard.admit_odometry(&jumped) else {
        panic!("a step of 1 m must be a jump")
    };
    assert!((jump.step_m[0] - 0.6).abs() < 1e-9 && (jump.step_m[1] + 0.8).abs() < 1e-9);
}

#[test]
fn step_after_a_gap_is_motion() {
    // Told at 0.4 s that it drives with 1 m/s, then nothing; braked meanwhile, it stands 0.8 m further on.
    let mut guard = guard_after(5);
    let standing = |cycle| Odometry {
        valid_at_ns: cycle * CYCLE_NS,
        position_m: [1.2, 0.0, 0.0],
        ..Odometry::default()
    };
    assert_eq!(guard.admit_odometry(&standing(30)), Ok(Admitted::Onward));
    // The same after a freeze.
    let mut guard = guard_after(5);
    for cycle in 5..30 {
        guard.admit_odometry(&Odometry { valid_at_ns: cycle * CYCLE_NS, ..driving(4) }).unwrap();
    }
    assert_eq!(guard.admit_odometry(&standing(30)), Ok(Admitted::Onward));
}

/// Odometry of a vehicle on a circle, without an error, its yaw wrapped into (-pi, pi] as drivers tell it.
fn circling(at_s: f64, speed_mps: f64, yaw_rate_radps: f64, start_rad: f64) -> Odometry {
    let yaw_rad = start_rad + yaw_rate_radps * at_s;
    let radius_m = speed_mps / yaw_rate_radps;
    Odometry {
        valid_at_ns: (at_s * 1e9).round() as u64,
        position_m: [
            radius_m * (yaw_rad.sin() - start_rad.sin()),
            radius_m * (start_rad.cos() - yaw_rad.cos()),
            0.0,
        ],
        attitude_rad: [0.0, 0.0, PI - (PI - yaw_rad).rem_euclid(TAU)],
        velocity_mps: [speed_mps, 0.0],
        yaw_rate_radps,
        wheel_speed_mps: speed_mps,
        ..Odometry::default()
    }
}

#[test]
fn a_drive_westwards_past_pi_is_no_jump() {
    let mut guard = Guard::new(GuardConfig::default());
    for cycle in 0..40 {
        // 2 m/s at 10 Hz, the yaw going back and forth between 3.1 and -3.1.
        let yaw_rad = if cycle % 2 == 0 { 3.1 } else { -3.1 };
        let odometry = Odometry {
            valid_at_ns: cycle * CYCLE_NS,
            position_m: [-0.2 * cycle as f64, 0.0, 0.0],
            attitude_rad: [0.0, 0.0, yaw_rad],
            velocity_mps: [2.0, 0.0],
            ..Odometry::default()
        };
        assert_eq!(guard.admit_odometry(&odometry), Ok(Admitted::Onward), "cycle {cycle}");
    }
}

proptest! {
    #[test]
    fn driving_on_circles_through_every_yaw_never_jumps(
        speed_mps in -15.0..15.0_f64, yaw_rate_radps in 0.01..1.5_f64, is_right in any::<bool>(),
        start_rad in -PI..PI, rate_hz in 8.0..100.0_f64,
    ) {
        let yaw_rate_radps = if is_right { -yaw_rate_radps } else { yaw_rate_radps };
        let mut guard = Guard::new(GuardConfig::default());
        // Around at least once.
        let n = (1.1 * TAU / yaw_rate_radps.abs() * rate_hz).ceil().min(3000.0) as u64;
        for k in 0..n {
            let odometry = circling(k as f64 / rate_hz, speed_mps, yaw_rate_radps, start_rad);
            prop_assert_eq!(guard.admit_odometry(&odometry), Ok(Admitted::Onward), "sample {} of {}", k, n);
        }
    }

    #[test]
    fn any_correction_beyond_the_limits_is_seen_and_told(
        speed_mps in -5.0..5.0_f64, yaw_rate_radps in -1.0..-0.01_f64, start_rad in -PI..PI,
        // Far away, hardly, and not at all: then it is the turn alone that is to be seen.
        step_m in prop_oneof![
            prop::array::uniform2(-20.0..20.0_f64),
            prop::array::uniform2(-0.2..0.2_f64),
            Just([0.0; 2]),
        ],
        turn_rad in prop_oneof![-PI..PI, -0.2..0.2_f64, Just(0.0)], rate_hz in 10.0..100.0_f64,
    ) {
        let config = GuardConfig::default();
        // A hundredth of a metre and of a radian for the reckoning along a chord.
        prop_assume!(step_m[0].hypot(step_m[1]) > config.jump_min_m + 0.01 || turn_rad.abs() > config.jump_min_rad + 0.01);
        let mut guard = Guard::new(config);
        let at = |k: u64| circling(k as f64 / rate_hz, speed_mps, yaw_rate_radps, start_rad);
        (0..5).for_each(|k| assert_eq!(guard.admit_odometry(&at(k)), Ok(Admitted::Onward)));
        let (truth, mut corrected) = (at(5), at(5));
        (0..2).for_each(|axis| corrected.position_m[axis] += step_m[axis]);
        let yaw_rad = corrected.attitude_rad[2] + turn_rad;
        corrected.attitude_rad[2] = PI - (PI - yaw_rad).rem_euclid(TAU);
        let admitted = guard.admit_odometry(&corrected);
        let Ok(Admitted::Jumped(jump)) = admitted else { panic!("{admitted:?}") };
        prop_assert!((turned_rad(turn_rad, jump.yaw_rad)).abs() < 0.01, "{:?}", jump);
        let now_m = jump.place_m(truth.position_m);
        let away_m = (now_m[0] - corrected.position_m[0]).hypot(now_m[1] - corrected.position_m[1]);
        prop_assert!(away_m < 0.01, "{} m", away_m);
    }
}

#[test]
fn odometry_out_of_order_is_refused_and_counted() {
    let mut guard = guard_after(5);
    // Late on the way, and another one of the same time; the last once more is no fault.
    assert_eq!(guard.admit_odometry(&driving(2)), Err(StopReason::InputOutOfOrder));
    let other = Odometry { yaw_rate_radps: 0.1, ..driving(4) };
    assert_eq!(guard.admit_odometry(&other), Err(StopReason::InputOutOfOrder));
    assert_eq!(guard.admit_odometry(&driving(4)), Ok(Admitted::Again));
    assert_eq!(guard.refused()[&StopReason::InputOutOfOrder], 2);
    assert_eq!(guard.admit_odometry(&driving(5)), Ok(Admitted::Onward), "no jump is made of it");
    assert_eq!(guard.check(5 * CYCLE_NS), Ok(()));
}

#[test]
fn measurements_from_the_future_stop_the_vehicle_and_do_not_lock_it() {
    let mut guard = guard_after(5);
    let glitch = Odometry { valid_at_ns: u64::MAX - 5, ..driving(5) };
    guard.admit_odometry(&glitch).unwrap();
    assert_eq!(guard.check(5 * CYCLE_NS), Err(StopReason::InputFromFuture));
    // What comes in its time is behind the glitch, until it has gone on for longer than the age limit of 0.3 s.
    let admitted: Vec<_> = (6..=10).map(|cycle| guard.admit_odometry(&driving(cycle))).collect();
    assert_eq!(admitted[..3], [Err(StopReason::InputOutOfOrder); 3]);
    assert!(admitted[3..].contains(&Ok(Admitted::ClockSetBack)), "{admitted:?}");
    assert_eq!(guard.check(10 * CYCLE_NS), Err(StopReason::StaleScan), "no scan has come in the new time");
    guard.admit_scan(10 * CYCLE_NS).unwrap();
    guard.note_scan(10 * CYCLE_NS);
    assert_eq!(guard.check(10 * CYCLE_NS), Ok(()));
    // Clocks of two machines are never the same.
    assert_eq!(guard.check(10 * CYCLE_NS - 15_000_000), Ok(()));
}

#[test]
fn a_clock_that_is_set_back_is_followed_after_the_age_limit() {
    let mut guard = Guard::new(GuardConfig::default());
    let shifted = |cycle: u64| Odometry { valid_at_ns: (1_000_000 + cycle) * CYCLE_NS, ..driving(cycle) };
    (0..5).for_each(|cycle| assert_eq!(guard.admit_odometry(&shifted(cycle)), Ok(Admitted::Onward)));
    // Two publishers that take turns are no clock that was set back.
    for cycle in 5..20 {
        assert_eq!(guard.admit_odometry(&driving(cycle)), Err(StopReason::InputOutOfOrder));
        assert_eq!(guard.admit_odometry(&shifted(cycle)), Ok(Admitted::Onward));
    }
    let admitted: Vec<_> = (20..30).map(|cycle| guard.admit_odometry(&driving(cycle))).collect();
    assert_eq!(admitted[..3], [Err(StopReason::InputOutOfOrder); 3]);
    assert!(admitted[3..5].contains(&Ok(Admitted::ClockSetBack)), "{admitted:?}");
    assert_eq!(admitted[5..], [Ok(Admitted::Onward); 5]);
}

#[test]
fn scans_of_the_future_and_older_ones_do_not_count() {
    let mut guard = guard_after(5);
    assert_eq!(guard.admit_scan(8 * CYCLE_NS), Err(StopReason::InputFromFuture));
    guard.note_scan(u64::MAX);
    assert_eq!(guard.check(4 * CYCLE_NS), Ok(()));
    assert_eq!(guard.admit_scan(3 * CYCLE_NS), Err(StopReason::InputOutOfOrder));
    guard.note_scan(3 * CYCLE_NS);
    assert_eq!(guard.admit_scan(4 * CYCLE_NS), Ok(()), "the last one once more");
    for cycle in 5..15 {
        guard.admit_odometry(&driving(cycle)).unwrap();
    }
    // The last that counted came at 0.4 s; at 1.4 s it is at the limit.
    assert_eq!(guard.check(14 * CYCLE_NS), Ok(()));
    guard.admit_odometry(&driving(15)).unwrap();
    assert_eq!(guard.check(14 * CYCLE_NS + 1), Err(StopReason::InputFromFuture), "odometry is ahead");
    assert_eq!(guard.check(15 * CYCLE_NS), Err(StopReason::StaleScan));
    let counted =
        [StopReason::InputFromFuture, StopReason::InputOutOfOrder].map(|reason| guard.refused()[&reason]);
    assert_eq!(counted, [1, 1]);
}

#[test]
fn numbers_that_no_vehicle_has_are_refused_with_their_own_reason() {
    let mut guard = guard_after(5);
    let wild = [
        Odometry { position_m: [1e19, 0.0, 0.0], ..driving(5) },
        Odometry { position_m: [0.0, 0.0, -1e19], ..driving(5) },
        Odometry { velocity_mps: [1e300, 0.0], ..driving(5) },
        Odometry { yaw_rate_radps: -1e9, ..driving(5) },
        Odometry { attitude_rad: [0.0, 0.0, 1e19], ..driving(5) },
        Odometry { wheel_speed_mps: f64::MAX, ..driving(5) },
    ];
    for odometry in wild {
        assert_eq!(guard.admit_odometry(&odometry), Err(StopReason::InputOutOfRange), "{odometry:?}");
    }
    assert_eq!(guard.refused()[&StopReason::InputOutOfRange], 6);
    assert_eq!(guard.admit_odometry(&driving(5)), Ok(Admitted::Onward));
}

#[test]
fn a_localisation_that_thaws_soon_has_not_jumped() {
    // 6 m/s at 50 Hz, frozen for 0.2 s: then it tells where it has come to.
    let at = |k: u64, of: u64| Odometry {
        valid_at_ns: k * 20_000_000,
        position_m: [0.12 * of as f64, 0.0, 0.0],
        velocity_mps: [6.0, 0.0],
        ..Odometry::default()
    };
    let mut guard = Guard::new(GuardConfig::default());
    guard.note_command(6.0);
    for k in 0..30 {
        let of = if (10..20).contains(&k) { 9 } else { k };
        assert_eq!(guard.admit_odometry(&at(k, of)), Ok(Admitted::Onward), "sample {k}");
    }
}
