//! Against lengths of arcs in closed form, a map that is turned and shifted by known amounts, and receivers that err.

use super::*;
use proptest::prelude::*;

fn fix(latitude: f64, longitude: f64, deviation_m: f64) -> NavSatFix {
    let variance_m2 = deviation_m * deviation_m;
    let mut fix = NavSatFix { latitude, longitude, position_covariance_type: 2, ..NavSatFix::default() };
    (fix.position_covariance[0], fix.position_covariance[4]) = (variance_m2, variance_m2);
    fix
}

fn point(latitude: f64, longitude: f64) -> GeoPoint {
    GeoPoint { latitude, longitude, altitude: 0.0 }
}

fn close(found_m: [f64; 2], expected_m: [f64; 2], within_m: f64) {
    let is_close =
        found_m.iter().zip(expected_m).all(|(found, expected)| (found - expected).abs() < within_m);
    assert!(is_close, "{found_m:?}, not {expected_m:?}");
}

/// A thousandth of a degree is so many metres: pi / 180000 times the radius of curvature, along the meridian
/// a (1 - e2) / (1 - e2 sin2)^1.5, across it a cos / (1 - e2 sin2)^0.5, with e2 = 0.006 694 38.
#[test]
fn a_thousandth_of_a_degree_is_as_long_as_the_ellipsoid_is_curved() {
    for (latitude, east_m, north_m) in
        [(0.0, 111.319_49, 110.574_28), (45.0, 78.846_8, 111.131_8), (-60.0, 55.800, 111.412_3)]
    {
        let mut globe = Georeference::default();
        globe.note(&fix(latitude, 7.0, 0.1), [100.0, 200.0]).unwrap();
        close(globe.place_m(&point(latitude, 7.001)).unwrap(), [100.0 + east_m, 200.0], 2e-3);
        close(globe.place_m(&point(latitude + 1e-3, 7.0)).unwrap(), [100.0, 200.0 + north_m], 2e-3);
    }
}

#[test]
fn the_date_line_is_no_border() {
    let mut globe = Georeference::default();
    globe.note(&fix(0.0, 179.999_5, 0.1), [0.0, 0.0]).unwrap();
    close(globe.place_m(&point(0.0, -179.999_5)).unwrap(), [111.319_49, 0.0], 1e-3);
}

/// A vehicle that drives 60 m of a curve in a map turned by an angle against east; its receiver errs.
fn driven(turn_rad: f64, deviation_m: f64, n: usize) -> Georeference {
    let mut globe = Georeference::default();
    let (turn, mut phase) = (Rotation2::new(turn_rad), 0.0_f64);
    for k in 0..n {
        let map_m = Vector2::new(k as f64, 10.0 * (0.05 * k as f64).sin());
        phase += 2.4;
        let error_m = deviation_m * Vector2::new(phase.sin(), phase.cos());
        let plane_m = turn.inverse() * (map_m - Vector2::new(3.0, -4.0)) + error_m;
        // On the equator.
        let [longitude, latitude] = [plane_m.x / 111_319.49, plane_m.y / 110_574.28];
        globe.note(&fix(latitude, longitude, deviation_m), map_m.into()).unwrap();
    }
    globe
}

proptest! {
    #[test]
    fn a_map_that_is_turned_is_found_by_driving(turn_rad in -3.1..3.1_f64) {
        let globe = driven(turn_rad, 0.3, 60);
        // 100 m east of where the map has (3, -4).
        let place_m = globe.place_m(&point(0.0, 100.0 / 111_319.49)).unwrap();
        let expected_m = [3.0 + 100.0 * turn_rad.cos(), -4.0 + 100.0 * turn_rad.sin()];
        // 0.3 m over some 20 m from the middle, with a dozen fixes: half a degree, so half a metre at 70 m from there.
        close(place_m, expected_m, 1.5);
    }
}

#[test]
fn before_it_has_driven_far_enough_for_its_receiver_the_map_points_east() {
    let ahead = point(0.0, 100.0 / 111_319.49);
    for (deviation_m, n) in [(0.3, 3), (20.0, 60)] {
        let [east_m, north_m] = driven(1.0, deviation_m, n).place_m(&ahead).unwrap();
        assert!(east_m > 60.0 && north_m.abs() < 60.0, "{deviation_m} m, {n}: {east_m} {north_m}");
    }
}

#[test]
fn a_localisation_that_jumps_takes_the_goals_along() {
    let mut globe = driven(0.0, 0.1, 60);
    globe.note(&fix(0.0, 60.0 / 111_319.49, 0.1), [500.0, 300.0]).unwrap();
    close(globe.place_m(&point(0.0, 70.0 / 111_319.49)).unwrap(), [510.0, 300.0], 0.5);
}

/// Receivers tell latitude and longitude 0 before they know better.
#[test]
fn a_first_fix_of_elsewhere_is_got_over() {
    let mut globe = Georeference::default();
    globe.note(&fix(0.0, 0.0, 0.1), [0.0; 2]).unwrap();
    assert!(matches!(globe.note(&fix(0.0, 7.0, 0.1), [0.0; 2]), Err(GlobeError::TooFar { .. })));
    globe.note(&fix(0.0, 7.0, 0.1), [100.0, 200.0]).unwrap();
    close(globe.place_m(&point(0.0, 7.001)).unwrap(), [100.0 + 111.319_49, 200.0], 2e-3);
}

#[test]
fn memory_ends_after_a_kilometre() {
    assert_eq!(driven(0.3, 0.3, 3000).pairs.len(), KEPT);
}

#[test]
fn what_tells_nothing_is_refused_and_leaves_what_is_known() {
    let mut globe = Georeference::default();
    let told = |error: GlobeError| error.to_string();
    assert!(told(globe.place_m(&point(1.0, 1.0)).unwrap_err()).contains("expected a fix before"));
    let mut none = fix(1.0, 1.0, 0.1);
    none.status.status = -1;
    assert_eq!(globe.note(&none, [0.0; 2]), Err(GlobeError::NoFix));
    for (latitude, longitude) in [(f64::NAN, 0.0), (91.0, 0.0), (0.0, -181.0), (0.0, f64::INFINITY)] {
        let refused = globe.note(&fix(latitude, longitude, 0.1), [0.0; 2]).unwrap_err();
        assert!(matches!(refused, GlobeError::NoPlace { .. }), "{refused}");
    }
    for deviation_m in [f64::NAN, 51.0] {
        let refused = globe.note(&fix(1.0, 1.0, deviation_m), [0.0; 2]).unwrap_err();
        assert!(matches!(refused, GlobeError::Unsure { .. }), "{refused}");
    }
    assert!(globe.alignment().is_none());
    globe.note(&fix(1.0, 1.0, 0.1), [0.0; 2]).unwrap();
    // One degree of latitude away.
    assert!(told(globe.place_m(&point(2.0, 1.0)).unwrap_err()).contains("found one 1105"));
    assert!(matches!(globe.note(&fix(2.0, 1.0, 0.1), [0.0; 2]), Err(GlobeError::TooFar { .. })));
    assert!(matches!(globe.place_m(&point(f64::NAN, 1.0)), Err(GlobeError::NoPlace { .. })));
}

#[test]
fn who_does_not_say_how_sure_it_is_counts_as_five_metres() {
    let mut unstated = fix(0.0, 0.0, 0.0);
    unstated.position_covariance_type = 0;
    assert_eq!(deviation_m(&unstated), Ok(UNSTATED_DEVIATION_M));
    assert_eq!(deviation_m(&fix(0.0, 0.0, 0.0)), Ok(DEVIATION_MIN_M));
}
