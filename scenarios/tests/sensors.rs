//! Simulated sensors against geometry and statistics.
#![allow(clippy::unwrap_used, reason = "helpers of tests fail the test")]

use std::sync::Arc;

use proptest::prelude::*;
use scenarios::{
    IMU_PERIOD_NS, Imu, ImuConfig, Motion, OdometryConfig, OdometrySensor, Patch, RangeSensor,
    RangeSensorConfig, RockFieldConfig, RockMap, Split, Stribeck, World, rock_field,
};
use terrain::{BodyBox, GridGeometry, Pose, Scan, TerrainClass};

const EXACT: RangeSensorConfig = RangeSensorConfig {
    n_azimuths: 180,
    n_beams: 24,
    elevation_rad: [-0.8, 0.1],
    origin_m: [0.0, 0.0, 2.0],
    range_m: [0.2, 20.0],
    noise_m: 0.0,
    noise_per_range: 0.0,
    dropout: 0.0,
    class_confusion: 0.0,
    plant_extinction_per_m: 2.0,
    own_body: BodyBox::EMPTY,
};

const GROUND: Patch = Patch::open(Stribeck::DIRT);

fn world(height_m: impl Fn(f64, f64) -> f64, patch: impl Fn(f64, f64) -> Patch) -> Arc<World> {
    let geometry = GridGeometry { resolution_m: 0.1, origin: [-250, -250], n_rows: 500, n_cols: 500 };
    Arc::new(World::from_fn("sensed", geometry, height_m, patch).unwrap())
}

fn scan(config: RangeSensorConfig, world: &Arc<World>, pose: &Pose) -> Scan {
    RangeSensor::new(config, Arc::clone(world), 5).unwrap().scan(pose, 0, 0)
}

/// Points of a scan in the map frame.
fn seen(scan: &Scan, pose: &Pose) -> Vec<([f64; 3], TerrainClass)> {
    let motion = pose.isometry();
    let place = |p: [f32; 3]| (motion * nalgebra::Point3::from(p.map(f64::from))).coords.into();
    scan.points.iter().map(|point| (place(point.position_m), point.class)).collect()
}

#[test]
fn every_return_lies_on_a_tilted_plane_whatever_the_attitude() {
    let plane = |x: f64, y: f64| 0.1 * x - 0.2 * y;
    let world = world(plane, |_, _| GROUND);
    let pose = Pose { x_m: 3.0, y_m: -2.0, z_m: 1.2, roll_rad: 0.2, pitch_rad: -0.15, yaw_rad: 2.1 };
    let points = seen(&scan(EXACT, &world, &pose), &pose);
    assert!(points.len() > 2000, "{}", points.len());
    for ([x_m, y_m, z_m], class) in points {
        // Seven halvings of a 5 cm step leave 0.4 mm along the ray.
        assert!((z_m - plane(x_m, y_m)).abs() < 1e-3, "{x_m} {y_m} {z_m}");
        assert_eq!(class, TerrainClass::Open);
    }
}

#[test]
fn a_beam_meets_level_ground_at_height_over_sine() {
    let world = world(|_, _| 0.0, |_, _| GROUND);
    let down_rad: f64 = 0.3;
    let config = RangeSensorConfig { n_beams: 1, elevation_rad: [-down_rad; 2], ..EXACT };
    for point in scan(config, &world, &Pose::default()).points {
        let [x, y, z] = point.position_m;
        let range_m = f64::from((x * x + y * y + (z - 2.0) * (z - 2.0)).sqrt());
        assert!((range_m - 2.0 / down_rad.sin()).abs() < 1e-3, "{range_m}");
    }
}

#[test]
fn nothing_is_seen_behind_a_wall() {
    let wall = |x: f64, y: f64| (5.0..5.4).contains(&x) && y.abs() < 8.0;
    let world = world(|_, _| 0.0, |x, y| if wall(x, y) { GROUND.obstructed(3.0) } else { GROUND });
    let points = seen(&scan(EXACT, &world, &Pose::default()), &Pose::default());
    let shadowed = |x: f64, y: f64| x > 5.45 && (y / x).abs() < 8.0 / 5.4;
    assert!(points.iter().all(|([x, y, _], _)| !shadowed(*x, *y)));
    let on_wall: Vec<_> = points.iter().filter(|(_, class)| *class == TerrainClass::Obstacle).collect();
    assert!(on_wall.len() > 500, "{}", on_wall.len());
    assert!(on_wall.iter().all(|([x, _, z], _)| (4.99..5.41).contains(x) && (0.0..3.0).contains(z)));
    // Beams that rise by 0.1 rad pass 2.5 m at the wall: they hit it, while those to the west fly free.
    assert!(points.iter().any(|([_, _, z], _)| *z > 2.3));
}

#[test]
fn a_boulder_throws_the_shadow_of_similar_triangles() {
    // A box of 1 m from x = 4 to 5: the eye at 2 m sees the ground again at 5 x 2 / (2 - 1) = 10 m.
    let world = world(|x, y| f64::from((4.0..5.0).contains(&x) && y.abs() < 3.0), |_, _| GROUND);
    let config = RangeSensorConfig { n_beams: 200, elevation_rad: [-0.6, 0.0], ..EXACT };
    let points = seen(&scan(config, &world, &Pose::default()), &Pose::default());
    let ahead: Vec<_> = points.iter().filter(|([x, y, _], _)| *x > 0.0 && y.abs() < 0.2 * x).collect();
    assert!(ahead.iter().all(|([x, _, z], _)| *z > 0.05 || !(5.2..9.7).contains(x)));
    assert!(ahead.iter().any(|([x, _, _], _)| (10.0..11.0).contains(x)));
    assert!(ahead.iter().any(|([x, _, z], _)| *z > 0.99 && (4.0..5.0).contains(x)));
}

#[test]
fn plants_let_through_what_beer_and_lambert_say() {
    let world = world(|_, _| 0.0, |_, _| GROUND.overgrown(0.4));
    let down_rad: f64 = 0.5;
    let config = RangeSensorConfig { n_azimuths: 4000, n_beams: 1, elevation_rad: [-down_rad; 2], ..EXACT };
    let points = scan(config, &world, &Pose::default()).points;
    assert_eq!(points.len(), 4000);
    let through = points.iter().filter(|p| p.class == TerrainClass::Open).count() as f64 / 4000.0;
    // exp(-2 per metre x 0.4 m / sin(0.5)) = 0.189; three standard errors of 4000 trials are 0.019,
    // the step of 5 cm in 0.83 m makes 0.02 more.
    let expected = (-2.0 * 0.4 / down_rad.sin()).exp();
    assert!((through - expected).abs() < 0.04, "{through} against {expected}");
    assert!(points.iter().all(|p| (-0.001..0.4).contains(&p.position_m[2])));
}

#[test]
fn noise_grows_with_range_and_a_share_is_lost_or_misnamed() {
    let world = world(|_, _| 0.0, |_, _| GROUND);
    let noisy = RangeSensorConfig {
        n_azimuths: 4000,
        n_beams: 1,
        noise_m: 0.02,
        noise_per_range: 0.01,
        dropout: 0.1,
        class_confusion: 0.05,
        ..EXACT
    };
    for down_rad in [0.8_f64, 0.2] {
        let config = RangeSensorConfig { elevation_rad: [-down_rad; 2], ..noisy };
        let points = scan(config, &world, &Pose::default()).points;
        let true_m = 2.0 / down_rad.sin();
        let errors = points.iter().map(|p| {
            let [x, y, z] = p.position_m.map(f64::from);
            (x * x + y * y + (z - 2.0) * (z - 2.0)).sqrt() - true_m
        });
        let n = points.len() as f64;
        let std_m = (errors.map(|e| e * e).sum::<f64>() / n).sqrt();
        let expected_m = 0.02 + 0.01 * true_m;
        // Standard error of a standard deviation: 1 / sqrt(2 n) = 1.2 %.
        assert!((std_m / expected_m - 1.0).abs() < 0.05, "{std_m} against {expected_m}");
        assert!((n / 4000.0 - 0.9).abs() < 0.02, "{n}");
        let misnamed = points.iter().filter(|p| p.class != TerrainClass::Open).count() as f64 / n;
        assert!((misnamed - 0.05).abs() < 0.015, "{misnamed}");
    }
}

fn rocks() -> Arc<World> {
    let map = RockMap { seed: 3, split: Split::Test, index: 1 };
    Arc::new(rock_field(&RockFieldConfig::default(), map, &[]).unwrap())
}

#[test]
fn a_scan_is_the_same_for_any_number_of_threads() {
    let sensor = RangeSensor::new(EXACT, rocks(), 9).unwrap();
    let pose = Pose { x_m: 25.0, y_m: 20.0, z_m: 1.0, ..Pose::default() };
    let with = |n| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(n).build().unwrap();
        pool.install(|| sensor.scan(&pose, 4, 7))
    };
    assert_eq!(with(1), with(3));
    assert_ne!(sensor.scan(&pose, 5, 7).points, with(1).points);
}

#[test]
fn a_ray_along_the_edge_of_a_tile_gets_on() {
    // The eye stands on the edges of the skyline's tiles and looks along them: 2 million such rays would take hours
    // if each crept along its edge.
    let world = world(|_, _| 0.0, |_, _| GROUND);
    let config = RangeSensorConfig { n_azimuths: 4, n_beams: 2000, elevation_rad: [-0.8, 0.8], ..EXACT };
    let points = scan(config, &world, &Pose { x_m: 2.0, y_m: -4.0, ..Pose::default() }).points;
    assert!(points.len() > 3000, "{}", points.len());
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]
    /// The skyline only skips: no return lies below the ground, and no ray passes through it on its way.
    #[test]
    fn rays_stop_at_the_first_ground(x_m in 10.0..40.0, y_m in 10.0..40.0, yaw_rad in 0.0..6.0) {
        let world = rocks();
        let z_m = world.height_m(x_m, y_m) + 0.4;
        let pose = Pose { x_m, y_m, z_m, yaw_rad, ..Pose::default() };
        let config = RangeSensorConfig { n_azimuths: 30, n_beams: 12, ..EXACT };
        let eye = [x_m, y_m, z_m + 2.0];
        for ([px, py, pz], _) in seen(&scan(config, &world, &pose), &pose) {
            prop_assert!((pz - world.height_m(px, py)).abs() < 0.05);
            for k in 1..100 {
                let share = 0.99 * f64::from(k) / 100.0;
                let along = |a: f64, b: f64| a + (b - a) * share;
                let ground_m = world.height_m(along(eye[0], px), along(eye[1], py));
                prop_assert!(along(eye[2], pz) > ground_m - 0.03);
            }
        }
    }
}

#[test]
fn a_sensor_that_cannot_be_is_refused() {
    let refused = RangeSensor::new(RangeSensorConfig { dropout: 1.5, ..EXACT }, rocks(), 0).unwrap_err();
    assert_eq!(refused.to_string(), "dropout: expected from 0 to 1, found 1.5");
    assert!(RangeSensorConfig { range_m: [1.0, 0.5], ..EXACT }.validate().is_err());
    assert!(RangeSensorConfig { n_beams: 0, ..EXACT }.validate().is_err());
    assert!(RangeSensorConfig { elevation_rad: [0.2, -0.2], ..EXACT }.validate().is_err());
}

fn at(x_m: f64) -> Motion {
    Motion { pose: Pose { x_m, ..Pose::default() }, velocity_mps: [1.0, 0.0, 0.0], ..Motion::default() }
}

#[test]
fn localisation_drifts_as_the_root_of_the_way_and_not_at_rest() {
    let config = OdometryConfig { position_drift: 0.02, yaw_drift: 0.003, ..OdometryConfig::PERFECT };
    let spread = |way_m: f64, n_steps: u32| {
        let (mut squares_m2, mut squares_rad2) = (0.0, 0.0);
        for seed in 0..500 {
            let mut sensor = OdometrySensor::new(config, seed);
            let mut last = sensor.measure(&at(0.0), 0);
            for k in 1..=n_steps {
                last = sensor.measure(&at(way_m * f64::from(k) / f64::from(n_steps)), 0);
            }
            squares_m2 += (last.position_m[0] - way_m).powi(2) / 500.0;
            squares_rad2 += last.attitude_rad[2].powi(2) / 500.0;
        }
        [squares_m2.sqrt(), squares_rad2.sqrt()]
    };
    // 0.02 sqrt(25) = 0.1 m and 0.003 sqrt(25) = 0.015 rad, whatever the step; standard error 3 %.
    for n_steps in [10, 60] {
        let [position_m, yaw_rad] = spread(25.0, n_steps);
        assert!((position_m / 0.1 - 1.0).abs() < 0.12, "{position_m}");
        assert!((yaw_rad / 0.015 - 1.0).abs() < 0.12, "{yaw_rad}");
    }
    assert_eq!(spread(0.0, 50), [0.0, 0.0]);
}

#[test]
fn perfect_odometry_is_the_truth() {
    let mut motion = at(3.0);
    motion.wheel_speed_mps = 1.1;
    motion.steering_rad = -0.2;
    motion.pose.roll_rad = 0.1;
    let odometry = OdometrySensor::new(OdometryConfig::PERFECT, 1).measure(&motion, 42);
    assert_eq!(odometry.position_m, [3.0, 0.0, 0.0]);
    assert_eq!(odometry.attitude_rad, [0.1, 0.0, 0.0]);
    assert_eq!((odometry.valid_at_ns, odometry.velocity_mps), (42, [1.0, 0.0]));
    assert_eq!((odometry.wheel_speed_mps, odometry.steering_rad), (1.1, -0.2));
}

/// Standard deviation of the vertical specific force over ten seconds.
fn vibration_mps2(world: &World, speed_mps: f64) -> f64 {
    let config = ImuConfig { acceleration_noise_mps2: 0.0, ..ImuConfig::for_length(3.4) };
    let mut imu = Imu::new(config, 3);
    let n = 2000;
    let values: Vec<_> = (0..n)
        .map(|k| {
            let mut motion = at(speed_mps * f64::from(k) * IMU_PERIOD_NS as f64 * 1e-9);
            motion.velocity_mps = [speed_mps, 0.0, 0.0];
            motion.specific_force_mps2 = [0.0, 0.0, 9.81];
            f64::from(imu.sample(&motion, world, 0).acceleration_mps2[2])
        })
        .collect();
    let mean = values.iter().sum::<f64>() / f64::from(n);
    assert!((mean - 9.81).abs() < 0.2, "{mean}");
    (values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / f64::from(n)).sqrt()
}

#[test]
fn vibration_grows_with_speed_and_with_the_roughness_of_the_ground() {
    let smooth = world(|_, _| 0.0, |_, _| GROUND);
    let overgrown = world(|_, _| 0.0, |_, _| GROUND.overgrown(0.1));
    let bumpy = world(|x, _| 0.03 * (x * 12.0).sin(), |_, _| GROUND);
    assert!(vibration_mps2(&smooth, 0.0) < 1e-6);
    // Same noise, so twice the speed is twice the vibration.
    let slow = vibration_mps2(&smooth, 0.5);
    let fast = vibration_mps2(&smooth, 1.0);
    assert!(slow > 0.0 && (fast / slow - 2.0).abs() < 1e-3, "{slow} {fast}");
    assert!(vibration_mps2(&overgrown, 1.0) > 2.0 * fast);
    assert!(vibration_mps2(&bumpy, 1.0) > 4.0 * fast);
}

#[test]
fn the_vehicles_own_body_stands_before_what_lies_behind_it() {
    let own_body = BodyBox { min_m: [0.4, -0.6, 0.2], max_m: [1.5, 0.6, 1.1] };
    let flat = world(|_, _| 0.0, |_, _| GROUND);
    let pose = Pose { x_m: 3.0, yaw_rad: 0.7, ..Pose::default() };
    let bare = scan(EXACT, &flat, &pose);
    let covered = scan(RangeSensorConfig { own_body, ..EXACT }, &flat, &pose);
    let place = |point: &terrain::RangePoint| point.position_m.map(f64::from);
    let on_body = covered.points.iter().filter(|point| own_body.grown(1e-5).contains(place(point))).count();
    assert!(on_body > 100, "{on_body} of {}", covered.points.len());
    assert!(!bare.points.iter().any(|point| own_body.contains(place(point))), "rays pass through by default");
    // No ray has come through the body.
    let inner = own_body.grown(-1e-3);
    for point in &covered.points {
        let at =
            |share: f64| [0, 1, 2].map(|i| EXACT.origin_m[i] + share * (place(point)[i] - EXACT.origin_m[i]));
        assert!((0..500).all(|k| !inner.contains(at(f64::from(k) / 500.0))), "{point:?}");
    }
}
