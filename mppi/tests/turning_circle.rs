//! What a turning circle adds to the field of least time, against closed forms and against a bicycle that follows it.

#![allow(clippy::unwrap_used, reason = "a panic is how a test fails")]

mod fixture;

use fixture::block;
use mppi::{CostToGo, CostToGoConfig, CostToGoView, N_HEADINGS};
use rand::{RngExt, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;
use std::f64::consts::{PI, TAU};
use traversability::{Cell, GridGeometry, Risk, RiskMap};

const SPEED_MPS: f64 = 2.0;
const RADIUS_M: f64 = 4.0;
const RESOLUTION_M: f64 = 0.25;
const REVERSE_SHARE: f64 = 0.25;

fn config(reverse_speed_share: f64) -> CostToGoConfig {
    CostToGoConfig { turning_radius_m: RADIUS_M, reverse_speed_share, ..CostToGoConfig::default() }
}

/// Level ground, 24 m a side, with its corner at the origin.
fn level() -> RiskMap {
    let geometry = GridGeometry { resolution_m: RESOLUTION_M, origin: [0, 0], n_rows: 96, n_cols: 96 };
    RiskMap::constant(geometry, 16, Risk::NONE)
}

fn solved(map: &RiskMap, config: CostToGoConfig, goal_m: [f64; 2], tolerance_m: f64) -> CostToGo {
    let GridGeometry { n_rows, n_cols, .. } = *map.geometry();
    let mut field = CostToGo::new(config, &fixture::model().limits, n_rows, n_cols).unwrap();
    field.update(map.view(), goal_m, tolerance_m).unwrap();
    field
}

/// Yaw of a heading: to the 8 adjacent cells and a knight's move away, counter-clockwise from east.
fn yaw_rad(heading: usize) -> f64 {
    let knight = 0.5_f64.atan();
    let of_octant = [0.0, knight, PI / 4.0, PI / 2.0 - knight];
    of_octant[heading % 4] + PI / 2.0 * (heading / 4) as f64
}

/// Time from a cell and heading [s].
fn time_s(view: &CostToGoView<'_>, index: usize, heading: usize) -> f64 {
    f64::from(view.seconds[index] + view.turning_s[heading * view.seconds.len() + index])
}

/// Time from the cell and the heading nearest to a pose [s].
fn nearest_s(view: &CostToGoView<'_>, [x_m, y_m, yaw_rad_of]: [f64; 3]) -> f64 {
    let Some(cell) = view.geometry.cell_at(x_m, y_m) else { return f64::INFINITY };
    let off = |heading: &usize| {
        let turn = (yaw_rad(*heading) - yaw_rad_of).rem_euclid(TAU);
        turn.min(TAU - turn)
    };
    let heading = (0..N_HEADINGS).min_by(|a, b| off(a).total_cmp(&off(b))).unwrap();
    time_s(view, view.geometry.index(cell), heading)
}

/// Shortest way of a vehicle that drives ahead and turns in circles of radius R at the tightest to a point outside
/// both circles: along one circle to its tangent through the point, then straight (Dubins, with a free heading at
/// the end). A circle whose centre is at distance d from the point leaves a tangent of sqrt(d^2 - R^2).
fn dubins_m([x_m, y_m, yaw_rad]: [f64; 3], goal_m: [f64; 2]) -> f64 {
    let way_m = |side: f64| {
        let centre_m = [x_m - side * RADIUS_M * yaw_rad.sin(), y_m + side * RADIUS_M * yaw_rad.cos()];
        let (dx, dy) = (goal_m[0] - centre_m[0], goal_m[1] - centre_m[1]);
        let straight_m = (dx.hypot(dy).powi(2) - RADIUS_M * RADIUS_M).sqrt();
        let leaving_rad = dy.atan2(dx) - side * straight_m.atan2(RADIUS_M);
        let turned_rad = (side * (leaving_rad - (yaw_rad - side * PI / 2.0))).rem_euclid(TAU);
        // A rounding below zero is not a whole turn.
        let turned_rad = if turned_rad > TAU - 1e-9 { 0.0 } else { turned_rad };
        RADIUS_M * turned_rad + straight_m
    };
    way_m(1.0).min(way_m(-1.0))
}

/// From everywhere and every heading, with room for the turn: within the lattice's tolerance of Dubins' shortest way. Its
/// arcs are up to 3 % tighter, and its straight lines lead to sixteen headings, at most 2.8 % longer; turns end at a
/// heading, half of one away from the tangent in the mean.
#[test]
fn on_open_ground_the_way_is_that_of_dubins() {
    let (map, goal_m, tolerance_m) = (level(), [12.1, 12.1], 0.5);
    let field = solved(&map, config(0.0), goal_m, tolerance_m);
    let (view, mut n, mut sum) = (field.view(), 0, 0.0);
    for index in 0..view.seconds.len() {
        let [x_m, y_m] = view.geometry.centre_m(view.geometry.cell(index));
        for heading in 0..N_HEADINGS {
            let pose = [x_m, y_m, yaw_rad(heading)];
            let centres = [1.0, -1.0]
                .map(|side| [x_m - side * RADIUS_M * pose[2].sin(), y_m + side * RADIUS_M * pose[2].cos()]);
            let off_m = centres.map(|centre| (goal_m[0] - centre[0]).hypot(goal_m[1] - centre[1]));
            // Both circles are within the window, with room for the straight pieces of arcs, and the goal within neither.
            let has_room =
                centres.iter().flatten().all(|at_m| (RADIUS_M + 1.5..22.5 - RADIUS_M).contains(at_m));
            if !has_room || off_m.iter().any(|off_m| *off_m < RADIUS_M + 0.5) {
                continue;
            }
            let shortest_s = dubins_m(pose, goal_m) / SPEED_MPS;
            let found_s = time_s(&view, index, heading);
            assert!(found_s > 0.96 * shortest_s - 0.1, "{pose:?}: {found_s} below {shortest_s}");
            assert!(found_s < 1.1 * shortest_s + 0.75, "{pose:?}: {found_s} above {shortest_s}");
            (n, sum) = (n + 1, sum + found_s / shortest_s);
        }
    }
    assert!(n > 500, "{n} poses");
    assert!((sum / f64::from(n) - 1.0).abs() < 0.05, "mean ratio {}", sum / f64::from(n));
}

/// A lane of one cell, closed in the west, open in the east, where the goal lies. Who faces the wall has no room to turn:
/// it backs out, and a metre of that takes 1 / share times as long as one ahead. Without reverse no way leads out.
#[test]
fn who_cannot_turn_backs_out() {
    let mut map = level();
    block(&mut map, |x_m, y_m| x_m < 8.0 && !(12.0..12.25).contains(&y_m) || x_m < 2.0);
    let goal_m = [20.0, 12.1];
    let lane = |field: &CostToGo, x_m: f64, heading: usize| {
        let view = field.view();
        time_s(&view, view.geometry.index(view.geometry.cell_at(x_m, 12.1).unwrap()), heading)
    };
    let (east, west) = (0, 8);
    let field = solved(&map, config(REVERSE_SHARE), goal_m, 0.5);
    for k in 0..12 {
        let x_m = 3.1 + RESOLUTION_M * f64::from(k);
        let ahead_s = lane(&field, x_m, east) - lane(&field, x_m + RESOLUTION_M, east);
        assert!((ahead_s - RESOLUTION_M / SPEED_MPS).abs() < 1e-3, "{ahead_s}");
        let back_s = lane(&field, x_m, west) - lane(&field, x_m + RESOLUTION_M, west);
        assert!((back_s - RESOLUTION_M / (SPEED_MPS * REVERSE_SHARE)).abs() < 1e-3, "{back_s}");
    }
    let without = solved(&map, config(0.0), goal_m, 0.5);
    assert!(lane(&without, 4.0, west) > 100.0 && lane(&without, 4.0, east) < 10.0);
}

/// Two walls of 1 m, 1.5 m apart, with gaps of 1 m, 5 m from each other: the field of least time goes through one and the
/// other. Who turns in circles of 4 m passes a gap within 45 degrees of straight on, and from there to the next and back to
/// 45 degrees takes more than the 1.5 m: it drives around the walls' southern end.
#[test]
fn a_way_that_no_turn_can_follow_is_not_promised() {
    let mut map = level();
    block(&mut map, |x_m, y_m| {
        let first = (9.5..10.5).contains(&x_m) && !(14.0..15.0).contains(&y_m);
        let second = (12.0..13.0).contains(&x_m) && !(9.0..10.0).contains(&y_m);
        (first || second) && y_m > 3.0
    });
    let (start, goal_m) = ([3.0, 14.5, 0.0], [20.0, 9.5]);
    let field = solved(&map, config(0.0), goal_m, 0.5);
    let view = field.view();
    let ignored_s = f64::from(view.nearest_s(start[0], start[1]));
    // 8 m to the lane between the walls, 5 m along it, 8 m to the goal, of which corners spare some.
    assert!((9.0..10.5).contains(&ignored_s), "{ignored_s}");
    // A quarter turn of 6.3 m to (7, 10.5), 8 m to the end at (9.5, 2.9), 3.5 m past it, 9.1 m to within the goal's half
    // metre, of which a wider turn spares some.
    let turning_s = nearest_s(&view, start);
    assert!((12.5..15.5).contains(&turning_s), "{turning_s}");
}

/// Within the tolerance nobody has to turn any more, and what is in the way is none: a goal that cannot be stood on is as
/// far as it is.
#[test]
fn within_the_tolerance_the_straight_line_counts() {
    let mut map = level();
    let goal_m = [12.1, 12.1];
    block(&mut map, |x_m, y_m| (x_m - goal_m[0]).hypot(y_m - goal_m[1]) < 1.0);
    let [blocked, open] = [0.5, 1.5].map(|tolerance_m| solved(&map, config(0.0), goal_m, tolerance_m));
    let start = [4.0, 12.1, 0.0];
    assert!(
        nearest_s(&blocked.view(), start) > 50.0,
        "half a metre of blocked poses at a thousandth of the speed"
    );
    let found_s = nearest_s(&open.view(), start);
    assert!((found_s - 8.1 / SPEED_MPS).abs() < 0.2, "{found_s}");
    for heading in 0..N_HEADINGS {
        let index = open.view().geometry.index(open.view().geometry.cell_at(12.1, 13.4).unwrap());
        let within_s = time_s(&open.view(), index, heading);
        assert!((within_s - 1.3 / SPEED_MPS).abs() < RESOLUTION_M / SPEED_MPS, "{within_s}");
    }
}

/// A bicycle that looks ahead by two arcs of 2 m, each of five curvatures, heads for where the least time is left, and
/// looks again after a metre, arrives, and in about the time that was told. No equation of the search is used for it.
#[test]
fn a_bicycle_that_follows_the_field_arrives_in_the_time_told() {
    for seed in 1..=8 {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
        let stones: Vec<[f64; 2]> = (0..14).map(|_| [0, 1].map(|_| rng.random_range(1.0..23.0))).collect();
        let (goal_m, start) = ([20.0, 20.0], [4.0, 4.0, rng.random_range(0.0..PI / 2.0)]);
        let is_near =
            |[x_m, y_m]: [f64; 2], at: &[f64; 2], radius_m: f64| (x_m - at[0]).hypot(y_m - at[1]) < radius_m;
        let mut map = level();
        block(&mut map, |x_m, y_m| {
            let at = [x_m, y_m];
            let is_stone = stones.iter().any(|stone| is_near(at, stone, 1.0));
            is_stone && !is_near(at, &goal_m, 3.0) && !is_near(at, &[4.0, 4.0], 6.0)
        });
        let field = solved(&map, config(0.0), goal_m, 1.0);
        let view = field.view();
        let (told_s, mut pose, mut way_m) = (nearest_s(&view, start), start, 0.0);
        while !is_near([pose[0], pose[1]], &goal_m, 1.25) && way_m < 100.0 {
            let curvatures = (-2..=2).map(|k| f64::from(k) / (2.0 * RADIUS_M));
            let pairs =
                curvatures.clone().flat_map(|first| curvatures.clone().map(move |second| [first, second]));
            let left_s = |[first, second]: [f64; 2]| {
                let (mut at, mut least_s) = (pose, f64::INFINITY);
                for (k, curvature) in [first, first, second, second].into_iter().enumerate() {
                    at = drive(at, curvature, 1.0);
                    let passed_s = (k as f64 - 3.0) / SPEED_MPS;
                    if k == 3 || is_near([at[0], at[1]], &goal_m, 1.25) {
                        least_s = least_s.min(passed_s + nearest_s(&view, at));
                    }
                }
                least_s
            };
            let [first, _] = pairs.min_by(|a, b| left_s(*a).total_cmp(&left_s(*b))).unwrap();
            pose = drive(pose, first, 1.0);
            way_m += 1.0;
        }
        let taken_s = way_m / SPEED_MPS;
        assert!(taken_s < 1.25 * told_s + 1.0, "seed {seed}: told {told_s} s, took {taken_s} s");
        assert!(taken_s > 0.8 * told_s - 1.0, "seed {seed}: told {told_s} s, took {taken_s} s");
    }
}

/// The pose after a way of constant curvature.
fn drive([mut x_m, mut y_m, mut yaw_rad]: [f64; 3], curvature_per_m: f64, way_m: f64) -> [f64; 3] {
    const N: u32 = 50;
    for _ in 0..N {
        let step_m = way_m / f64::from(N);
        yaw_rad += 0.5 * curvature_per_m * step_m;
        (x_m, y_m) = (x_m + step_m * yaw_rad.cos(), y_m + step_m * yaw_rad.sin());
        yaw_rad += 0.5 * curvature_per_m * step_m;
    }
    [x_m, y_m, yaw_rad]
}

/// A goal beyond the window: on open ground the time to it is that to the border and the straight line on, at half the
/// speed, and who faces away turns first.
#[test]
fn a_goal_beyond_the_window_is_turned_to() {
    let field = solved(&level(), config(0.0), [60.0, 12.1], 0.5);
    let view = field.view();
    let [east_s, west_s] = [0.0, PI].map(|yaw_rad| nearest_s(&view, [10.1, 12.1, yaw_rad]));
    // 13.9 m to the border, 36 m beyond it.
    assert!((east_s - (13.9 / SPEED_MPS + 36.0 / (0.5 * SPEED_MPS))).abs() < 0.5, "{east_s}");
    // Half a circle, which leads two radii aside: pi R more, and back over the rest of the way.
    let lost_s = west_s - east_s;
    assert!((lost_s - PI * RADIUS_M / SPEED_MPS).abs() < 1.0, "{lost_s}");
}

/// Another map, goal and resolution before leave nothing behind.
#[test]
fn the_result_does_not_depend_on_what_was_solved_before() {
    let mut map = level();
    block(&mut map, |x_m, y_m| (x_m - 12.0).hypot(y_m - 10.0) < 2.0);
    let fresh = solved(&map, config(REVERSE_SHARE), [20.0, 10.0], 0.5);
    let mut used = solved(&level(), config(REVERSE_SHARE), [-5.0, 3.0], 2.0);
    let coarse = GridGeometry { resolution_m: 0.5, ..*map.geometry() };
    used.update(RiskMap::constant(coarse, 16, Risk::NONE).view(), [3.0, 3.0], 0.0).unwrap();
    used.update(map.view(), [20.0, 10.0], 0.5).unwrap();
    let bits = |field: &CostToGo| -> Vec<u32> {
        let view = field.view();
        view.seconds.iter().chain(view.turning_s).map(|value| value.to_bits()).collect()
    };
    assert_eq!(bits(&fresh), bits(&used));
}

/// What is broken in a map is forbidden there, and nothing that comes out is not finite.
#[test]
fn broken_values_stay_where_they_are() {
    let mut map = level();
    let index = map.geometry().index(Cell { row: 40, col: 40 });
    map.fill(|risks, _| {
        risks[16 * index..16 * (index + 1)].iter_mut().for_each(|risk| risk.linear_traction = f32::NAN);
    });
    let field = solved(&map, config(REVERSE_SHARE), [20.0, 10.0], 0.5);
    let view = field.view();
    assert_eq!(view.turning_s.len(), N_HEADINGS * 96 * 96);
    assert!(view.turning_s.iter().all(|turning_s| turning_s.is_finite() && *turning_s >= 0.0));
    assert!(solved(&map, CostToGoConfig::default(), [20.0, 10.0], 0.5).view().turning_s.is_empty());
}

/// Windows smaller than a single arc are solved as well.
#[test]
fn a_window_smaller_than_the_turning_circle_is_solved() {
    for n in [3, 5, 9] {
        let geometry = GridGeometry { resolution_m: RESOLUTION_M, origin: [0, 0], n_rows: n, n_cols: n + 1 };
        let map = RiskMap::constant(geometry, 16, Risk::NONE);
        for goal_m in [[0.3, 0.3], [50.0, -20.0]] {
            let field = solved(&map, config(REVERSE_SHARE), goal_m, 0.1);
            assert!(field.view().turning_s.iter().all(|turning_s| turning_s.is_finite()));
        }
    }
}
