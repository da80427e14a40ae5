//! Fixes of an antenna beside the middle of a vehicle that turns and drives, and goals in degrees.

use crate::message::{GeoPoint, GeoPose, GeoPoseStamped, NavSatFix, NavSatStatus};

use super::*;

/// Metres of a degree on the equator, along it and north of it.
const M_PER_DEG: [f64; 2] = [111_319.49, 110_574.28];

/// A fix of an antenna on the mast at 0.02 m, told of this time.
fn fix(sec: i32, nanosec: u32, [east_m, north_m]: [f64; 2]) -> NavSatFix {
    let mut covariance = [0.0; 9];
    (covariance[0], covariance[4]) = (4e-4, 4e-4);
    NavSatFix {
        header: Header { stamp: Time { sec, nanosec }, frame_id: "mast".into() },
        status: NavSatStatus::default(),
        longitude: east_m / M_PER_DEG[0],
        latitude: north_m / M_PER_DEG[1],
        altitude: 0.0,
        position_covariance: covariance,
        position_covariance_type: 2,
    }
}

fn goal([east_m, north_m]: [f64; 2]) -> GeoPoseStamped {
    let position =
        GeoPoint { latitude: north_m / M_PER_DEG[1], longitude: east_m / M_PER_DEG[0], altitude: 0.0 };
    GeoPoseStamped { pose: GeoPose { position, ..GeoPose::default() }, ..GeoPoseStamped::default() }
}

/// The vehicle looks north at the map's (10, 0) and drives there with 2 m/s; 0.25 s later its mast, 0.5 m ahead of the
/// middle, is at (10, 1), which is where the globe has its (0, 0).
#[test]
fn an_antenna_is_where_the_vehicle_has_taken_it_by_then() {
    let mut intake = intake();
    let mut north = odometry(201);
    let turn = std::f64::consts::FRAC_1_SQRT_2;
    north.pose.pose.orientation = Quaternion { x: 0.0, y: 0.0, z: turn, w: turn };
    north.twist.twist.linear.x = 2.0;
    intake.odometry(&north, arrival(201)).unwrap();
    intake.fix(&fix(201, 250_000_000, [0.0, 0.0]), arrival(201)).unwrap();
    let places_m = intake.goal_on_globe(&goal([30.0, -40.0])).unwrap();
    let [[east_m, north_m]] = places_m[..] else { panic!("{places_m:?}") };
    assert!((east_m - 40.0).abs() < 1e-3 && (north_m + 39.0).abs() < 1e-3, "{places_m:?}");
}

#[test]
fn fixes_that_cannot_be_placed_are_refused_and_disturb_nobody() {
    let mut intake = intake();
    let told = |refused: Result<(), IntakeError>| refused.unwrap_err().to_string();
    let whole = fix(201, 0, [0.0, 0.0]);
    assert!(told(intake.fix(&whole, arrival(201))).starts_with("stamp: expected odometry within 0.3 s"));
    intake.odometry(&odometry(201), arrival(201)).unwrap();
    let late = fix(202, 0, [0.0, 0.0]);
    assert!(told(intake.fix(&late, arrival(202))).starts_with("stamp: expected odometry within 0.3 s"));
    let mut lost = whole.clone();
    lost.header.frame_id = "roof".into();
    assert!(told(intake.fix(&lost, arrival(201))).starts_with("frame \"roof\": expected transforms"));
    let mut of_another_clock = whole.clone();
    of_another_clock.header.stamp.sec -= 100_000;
    assert!(told(intake.fix(&of_another_clock, arrival(201))).starts_with("stamp: expected a time of"));
    let before = intake.goal_on_globe(&goal([1.0, 1.0])).unwrap_err().to_string();
    assert!(before.contains("expected a fix before"), "{before}");
    intake.fix(&whole, arrival(201)).unwrap();
    assert!(intake.goal_on_globe(&goal([1.0, 1.0])).is_ok());
}

/// Where a robot has a clock of its own, a receiver that has the satellites' time would otherwise set it.
#[test]
fn a_receiver_of_another_time_does_not_set_the_robots_clock() {
    let mut intake = Intake { clock: StampClock::new(StampSource::OfItsOwn), ..intake() };
    intake.fixed_frames(&told()).unwrap();
    let (at_ns, _) = intake.odometry(&odometry(201), arrival(201)).unwrap();
    let refused = intake.fix(&fix(1_000_201, 0, [0.0, 0.0]), arrival(201)).unwrap_err();
    assert!(matches!(refused, IntakeError::Stamp(StampError::Jumped { .. })), "{refused}");
    assert_eq!(intake.odometry(&odometry(202), arrival(202)).unwrap().0, at_ns + 1_000_000_000);
}
