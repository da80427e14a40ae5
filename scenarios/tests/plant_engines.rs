//! What every engine has to make of the same vehicle on the same ground, held against closed forms.
//!
//! The built-in engine always; MuJoCo with it in builds that have it:
//! `scripts/mujoco cargo test -p scenarios --features mujoco --test plant_engines`.
#![allow(clippy::unwrap_used)]

#[allow(dead_code)] // each test file takes what it needs
mod plant_machines;

use std::sync::Arc;

use bicycle::{Command, Vehicle};
use plant_machines::*;
use scenarios::{Engine, Plant, PlantError, Stribeck, World};

const ENGINES: &[Engine] =
    if cfg!(feature = "mujoco") { &[Engine::Rapier, Engine::Mujoco] } else { &[Engine::Rapier] };

fn plant(engine: Engine, vehicle: &Vehicle, world: &Arc<World>, start: [f64; 3]) -> Plant {
    Plant::in_engine(engine, vehicle, &[], Arc::clone(world), start).unwrap()
}

/// Level ground of 80 m with the cells of the benchmarks.
fn ground(friction: Stribeck, height_m: impl Fn(f64, f64) -> f64) -> Arc<World> {
    world_of(80.0, 0.1, friction, height_m)
}

#[test]
fn at_rest_the_ground_carries_the_weight_and_an_accelerometer_feels_gravity() {
    let world = ground(Stribeck::ASPHALT, |_, _| 0.0);
    for &engine in ENGINES {
        let plant = plant(engine, &full_size(), &world, [3.0, 5.0, 0.7]);
        let total_n: f64 = plant.wheels().iter().map(|wheel| wheel.load_n).sum();
        assert!((total_n / (1500.0 * G) - 1.0).abs() < 2e-3, "{engine:?}: {total_n} N");
        for wheel in plant.wheels() {
            assert!((wheel.load_n / total_n - 0.25).abs() < 5e-3, "{engine:?}: {wheel:?}");
            assert!(wheel.travel_m.abs() < 2e-3, "{engine:?}: {wheel:?}");
        }
        let motion = plant.motion();
        assert!((motion.pose.yaw_rad - 0.7).abs() < 1e-3, "{engine:?}: {motion:?}");
        let [ahead, left, up] = motion.specific_force_mps2;
        assert!((up - G).abs() < 0.02 && ahead.hypot(left) < 0.02, "{engine:?}: {motion:?}");
    }
}

#[test]
fn the_ground_lies_where_the_world_says() {
    // Rises to the north alone, then to the east alone: an engine that mirrors or turns its height field shows.
    for (slope, pitch_rad, roll_rad) in [([0.1, 0.0], -0.0997, 0.0), ([0.0, 0.1], 0.0, 0.0997)] {
        let world = ground(Stribeck::ASPHALT, move |x_m, y_m| slope[0] * x_m + slope[1] * y_m);
        for &engine in ENGINES {
            let pose = plant(engine, &full_size(), &world, [12.0, -7.0, 0.0]).pose();
            let height_m = slope[0] * 12.0 - slope[1] * 7.0;
            assert!((pose.z_m - 0.44 - height_m).abs() < 0.05, "{engine:?}: {pose:?} above {height_m} m");
            assert!((pose.pitch_rad - pitch_rad).abs() < 0.02, "{engine:?}: {pose:?}");
            assert!((pose.roll_rad - roll_rad).abs() < 0.02, "{engine:?}: {pose:?}");
        }
    }
}

#[test]
fn a_braked_vehicle_holds_across_a_slope_of_15_degrees_and_hardly_creeps_down_it() {
    let world = ground(Stribeck::ASPHALT, |x_m, _| x_m * 15f64.to_radians().tan());
    for &engine in ENGINES {
        for (yaw_rad, most_mps) in [(std::f64::consts::FRAC_PI_2, 0.002), (0.0, 0.03)] {
            let mut plant = plant(engine, &full_size(), &world, [0.0, 0.0, yaw_rad]);
            let before = plant.pose();
            plant.advance(10.0);
            let after = plant.pose();
            let creep_mps = (after.x_m - before.x_m).hypot(after.y_m - before.y_m) / 10.0;
            println!("{engine:?}: creep at yaw {yaw_rad:.2}: {creep_mps:.5} m/s");
            assert!(creep_mps < most_mps, "{engine:?}: {creep_mps} m/s at yaw {yaw_rad}");
        }
    }
}

#[test]
fn a_braked_vehicle_slides_where_the_slope_exceeds_the_friction() {
    let slope_rad = 25f64.to_radians();
    let world = ground(coulomb(0.4), move |x_m, _| x_m * slope_rad.tan());
    let mut vehicle = full_size();
    vehicle.tyre.load_sensitivity = 0.0;
    for &engine in ENGINES {
        let mut plant = plant(engine, &vehicle, &world, [20.0, 0.0, 0.0]);
        let before_mps = plant.motion().velocity_mps[0];
        plant.advance(3.0);
        let found_mps2 = (before_mps - plant.motion().velocity_mps[0]) / 3.0;
        let expected_mps2 = G * (slope_rad.sin() - 0.4 * slope_rad.cos());
        println!("{engine:?}: sliding down: {found_mps2:.3}, expected {expected_mps2:.3} m/s2");
        assert!((found_mps2 - expected_mps2).abs() < 0.06, "{engine:?}: {found_mps2} m/s2");
    }
}

#[test]
fn a_commanded_speed_is_driven_on_the_level_and_uphill() {
    for slope_rad in [0.0, 15f64.to_radians()] {
        let world = ground(Stribeck::ASPHALT, move |x_m, _| x_m * slope_rad.tan());
        for &engine in ENGINES {
            let mut plant = plant(engine, &full_size(), &world, [-20.0, 0.0, 0.0]);
            drive(&mut plant, 1.0, 0.0, 8.0);
            let before = plant.pose();
            plant.advance(2.0);
            let speed_mps = (plant.pose().x_m - before.x_m) / slope_rad.cos() / 2.0;
            println!("{engine:?}: {speed_mps:.3} m/s up {slope_rad:.2} rad");
            assert!((speed_mps - 1.0).abs() < 0.05, "{engine:?}: {speed_mps} m/s up {slope_rad} rad");
        }
    }
}

#[test]
fn a_slow_turn_has_the_radius_of_its_geometry() {
    let world = ground(Stribeck::ASPHALT, |_, _| 0.0);
    for &engine in ENGINES {
        for steering_rad in [0.3, -0.3] {
            let mut plant = plant(engine, &full_size(), &world, [0.0; 3]);
            drive(&mut plant, 1.0, steering_rad, 10.0);
            let before_rad = plant.pose().yaw_rad;
            plant.advance(1.0);
            let motion = plant.motion();
            let radius_m = motion.velocity_mps[0] / (motion.pose.yaw_rad - before_rad);
            let expected_m = 2.5 / f64::from(steering_rad).tan();
            println!("{engine:?}: radius {radius_m:.2}, expected {expected_m:.2} m");
            assert!((radius_m / expected_m - 1.0).abs() < 0.05, "{engine:?}: {radius_m} m");
        }
    }
}

#[test]
fn locked_wheels_stop_within_v2_over_2_mu_g() {
    let world = ground(coulomb(0.6), |_, _| 0.0);
    let mut vehicle = prompt(full_size());
    vehicle.drivetrain.brake_torque_max_nm = 20_000.0;
    vehicle.tyre.load_sensitivity = 0.0;
    for &engine in ENGINES {
        let mut plant = plant(engine, &vehicle, &world, [-35.0, 0.0, 0.0]);
        drive(&mut plant, 5.0, 0.0, 6.0);
        let first = plant.motion();
        drive(&mut plant, 0.0, 0.0, 4.0);
        let (found_m, speed_mps) = (plant.pose().x_m - first.pose.x_m, first.velocity_mps[0]);
        let expected_m = speed_mps * speed_mps / (2.0 * 0.6 * G);
        println!("{engine:?}: braking from {speed_mps:.2} m/s: {found_m:.3}, expected {expected_m:.3} m");
        assert!((found_m / expected_m - 1.0).abs() < 0.1, "{engine:?}: {found_m} m, expected {expected_m} m");
    }
}

#[test]
fn all_wheels_slipping_climb_by_g_mu_cos_less_sin() {
    let slope_rad = 0.4f64.atan() - 5f64.to_radians();
    let world = ground(coulomb(0.4), move |x_m, _| x_m * slope_rad.tan());
    let mut vehicle = full_size();
    vehicle.tyre.load_sensitivity = 0.0;
    vehicle.drivetrain.drive_torque_max_nm = 12_000.0;
    for &engine in ENGINES {
        let mut plant = plant(engine, &vehicle, &world, [-20.0, 0.0, 0.0]);
        drive(&mut plant, 10.0, 0.0, 2.0);
        let before_mps = plant.motion().velocity_mps[0];
        plant.advance(3.0);
        let found_mps2 = (plant.motion().velocity_mps[0] - before_mps) / 3.0;
        let expected_mps2 = G * (0.4 * slope_rad.cos() - slope_rad.sin());
        println!("{engine:?}: climbing: {found_mps2:.3}, expected {expected_mps2:.3} m/s2");
        assert!((found_mps2 - expected_mps2).abs() < 0.12, "{engine:?}: {found_mps2} m/s2");
    }
}

#[test]
fn a_belly_on_a_block_takes_weight_off_the_wheels() {
    // The block is 0.05 m higher than the clearance: four springs of 30.2 kN/m give away 6.0 of 14.7 kN.
    let block = |x_m: f64, y_m: f64| if x_m.abs() < 0.5 && y_m.abs() < 0.4 { 0.4 } else { 0.0 };
    let world = ground(Stribeck::ROCK, block);
    for &engine in ENGINES {
        let mut plant = plant(engine, &full_size(), &world, [-1.25, 0.0, 0.0]);
        plant.advance(3.0);
        let load_n: f64 = plant.wheels().iter().map(|wheel| wheel.load_n).sum();
        println!("{engine:?}: wheels carry {load_n:.0} N, expected 8675 N");
        assert!((load_n - 8675.0).abs() < 1500.0, "{engine:?}: {load_n} N");
    }
}

#[test]
fn a_wall_takes_the_momentum_and_is_told_as_a_collision() {
    use scenarios::Patch;
    use terrain::GridGeometry;
    let geometry = GridGeometry::centred(0.1, 400, 400, 0.0, 0.0);
    let patch = |x_m: f64, _: f64| {
        let open = Patch::open(Stribeck::DIRT);
        if x_m > 5.0 { open.obstructed(2.0) } else { open }
    };
    let world = Arc::new(World::from_fn("wall", geometry, |_, _| 0.0, patch).unwrap());
    for &engine in ENGINES {
        let mut plant = plant(engine, &full_size(), &world, [-5.0, 0.0, 0.0]);
        drive(&mut plant, 1.0, 0.0, 5.0);
        assert!(plant.collision().is_none(), "{engine:?}");
        drive(&mut plant, 1.0, 0.0, 5.0);
        drive(&mut plant, 0.0, 0.0, 2.0);
        let collision = plant.collision().unwrap();
        println!("{engine:?}: {collision:?} of {:.0} N s", 1500.0);
        assert!((1.0..3.0).contains(&collision.at_m[0]), "{engine:?}: {collision:?}");
        assert!(collision.impulse_ns > 0.5 * 1500.0, "{engine:?}: {collision:?}");
    }
}

#[test]
fn repeats_are_bit_identical() {
    let world = ground(Stribeck::GRASS, |x_m, y_m| 0.2 * (0.7 * x_m).sin() + 0.2 * (0.5 * y_m).cos());
    for &engine in ENGINES {
        let run = || {
            let mut plant = plant(engine, &rc_car(), &world, [0.0, 0.0, 0.3]);
            drive(&mut plant, 1.5, 0.3, 2.0);
            drive(&mut plant, -0.5, -0.3, 1.0);
            assert!(plant.is_finite() && !plant.rolled_over() && !plant.left_world());
            format!("{:?} {:?}", plant.motion(), plant.wheels())
        };
        assert_eq!(run(), run(), "{engine:?}");
    }
}

#[test]
fn what_cannot_be_is_refused() {
    let world = ground(Stribeck::DIRT, |_, _| 0.0);
    for &engine in ENGINES {
        let make = |start| Plant::in_engine(engine, &full_size(), &[], Arc::clone(&world), start);
        assert!(matches!(make([38.5, 0.0, 0.0]).err(), Some(PlantError::StartOutside { .. })), "{engine:?}");
        assert!(matches!(make([f64::NAN, 0.0, 0.0]).err(), Some(PlantError::NonFiniteStart(_))));
        let mut plant = make([0.0; 3]).unwrap();
        assert!(plant.set_command(Command { speed_mps: f32::NAN, steering_rad: 0.0 }).is_err());
    }
}

#[cfg(feature = "mujoco")]
#[test]
fn mujoco_takes_no_deviations() {
    let world = ground(Stribeck::DIRT, |_, _| 0.0);
    let droop = [scenarios::Deviation::MotorDroop];
    let refused = Plant::in_engine(Engine::Mujoco, &full_size(), &droop, world, [0.0; 3]).err();
    assert_eq!(refused, Some(PlantError::DeviationsInMujoco { n_found: 1 }));
}

#[cfg(not(feature = "mujoco"))]
#[test]
fn a_build_without_mujoco_says_how_to_get_it() {
    let world = ground(Stribeck::DIRT, |_, _| 0.0);
    let refused = Plant::in_engine(Engine::Mujoco, &full_size(), &[], world, [0.0; 3]).err().unwrap();
    assert_eq!(refused, PlantError::NoMujoco);
    assert!(refused.to_string().contains("scripts/mujoco cargo build --features mujoco"), "{refused}");
}
