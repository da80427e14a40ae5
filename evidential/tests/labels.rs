//! Labels of drives whose traction is known, because the test drove them.
#![allow(clippy::unwrap_used, reason = "a panic is how a test fails")]

use bicycle::{Column, DriveLog, DriveRow, Geometry, Limits};
use evidential::{
    Label, LabelConfig, LabelError, Response, Responses, Reversing, estimate_responses, labels,
};

const DT_S: f64 = 0.05;

/// 3.4 m by 1.8 m.
const GEOMETRY: Geometry = Geometry {
    wheelbase_m: 2.5,
    track_m: 1.55,
    length_m: 3.4,
    width_m: 1.8,
    rear_overhang_m: 0.45,
    ground_clearance_m: 0.42,
    wheel_radius_m: 0.45,
};

const LIMITS: Limits = Limits {
    speed_max_mps: 2.0,
    reverse_speed_max_mps: 2.0,
    steering_max_rad: std::f64::consts::FRAC_PI_6,
    steering_rate_max_radps: 0.6,
    acceleration_max_mps2: 1.5,
    lateral_acceleration_max_mps2: 3.0,
    roll_max_rad: std::f64::consts::FRAC_PI_6,
    pitch_max_rad: std::f64::consts::FRAC_PI_6,
};

/// What the ground does to the vehicle at a time: linear and angular traction.
type Ground = fn(f64) -> [f64; 2];

/// A vehicle with a delay and a first-order lag in speed and steering, integrated in steps of a millisecond, on ground
/// that takes its share of both; flat, without noise.
struct Machine {
    delay_s: [f64; 2],
    lag_s: [f64; 2],
    ground: Ground,
}

impl Machine {
    fn drive(&self, duration_s: f64, command: impl Fn(f64) -> [f64; 2]) -> DriveLog {
        let (mut speed, mut steer, mut pose) = (0.0, 0.0, [0.0; 3]);
        let mut log = DriveLog::default();
        // Commands are given anew at every row of the log and held in between.
        let held = |t: f64| command((t.max(0.0) / DT_S + 1e-9).floor() * DT_S);
        for step in 0..(duration_s * 1000.0) as usize {
            let t = step as f64 * 1e-3;
            let [linear, angular] = (self.ground)(t);
            let (v, w) = (linear * speed, angular * speed * f64::tan(steer) / GEOMETRY.wheelbase_m);
            if step.is_multiple_of(50) {
                let [cmd_speed, cmd_steer] = held(t);
                log.push("drive", &row(t, pose, [v, w], [cmd_speed, cmd_steer])).unwrap();
            }
            let before =
                |k: usize| if t < self.delay_s[k] { command(0.0)[k] } else { held(t - self.delay_s[k])[k] };
            speed += 1e-3 / self.lag_s[0] * (before(0) - speed);
            steer += 1e-3 / self.lag_s[1] * (before(1) - steer);
            pose =
                [pose[0] + 1e-3 * v * pose[2].cos(), pose[1] + 1e-3 * v * pose[2].sin(), pose[2] + 1e-3 * w];
        }
        log
    }
}

fn row(t: f64, [x, y, yaw]: [f64; 3], [vx, wz]: [f64; 2], [speed, steer]: [f64; 2]) -> DriveRow {
    let values = [
        (Column::X, x),
        (Column::Y, y),
        (Column::Yaw, yaw),
        (Column::Roll, -0.1),
        (Column::Pitch, 0.0),
        (Column::Vx, vx),
        (Column::Wz, wz),
        (Column::CmdSpeed, speed),
        (Column::CmdSteer, steer),
    ];
    values.into_iter().fold(DriveRow::new(t), |row, (column, value)| row.with(column, value))
}

fn sine(t: f64) -> [f64; 2] {
    [2.0, 0.35 * (std::f64::consts::TAU * t / 8.0).sin()]
}

/// Labels with the responses found in the log itself.
fn labelled(log: &DriveLog, config: &LabelConfig) -> Vec<Label> {
    let responses = estimate_responses(log, &GEOMETRY, config).unwrap();
    log.runs().flat_map(|run| labels(&run, &GEOMETRY, &responses, config).unwrap()).collect()
}

fn config() -> LabelConfig {
    LabelConfig::for_vehicle(&GEOMETRY, &LIMITS)
}

const LAGGING: Machine = Machine {
    delay_s: [0.1, 0.2],
    lag_s: [0.4, 0.3],
    ground: |t| if t < 20.0 { [0.9, 0.7] } else { [0.5, 0.4] },
};

#[test]
fn traction_is_found_although_the_commands_lag() {
    let log = LAGGING.drive(40.0, sine);
    let labels = labelled(&log, &config());
    // Every 0.2 s of 40 s, less what is left out at both ends.
    assert!((190..200).contains(&labels.len()), "{}", labels.len());
    let mut n = [0; 2];
    for label in labels.iter().filter(|label| (label.time_s - 20.0).abs() > 0.2) {
        let expected = (LAGGING.ground)(label.time_s);
        for k in (0..2).filter(|&k| !label.measured[k].is_nan()) {
            n[k] += 1;
            let error = f64::from(label.measured[k]) - expected[k];
            assert!(error.abs() < [0.02, 0.03][k], "{k} {}: {}", label.time_s, label.measured[k]);
        }
        assert!((label.measured[2] - 0.1).abs() < 1e-6 && label.measured[3] == 0.0);
    }
    // Turning is masked while the wheels are nearly straight or turn fast.
    assert!(n[0] > 170 && n[1] > 60 && n[1] < 150, "{n:?}");
}

#[test]
fn responses_are_those_of_the_machine() {
    let square = |t: f64| [if ((t / 6.0) as u32).is_multiple_of(2) { 2.0 } else { 1.0 }, sine(t)[1]];
    let log = LAGGING.drive(40.0, square);
    let found = estimate_responses(&log, &GEOMETRY, &config()).unwrap();
    // Delay and lag blur into each other; their sum does not.
    for (found, [delay_s, lag_s]) in [(found.speed, [0.1, 0.4]), (found.turn, [0.2, 0.3])] {
        let sum_s = found.delay_s + found.time_constant_s;
        assert!((sum_s - delay_s - lag_s).abs() < 0.06, "{found:?}");
        assert!((found.delay_s - delay_s).abs() < 0.11, "{found:?}");
    }
}

#[test]
fn a_start_that_is_cut_short_is_no_slow_machine() {
    let log = LAGGING.drive(2.5, sine);
    let found = estimate_responses(&log, &GEOMETRY, &config()).unwrap();
    assert!((found.speed.delay_s + found.speed.time_constant_s - 0.5).abs() < 0.2, "{found:?}");
}

#[test]
fn ratios_without_alignment_are_wrong_where_those_with_it_are_right() {
    let log = LAGGING.drive(18.0, sine);
    let lax = LabelConfig { unsettled_turn_share_max: 1e9, start_s: 4.0, ..config() };
    let run = log.runs().next().unwrap();
    let worst = |responses: &Responses| {
        let labels = labels(&run, &GEOMETRY, responses, &lax).unwrap();
        let errors =
            labels.iter().map(|label| (label.measured[1] - 0.7).abs()).filter(|error| !error.is_nan());
        errors.fold(0.0, f32::max)
    };
    assert!(worst(&Responses::default()) > 0.3);
    assert!(worst(&estimate_responses(&log, &GEOMETRY, &lax).unwrap()) < 0.04);
}

#[test]
fn a_command_that_never_changes_tells_no_response() {
    let mut log = DriveLog::default();
    for k in 0..200 {
        let t = f64::from(k) * DT_S;
        log.push("", &row(t, [1.8 * t, 0.0, 0.0], [1.8, 0.0], [2.0, 0.0])).unwrap();
    }
    let found = estimate_responses(&log, &GEOMETRY, &config()).unwrap();
    assert_eq!(found, Responses::default());
}

#[test]
fn a_stuck_vehicle_has_no_traction_and_says_so_once_a_second() {
    let stuck = Machine { ground: |_| [0.0, 0.0], ..LAGGING };
    let log = stuck.drive(10.0, |_| [2.0, 0.3]);
    let responses = Responses {
        speed: Response { delay_s: 0.1, rate_max_per_s: None, time_constant_s: 0.4 },
        turn: Response::default(),
    };
    let run = log.runs().next().unwrap();
    let labels = labels(&run, &GEOMETRY, &responses, &config()).unwrap();
    assert_eq!(labels.len(), 9);
    let settled = labels.iter().filter(|label| label.time_s > 2.0);
    assert!(settled.clone().all(|label| label.measured[..2] == [0.0, 0.0]), "{labels:?}");
    assert!(settled.count() >= 7);
}

#[test]
fn a_parked_vehicle_says_nothing() {
    let log = LAGGING.drive(5.0, |_| [0.0, 0.3]);
    assert_eq!(labelled(&log, &config()), []);
}

#[test]
fn nearly_straight_and_nearly_standing_mean_nothing() {
    let labels = labelled(&LAGGING.drive(10.0, |_| [2.0, 0.01]), &config());
    assert!(labels.iter().all(|label| label.measured[1].is_nan()));
    assert!(labels.iter().filter(|label| label.time_s > 3.0).all(|label| !label.measured[0].is_nan()));
    let crawling = labelled(&LAGGING.drive(10.0, |_| [0.19, 0.5]), &config());
    assert!(crawling.iter().all(|label| label.measured[0].is_nan()));
}

#[test]
fn reversing_is_masked_unless_it_is_wanted() {
    let log = LAGGING.drive(18.0, |t| [-1.5, sine(t)[1]]);
    let masked = labelled(&log, &config());
    assert!(!masked.is_empty());
    assert!(masked.iter().all(|label| label.measured[..2].iter().all(|value| value.is_nan())));
    let wanted = labelled(&log, &LabelConfig { reversing: Reversing::Labelled, ..config() });
    let linear: Vec<f32> = wanted.iter().map(|label| label.measured[0]).filter(|v| !v.is_nan()).collect();
    assert!(linear.len() > 60 && linear.iter().all(|v| (v - 0.9).abs() < 0.02), "{linear:?}");
}

#[test]
fn what_is_not_finite_masks_what_it_enters_and_nothing_else() {
    let whole = LAGGING.drive(10.0, sine);
    let mut log = DriveLog::default();
    for row in whole.runs().next().unwrap().drive_rows() {
        let near = |at_s: f64| (row.time_s - at_s).abs() < 0.01;
        let mut broken = row;
        for (at_s, column) in [(6.2, Column::Vx), (7.0, Column::Roll), (8.0, Column::X)] {
            broken = if near(at_s) { broken.with(column, f64::NAN) } else { broken };
        }
        log.push("drive", &broken).unwrap();
    }
    let at = |labels: &[Label], at_s: f64| {
        labels.iter().find(|label| (label.time_s - at_s).abs() < 0.01).map(|label| label.measured)
    };
    let (whole, broken) = (labelled(&whole, &config()), labelled(&log, &config()));
    assert!(at(&whole, 6.2).unwrap().iter().all(|value| value.is_finite()));
    let without_speed = at(&broken, 6.2).unwrap();
    assert!(without_speed[0].is_nan() && without_speed[2].is_finite());
    assert!(at(&broken, 7.0).unwrap()[2].is_nan() && at(&broken, 7.0).unwrap()[0].is_finite());
    // A place that is none cannot be labelled; the next row is.
    assert_eq!(at(&broken, 8.0), None);
}

#[test]
fn skid_steered_machines_are_labelled_by_their_yaw_rate_or_their_sides() {
    let log = |with: fn(DriveRow, f64, f64) -> DriveRow| {
        let mut log = DriveLog::default();
        for k in 0..200 {
            let t = f64::from(k) * DT_S;
            let bare = row(t, [0.8 * t, 0.0, 0.0], [0.8, 0.3], [f64::NAN; 2]);
            log.push("", &with(bare, 1.0, 0.5)).unwrap();
        }
        log
    };
    let by_rate = log(|row, v, w| row.with(Column::CmdSpeed, v).with(Column::CmdWz, w));
    let by_sides = log(|row, v, w| {
        let half_m = 0.5 * GEOMETRY.track_m;
        row.with(Column::CmdLeft, v - half_m * w).with(Column::CmdRight, v + half_m * w)
    });
    for log in [by_rate, by_sides] {
        let labels = labelled(&log, &config());
        assert!(labels.len() > 40);
        for label in labels {
            assert!((label.measured[0] - 0.8).abs() < 1e-6 && (label.measured[1] - 0.6).abs() < 1e-6);
        }
    }
}

#[test]
fn a_climbing_vehicle_is_as_fast_as_it_looks_from_above() {
    let mut log = DriveLog::default();
    for k in 0..100 {
        let t = f64::from(k) * DT_S;
        let level = row(t, [t, 0.0, 0.0], [1.0, 0.0], [1.0, 0.0]);
        log.push("", &level.with(Column::Pitch, -std::f64::consts::FRAC_PI_3)).unwrap();
    }
    let labels = labelled(&log, &config());
    assert!(labels.iter().all(|label| (label.measured[0] - 0.5).abs() < 1e-6), "{labels:?}");
}

#[test]
fn missing_columns_are_named_with_those_that_are_there() {
    let mut log = DriveLog::default();
    log.push("7", &DriveRow::new(0.0).with(Column::X, 0.0).with(Column::Vx, 1.0)).unwrap();
    let error = estimate_responses(&log, &GEOMETRY, &config()).unwrap_err();
    assert_eq!(
        error.to_string(),
        "run '7': expected the columns y, yaw, wz, cmd_speed, cmd_steer or cmd_wz too, found only x, vx"
    );
}

#[test]
fn settings_out_of_range_are_refused() {
    let usual = config();
    let wrong = [
        (LabelConfig { period_s: 0.0, ..usual }, "period_s"),
        (LabelConfig { standing_period_s: f64::NAN, ..usual }, "standing_period_s"),
        (LabelConfig { speed_min_mps: -1.0, ..usual }, "speed_min_mps"),
        (LabelConfig { yaw_rate_min_radps: 0.0, ..usual }, "yaw_rate_min_radps"),
        (LabelConfig { unsettled_speed_share_max: f64::INFINITY, ..usual }, "unsettled_speed_share_max"),
        (LabelConfig { unsettled_turn_share_max: 0.0, ..usual }, "unsettled_turn_share_max"),
        (LabelConfig { moved_min_m: -0.1, ..usual }, "moved_min_m"),
        (LabelConfig { window_s: -0.1, ..usual }, "window_s"),
        (LabelConfig { start_s: f64::NAN, ..usual }, "start_s"),
        (LabelConfig { end_s: -1.0, ..usual }, "end_s"),
    ];
    for (config, name) in wrong {
        match config.validate() {
            Err(LabelError::Setting { field, .. }) => assert_eq!(field, name),
            other => panic!("{name}: {other:?}"),
        }
    }
    assert_eq!(usual.validate(), Ok(()));
}
