//! What many noisy points make of one cell: heights, variances, classes, plants, obstacles, bad input.

use crate::points::{all_centres, plain_config, plain_map, scan_of};
use rand::SeedableRng;
use rand_distr::{Distribution, Normal};
use rand_xoshiro::Xoshiro256PlusPlus;
use terrain::TerrainClass::{Loose, Obstacle, Open, Vegetation};
use terrain::{
    BodyBox, ElevationConfig, ElevationMap, FuseError, Knowledge, Pose, Scan, SurfaceCell, TerrainClass,
};

const HERE: Pose = Pose { x_m: 0.0, y_m: 0.0, z_m: 0.0, roll_rad: 0.0, pitch_rad: 0.0, yaw_rad: 0.0 };
/// Centre of one cell of the plain map.
const SPOT: [f64; 2] = [0.25, 0.25];

fn at_spot(map: &ElevationMap) -> SurfaceCell {
    *map.surface().at(SPOT[0], SPOT[1]).unwrap()
}

fn column(heights_m: &[f64], class: TerrainClass) -> Vec<([f64; 3], TerrainClass)> {
    heights_m.iter().map(|&z_m| ([SPOT[0], SPOT[1], z_m], class)).collect()
}

/// Mean squared error and mean published variance after `n_scans` scans of one point per cell, truth 1.5 m.
fn error_after(n_scans: usize, sigma_m: f64) -> (f64, f64) {
    let mut map = plain_map(|config| config.noise_floor_m = sigma_m);
    let mut random = Xoshiro256PlusPlus::seed_from_u64(11);
    let noise = Normal::new(1.5, sigma_m).unwrap();
    for _ in 0..n_scans {
        let points = all_centres().map(|[x, y]| ([x, y, noise.sample(&mut random)], Open));
        let scan = scan_of(points.collect::<Vec<_>>());
        map.fuse(&scan, &HERE).unwrap();
    }
    let n = map.surface().values().len() as f64;
    let mean = |f: &dyn Fn(&SurfaceCell) -> f64| map.surface().values().iter().map(f).sum::<f64>() / n;
    (mean(&|cell| (f64::from(cell.height_m) - 1.5).powi(2)), mean(&|cell| f64::from(cell.height_variance_m2)))
}

#[test]
fn the_error_falls_as_one_over_root_n_and_the_variance_says_so() {
    let sigma_m = 0.05;
    for n_scans in [1, 4, 16, 64] {
        let expected_m2 = sigma_m * sigma_m / n_scans as f64;
        let (error_m2, variance_m2) = error_after(n_scans, sigma_m);
        // 1600 cells: the mean square has a relative standard error of sqrt(2 / 1600) = 3.5 %; three of them.
        assert!((error_m2 / expected_m2 - 1.0).abs() < 0.11, "{n_scans} scans: {error_m2} for {expected_m2}");
        // A surprise beyond four standard deviations, one in 16 000 updates, adds a little.
        assert!((variance_m2 / expected_m2 - 1.0).abs() < 0.02, "{n_scans} scans: {variance_m2}");
    }
}

#[test]
fn points_of_one_scan_share_the_error_of_its_pose() {
    let mut map = plain_map(|config| config.scan_noise_m = 0.03);
    let offsets_m = [-0.02, 0.02, -0.01, 0.01];
    map.fuse(&scan_of(column(&offsets_m, Open)), &HERE).unwrap();
    // 0.02^2 / 4 + 0.03^2
    assert!((at_spot(&map).height_variance_m2 - 1.0e-3).abs() < 1e-7);
    assert!(at_spot(&map).height_m.abs() < 1e-7);
}

#[test]
fn noise_grows_with_range() {
    let mut map = plain_map(|config| config.noise_per_range = 0.01);
    map.fuse(&scan_of([([3.25, 4.25, 10.0], Open)]), &HERE).unwrap();
    // The ray is 5.35 m long, from (0, 0, 10) to (3.25, 4.25, 10): (0.02 + 0.0535)^2
    let cell = map.surface().at(3.25, 4.25).unwrap();
    let expected_m2 = (0.02 + 0.01 * 3.25_f32.hypot(4.25)).powi(2);
    assert!((cell.height_variance_m2 / expected_m2 - 1.0).abs() < 1e-5);
}

#[test]
fn a_cell_with_two_heights_says_that_it_is_uncertain() {
    let mut map = plain_map(|_| {});
    for i in 0..60 {
        let z_m = if i % 2 == 0 { 0.0 } else { 0.3 };
        map.fuse(&scan_of(column(&[z_m], Open)), &HERE).unwrap();
    }
    let cell = at_spot(&map);
    assert!((0.05..0.25).contains(&cell.height_m), "{cell:?}");
    // Half of the points lie 0.15 m above the mean, half below: standard deviation 0.15 m.
    assert!((0.08..0.3).contains(&cell.height_variance_m2.sqrt()), "{cell:?}");
}

#[test]
fn heights_within_one_scan_count_as_spread() {
    let mut map = plain_map(|_| {});
    map.fuse(&scan_of(column(&[0.0, 0.1, 0.2, 0.3, 0.4], Open)), &HERE).unwrap();
    let cell = at_spot(&map);
    assert!((cell.height_m - 0.2).abs() < 1e-6);
    // Sample variance 0.025 m2, mean of five: 0.005 m2 more; sensor noise of 0.0004 m2 explains 2 % of it.
    assert!((0.025..0.031).contains(&cell.height_variance_m2), "{cell:?}");
}

#[test]
fn ground_that_moved_is_followed_within_a_second() {
    let mut map = plain_map(|_| {});
    for _ in 0..50 {
        map.fuse(&scan_of(column(&[0.0], Open)), &HERE).unwrap();
    }
    for _ in 0..8 {
        map.fuse(&scan_of(column(&[0.25], Open)), &HERE).unwrap();
    }
    let cell = at_spot(&map);
    assert!((cell.height_m - 0.25).abs() < 0.05, "{cell:?}");
    assert!((cell.height_m - 0.25).abs() < 3.0 * cell.height_variance_m2.sqrt());
}

#[test]
fn classes_are_counted_beside_one_prior_point_of_open_ground() {
    let mut map = plain_map(|_| {});
    let points = [column(&[0.0; 3], Loose), column(&[0.0; 4], Vegetation)].concat();
    map.fuse(&scan_of(points), &HERE).unwrap();
    let expected = [1.0 / 8.0, 3.0 / 8.0, 4.0 / 8.0, 0.0];
    for (p, expected) in at_spot(&map).class_probability.iter().zip(expected) {
        assert!((p - expected).abs() < 1e-6);
    }
    assert_eq!(at_spot(&map).class(), Vegetation);
}

#[test]
fn old_evidence_is_forgotten_beyond_the_cap() {
    let mut map = plain_map(|config| config.evidence_cap = 10.0);
    map.fuse(&scan_of(column(&[0.0; 100], Loose)), &HERE).unwrap();
    for _ in 0..7 {
        map.fuse(&scan_of(column(&[0.0], Open)), &HERE).unwrap();
    }
    // Of ten points' worth of loose ground, 10 (10/11)^7 = 5.13 are left; 1 is the prior.
    let loose = at_spot(&map).class_probability[Loose as usize];
    assert!((loose - 5.13158 / 11.0).abs() < 1e-4, "{loose}");
}

#[test]
fn one_point_named_wrongly_makes_no_obstacle_but_two_do() {
    let mut map = plain_map(|_| {});
    map.fuse(&scan_of(column(&[0.4], Obstacle)), &HERE).unwrap();
    assert_ne!(at_spot(&map).class(), Obstacle);
    map.fuse(&scan_of(column(&[0.5], Obstacle)), &HERE).unwrap();
    assert_eq!(at_spot(&map).class(), Obstacle);
    assert_eq!(at_spot(&map).knowledge, Knowledge::Interpolated);
    assert!(at_spot(&map).height_m <= 0.4, "the ground is not above the lowest point");
}

#[test]
fn plants_stand_on_the_ground_seen_between_them() {
    let mut map = plain_map(|_| {});
    for _ in 0..10 {
        let points = [column(&[0.2, 0.35, 0.5], Vegetation), column(&[0.1], Open)].concat();
        map.fuse(&scan_of(points), &HERE).unwrap();
    }
    let cell = at_spot(&map);
    assert_eq!(cell.knowledge, Knowledge::Measured);
    assert!((cell.height_m - 0.1).abs() < 1e-6 && (cell.vegetation_height_m - 0.4).abs() < 0.03, "{cell:?}");
}

/// Ground h = 0.2 x + `rise_m` in the eight cells around the spot, plants from 0.3 to 0.6 m in its own.
fn bush_on_a_slope(rise_m: f64) -> SurfaceCell {
    let mut map = plain_map(|_| {});
    let mut points = column(&[0.3, 0.45, 0.6], Vegetation);
    for (dx_m, dy_m) in (-1..=1).flat_map(|i| (-1..=1).map(move |j| (0.5 * f64::from(i), 0.5 * f64::from(j))))
    {
        if (dx_m, dy_m) != (0.0, 0.0) {
            points.push(([SPOT[0] + dx_m, SPOT[1] + dy_m, 0.2 * (SPOT[0] + dx_m) + rise_m], Open));
        }
    }
    map.fuse(&scan_of(points), &HERE).unwrap();
    at_spot(&map)
}

#[test]
fn ground_hidden_by_plants_is_inferred_from_the_ground_around_them() {
    let cell = bush_on_a_slope(0.1);
    assert_eq!(cell.knowledge, Knowledge::Interpolated);
    assert!(
        (cell.height_m - 0.15).abs() < 1e-5 && (cell.vegetation_height_m - 0.45).abs() < 1e-5,
        "{cell:?}"
    );
    // Each neighbour has 0.02^2; what is inferred is no better.
    assert!(cell.height_variance_m2 >= 0.99 * 4e-4);
    assert_eq!(cell.class(), Vegetation);
}

#[test]
fn hidden_ground_is_never_above_the_lowest_leaf() {
    assert!((bush_on_a_slope(0.9).height_m - 0.3).abs() < 1e-6);
}

#[test]
fn in_a_meadow_the_ground_is_at_the_lowest_leaf_around_and_uncertain() {
    let mut map = plain_map(|config| config.hidden_ground_std_m = 0.15);
    let leaves =
        |x_m: f64, low_m: f64| [([x_m, SPOT[1], low_m], Vegetation), ([x_m, SPOT[1], 0.8], Vegetation)];
    let points = [leaves(SPOT[0], 0.4), leaves(SPOT[0] + 0.5, 0.2), leaves(SPOT[0] + 2.0, 0.1)].concat();
    map.fuse(&scan_of(points), &HERE).unwrap();
    let cell = at_spot(&map);
    assert_eq!((cell.knowledge, cell.height_m), (Knowledge::Interpolated, 0.2), "0.1 m is two metres away");
    assert!((cell.vegetation_height_m - 0.6).abs() < 1e-6 && (cell.height_variance_m2 - 0.0225).abs() < 1e-7);
}

/// Two rows of seven cells of bushes of 0.4 m on ground that rises by 0.2 per metre: between those of the first the ground
/// is seen, of all others the upper half. A leaf of a first cell seems to be 0.9 m high.
fn fuse_thicket(map: &mut ElevationMap) {
    let mut points = vec![([SPOT[0], SPOT[1], 0.9], Vegetation)];
    for (row, i) in (0..2).flat_map(|row| (0..7).map(move |i| (row, i))) {
        let (x_m, low_m) = (SPOT[0] + 0.5 * f64::from(i), if i == 0 { 0.0 } else { 0.2 });
        let at = |rise_m: f64| [x_m, SPOT[1] + 0.5 * f64::from(row), 0.2 * x_m + rise_m];
        points.extend([low_m, 0.3, 0.35, 0.4].map(|rise_m| (at(rise_m), Vegetation)));
        points.extend((i == 0).then(|| [0.0, 0.0].map(|rise_m| (at(rise_m), Open))).into_iter().flatten());
    }
    map.fuse(&scan_of(points), &HERE).unwrap();
}

/// Hidden ground is where it is, and uncertain by a uniform distribution over the plants' 0.4 m.
fn assert_is_thicket(map: &ElevationMap) {
    for x_m in (1..7).map(|i| SPOT[0] + 0.5 * f64::from(i)) {
        let cell = map.surface().at(x_m, SPOT[1]).unwrap();
        assert!((cell.vegetation_height_m - 0.4).abs() < 0.02, "{x_m} m: {cell:?}");
        assert!((f64::from(cell.height_m) - 0.2 * x_m).abs() < 0.02, "{x_m} m: {cell:?}");
        let above_uniform_m2 = cell.height_variance_m2 - 0.4_f32.powi(2) / 12.0;
        assert!((0.0..0.001).contains(&above_uniform_m2), "{x_m} m: {cell:?}");
    }
}

#[test]
fn plants_that_hide_the_ground_are_as_tall_as_those_of_their_stand() {
    for gap_radius_m in [0.2, 1.0] {
        let mut map = plain_map(|config| config.gap_radius_m = gap_radius_m);
        fuse_thicket(&mut map);
        assert_is_thicket(&map);
    }
}

/// A leaf in the sixth cell, 0.38 m above the ground, is named as ground.
#[test]
fn one_leaf_named_as_ground_in_a_thicket_says_nothing_of_the_ground() {
    let mut map = plain_map(|config| config.gap_radius_m = 1.0);
    let x_m = SPOT[0] + 2.5;
    map.fuse(&scan_of([([x_m, SPOT[1], 0.2 * x_m + 0.38], Open)]), &HERE).unwrap();
    fuse_thicket(&mut map);
    assert_is_thicket(&map);
}

#[test]
fn plants_of_another_stand_say_nothing() {
    let mut map = plain_map(|config| config.gap_radius_m = 0.2);
    let leaves = [0.2, 0.4].map(|z_m| ([SPOT[0] + 2.0, SPOT[1], z_m], Vegetation));
    let seen = [column(&[0.0, 0.0], Open), column(&[0.1, 0.3, 0.4], Vegetation)].concat();
    let beside = seen.iter().map(|&([x_m, y_m, z_m], class)| ([x_m, y_m + 0.5, z_m], class));
    map.fuse(&scan_of(beside.chain(seen.clone()).chain(leaves)), &HERE).unwrap();
    assert!((at_spot(&map).vegetation_height_m - 0.4).abs() < 1e-6);
    let other = map.surface().at(SPOT[0] + 2.0, SPOT[1]).unwrap();
    assert!(
        (other.vegetation_height_m - 0.2).abs() < 0.02 && (other.height_m - 0.2).abs() < 1e-6,
        "{other:?}"
    );
}

#[test]
fn a_leaf_named_as_ground_does_not_lift_the_ground() {
    let mut map = plain_map(|_| {});
    map.fuse(&scan_of(column(&[0.5], Open)), &HERE).unwrap();
    for _ in 0..5 {
        let points = [column(&[0.2, 0.35, 0.5], Vegetation), column(&[0.45], Open)].concat();
        map.fuse(&scan_of(points), &HERE).unwrap();
    }
    let cell = at_spot(&map);
    assert_eq!(cell.knowledge, Knowledge::Interpolated);
    assert!((cell.height_m - 0.2).abs() < 1e-6, "{cell:?}");
}

#[test]
fn branches_above_the_vehicle_are_left_out() {
    let mut map = plain_map(|_| {});
    map.fuse(&scan_of(column(&[0.0, 0.0], Open)), &HERE).unwrap();
    map.fuse(&scan_of(column(&[2.6, 3.0, 4.0], Vegetation)), &HERE).unwrap();
    assert_eq!(at_spot(&map).vegetation_height_m, 0.0);
    assert_eq!(at_spot(&map).class(), Open);
}

#[test]
fn ground_far_above_a_false_low_return_is_believed_the_second_time() {
    let mut map = plain_map(|_| {});
    map.fuse(&scan_of(column(&[-4.0], Open)), &HERE).unwrap();
    map.fuse(&scan_of(column(&[0.0, 0.0], Open)), &HERE).unwrap();
    assert_eq!(at_spot(&map).height_m, -4.0);
    map.fuse(&scan_of(column(&[0.0, 0.0], Open)), &HERE).unwrap();
    assert_eq!(at_spot(&map).height_m, 0.0);
}

#[test]
fn a_steep_face_is_an_obstacle_whatever_its_name() {
    let mut map = plain_map(|_| {});
    let face: Vec<f64> = (0..26).map(|i| 0.1 * f64::from(i)).collect();
    map.fuse(&scan_of(column(&face, Open)), &HERE).unwrap();
    assert_eq!(at_spot(&map).class(), Obstacle);
    let mut map = plain_map(|_| {});
    map.fuse(&scan_of(column(&[0.0, 0.05, 0.0, 0.02, 2.4], Open)), &HERE).unwrap();
    assert_eq!(at_spot(&map).class(), Open, "a single high point is no face");
    let mut map = plain_map(|_| {});
    // 70 degrees across the diagonal of 0.71 m: 1.94 m.
    let hump: Vec<f64> = (0..20).map(|i| 0.1 * f64::from(i)).collect();
    map.fuse(&scan_of(column(&hump, Open)), &HERE).unwrap();
    assert_eq!(at_spot(&map).class(), Open);
}

#[test]
fn bad_points_are_dropped_and_counted() {
    let mut map = plain_map(|config| config.own_body_m = 1.0);
    let bad = [
        ([f64::NAN, 0.0, 0.0], Open),
        ([0.0, f64::INFINITY, 0.0], Open),
        ([0.0, 0.0, f64::NEG_INFINITY], Obstacle),
        ([100.0, 0.0, 0.0], Open),
        ([1.0, 1.0, 1e30], Open),
        ([0.3, 0.0, 10.5], Obstacle),
        ([SPOT[0], SPOT[1], 0.7], Open),
    ];
    let report = map.fuse(&scan_of(bad), &HERE).unwrap();
    assert_eq!((report.n_points, report.n_rejected_non_finite), (7, 3));
    assert_eq!((report.n_out_of_window, report.n_own_body), (2, 1));
    assert_eq!(map.surface().values().iter().filter(|cell| cell.is_known()).count(), 1);
    assert!((at_spot(&map).height_m - 0.7).abs() < 1e-6);
}

#[test]
fn points_on_the_vehicles_own_body_are_no_ground_and_those_beside_above_and_below_it_are() {
    let body = BodyBox { min_m: [-0.8, -0.9, -0.1], max_m: [2.6, 0.9, 1.4] };
    let mut map = plain_map(|config| config.own_body = body);
    let own = [[2.0, 0.0, 0.9], [2.59, 0.89, 1.39], [-0.79, -0.89, -0.09]].map(|place| (place, Open));
    let others =
        [[2.7, 0.0, 0.9], [0.0, 1.0, 0.5], [0.0, 0.0, -0.2], [0.0, 0.0, 1.5]].map(|place| (place, Open));
    // The body turns and tilts with the pose.
    let pose = Pose { x_m: 1.0, yaw_rad: 2.0, pitch_rad: 0.3, roll_rad: -0.2, ..HERE };
    let report = map.fuse(&scan_of(own), &pose).unwrap();
    assert_eq!((report.n_own_body, report.n_mapped()), (3, 0));
    assert!(map.surface().values().iter().all(|cell| !cell.is_known()));
    let report = map.fuse(&scan_of(own.into_iter().chain(others)), &pose).unwrap();
    assert_eq!((report.n_own_body, report.n_mapped()), (3, 4));
}

#[test]
fn an_empty_scan_changes_nothing() {
    let mut map = plain_map(|_| {});
    map.fuse(&scan_of(column(&[0.3], Open)), &HERE).unwrap();
    let before = map.surface().values().to_vec();
    let report = map.fuse(&scan_of([]), &HERE).unwrap();
    assert_eq!((report.n_points, report.changed), (0, None));
    assert_eq!(before.iter().filter(|cell| cell.is_known()).count(), 1);
    for (a, b) in before.iter().zip(map.surface().values()) {
        assert_eq!(a.height_m.to_bits(), b.height_m.to_bits());
    }
}

#[test]
fn a_pose_or_origin_that_is_no_number_is_refused_and_leaves_the_map_alone() {
    let mut map = plain_map(|_| {});
    let scan = scan_of(column(&[0.3], Open));
    for broken in [
        Pose { x_m: f64::NAN, ..HERE },
        Pose { z_m: f64::INFINITY, ..HERE },
        Pose { yaw_rad: f64::NAN, ..HERE },
    ] {
        assert!(matches!(map.fuse(&scan, &broken), Err(FuseError::NonFinitePose(_))));
    }
    let nowhere = Scan { origin_m: [0.0, f32::NAN, 0.0], ..scan };
    assert!(matches!(map.fuse(&nowhere, &HERE), Err(FuseError::NonFiniteOrigin(_))));
    assert!(map.surface().values().iter().all(|cell| !cell.is_known()));
    assert_eq!(map.take_changed(), None);
}

#[test]
fn a_pose_beyond_all_lattices_is_refused_and_one_at_their_end_is_not() {
    let mut map = plain_map(|config| config.recentre_m = 1.0);
    let scan = scan_of(column(&[0.3], Open));
    map.fuse(&scan, &HERE).unwrap();
    let before = map.surface().geometry().origin;
    for far_m in [1e19, -1e19, 1e300, 5.6e11] {
        for pose in [Pose { x_m: far_m, ..HERE }, Pose { y_m: far_m, ..HERE }] {
            let error = map.fuse(&scan, &pose).unwrap_err();
            assert!(matches!(error, FuseError::Distant(_)), "{far_m}: {error}");
            assert!(error.to_string().contains("5.497"), "says what would do: {error}");
            assert_eq!(map.reanchor(&HERE, &pose), Err(error));
        }
    }
    assert_eq!(map.surface().geometry().origin, before);
    // Half a metre times 2^40 is 5.5e11.
    for far_m in [5.4e11, -5.4e11] {
        map.fuse(&scan, &Pose { x_m: far_m, y_m: -far_m, ..HERE }).unwrap();
        map.take_changed();
    }
}

#[test]
fn uncertainty_grows_with_time_and_never_shrinks_for_an_old_scan() {
    let mut map = plain_map(|config| config.fading_m2ps = 1e-4);
    let scan = |valid_at_ns, points: Vec<_>| Scan { valid_at_ns, ..scan_of(points) };
    map.fuse(&scan(1_000_000_000, column(&[0.3], Open)), &HERE).unwrap();
    map.fuse(&scan(3_500_000_000, vec![]), &HERE).unwrap();
    // 0.02^2 + 1e-4 x 2.5
    assert!((at_spot(&map).height_variance_m2 - 6.5e-4).abs() < 1e-8);
    map.fuse(&scan(2_000_000_000, vec![]), &HERE).unwrap();
    assert!((at_spot(&map).height_variance_m2 - 6.5e-4).abs() < 1e-8);
    map.fuse(&scan(4_500_000_000, vec![]), &HERE).unwrap();
    assert!((at_spot(&map).height_variance_m2 - 7.5e-4).abs() < 1e-8);
}

/// Heights that move by less than two standard deviations are told of with every fourth scan, others at once.
#[test]
fn what_tells_little_waits() {
    let mut map = told_every(4, 100.0);
    map.fuse(&scan(0.1), &HERE).unwrap();
    let first_m = heights_m(&map);
    assert!(first_m.iter().all(|height_m| (height_m - 0.1).abs() < 1e-6), "seen for the first time");
    // 2 cm were told as the standard deviation: 2 cm more are more than half of it, and less than twice.
    for number in 1..=3 {
        map.fuse(&scan(0.14), &HERE).unwrap();
        assert_eq!(heights_m(&map), first_m, "scan {number}");
    }
    map.fuse(&scan(0.14), &HERE).unwrap();
    assert!(heights_m(&map).iter().all(|height_m| *height_m > 0.12), "with the fourth scan all is told");
    map.fuse(&scan(0.5), &HERE).unwrap();
    assert!(heights_m(&map).iter().all(|height_m| *height_m > 0.15), "a step is told of at once");
}

/// A map that tells everything with every so many scans, and what is urgent within `near_m` at once.
fn told_every(n_scans: u8, near_m: f64) -> ElevationMap {
    plain_map(|config| {
        (config.publish_period_scans, config.publish_near_m, config.publish_step_m) =
            (n_scans, near_m, 0.001);
    })
}

/// A level scan of every cell.
fn scan(height_m: f64) -> Scan {
    scan_of(all_centres().map(|[x_m, y_m]| ([x_m, y_m, height_m], Open)))
}

fn heights_m(map: &ElevationMap) -> Vec<f32> {
    map.surface().values().iter().map(|cell| cell.height_m).collect()
}

#[test]
fn far_from_the_vehicle_everything_waits() {
    let mut map = told_every(4, 3.0);
    map.fuse(&scan(0.1), &HERE).unwrap();
    let first_m = heights_m(&map);
    map.fuse(&scan(0.5), &HERE).unwrap();
    let geometry = *map.surface().geometry();
    for (index, (now_m, first_m)) in heights_m(&map).into_iter().zip(&first_m).enumerate() {
        let [x_m, y_m] = geometry.centre_m(geometry.cell(index));
        let away_m = x_m.hypot(y_m);
        // The cell of the vehicle has its corner at the origin: half a cell's diagonal to either side.
        assert!(away_m < 3.0 + 0.36 || now_m == *first_m, "{away_m} m away: is told at once");
        assert!(away_m > 3.0 - 0.36 || now_m > 0.15, "{away_m} m away: waits");
    }
    (0..3).for_each(|_| map.fuse(&scan(0.5), &HERE).map(|_| ()).unwrap());
    assert!(heights_m(&map).iter().all(|height_m| *height_m > 0.15), "with the fourth scan all is told");
}

/// A height that moves by less than half of the standard deviation that was told with it is no news.
#[test]
fn what_lies_within_what_was_told_is_not_told_again() {
    let moved_m = |last_m: f64| {
        let mut map = plain_map(|config| config.publish_step_m = 0.001);
        for _ in 0..40 {
            map.fuse(&scan(0.1), &HERE).unwrap();
        }
        let before_m = at_spot(&map).height_m;
        map.fuse(&scan(last_m), &HERE).unwrap();
        at_spot(&map).height_m - before_m
    };
    // A variance is told when it has fallen by a fifth: the last time with the 37th point of 2 cm, as 3.3 mm squared.
    // 5 cm move the mean of 41 by 1.2 mm, less than half of that; 7.5 cm by 1.8 mm.
    assert_eq!(moved_m(0.15), 0.0);
    assert!((moved_m(0.175) - 0.0018).abs() < 1e-4, "{}", moved_m(0.175));
}

#[test]
fn settings_that_cannot_be_are_refused_with_field_and_number() {
    let refused = |change: fn(&mut ElevationConfig)| {
        let mut config = plain_config();
        change(&mut config);
        let error = ElevationMap::new(config).unwrap_err();
        (error.field, error.to_string())
    };
    let (field, message) = refused(|c| c.resolution_m = -0.5);
    assert_eq!(field, "resolution_m");
    assert!(message.contains("-0.5") && message.contains("> 0"), "{message}");
    assert_eq!(refused(|c| c.n_rows = 0).0, "n_rows");
    assert_eq!(refused(|c| c.publish_period_scans = 0).0, "publish_period_scans");
    assert_eq!(refused(|c| c.noise_per_range = f64::NAN).0, "noise_per_range");
    assert_eq!(refused(|c| c.recentre_m = 0.0).0, "recentre_m");
    assert_eq!(refused(|c| c.gap_radius_m = f64::INFINITY).0, "gap_radius_m");
    assert_eq!(refused(|c| c.own_body.max_m[1] = f64::NAN).0, "own_body.max_m");
    assert!(ElevationConfig::scaled_to(0.33).validate().is_ok());
    assert_eq!(ElevationConfig::scaled_to(3.4), ElevationConfig::default());
}
