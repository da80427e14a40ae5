//! The plant in motion on even ground, held against closed forms.
#![allow(clippy::unwrap_used)]

#[allow(dead_code)] // each test file takes what it needs
mod plant_machines;

use std::sync::Arc;

use bicycle::{Command, Differential, Vehicle};
use plant_machines::*;
use scenarios::{Patch, Plant, Stribeck, World};
use terrain::GridGeometry;

/// Runs on until something has happened; fails after two minutes.
fn drive_until(plant: &mut Plant, happened: impl Fn(&Plant) -> bool) {
    let done = (0..12_000).any(|_| {
        plant.advance(0.01);
        happened(plant)
    });
    assert!(done, "{:?}", plant.motion());
}

#[test]
fn coasting_distance_follows_from_rolling_resistance() {
    // Down a ramp without motor or brakes, then out on the level: with c = 0.02 + 0 and the wheels' inertia
    // 4 * 5 / 0.44^2 = 103 kg beside 1500 kg, slowing from v1 to v2 takes (v1^2 - v2^2) (1603 / 1500) / (2 c g).
    let mut vehicle = powerless(full_size());
    vehicle.limits.steering_max_rad = 0.1;
    let world = world_of(200.0, 0.5, Stribeck::ASPHALT, |x_m, _| if x_m < 0.0 { -0.1 * x_m } else { 0.0 });
    let mut plant = Plant::new(&vehicle, world, [-20.0, 0.0, 0.0]).unwrap();
    drive_until(&mut plant, |plant| plant.pose().x_m > 5.0);
    let first = plant.motion();
    drive_until(&mut plant, |plant| plant.motion().velocity_mps[0] < 2.0);
    let last = plant.motion();
    let squares = first.velocity_mps[0].powi(2) - last.velocity_mps[0].powi(2);
    let expected_m = squares * (1.0 + 4.0 * 5.0 / 0.44f64.powi(2) / 1500.0) / (2.0 * 0.02 * G);
    let found_m = last.pose.x_m - first.pose.x_m;
    println!("coasting: {found_m:.2} m, expected {expected_m:.2} m");
    assert!(expected_m > 20.0, "{expected_m} m is too short to tell");
    assert!((found_m / expected_m - 1.0).abs() < 0.03, "{found_m} m, expected {expected_m} m");
}

/// Distance from the command to stop until standstill [m] and the speed before [m/s].
fn stopping(vehicle: &Vehicle, friction: f32, speed_mps: f32) -> [f64; 2] {
    let mut plant = Plant::new(vehicle, level(coulomb(friction)), [-150.0, 0.0, 0.0]).unwrap();
    drive(&mut plant, speed_mps, 0.0, 12.0);
    let first = plant.motion();
    drive(&mut plant, 0.0, 0.0, 0.0);
    drive_until(&mut plant, |plant| plant.motion().velocity_mps[0] < 1e-3);
    [plant.pose().x_m - first.pose.x_m, first.velocity_mps[0]]
}

#[test]
fn locked_wheels_stop_within_v2_over_2_mu_g() {
    let mut vehicle = prompt(full_size());
    vehicle.limits.acceleration_max_mps2 = 50.0;
    vehicle.drivetrain.brake_torque_max_nm = 20_000.0;
    vehicle.tyre.load_sensitivity = 0.0;
    for friction in [0.3, 0.6] {
        let [found_m, speed_mps] = stopping(&vehicle, friction, 10.0);
        let expected_m = speed_mps * speed_mps / (2.0 * f64::from(friction) * G);
        println!("locked wheels, mu {friction}: {found_m:.2} m, expected {expected_m:.2} m");
        assert!((speed_mps - 10.0).abs() < 0.2, "{speed_mps} m/s");
        assert!(
            (found_m / expected_m - 1.0).abs() < 0.04,
            "mu {friction}: {found_m} m, expected {expected_m} m"
        );
    }
}

#[test]
fn the_servo_slows_at_the_limit_of_acceleration() {
    // 1.5 m/s2 from 6 m/s: 12 m; the lags of queue, motor and servo (0.05 s, 0.15 s, 0.08 s) add 1.7 m at most.
    let [found_m, speed_mps] = stopping(&full_size(), 0.9, 6.0);
    let least_m = speed_mps * speed_mps / (2.0 * 1.5);
    assert!((least_m..least_m + 0.28 * speed_mps).contains(&found_m), "{found_m} m from {speed_mps} m/s");
}

/// Acceleration up a slope at full throttle, all wheels slipping [m/s2].
fn climbing_mps2(vehicle: &Vehicle, friction: f32, slope_rad: f64) -> f64 {
    let world = incline(slope_rad, coulomb(friction));
    let mut plant = Plant::new(vehicle, world, [0.0; 3]).unwrap();
    drive(&mut plant, 10.0, 0.0, 2.0);
    let before_mps = plant.motion().velocity_mps[0];
    plant.advance(3.0);
    (plant.motion().velocity_mps[0] - before_mps) / 3.0
}

#[test]
fn the_steepest_slope_climbed_is_atan_mu() {
    // All wheels driven and all slipping: a = g (mu cos - sin), zero at atan(0.4) = 21.8, atan(0.6) = 31.0 degrees.
    let mut vehicle = full_size();
    vehicle.tyre.load_sensitivity = 0.0;
    vehicle.drivetrain.drive_torque_max_nm = 12_000.0;
    for friction in [0.4f32, 0.6] {
        for beyond_rad in [-5f64, -1.0, 1.0, 5.0].map(f64::to_radians) {
            let slope_rad = f64::from(friction).atan() + beyond_rad;
            let found_mps2 = climbing_mps2(&vehicle, friction, slope_rad);
            let expected_mps2 = G * (f64::from(friction) * slope_rad.cos() - slope_rad.sin());
            println!(
                "climb, mu {friction}, {slope_rad:.3} rad: {found_mps2:.3}, expected {expected_mps2:.3} m/s2"
            );
            let error_mps2 = (found_mps2 - expected_mps2).abs();
            assert!(
                error_mps2 < 0.05,
                "mu {friction}, {slope_rad} rad: {found_mps2}, expected {expected_mps2} m/s2"
            );
        }
    }
}

#[test]
fn the_servo_holds_its_speed_up_and_down_a_slope() {
    for (yaw_rad, start_m) in [(0.0, -20.0), (std::f64::consts::PI, 20.0)] {
        let world = incline(15f64.to_radians(), Stribeck::ASPHALT);
        let mut plant = Plant::new(&full_size(), world, [start_m, 0.0, yaw_rad]).unwrap();
        drive(&mut plant, 1.0, 0.0, 8.0);
        let motion = plant.motion();
        assert!((motion.wheel_speed_mps - 1.0).abs() < 0.02, "{motion:?}");
        // tan 15 = 0.268 of the load takes a slip of 3 0.98 / 12 (1 - cbrt(1 - 0.268 / 0.98)) = 0.0248; the standing
        // tread's damping saves a thousandth of it.
        let slip_mps = (motion.wheel_speed_mps - motion.velocity_mps[0]) * yaw_rad.cos();
        assert!((slip_mps - 0.0248).abs() < 0.002, "{slip_mps} m/s: {motion:?}");
    }
}

#[test]
fn a_descent_that_friction_holds_is_driven_at_the_speed_asked_for() {
    // 28 degrees leave the rear axle 0.5 - 0.289 tan 28 = 0.346 of the weight, and it brakes with half of tan 28 = 0.532:
    // its wheels slide, for 0.65 0.346 = 0.225 is less than 0.266. With the front axle's 0.65 0.654 all hold 0.65.
    let world = incline(-28f64.to_radians(), coulomb(0.65));
    let mut plant = Plant::new(&full_size(), world, [-20.0, 0.0, 0.0]).unwrap();
    drive(&mut plant, 1.0, 0.0, 5.0);
    let speed_mps = plant.motion().velocity_mps[0];
    let wheels_mps = plant.wheels().map(|wheel| wheel.speed_mps);
    assert!(wheels_mps[2].max(wheels_mps[3]) < 0.7 * wheels_mps[0], "{wheels_mps:?}");
    assert!((speed_mps - 1.0).abs() < 0.1, "{speed_mps} m/s, wheels {wheels_mps:?}");
}

/// Steady speed, yaw rate [m/s, rad/s] of the cog after 12 s at a command.
fn steady_turn(vehicle: &Vehicle, friction: Stribeck, speed_mps: f32, steering_rad: f32) -> [f64; 2] {
    let mut plant = Plant::new(vehicle, level(friction), [0.0; 3]).unwrap();
    drive(&mut plant, speed_mps, steering_rad, 15.0);
    let motion = plant.motion();
    let ahead_mps = motion.velocity_mps[0];
    let left_mps = motion.velocity_mps[1] + 1.25 * motion.angular_rate_radps[2];
    [ahead_mps.hypot(left_mps), motion.angular_rate_radps[2]]
}

fn with(differential: Differential) -> Vehicle {
    let mut vehicle = full_size();
    vehicle.drivetrain.differential = differential;
    vehicle
}

/// Lateral acceleration over mu g = 0.4 g of a bend taken too fast, in which the front ploughs; nothing rolls heavily.
fn limit_of_cornering(differential: Differential) -> f64 {
    let mut vehicle = with(differential);
    vehicle.tyre.load_sensitivity = 0.0;
    vehicle.tyre.rolling_resistance = 0.0;
    let mut plant = Plant::new(&vehicle, level(coulomb(0.4)), [0.0; 3]).unwrap();
    drive(&mut plant, 14.0, 0.12, 15.0);
    let motion = plant.motion();
    // All of the front's friction is used, 0.4 of its load.
    let wheels = plant.wheels();
    let horizontal_n: f64 = wheels[..2].iter().map(|wheel| wheel.force_n[0].hypot(wheel.force_n[1])).sum();
    let load_n: f64 = wheels[..2].iter().map(|wheel| wheel.load_n).sum();
    assert!((horizontal_n / load_n - 0.4).abs() < 0.004, "{horizontal_n} of {load_n} N");
    motion.velocity_mps[0] * motion.angular_rate_radps[2] / (0.4 * G)
}

#[test]
fn cornering_ends_at_v2_over_r_equal_mu_g_where_the_differential_lets_it() {
    let [open, limited, locked] =
        [Differential::Open, Differential::LimitedSlip, Differential::Locked].map(limit_of_cornering);
    println!("limit of cornering over mu g, open, limited slip, locked: {open:.3} {limited:.3} {locked:.3}");
    // An open one asks nothing of the tyres: the centre of gravity lies half way, and both axles give all they have. But
    // the outer front wheel carries 3 kN more and drags, 0.12 rad across the way, by 0.4 0.12 0.775 m of that: 110 N m
    // against the 3679 N m that the front makes, which the rear must leave unused: (1 + (3679 - 110) / 3679) / 2.
    assert!((open - 0.985).abs() < 0.015, "{open}");
    // At 14 m/s and 0.28 rad/s the wheels to the left and to the right differ from the mean by 0.217 m/s, which limited
    // slip answers with 0.217 / (4 + 14 / 12) = 0.042 of their load: 14 715 N 0.042 0.775 m = 479 N m more:
    // (1 + (3679 - 589) / 3679) / 2.
    assert!((limited - 0.92).abs() < 0.03, "{limited}");
    // Locked wheels slip by 0.0155 instead: 0.186 of the load at the rear, a third of that at the front, which slides
    // sideways already; 1400 N m at first, and as much less as the bend is wider: between 0.75 and 0.9.
    assert!((0.75..0.9).contains(&locked), "{locked}");
}

/// Yaw rate over that of the geometry, v tan(steering) / L.
fn gain(vehicle: &Vehicle, speed_mps: f32) -> f64 {
    let [found_mps, yaw_radps] = steady_turn(vehicle, Stribeck::ASPHALT, speed_mps, 0.1);
    yaw_radps / (found_mps * 0.1f64.tan() / 2.5)
}

#[test]
fn locked_wheels_widen_a_slow_turn_by_track_squared_over_wheelbase_squared() {
    // Wheels half a track t to either side slip by kappa t / 2 and make a moment of C W kappa t^2 / 4 against the turn;
    // the axles hold it with slip angles of kappa t^2 / (2 L) each, whatever the stiffness C and the weight W are:
    // steering = kappa (L + t^2 / L), and the turn is 1 / (1 + 0.62^2) = 0.722 of the geometry's. Where only the rear
    // axle is driven half of the moment is left: 0.839. At 1 m/s limited slip yields 48 times as much as the tyres:
    // 1 / (1 + 0.384 / 49) = 0.992; an open differential takes nothing.
    let mut rear_driven = with(Differential::Locked);
    rear_driven.drivetrain.rear_share = 1.0;
    for (vehicle, expected) in [
        (with(Differential::Open), 1.0),
        (with(Differential::LimitedSlip), 0.992),
        (with(Differential::Locked), 0.722),
        (rear_driven, 0.839),
    ] {
        let found = gain(&vehicle, 1.0);
        println!(
            "turn over geometry, {:?}: {found:.3}, expected {expected}",
            vehicle.drivetrain.differential
        );
        assert!((found - expected).abs() < 0.01, "{:?}: {found}", vehicle.drivetrain.differential);
    }
}

#[test]
fn tyres_alike_on_all_wheels_steer_neutrally_and_limited_slip_understeers_with_speed() {
    let gains = |differential: Differential| {
        let mut vehicle = with(differential);
        vehicle.tyre.rolling_resistance = 0.0;
        [1.0, 4.0, 8.0].map(|speed_mps| gain(&vehicle, speed_mps))
    };
    // Stiffness does not depend on speed, and the weight rests on both axles alike: no speed changes the turn. At 8 m/s
    // the bend takes 0.26 g; of that what the outer front wheel drags more than the inner one costs half a per cent.
    let open = gains(Differential::Open);
    assert!(open.iter().all(|gain| (gain - 1.0).abs() < 0.015), "{open:?}");
    // Of that, limited slip of 4 m/s per friction in series with tyres of v / 12 leaves 1 / (1 + e) with
    // e = 0.384 (v / 12) / (4 + v / 12) = 0.008, 0.030 and 0.055, which the tyres yield to the more, the more of their
    // 0.98 they hold already: of 0.26 in the last bend a brush is 1 / (1 - 0.26 / 2.94)^2 = 1.2 times as soft.
    let limited = gains(Differential::LimitedSlip);
    for i in 0..3 {
        let (found, expected) = (limited[i] / open[i], [0.992, 0.970, 0.938][i]);
        assert!((found - expected).abs() < 0.01, "{found}, expected {expected}: {limited:?} {open:?}");
    }
}

#[test]
fn left_and_right_are_mirror_images() {
    for vehicle in [full_size(), rc_car()] {
        let run = |side: f32| {
            let mut plant = Plant::new(&vehicle, level(Stribeck::DIRT), [0.0; 3]).unwrap();
            drive(&mut plant, 1.5, side * 0.4, 4.0);
            drive(&mut plant, -0.5, side * -0.2, 2.0);
            plant.pose()
        };
        let (left, right) = (run(1.0), run(-1.0));
        for (name, sum) in [
            ("y", left.y_m + right.y_m),
            ("yaw", left.yaw_rad + right.yaw_rad),
            ("roll", left.roll_rad + right.roll_rad),
            ("x", left.x_m - right.x_m),
        ] {
            assert!(sum.abs() < 1e-6, "{} {name}: {left:?} {right:?}", vehicle.name);
        }
        assert!(left.y_m > 0.1);
    }
}

#[test]
fn commands_arrive_after_the_delay_and_at_the_limited_rate() {
    let mut vehicle = full_size();
    vehicle.servo.response_s = 0.0;
    let mut plant = Plant::new(&vehicle, level(Stribeck::DIRT), [0.0; 3]).unwrap();
    drive(&mut plant, 0.0, 0.3, 0.05);
    assert!(plant.motion().steering_rad.abs() < 1e-9);
    plant.advance(0.25);
    // 0.6 rad/s for 0.25 s.
    assert!((plant.motion().steering_rad - 0.15).abs() < 1e-3);
    drive(&mut plant, 0.0, 3.0, 3.0);
    assert!((plant.motion().steering_rad - vehicle.limits.steering_max_rad).abs() < 1e-9);
    let refused = plant.set_command(Command { speed_mps: f32::NAN, steering_rad: 0.0 });
    assert!(refused.is_err());
}

#[test]
fn loose_ground_makes_a_balanced_vehicle_understeer_because_its_rear_wheels_follow_the_front_ones() {
    // Contact under 3679 N: 2 sqrt(2 0.45 3679 / 150 000) = 0.297 m. With K = 25 mm the ground answers 0.98 0.297 / 0.05 =
    // 5.82 to the front wheels and 2.5 times that to the rear ones in their ruts: at a lateral acceleration a the front slips
    // by a / g (1 / 5.82 - 1 / 14.6) = 0.103 a / g more, and the curvature is that of firm ground over
    // 1 + 0.103 v^2 / (g 2.5 m) = 1.27 at 8 m/s.
    let curvature_per_m = |shear_deformation_m: f32| {
        let geometry = GridGeometry::centred(1.0, 400, 400, 0.0, 0.0);
        let patch = Patch { shear_deformation_m, ..Patch::open(Stribeck::ASPHALT) };
        let world = Arc::new(World::from_fn("level", geometry, |_, _| 0.0, |_, _| patch).unwrap());
        let mut vehicle = with(Differential::Open);
        vehicle.tyre.rolling_resistance = 0.0;
        let mut plant = Plant::new(&vehicle, world, [-100.0, 0.0, 0.0]).unwrap();
        drive(&mut plant, 8.0, 0.02, 16.0);
        let motion = plant.motion();
        motion.angular_rate_radps[2] / motion.velocity_mps[0]
    };
    let ratio = curvature_per_m(0.0) / curvature_per_m(0.025);
    println!("curvature on firm over that on loose ground: {ratio:.3}, expected 1.269");
    assert!((ratio - 1.269).abs() < 0.02, "{ratio}");
}
