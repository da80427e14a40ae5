#![allow(clippy::unwrap_used, reason = "a panic is how a test fails")]

use super::*;
use crate::programme::{Affine, Programme};
use std::f64::consts::TAU;

const LEVEL: Bend =
    Bend { curvature_per_m: 0.0, grade: 0.0, cross_slope: 0.0, friction: 0.6, roughness_m: 0.0 };
const LIMITS: SpeedLimits = SpeedLimits {
    speed_max_mps: 10.0,
    traction_max_mps2: 2.0,
    braking_max_mps2: 20.0,
    friction_share: 1.0,
    roughness_speed_m2ps: 0.3,
};

/// Evenly from 0 to 1.
fn random(mut state: u64) -> impl FnMut() -> f64 {
    move || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 11) as f64 / (1_u64 << 53) as f64
    }
}

#[test]
fn a_straight_line_is_driven_at_full_traction_and_full_friction() {
    // 100 m: up at 2 m/s2, down at 0.6 g = 5.884 m/s2; never at 10 m/s for long:
    // 25 m to reach 10 m/s, 8.5 m to stop.
    let speeds = fastest_speeds(&vec![LEVEL; 101], 1.0, &LIMITS).unwrap();
    for (at_m, speed) in speeds.iter().enumerate() {
        let up = (2.0 * 2.0 * at_m as f64).sqrt();
        let down = (2.0 * 0.6 * GRAVITY_MPS2 * (100 - at_m) as f64).sqrt();
        assert!((speed - up.min(down).min(10.0)).abs() < 1e-3, "{at_m}: {speed}");
    }
    // 5 s up, 66.5 m at 10 m/s, 1.7 s down.
    let expected_s = 5.0 + (100.0 - 25.0 - 50.0 / (0.6 * GRAVITY_MPS2)) / 10.0 + 10.0 / (0.6 * GRAVITY_MPS2);
    assert!((duration_s(&speeds, 1.0) - expected_s).abs() < 0.02);
}

#[test]
fn a_long_bend_is_driven_at_the_speed_that_friction_holds_and_a_bank_changes_it() {
    let radius_m = 12.0;
    for cross_slope in [-0.2, 0.0, 0.2] {
        let bend = Bend { curvature_per_m: 1.0 / radius_m, cross_slope, ..LEVEL };
        let speeds = fastest_speeds(&vec![bend; 201], 1.0, &LIMITS).unwrap();
        let weight_mps2 = GRAVITY_MPS2 / (1.0 + cross_slope * cross_slope).sqrt();
        // Ground that rises to the left, inside of the turn, takes friction; a bank gives some.
        let expected = (radius_m * weight_mps2 * (0.6 - cross_slope)).sqrt();
        assert!((speeds[100] - expected).abs() < 2e-3, "{cross_slope}: {} {expected}", speeds[100]);
    }
}

#[test]
fn every_constraint_holds_on_a_random_line_and_one_is_active_everywhere() {
    let mut random = random(7);
    let bends: Vec<Bend> = (0..200)
        .map(|_| Bend {
            curvature_per_m: 0.2 * (random() - 0.5),
            grade: 0.2 * (random() - 0.5),
            cross_slope: 0.2 * (random() - 0.5),
            friction: 0.4 + 0.5 * random(),
            roughness_m: 0.1 * random(),
        })
        .collect();
    let speeds = fastest_speeds(&bends, 1.0, &LIMITS).unwrap();
    assert!(speeds[0] < 1e-9 && speeds[199] < 1e-9);
    for (index, bend) in bends.iter().enumerate().take(199).skip(1) {
        let speed = speeds[index];
        let (friction_mps2, grade_mps2, cross_mps2) = bend.forces_mps2(&LIMITS);
        let force = |from: f64, to: f64| 0.5 * (to * to - from * from);
        let along = grade_mps2 + force(speed, speeds[index + 1]);
        let used = libm::hypot(along, cross_mps2 + bend.curvature_per_m * speed * speed);
        let fastest = LIMITS.fastest_mps(bend.roughness_m);
        assert!(used <= friction_mps2 + 1e-3, "{index}: {used} of {friction_mps2}");
        assert!(speed <= fastest + 1e-4 && along <= LIMITS.traction_max_mps2 + 1e-3, "{index}");
        // What keeps it from being faster is the point itself or a neighbour.
        let (before, _, _) = bends[index - 1].forces_mps2(&LIMITS);
        let (_, grade_before, cross_before) = bends[index - 1].forces_mps2(&LIMITS);
        let along_before = grade_before + force(speeds[index - 1], speed);
        let turning = cross_before + bends[index - 1].curvature_per_m * speeds[index - 1].powi(2);
        let used_before = libm::hypot(along_before, turning);
        let is_active = used > friction_mps2 - 1e-2
            || used_before > before - 1e-2
            || speed > fastest - 1e-2
            || along_before > LIMITS.traction_max_mps2 - 1e-2;
        assert!(is_active, "{index}: {speed}");
    }
}

#[test]
fn what_cannot_even_creep_is_refused_with_its_place() {
    let mut bends = vec![LEVEL; 20];
    bends[7].cross_slope = 0.7;
    let error = fastest_speeds(&bends, 2.0, &LIMITS).unwrap_err();
    assert_eq!(
        error.to_string(),
        "ground at 14.0 m along the way: expected a slope of at most 0.60, found 0.70"
    );
    bends[7] = Bend { grade: 0.3, ..LEVEL };
    let error = fastest_speeds(&bends, 2.0, &LIMITS).unwrap_err();
    assert_eq!(error.to_string(), "climb at 14.0 m along the way: expected at most 2.00 m/s2, found 2.82");
    bends[7] = Bend { grade: -0.3, ..LEVEL };
    let error = fastest_speeds(&bends, 2.0, &SpeedLimits { braking_max_mps2: 2.0, ..LIMITS }).unwrap_err();
    assert_eq!(error.to_string(), "descent at 14.0 m along the way: expected at most 2.00 m/s2, found 2.82");
}

/// The paper's programme: the friction circle is a second-order cone, and a segment's time the epigraph of a rotated one.
fn duration_by_programme_s(bends: &[Bend], spacing_m: f64, limits: &SpeedLimits) -> f64 {
    let n = bends.len();
    // Speeds at the points between the ends, their squares, and the segments' times.
    let (speed, square) = (|point: usize| point - 1, |point: usize| n - 2 + point - 1);
    let time = |segment: usize| 2 * (n - 2) + segment;
    let of_point = |variable: &dyn Fn(usize) -> usize, point: usize, factor: f64| {
        let is_inner = (1..n - 1).contains(&point);
        is_inner.then(|| (variable(point), factor))
    };
    let mut programme = Programme::new(2 * (n - 2) + n - 1);
    for (point, bend) in bends.iter().enumerate().take(n - 1).skip(1) {
        let fastest_mps = limits.fastest_mps(bend.roughness_m);
        programme.not_negative(&[
            Affine::new(fastest_mps.powi(2), &[(square(point), -1.0)]),
            Affine::new(0.0, &[(speed(point), 1.0)]),
        ]);
        // v^2 <= b, as (b + 1)^2 >= (b - 1)^2 + (2 v)^2.
        programme.no_shorter(&[
            Affine::new(1.0, &[(square(point), 1.0)]),
            Affine::new(-1.0, &[(square(point), 1.0)]),
            Affine::new(0.0, &[(speed(point), 2.0)]),
        ]);
    }
    for (segment, bend) in bends.iter().enumerate().take(n - 1) {
        let (friction_mps2, grade_mps2, cross_mps2) = bend.forces_mps2(limits);
        let per_length = 0.5 / spacing_m;
        let mut terms: Vec<_> = of_point(&square, segment + 1, per_length).into_iter().collect();
        terms.extend(of_point(&square, segment, -per_length));
        let along = Affine::new(grade_mps2, &terms);
        let turning: Vec<_> = of_point(&square, segment, bend.curvature_per_m).into_iter().collect();
        programme.no_shorter(&[
            Affine::new(friction_mps2, &[]),
            along.clone(),
            Affine::new(cross_mps2, &turning),
        ]);
        let negated: Vec<_> = along.terms.iter().map(|(variable, factor)| (*variable, -factor)).collect();
        programme.not_negative(&[
            Affine::new(limits.traction_max_mps2 - grade_mps2, &negated),
            Affine { constant: limits.braking_max_mps2 + grade_mps2, terms },
        ]);
        // t (v + w) >= 2 d, as (t + v + w)^2 >= (t - v - w)^2 + 8 d.
        let ends: Vec<_> =
            [segment, segment + 1].into_iter().filter_map(|point| of_point(&speed, point, 1.0)).collect();
        let signed = |sign: f64| {
            let mut terms: Vec<_> = ends.iter().map(|(variable, _)| (*variable, sign)).collect();
            terms.push((time(segment), 1.0));
            Affine { constant: 0.0, terms }
        };
        programme.no_shorter(&[signed(1.0), signed(-1.0), Affine::new((8.0 * spacing_m).sqrt(), &[])]);
        programme.minimise(time(segment), 1.0);
    }
    let found = programme.solve().unwrap();
    (0..n - 1).map(|segment| found[time(segment)]).sum()
}

/// Two sweeps give away what turning at the limit leaves for neither: nothing that matters, on lines that a vehicle
/// drives as on such that bend at random from point to point.
#[test]
fn two_sweeps_take_no_longer_than_the_convex_programme() {
    let mut random = random(11);
    for line in 0..12 {
        let turns: [f64; 3] = std::array::from_fn(|_| random() - 0.5);
        let is_smooth = line < 8;
        let bends: Vec<Bend> = (0..160)
            .map(|point| {
                let wave = |turn: f64, k: f64| turn * (k * f64::from(point) / 160.0 * TAU).sin();
                let smooth = wave(turns[0], 1.0) + wave(turns[1], 3.0) + wave(turns[2], 6.0);
                Bend {
                    curvature_per_m: if is_smooth { 0.15 * smooth } else { 0.2 * (random() - 0.5) },
                    grade: 0.1 * turns[1],
                    cross_slope: 0.15 * turns[2],
                    friction: if point / 40 % 2 == 0 { 0.8 } else { 0.3 },
                    roughness_m: 0.02,
                }
            })
            .collect();
        let spacing_m = if is_smooth { 0.5 } else { 1.0 };
        let found_s = duration_s(&fastest_speeds(&bends, spacing_m, &LIMITS).unwrap(), spacing_m);
        let least_s = duration_by_programme_s(&bends, spacing_m, &LIMITS);
        let most = if is_smooth { 1.001 } else { 1.005 };
        assert!((0.9999..most).contains(&(found_s / least_s)), "{line}: {found_s} s, least {least_s} s");
    }
}
