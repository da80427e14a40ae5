//! The plant at rest: loads, holding on slopes, settling, tipping over.
#![allow(clippy::unwrap_used)]

#[allow(dead_code)] // each test file takes what it needs
mod plant_machines;

use bicycle::Vehicle;
use plant_machines::*;
use scenarios::{Plant, PlantError, Stribeck};

#[test]
fn wheel_loads_split_the_weight_by_the_centre_of_gravity() {
    let mut vehicle = full_size();
    vehicle.body.cog_ahead_m = 1.5;
    let plant = Plant::new(&vehicle, level(Stribeck::ASPHALT), [3.0, 5.0, 0.7]).unwrap();
    // Body 1360 kg at 1.5 m, four wheels of 35 kg at 1.25 m on average: 1500 kg at (2040 + 175) / 1500 = 1.47667 m
    // ahead of the rear axle. Front: 1500 * 9.81 * 1.47667 / 2.5 / 2 = 4345.8 N a wheel, rear 3011.7 N.
    let front_n = 1500.0 * G * (1360.0 * 1.5 + 140.0 * 1.25) / 1500.0 / 2.5 / 2.0;
    let rear_n = 1500.0 * G / 2.0 - front_n;
    assert!((front_n - 4345.8).abs() < 0.1 && (rear_n - 3011.7).abs() < 0.1);
    for (wheel, expected_n) in plant.wheels().iter().zip([front_n, front_n, rear_n, rear_n]) {
        assert!((wheel.load_n / expected_n - 1.0).abs() < 1e-3, "{wheel:?}, expected {expected_n} N");
        assert!(wheel.travel_m.abs() < 1e-3, "{wheel:?}");
    }
    let pose = plant.pose();
    assert!(pose.roll_rad.abs() < 1e-4 && pose.pitch_rad.abs() < 1e-3, "{pose:?}");
    assert!((pose.yaw_rad - 0.7).abs() < 1e-6);
    // Accelerometer: gravity and nothing else.
    let force_mps2 = plant.motion().specific_force_mps2;
    assert!((force_mps2[2] - G).abs() < 5e-3 && force_mps2[0].hypot(force_mps2[1]) < 0.02, "{force_mps2:?}");
}

#[test]
fn load_shifts_downhill_on_a_slope() {
    // On a slope of 15 degrees the rear wheels carry m g (cos (L - b) + sin h) / L with b = L / 2, h = 0.722 m.
    let slope_rad = 15f64.to_radians();
    let plant = Plant::new(&full_size(), incline(slope_rad, Stribeck::ASPHALT), [0.0; 3]).unwrap();
    let height_m = (1360.0 * 0.75 + 140.0 * 0.45) / 1500.0;
    let rear_n = 1500.0 * G * (slope_rad.cos() * 1.25 + slope_rad.sin() * height_m) / 2.5 / 2.0;
    let wheels = plant.wheels();
    for wheel in &wheels[2..] {
        // The springs let the rear sink and the centre of gravity move back a little.
        assert!((wheel.load_n / rear_n - 1.0).abs() < 0.02, "{wheel:?}, expected {rear_n} N");
    }
    let total_n: f64 = wheels.iter().map(|wheel| wheel.load_n).sum();
    assert!((total_n / (1500.0 * G * slope_rad.cos()) - 1.0).abs() < 1e-3, "{total_n} N");
}

/// Displacement over 60 s of parking [m].
fn creep_m(vehicle: &Vehicle, slope_rad: f64, yaw_rad: f64) -> f64 {
    let world = incline(slope_rad, Stribeck::ASPHALT);
    let mut plant = Plant::new(vehicle, world, [0.0, 0.0, yaw_rad]).unwrap();
    let start = plant.pose();
    plant.advance(60.0);
    let end = plant.pose();
    (end.isometry().translation.vector - start.isometry().translation.vector).norm()
}

#[test]
fn a_braked_vehicle_holds_on_a_slope_of_15_degrees() {
    let slope_rad = 15f64.to_radians();
    for (vehicle, yaw_rad) in [(full_size(), 0.0), (full_size(), 2.0), (rc_car(), 0.8)] {
        let moved_m = creep_m(&vehicle, slope_rad, yaw_rad);
        assert!(moved_m < 0.01, "{} at yaw {yaw_rad} moved {moved_m} m", vehicle.name);
    }
}

#[test]
fn a_braked_vehicle_slides_where_the_slope_exceeds_the_friction() {
    // Friction 0.4 holds up to atan(0.4) = 21.8 degrees. At 25 degrees: g (sin - 0.4 cos) = 0.590 m/s2.
    let slope_rad = 25f64.to_radians();
    let mut vehicle = full_size();
    vehicle.tyre.load_sensitivity = 0.0;
    let mut plant = Plant::new(&vehicle, incline(slope_rad, coulomb(0.4)), [40.0, 0.0, 0.0]).unwrap();
    let before_mps = plant.motion().velocity_mps[0];
    plant.advance(3.0);
    let found_mps2 = (before_mps - plant.motion().velocity_mps[0]) / 3.0;
    let expected_mps2 = G * (slope_rad.sin() - 0.4 * slope_rad.cos());
    println!("sliding down with brakes: {found_mps2:.3}, expected {expected_mps2:.3} m/s2");
    assert!((found_mps2 - expected_mps2).abs() < 0.02, "{found_mps2} m/s2, expected {expected_mps2} m/s2");
}

#[test]
fn a_dropped_vehicle_settles() {
    // The start pose stands on the highest rock under a wheel: the others fall until they stand.
    let rocks = world_of(20.0, 0.1, Stribeck::ROCK, |x_m, y_m| {
        0.25 * (-((x_m - 2.5).powi(2) + (y_m - 0.775).powi(2)) / 0.05).exp()
    });
    let mut plant = Plant::new(&full_size(), rocks, [0.0; 3]).unwrap();
    plant.advance(3.0);
    let motion = plant.motion();
    let speed_mps = motion.velocity_mps.iter().map(|v| v * v).sum::<f64>().sqrt();
    assert!(speed_mps < 1e-3, "{motion:?}");
    let total_n: f64 = plant.wheels().iter().map(|wheel| wheel.load_n).sum();
    assert!((total_n / (1500.0 * G) - 1.0).abs() < 0.03, "{total_n} N: {:?}", plant.wheels());
    assert!(plant.wheels()[0].hub_m[2] > plant.wheels()[1].hub_m[2] + 0.1);
}

/// Across a slope, on stiff springs and tyres.
fn tilted(tilt_rad: f64) -> Plant {
    let mut vehicle = full_size();
    vehicle.tyre.radial_stiffness_n_per_m *= 4.0;
    for axle in [&mut vehicle.front, &mut vehicle.rear] {
        axle.suspension.stiffness_n_per_m *= 10.0;
        axle.suspension.damping_ns_per_m *= 3.0;
        axle.anti_roll_nm_per_rad = 0.0;
    }
    let across = [0.0, 0.0, std::f64::consts::FRAC_PI_2];
    Plant::new(&vehicle, incline(tilt_rad, coulomb(2.0)), across).unwrap()
}

#[test]
fn the_vehicle_tips_over_where_gravity_points_past_its_wheels() {
    // Moments about the lower wheels: the upper ones carry m g (cos t / 2 - sin h) / t, t = 1.55 m, h = 0.722 m,
    // which is zero at atan(t / 2 / h) = 47.0 degrees.
    let height_m = (1360.0 * 0.75 + 140.0 * 0.45) / 1500.0;
    let limit_rad = f64::atan(1.55 / 2.0 / height_m);
    assert!((limit_rad.to_degrees() - 47.0).abs() < 0.1);
    for tilt_rad in [20f64, 30.0, 40.0].map(f64::to_radians) {
        let mut plant = tilted(tilt_rad);
        plant.advance(3.0);
        let expected_n = 1500.0 * G * (tilt_rad.cos() / 2.0 - tilt_rad.sin() * height_m / 1.55) / 2.0;
        // Yaw of 90 degrees on an eastward rise: the right side is uphill.
        let found_n = plant.wheels()[1].load_n;
        assert!((found_n - expected_n).abs() < 60.0, "{tilt_rad} rad: {found_n} N, expected {expected_n} N");
        assert!(!plant.rolled_over());
    }
    let mut plant = tilted(limit_rad + 0.02);
    let tips = (0..50).any(|_| {
        plant.advance(0.1);
        plant.rolled_over()
    });
    assert!(tips, "{:?}", plant.pose());
}

#[test]
fn a_start_that_cannot_be_is_refused() {
    let world = world_of(20.0, 0.5, Stribeck::DIRT, |_, _| 0.0);
    let outside = Plant::new(&full_size(), world.clone(), [8.5, 0.0, 0.0]).err().unwrap();
    assert!(matches!(outside, PlantError::StartOutside { found_m, .. } if found_m[0] == 11.0), "{outside}");
    let no_pose = Plant::new(&full_size(), world.clone(), [0.0, f64::NAN, 0.0]).err().unwrap();
    assert!(matches!(no_pose, PlantError::NonFiniteStart(_)));
    let mut flat = full_size();
    flat.tyre.radial_stiffness_n_per_m = 5000.0;
    assert!(matches!(Plant::new(&flat, world.clone(), [0.0; 3]), Err(PlantError::FlatTyre { .. })));
    flat.body.mass_kg = -1.0;
    assert!(matches!(Plant::new(&flat, world, [0.0; 3]), Err(PlantError::Vehicle(_))));
}
