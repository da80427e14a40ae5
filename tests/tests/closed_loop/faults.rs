//! Sensors that fail: the drive survives, or comes to a controlled stop that says why.

use bench::closed_loop::ClosedLoop;
use bicycle::{Decision, HoldReason, State, StopReason};
use scenarios::{Outcome, RangeSensorConfig, SensorFault};
use terrain::{BodyBox, TerrainClass};

use crate::course::{Course, Driven, ground};

/// The fault begins when the vehicle is at full speed [s].
const FROM_S: f64 = 2.0;
/// Length of a control cycle [s].
const CYCLE_S: f64 = 0.1;
/// Speed below which a vehicle stands [m/s].
const STANDING_MPS: f64 = 0.05;

/// The first stop came for this reason, no sooner than `after_s` after the fault began and at most two cycles later;
/// from then on the vehicle braked to a standstill within twice the way that its limit of deceleration needs.
fn assert_stops(driven: &Driven, reason: StopReason, after_s: f64) {
    let at_s = driven.first_stop_s(reason).unwrap_or_else(|| panic!("{:?}", driven.stops()));
    let waited_s = at_s - FROM_S;
    assert!((after_s - 1e-6..after_s + 2.0 * CYCLE_S + 1e-6).contains(&waited_s), "{waited_s} s");
    let first_s =
        driven.stops().into_keys().filter_map(|any| driven.first_stop_s(any)).fold(f64::MAX, f64::min);
    assert_eq!(first_s, at_s, "no other reason before: {:?}", driven.stops());
    let rest = || driven.trace().iter().skip_while(|row| row.time_s < at_s);
    let first = rest().next().unwrap().motion;
    let standing = rest().find(|row| row.motion.velocity_mps[0].abs() < STANDING_MPS).unwrap();
    let way_m = (standing.motion.pose.x_m - first.pose.x_m).hypot(standing.motion.pose.y_m - first.pose.y_m);
    let deceleration_mps2 = Course::flat(1.0).vehicle.limits.acceleration_max_mps2;
    let speed_mps = first.velocity_mps[0];
    assert!(speed_mps > 0.5, "the fault must come at speed, found {speed_mps} m/s");
    assert!(way_m < speed_mps.powi(2) / deceleration_mps2 + 0.2, "{way_m} m from {speed_mps} m/s");
    assert!(rest().take_while(|row| row.time_s < standing.time_s).all(|row| row.command.speed_mps == 0.0));
}

fn flat_with(sensor: SensorFault, until_s: f64) -> Driven {
    Course::flat(8.0).with_fault(sensor, FROM_S, until_s).drive()
}

#[test]
fn points_that_are_no_numbers_are_survived() {
    let driven = Course::flat(6.0).with_fault(SensorFault::NonFinitePoints, 0.0, f64::INFINITY).drive();
    assert_eq!((driven.outcome, driven.stops().len()), (Outcome::Goal, 0), "{:?}", driven.stops());
    let known = driven.closed.navigator.surface().values().iter().filter(|cell| cell.is_known());
    assert!(known.clone().all(|cell| cell.height_m.abs() < 0.5), "the ground is flat");
    assert!(known.count() > 1000, "the other points make a map");
}

#[test]
fn empty_scans_stop_the_vehicle_until_it_sees_again() {
    // Scans come every other cycle; the last good one is from 1.8 s, the age limit is 1 s.
    for sensor in [SensorFault::EmptyScan, SensorFault::MissingScan] {
        let driven = flat_with(sensor, 4.5);
        assert_stops(&driven, StopReason::StaleScan, 0.8);
        assert_eq!(driven.outcome, Outcome::Goal);
    }
}

/// A bonnet in sight of the sensor above the roof.
const BONNET: BodyBox = BodyBox { min_m: [1.6, -0.7, -0.1], max_m: [2.4, 0.7, 0.5] };

#[test]
fn sensor_that_sees_only_the_vehicle_or_the_distance_is_blind() {
    // On the bonnet, and a kilometre away.
    for place_m in [[2.0, 0.0, 0.4], [1000.0, 0.0, 0.0]] {
        let driven = flat_with(SensorFault::ReturnsFrom(place_m), 4.5);
        assert_stops(&driven, StopReason::StaleScan, 0.8);
        assert_eq!(driven.outcome, Outcome::Goal);
        assert!(driven.closed.navigator.scans().blind > 0);
    }
}

#[test]
fn bonnet_of_the_vehicle_is_no_ground() {
    let mut course = Course::flat(6.0);
    course.episode.range_sensor =
        course.episode.range_sensor.map(|sensor| RangeSensorConfig { own_body: BONNET, ..sensor });
    let driven = course.drive();
    let tally = driven.closed.navigator.scans();
    assert!(tally.points_on_own_body > 500, "the sensor sees the bonnet: {tally:?}");
    assert_eq!((driven.outcome, driven.stops().len()), (Outcome::Goal, 0), "{:?}", driven.stops());
    let known = driven.closed.navigator.surface().values().iter().filter(|cell| cell.is_known());
    assert!(known.clone().all(|cell| cell.height_m.abs() < 0.2), "the ground is flat");
    assert!(known.count() > 1000);
}

#[test]
fn blindness_for_good_ends_the_drive_as_stopped() {
    let driven = flat_with(SensorFault::EmptyScan, f64::INFINITY);
    assert_stops(&driven, StopReason::StaleScan, 0.8);
    assert_eq!(driven.outcome, Outcome::Stopped);
}

#[test]
fn vehicle_that_has_never_seen_waits_and_then_says_why() {
    let driven = Course::flat(6.0).with_fault(SensorFault::EmptyScan, 0.0, f64::INFINITY).drive();
    assert_eq!(driven.outcome, Outcome::Stopped, "{:?}", driven.stops());
    assert!(driven.stops().contains_key(&StopReason::StaleScan), "{:?}", driven.stops());
    assert_eq!(driven.trace()[0].decision, Decision::Hold(HoldReason::NoMap));
    assert!(driven.closed.episode.path_length_m() < 0.05, "{} m", driven.closed.episode.path_length_m());
}

#[test]
fn odometry_that_freezes_for_good_ends_the_drive_at_a_standstill() {
    // It repeats from the first frozen sample on; half a second of that is too much.
    let driven = flat_with(SensorFault::FrozenOdometry, f64::INFINITY);
    assert_stops(&driven, StopReason::StaleOdometry, 0.5);
    assert_eq!(driven.outcome, Outcome::Stopped);
}

#[test]
fn odometry_that_thaws_lets_the_drive_go_on() {
    let driven = flat_with(SensorFault::FrozenOdometry, 4.5);
    assert_stops(&driven, StopReason::StaleOdometry, 0.5);
    assert_eq!((driven.outcome, driven.closed.navigator.n_jumps()), (Outcome::Goal, 0));
}

#[test]
fn odometry_that_falls_silent_stops_the_vehicle() {
    // The last message is from 1.9 s, the age limit is 0.3 s.
    let driven = flat_with(SensorFault::SilentOdometry, f64::INFINITY);
    assert_stops(&driven, StopReason::StaleOdometry, 0.2);
    assert_eq!(driven.outcome, Outcome::Stopped);
}

#[test]
fn odometry_that_is_no_number_stops_the_vehicle_at_once_and_only_as_long() {
    let driven = flat_with(SensorFault::NonFiniteOdometry, 4.5);
    assert_stops(&driven, StopReason::NonFiniteInput, 0.0);
    // 25 cycles from 2.0 to 4.4 s; then the map is out of date until the next scan, and no jump is made of the gap.
    assert_eq!((driven.outcome, driven.stops()[&StopReason::NonFiniteInput]), (Outcome::Goal, 25));
    assert!(driven.stops().get(&StopReason::StaleScan).is_none_or(|&n_cycles| n_cycles <= 2));
    assert_eq!(driven.closed.navigator.n_jumps(), 0);
    let driven = flat_with(SensorFault::NonFiniteOdometry, f64::INFINITY);
    assert_eq!(driven.outcome, Outcome::Stopped);
    assert!(driven.trace().iter().all(|row| row.command.speed_mps.is_finite()));
}

/// A block beside the way: 0.8 m wide around this place [m].
const BLOCK_M: [f64; 2] = [8.0, 3.5];
/// How far the localisation corrects itself: a metre.
const JUMP_M: [f64; 2] = [-0.8, 0.6];

/// Along x past the block.
fn past_block_with_jump() -> Course {
    let is_block = |x_m: f64, y_m: f64| (x_m - BLOCK_M[0]).abs().max((y_m - BLOCK_M[1]).abs()) < 0.4;
    let fault = SensorFault::PoseJump(JUMP_M);
    Course::along_x(ground(|_, _| 0.0, is_block), 8.0).with_fault(fault, FROM_S, f64::INFINITY)
}

#[test]
fn localisation_that_corrects_itself_by_a_metre_is_survived() {
    let driven = past_block_with_jump().drive();
    // The planner's goal lies 0.8 m behind and 0.6 m beside the true one: it passes within the tolerance of 1 m.
    assert_eq!((driven.outcome, driven.stops().len()), (Outcome::Goal, 0), "{:?}", driven.stops());
    assert!(driven.trace().iter().all(|row| matches!(row.decision, Decision::Drive(_))));
    assert_eq!(driven.closed.navigator.n_jumps(), 1);
}

#[test]
fn map_follows_a_localisation_that_corrects_itself() {
    let mut closed = past_block_with_jump().begin();
    // At once: later the old places would be cleared as ghosts, after having closed the way meanwhile.
    while closed.navigator.n_jumps() == 0 {
        assert_eq!(closed.episode.outcome(), None, "no jump was noticed");
        closed.cycle().unwrap();
    }
    let places = obstacles_m(&closed);
    assert!(!places.is_empty(), "the block was seen");
    let n = places.len() as f64;
    let off_m = [0, 1].map(|axis| {
        let mean_m = places.iter().map(|place_m| place_m[axis]).sum::<f64>() / n;
        mean_m - BLOCK_M[axis] - JUMP_M[axis]
    });
    // A cell is 0.3 m: half of one for rounding the shift. Left where it was, or kept twice, the block is off by 0.4 m
    // and more.
    assert!(off_m[0].hypot(off_m[1]) < 0.25, "{off_m:?} m off: {places:?}");
}

#[test]
fn map_follows_a_localisation_that_corrects_its_heading() {
    // About the place where the vehicle is then, so that only the yaw steps.
    let (about_m, turn_rad) = ([6.0, 0.0], 0.5);
    let fault = SensorFault::PoseTurn(about_m, turn_rad);
    let is_block = |x_m: f64, y_m: f64| (x_m - BLOCK_M[0]).abs().max((y_m - BLOCK_M[1]).abs()) < 0.4;
    let course = Course::along_x(ground(|_, _| 0.0, is_block), 8.0).with_fault(fault, FROM_S, f64::INFINITY);
    let mut closed = course.begin();
    while closed.navigator.n_jumps() == 0 {
        assert_eq!(closed.episode.outcome(), None, "no jump was noticed");
        closed.cycle().unwrap();
    }
    let places = obstacles_m(&closed);
    assert!(!places.is_empty(), "the block was seen");
    let mean_m =
        [0, 1].map(|axis| places.iter().map(|place_m| place_m[axis]).sum::<f64>() / places.len() as f64);
    let ([dx_m, dy_m], (sin, cos)) = ([BLOCK_M[0] - about_m[0], BLOCK_M[1] - about_m[1]], turn_rad.sin_cos());
    let expected_m = [about_m[0] + cos * dx_m - sin * dy_m, about_m[1] + sin * dx_m + cos * dy_m];
    let off_m = (mean_m[0] - expected_m[0]).hypot(mean_m[1] - expected_m[1]);
    // It moved by 2 m; a cell is 0.3 m.
    assert!(off_m < 0.3, "{off_m} m off: {places:?}");
    // It goes on to where the goal is said to be.
    for _ in 0..20 {
        let decision = closed.cycle().unwrap().decision;
        assert!(matches!(decision, Decision::Drive(_)), "{decision:?}");
    }
    assert_eq!(closed.navigator.n_jumps(), 1);
}

#[test]
fn between_a_jump_and_the_next_scan_the_vehicle_drives_on_the_ground_it_knew() {
    // A wall beside the way: where the vehicle is said to be after the jump, the map of before has it stand in the wall.
    let is_wall = |x_m: f64, y_m: f64| x_m > 5.0 && (1.7..2.4).contains(&y_m);
    let course = || Course::along_x(ground(|_, _| 0.0, is_wall), 8.0);
    for sensor in [SensorFault::PoseJump([0.0, 1.2]), SensorFault::PoseTurn([6.0, 0.0], 1.2)] {
        // Scans come in even cycles.
        let mut jumped = course().with_fault(sensor, FROM_S + CYCLE_S, f64::INFINITY).begin();
        let mut steady = course().begin();
        let [with, without] = loop {
            let cycles = [jumped.cycle().unwrap(), steady.cycle().unwrap()];
            if jumped.navigator.n_jumps() > 0 {
                break cycles;
            }
            assert_eq!(jumped.episode.outcome(), None, "no jump was noticed");
        };
        assert_eq!(with.map_ms, None, "before the next scan");
        let (Decision::Drive(with), Decision::Drive(without)) = (with.decision, without.decision) else {
            panic!("{sensor:?}: {with:?}, and without the jump {without:?}");
        };
        let off = [with.speed_mps - without.speed_mps, with.steering_rad - without.steering_rad];
        assert!(
            off.iter().all(|value| value.abs() < 0.1),
            "{sensor:?}: {with:?}, and without the jump {without:?}"
        );
        // One command differs little, wherever it is planned from: the plan starts where the vehicle stands on that map.
        let [on_map, expected] = [&jumped, &steady].map(planned_from);
        let off_m = (on_map.x_m - expected.x_m).hypot(on_map.y_m - expected.y_m);
        let off_rad = (on_map.yaw_rad - expected.yaw_rad).abs();
        assert!(
            off_m < 0.1 && off_rad < 0.05,
            "{sensor:?}: from {on_map:?}, and without the jump {expected:?}"
        );
    }
}

/// Where the last plan starts, in the frame of the map that it was made on.
fn planned_from(closed: &ClosedLoop) -> State {
    let map = closed.navigator.risk_map().unwrap();
    closed.navigator.controller().nominal_trajectory(map)[0]
}

/// Centres of the cells that show an obstacle [m].
fn obstacles_m(closed: &ClosedLoop) -> Vec<[f64; 2]> {
    let surface = closed.navigator.surface();
    let cells =
        surface.values().iter().enumerate().filter(|(_, cell)| cell.class() == TerrainClass::Obstacle);
    cells.map(|(index, _)| surface.geometry().centre_m(surface.geometry().cell(index))).collect()
}
