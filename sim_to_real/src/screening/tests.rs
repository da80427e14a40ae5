use bicycle::{Column, DriveRow};

use super::*;
use crate::GroundMap;

const WHEELBASE_M: f64 = 2.0;
const STEP_S: f64 = 0.02;

fn machine() -> Machine {
    Machine {
        name: "m".to_owned(),
        wheelbase_m: WHEELBASE_M,
        steering_max_rad: 0.5,
        speed_max_mps: 6.0,
        noise: None,
        ground: None,
    }
}

/// A drive of `n` rows: speed 4 + sin(t / 2), yaw rate 0.8 sin(0.7 t), steering as the kinematics demand, the path by
/// adding up small steps; a rise of 0.1 ahead.
fn rows(n: usize) -> Vec<DriveRow> {
    let [mut x, mut y, mut yaw, mut z] = [3.0, -2.0, 0.4, 0.0];
    let row = |k: usize| {
        let time_s = k as f64 * STEP_S;
        let speed = 4.0 + (0.5 * time_s).sin();
        let yaw_rate = 0.8 * (0.7 * time_s).sin();
        let slope = 0.1 * (0.2 * time_s).cos();
        let row = DriveRow::new(time_s)
            .with(Column::X, x)
            .with(Column::Y, y)
            .with(Column::Z, z)
            .with(Column::Pitch, -slope)
            .with(Column::Roll, 0.02)
            .with(Column::Yaw, yaw)
            .with(Column::Vx, speed)
            .with(Column::Wz, yaw_rate)
            .with(Column::CmdSpeed, speed)
            .with(Column::CmdSteer, (WHEELBASE_M * yaw_rate / speed).atan());
        let middle = yaw + 0.5 * yaw_rate * STEP_S;
        x += speed * middle.cos() * STEP_S;
        y += speed * middle.sin() * STEP_S;
        z += speed * slope * STEP_S;
        yaw += yaw_rate * STEP_S;
        yaw -= std::f64::consts::TAU * (yaw / std::f64::consts::TAU).round();
        row
    };
    (0..n).map(row).collect()
}

fn log(rows: &[DriveRow]) -> DriveLog {
    let mut log = DriveLog::default();
    rows.iter().for_each(|row| log.push("", row).unwrap());
    log
}

/// The drive with a column changed.
fn with(column: Column, change: impl Fn(usize, f64) -> f64) -> DriveLog {
    let change = |(k, row): (usize, &DriveRow)| row.with(column, change(k, row.value(column)));
    log(&rows(1000).iter().enumerate().map(change).collect::<Vec<_>>())
}

fn without(columns: &[Column]) -> DriveLog {
    let clear = |row: &DriveRow| columns.iter().fold(*row, |row, column| row.with(*column, f64::NAN));
    log(&rows(1000).iter().map(clear).collect::<Vec<_>>())
}

fn first(log: &DriveLog) -> Suspicion {
    let found = screen(&machine(), log);
    assert!(!found.is_empty(), "nothing was found");
    found[0].clone()
}

fn told(log: &DriveLog) -> String {
    first(log).to_string()
}

#[test]
fn a_sound_drive_is_not_suspected() {
    assert_eq!(screen(&machine(), &log(&rows(1000))), []);
}

#[test]
fn a_drive_with_few_sensors_is_not_suspected() {
    let few = [
        &[Column::X, Column::Y][..],
        &[Column::Wz],
        &[Column::Yaw, Column::X, Column::Y],
        &[Column::Vx],
        &[Column::CmdSpeed],
        &[Column::X, Column::Y, Column::Yaw, Column::Vx, Column::CmdSpeed],
    ];
    for columns in few {
        assert_eq!(screen(&machine(), &without(columns)), [], "{columns:?}");
    }
}

#[test]
fn a_gap_splits_the_drive_and_is_told() {
    let mut rows = rows(1000);
    rows.drain(400..430);
    let log = log(&rows);
    let Suspicion::Gap { place, length_s, .. } = first(&log) else { panic!("{:?}", first(&log)) };
    // Row 400, counted from 1, is the last before it.
    assert_eq!(place.row, 400);
    assert!((length_s - 31.0 * STEP_S).abs() < 1e-9 && (place.time_s - 399.0 * STEP_S).abs() < 1e-9);
    assert_eq!(first(&log).gravity(), Gravity::Doubtful);
    let split = split_at_breaks(&machine(), &log).unwrap();
    assert_eq!(
        split.runs().map(|run| (run.name().to_owned(), run.time_s().len())).collect::<Vec<_>>(),
        [("part 1".to_owned(), 400), ("part 2".to_owned(), 570)]
    );
}

#[test]
fn a_leap_is_told_with_its_length_and_short_pieces_are_left_out() {
    let moved = with(Column::X, |k, x| if k >= 950 { x + 7.0 } else { x });
    let Suspicion::Leap { place, length_m, explained_m } = first(&moved) else {
        panic!("{:?}", first(&moved))
    };
    assert_eq!(place.row, 950);
    assert!((6.8..7.2).contains(&length_m) && explained_m < 0.11, "{length_m} {explained_m}");
    let split = split_at_breaks(&machine(), &moved).unwrap();
    assert_eq!(split.runs().map(|run| run.time_s().len()).collect::<Vec<_>>(), [950]);
    assert_eq!(split_at_breaks(&machine(), &log(&rows(1000))).unwrap(), log(&rows(1000)));
}

#[test]
fn a_pose_that_starts_again_is_a_reset() {
    let start = rows(1);
    let mut rows = rows(1000);
    let offset = [Column::X, Column::Y].map(|column| rows[600].value(column) - start[0].value(column));
    for row in &mut rows[600..] {
        *row = row
            .with(Column::X, row.value(Column::X) - offset[0])
            .with(Column::Y, row.value(Column::Y) - offset[1]);
    }
    let told = told(&log(&rows));
    assert!(told.starts_with("pose reset after row 600 (t = 11.98 s): the position leaps "), "{told}");
    assert!(told.ends_with("m to (3.00, -2.00)"), "{told}");
}

#[test]
fn a_yaw_that_leaps_is_told_but_not_its_wrapping() {
    let told = told(&with(Column::Yaw, |k, yaw| if k >= 300 { yaw + 0.9 } else { yaw }));
    assert!(
        told.contains("yaw leaps 0.9") || told.contains("yaw: expected the direction of motion"),
        "{told}"
    );
}

#[test]
fn many_leaps_are_no_drive() {
    let shaken = with(Column::X, |k, x| if (k / 37) % 2 == 0 { x } else { x + 5.0 });
    let found = first(&shaken);
    assert!(matches!(found, Suspicion::ManyBreaks { n: 27, .. }), "{found}");
    assert_eq!(found.gravity(), Gravity::Refused);
}

/// A hole is told, and is neither a leap nor a reason to refuse the drive, until most of a column is one.
#[test]
fn missing_numbers_are_told_with_their_row() {
    let without = |column, rows: std::ops::Range<usize>| {
        with(column, move |k, value| if rows.contains(&k) { f64::NAN } else { value })
    };
    for column in [Column::Yaw, Column::X, Column::Vx, Column::CmdSpeed] {
        let found = screen(&machine(), &without(column, 100..112));
        let expected = format!(
            "{}: no number in 12 of 1000 rows, first in row 101 (t = 2.00 s); nothing is compared there",
            column.name()
        );
        assert_eq!(found.iter().map(ToString::to_string).collect::<Vec<_>>(), [expected]);
        assert_eq!(found[0].gravity(), Gravity::Doubtful);
    }
    let mostly = first(&without(Column::Yaw, 100..700));
    let expected = "yaw: expected a number in half of the rows at least, found none in 600 of 1000, first in row 101 (t = 2.00 s)";
    assert_eq!((mostly.to_string().as_str(), mostly.gravity()), (expected, Gravity::Refused));
}

#[test]
fn columns_of_one_sensor_are_missing_together() {
    let mut rows = rows(1000);
    for row in &mut rows[..10] {
        *row = row.with(Column::X, f64::NAN).with(Column::Y, f64::NAN).with(Column::Yaw, f64::NAN);
    }
    let found = screen(&machine(), &log(&rows));
    let expected =
        "x, y, yaw: no number in 10 of 1000 rows, first in row 1 (t = 0.00 s); nothing is compared there";
    assert_eq!(found.iter().map(ToString::to_string).collect::<Vec<_>>(), [expected]);
}

/// Of what is not a number in degrees, the unit is told as ever.
#[test]
fn a_hole_hides_no_wrong_unit() {
    let holed = with(Column::Yaw, |k, yaw| if (100..200).contains(&k) { f64::NAN } else { yaw.to_degrees() });
    assert!(told(&holed).starts_with("yaw: expected radians, found degrees?"), "{}", told(&holed));
}

#[test]
fn degrees_are_told_whichever_angle_holds_them() {
    let in_degrees = |column| told(&with(column, |_, value: f64| value.to_degrees()));
    let cases = [
        (Column::Yaw, "yaw: expected radians, found degrees? the yaw turns 57.2"),
        (
            Column::Wz,
            "wz: expected radians, found degrees? the yaw rate is 57.296 times speed x tan(cmd_steer)",
        ),
        (Column::CmdSteer, "cmd_steer: expected radians, found degrees? the largest is "),
        (Column::Roll, "pitch: expected radians, found degrees? the largest is 5.7"),
    ];
    for (column, expected) in cases {
        let told = if column == Column::Roll { in_degrees(Column::Pitch) } else { in_degrees(column) };
        assert!(told.starts_with(expected), "{told}");
    }
}

#[test]
fn degrees_are_told_where_no_number_is_large() {
    // A hundredth of the steering in degrees is at most 0.3, and turns a hundredth as fast.
    let small = |row: &DriveRow| {
        let yaw_rate = 0.01 * row.value(Column::Wz);
        let steering = (WHEELBASE_M * yaw_rate / row.value(Column::Vx)).atan().to_degrees();
        row.with(Column::Wz, yaw_rate).with(Column::CmdSteer, steering).with(Column::Yaw, f64::NAN)
    };
    let rows: Vec<_> = rows(1000).iter().map(small).collect();
    let told = told(&log(&rows));
    assert!(told.starts_with("cmd_steer: expected radians, found degrees? the yaw rate is 0.01"), "{told}");
    // A vehicle that turns beyond 180 degrees, without a yaw rate.
    let wide = |row: &DriveRow| {
        let yaw = 30.0 * row.time_s;
        row.with(Column::Wz, f64::NAN).with(Column::Yaw, yaw - 360.0 * (yaw / 360.0).round())
    };
    let told = self::told(&log(&self::rows(1000).iter().map(wide).collect::<Vec<_>>()));
    assert!(
        told.contains("yaw: expected radians, found degrees? it leaps by 360 after row 300 (t = 5.98 s)"),
        "{told}"
    );
}

#[test]
fn other_units_of_speed_and_length_are_named() {
    let told_of = |column, factor: f64| told(&with(column, move |_, value| factor * value));
    let cases = [
        (Column::Vx, 3.6, "vx: expected SI units, found km/h? the path is 0.277"),
        (Column::Vx, 2.2369, "vx: expected SI units, found mph?"),
        (
            Column::CmdSpeed,
            3.6,
            "cmd_speed: expected SI units, found km/h? the vehicle drives 0.2778 times as fast",
        ),
        (Column::Vx, 1.9, "the path is 0.53 times as long as vx says"),
    ];
    for (column, factor, expected) in cases {
        let told = told_of(column, factor);
        assert!(told.starts_with(expected), "{told}");
    }
    let in_millimetres = |row: &DriveRow| {
        row.with(Column::X, 1000.0 * row.value(Column::X)).with(Column::Y, 1000.0 * row.value(Column::Y))
    };
    let told = told(&log(&rows(1000).iter().map(in_millimetres).collect::<Vec<_>>()));
    assert!(told.starts_with("x and y: expected SI units, found millimetres?"), "{told}");
}

/// At a slip angle of 55 degrees the way is 1 / cos(55 degrees) = 1.74 times as long as the speed ahead says, which is
/// sliding and no wrong unit.
#[test]
fn sliding_sideways_is_not_a_unit() {
    let slip_rad = 55.0_f64.to_radians();
    let sliding = |row: &DriveRow| {
        row.with(Column::Vx, row.value(Column::Vx) * slip_rad.cos())
            .with(Column::Yaw, row.value(Column::Yaw) - slip_rad)
    };
    let log = log(&rows(1000).iter().map(sliding).collect::<Vec<_>>());
    let told = screen(&machine(), &log);
    assert!(
        !told.iter().any(|suspicion| matches!(suspicion, Suspicion::PathAgainstSpeed { .. })),
        "{told:?}"
    );
}

#[test]
fn a_vehicle_slower_than_commanded_is_not_a_unit() {
    for factor in [0.5, 0.8, 1.2] {
        let slow = with(Column::CmdSpeed, |_, speed| speed / factor);
        let found = screen(&Machine { speed_max_mps: 20.0, ..machine() }, &slow);
        assert_eq!(found, [], "{factor}");
    }
}

#[test]
fn mirrored_steering_is_told_even_when_it_acts_late() {
    let expected = "cmd_steer: expected left positive, found mirrored?";
    let mirrored = with(Column::CmdSteer, |_, angle| -angle);
    assert!(told(&mirrored).starts_with(expected), "{}", told(&mirrored));
    // The steering of half a second before, at the speed of now: 0.7 rad/s x 0.5 s out of phase.
    let late = rows(1025);
    let shifted = |sign: f64| {
        let rows = rows(1000).into_iter().enumerate();
        let rows =
            rows.map(|(k, row)| row.with(Column::CmdSteer, sign * late[k + 25].value(Column::CmdSteer)));
        log(&rows.collect::<Vec<_>>())
    };
    assert!(told(&shifted(-1.0)).starts_with(expected));
    assert_eq!(screen(&machine(), &shifted(1.0)), []);
}

#[test]
fn axes_against_each_other_are_told() {
    let told_of = |column, sign: f64| told(&with(column, move |_, value| sign * value));
    assert!(told_of(Column::Wz, -1.0).starts_with("yaw and wz: expected both counter-clockwise"));
    assert!(told_of(Column::Y, -1.0).starts_with("the path (x, y) and yaw: expected both counter-clockwise"));
    let turned = told(&with(Column::Yaw, |_, yaw| yaw + std::f64::consts::FRAC_PI_2));
    assert!(turned.starts_with("yaw: expected the direction of motion, found it -1.57 rad off"), "{turned}");
}

/// The drive with tyres that slip by 0.02 s2/m, and a sideways velocity told with a sign.
fn slipping(sign: f64) -> DriveLog {
    let [mut east, mut north] = [0.0; 2];
    let mut slip = |row: &DriveRow| {
        let [speed, yaw_rate, yaw] = [Column::Vx, Column::Wz, Column::Yaw].map(|column| row.value(column));
        let left_mps = -0.02 * speed * speed * yaw_rate;
        let [x, y] = [row.value(Column::X) + east, row.value(Column::Y) + north];
        east -= left_mps * yaw.sin() * STEP_S;
        north += left_mps * yaw.cos() * STEP_S;
        row.with(Column::X, x).with(Column::Y, y).with(Column::Vy, sign * left_mps)
    };
    log(&rows(1000).iter().map(&mut slip).collect::<Vec<_>>())
}

#[test]
fn a_sideways_velocity_against_the_path_is_doubted() {
    assert_eq!(screen(&machine(), &slipping(1.0)), []);
    let mirrored = screen(&machine(), &slipping(-1.0));
    assert!(
        matches!(mirrored[..], [Suspicion::SideSpeedAgainstPath { correlation }] if correlation < -0.9),
        "{mirrored:?}"
    );
    assert_eq!(mirrored[0].gravity(), Gravity::Doubtful);
}

#[test]
fn reverse_driving_is_not_an_offset() {
    let reverse = |row: &DriveRow| {
        let mirrored =
            row.with(Column::Vx, -row.value(Column::Vx)).with(Column::CmdSpeed, -row.value(Column::Vx));
        let yaw = row.value(Column::Yaw) + std::f64::consts::PI;
        mirrored.with(Column::Yaw, yaw).with(Column::CmdSteer, -row.value(Column::CmdSteer))
    };
    let rows: Vec<_> = rows(1000).iter().map(reverse).collect();
    assert_eq!(screen(&machine(), &log(&rows)), []);
}

#[test]
fn two_seconds_and_milliseconds_are_refused() {
    let told_short = told(&log(&rows(100)));
    assert_eq!(told_short, "expected at least 8 s of driving, found 1.98 s");
    let slow: Vec<_> = rows(1000)
        .iter()
        .map(|row| {
            let start = DriveRow::new(row.time_s * 1000.0);
            Column::ALL.into_iter().fold(start, |copy, column| copy.with(column, row.value(column)))
        })
        .collect();
    assert_eq!(told(&log(&slow)), "t: expected rows at most 0.5 s apart, found 20 s: is t in milliseconds?");
}

#[test]
fn nothing_to_diagnose_is_refused() {
    let commands = [Column::CmdSpeed, Column::CmdSteer];
    assert!(told(&without(&commands)).starts_with("expected a command: "));
    let motion = [Column::X, Column::Y, Column::Yaw, Column::Vx, Column::Wz];
    assert!(told(&without(&motion)).starts_with("expected a motion: "));
    let stands = |row: &DriveRow| {
        let held =
            row.with(Column::X, 0.001 * row.value(Column::X)).with(Column::Y, 0.001 * row.value(Column::Y));
        let held = held.with(Column::Vx, 0.001 * row.value(Column::Vx)).with(Column::Wz, 0.0);
        held.with(Column::Yaw, f64::NAN)
    };
    let told = told(&log(&rows(1000).iter().map(stands).collect::<Vec<_>>()));
    assert!(told.starts_with("expected a drive, found standstill: 0.08 m in 20 s"), "{told}");
}

#[test]
fn frozen_measurements_are_told() {
    let held = rows(301);
    let frozen =
        with(Column::Wz, |k, rate| if (300..400).contains(&k) { held[300].value(Column::Wz) } else { rate });
    let told = told(&frozen);
    assert!(
        told.starts_with("wz stays exactly ") && told.contains("for 2.0 s from row 301 (t = 6.00 s) on"),
        "{told}"
    );
}

#[test]
fn a_vehicle_that_is_stuck_is_told_but_not_one_that_slow_commands_do_not_move() {
    let still = |row: &DriveRow| {
        [Column::X, Column::Y, Column::Yaw, Column::Z]
            .iter()
            .fold(*row, |row, column| row.with(*column, f64::NAN))
    };
    let stands = |row: &DriveRow, is_standing: bool| {
        if is_standing { row.with(Column::Vx, 0.01 * row.time_s.sin()).with(Column::Wz, 0.0) } else { *row }
    };
    let stuck = rows(1000).iter().map(|row| stands(&still(row), row.time_s > 15.0)).collect::<Vec<_>>();
    let told = told(&log(&stuck));
    // 15 s is row 751, the first to stand is the next; up to row 1000 that makes 248 steps.
    assert!(
        told.starts_with("the vehicle stands for 5.0 s from row 752 (t = 15.02 s) on although "),
        "{told}"
    );
    let slow = rows(1000)
        .iter()
        .map(|row| stands(&still(row), row.value(Column::CmdSpeed) < 3.6))
        .collect::<Vec<_>>();
    assert_eq!(screen(&machine(), &log(&slow)), []);
}

#[test]
fn what_the_description_does_not_allow_is_told() {
    let narrow = Machine { steering_max_rad: 0.2, ..machine() };
    let found = screen(&narrow, &log(&rows(1000)));
    assert!(matches!(&found[..], [Suspicion::BeyondLimit { column: "cmd_steer", .. }]), "{found:?}");
    let ground = GroundMap {
        origin_m: [100.0, 100.0],
        resolution_m: 1.0,
        n_nodes: [2, 2],
        height_m: vec![0.0; 4],
        class: vec![0; 4],
    };
    let found = screen(&Machine { ground: Some(ground), ..machine() }, &log(&rows(1000)));
    assert_eq!(found, [Suspicion::OffMap { share_percent: 100.0 }]);
}

/// A drive with one speed and one steering angle.
fn steady() -> DriveLog {
    let steady =
        |row: &DriveRow| row.with(Column::CmdSpeed, 3.0).with(Column::Vx, 3.0).with(Column::CmdSteer, 0.1);
    log(&rows(1000).iter().map(steady).collect::<Vec<_>>())
}

#[test]
fn drives_without_excitation_are_refused_and_poor_ones_told() {
    let found = screen_sets(&[], &[steady()]);
    assert!(matches!(found[0], Suspicion::NoExcitation { .. }), "{found:?}");
    let straight = with(Column::CmdSteer, |_, angle| 0.01 * angle);
    assert!(matches!(screen_sets(&[], &[straight])[..], [Suspicion::LittleSteering { .. }]));
    let even = [Column::Vx, Column::CmdSpeed].iter().fold(rows(1000), |rows, column| {
        rows.iter().map(|row| row.with(*column, 4.0 + 0.01 * row.time_s)).collect()
    });
    assert!(matches!(screen_sets(&[], &[log(&even)])[..], [Suspicion::LittleSpeedChange { .. }]));
    // Together the drives may say what each alone does not.
    assert_eq!(screen_sets(&[], &[steady(), log(&rows(900))]), []);
}

#[test]
fn the_same_drive_twice_is_refused() {
    let (one, other) = (log(&rows(1000)), log(&rows(999)));
    let found = screen_sets(std::slice::from_ref(&one), &[other.clone(), one.clone()]);
    let names =
        |one: &str, other: &str| Suspicion::SameDrive { one: one.to_owned(), other: other.to_owned() };
    assert_eq!(found, [names("sim drive 1", "real drive 2")]);
    assert_eq!(screen_sets(&[], &[other.clone(), one, other]), [names("real drive 1", "real drive 3")]);
}
