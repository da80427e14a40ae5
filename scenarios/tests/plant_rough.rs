//! The plant on rocks, in plants, against walls and beyond the edge.
#![allow(clippy::unwrap_used)]

#[allow(dead_code)] // each test file takes what it needs
mod plant_machines;

use std::sync::Arc;

use bicycle::Vehicle;
use plant_machines::*;
use scenarios::{Patch, Plant, Stribeck, World};
use terrain::GridGeometry;

/// Highest point that the hub of a wheel reaches in a drive, above where it started [m].
fn highest_hub_m(plant: &mut Plant, wheel: usize, speed_mps: f32, duration_s: f64) -> f64 {
    let first_m = plant.wheels()[wheel].hub_m[2];
    let mut highest_m = first_m;
    for _ in 0..(duration_s / 0.01) as usize {
        drive(plant, speed_mps, 0.0, 0.01);
        highest_m = highest_m.max(plant.wheels()[wheel].hub_m[2]);
    }
    highest_m - first_m
}

#[test]
fn a_wheel_rises_over_a_rock() {
    // 10 cm high, 40 cm across, in the way of the left wheels; the tyre gives a little more than on the plane.
    let world = world_of(20.0, 0.1, Stribeck::ROCK, |x_m, y_m| {
        let from_m = (x_m - 1.0).hypot(y_m - 0.775);
        0.1 * (1.0 - (from_m / 0.2).powi(2)).max(0.0).sqrt()
    });
    for wheel in [0, 2] {
        let mut plant = Plant::new(&full_size(), world.clone(), [-3.0, 0.0, 0.0]).unwrap();
        let risen_m = highest_hub_m(&mut plant, wheel, 0.7, 10.0);
        assert!((0.07..0.11).contains(&risen_m), "wheel {wheel}: {risen_m} m");
        assert!(plant.pose().x_m > 2.0);
    }
    let mut plant = Plant::new(&full_size(), world, [-3.0, 0.0, 0.0]).unwrap();
    let risen_m = highest_hub_m(&mut plant, 1, 0.7, 10.0);
    assert!(risen_m < 0.02, "the right wheel passed beside the rock and rose {risen_m} m");
}

#[test]
fn no_rock_slips_through_the_tread() {
    // One raised grid point, wherever it lies across the tread of 0.25 m.
    for off_m in [-0.06, 0.0, 0.06] {
        let world = world_of(20.0, 0.1, Stribeck::ROCK, |x_m, y_m| {
            if (x_m - 1.05).abs() < 0.01 && (y_m - 0.75).abs() < 0.06 { 0.1 } else { 0.0 }
        });
        let mut plant = Plant::new(&full_size(), world, [-3.0, off_m, 0.0]).unwrap();
        let risen_m = highest_hub_m(&mut plant, 0, 0.5, 6.0);
        assert!(risen_m > 0.01, "{off_m} m off: {risen_m} m");
    }
}

#[test]
fn a_wheel_bridges_a_ditch_narrower_than_itself() {
    // A ditch 0.2 m wide and 0.3 m deep: a disc of 0.45 m radius sinks r - sqrt(r^2 - 0.1^2) = 11 mm.
    let world =
        world_of(20.0, 0.05, Stribeck::ROCK, |x_m, _| if (x_m - 1.0).abs() < 0.1 { -0.3 } else { 0.0 });
    let mut plant = Plant::new(&full_size(), world, [-3.0, 0.0, 0.0]).unwrap();
    let first_m = plant.wheels()[0].hub_m[2];
    let mut lowest_m = first_m;
    for _ in 0..800 {
        drive(&mut plant, 0.5, 0.0, 0.01);
        lowest_m = lowest_m.min(plant.wheels()[0].hub_m[2]);
    }
    assert!((0.01..0.05).contains(&(first_m - lowest_m)), "{} m", first_m - lowest_m);
}

/// A level world under plants of one height.
fn meadow(height_m: f32) -> Arc<World> {
    let geometry = GridGeometry::centred(0.1, 200, 200, 0.0, 0.0);
    let patch = Patch::open(Stribeck::ASPHALT).overgrown(height_m);
    Arc::new(World::from_fn("meadow", geometry, |_, _| 0.0, |_, _| patch).unwrap())
}

/// Share of the commanded 1 m/s that is left in plants.
fn pace(vehicle: &Vehicle, height_m: f32) -> f64 {
    let mut plant = Plant::new(vehicle, meadow(height_m), [-6.0, 0.0, 0.0]).unwrap();
    drive(&mut plant, 1.0, 0.0, 3.0);
    let first_m = plant.pose().x_m;
    plant.advance(5.0);
    (plant.pose().x_m - first_m) / 5.0
}

#[test]
fn plants_slow_the_vehicle_and_tall_ones_stop_it() {
    let paces = [0.0, 0.05, 0.10, 0.15, 0.25].map(|height_m| pace(&rc_car(), height_m));
    assert!(paces[0] > 0.97 && paces[1] > 0.93, "{paces:?}");
    assert!(paces.windows(2).all(|pair| pair[1] < pair[0]), "{paces:?}");
    // Stuck counts as less than 0.1 m in 5 s.
    assert!(paces[4] < 0.02, "{paces:?}");
    // Six times the wheel, the same plants: hardly felt.
    assert!(pace(&full_size(), 0.25) > 0.93);
}

#[test]
fn a_wall_stops_the_vehicle() {
    let geometry = GridGeometry::centred(0.1, 300, 300, 0.0, 0.0);
    let wall = |x_m: f64, _: f64| {
        let open = Patch::open(Stribeck::DIRT);
        if x_m > 5.0 { open.obstructed(1.5) } else { open }
    };
    let world = Arc::new(World::from_fn("wall", geometry, |_, _| 0.0, wall).unwrap());
    for vehicle in [full_size(), rc_car()] {
        let mut plant = Plant::new(&vehicle, world.clone(), [0.0; 3]).unwrap();
        drive(&mut plant, 1.0, 0.0, 10.0);
        let front_m = vehicle.geometry.length_m - vehicle.geometry.rear_overhang_m;
        let pose = plant.pose();
        assert!(pose.x_m + front_m < 5.1 + 0.1 * vehicle.geometry.length_m, "{}: {pose:?}", vehicle.name);
        assert!(plant.is_finite(), "{}: {pose:?}", vehicle.name);
    }
}

#[test]
fn the_belly_comes_to_rest_on_a_ridge() {
    // A ridge 0.6 m high and wide enough to lie on between the wheels, clearance 0.35 m: the body hangs on it.
    let world = world_of(20.0, 0.1, Stribeck::ROCK, |_, y_m| if y_m.abs() < 0.4 { 0.6 } else { 0.0 });
    let mut plant = Plant::new(&full_size(), world, [0.0; 3]).unwrap();
    plant.advance(3.0);
    let wheels_n: f64 = plant.wheels().iter().map(|wheel| wheel.load_n).sum();
    let belly_m = plant.pose().z_m - 0.425 + 0.35;
    assert!((0.57..0.62).contains(&belly_m), "belly at {belly_m} m over a ridge of 0.6 m");
    assert!(wheels_n < 0.8 * 1500.0 * G, "the wheels still carry {wheels_n} N");
    let speed_mps: f64 = plant.motion().velocity_mps.iter().map(|v| v.abs()).sum();
    assert!(speed_mps < 0.01, "{:?}", plant.motion());
}

#[test]
fn a_vehicle_on_its_side_says_so_and_stays_above_the_ground() {
    let world = incline(1.1, Stribeck::ROCK);
    let mut plant =
        Plant::new(&full_size(), world.clone(), [60.0, 0.0, std::f64::consts::FRAC_PI_2]).unwrap();
    let mut rolled_over = false;
    for _ in 0..40 {
        plant.advance(0.1);
        rolled_over |= plant.rolled_over();
        let pose = plant.pose();
        assert!(plant.is_finite());
        assert!(pose.z_m > world.height_m(pose.x_m, pose.y_m) - 0.2, "{pose:?}");
    }
    assert!(rolled_over);
}

#[test]
fn leaving_the_world_is_reported() {
    let world = world_of(20.0, 0.5, Stribeck::DIRT, |_, _| 0.0);
    let mut plant = Plant::new(&full_size(), world, [0.0; 3]).unwrap();
    drive(&mut plant, 2.0, 0.0, 3.0);
    assert!(!plant.left_world());
    plant.advance(6.0);
    assert!(plant.left_world() && plant.is_finite());
    // The made-up ground beyond the edge carries it: it does not fall for ever.
    assert!(plant.pose().z_m > 0.3);
}

#[test]
fn a_wall_takes_the_momentum_that_the_vehicle_loses() {
    // Down a ramp without motor and brakes and over level ground against a wall.
    let geometry = GridGeometry::centred(0.1, 100, 600, 0.0, 0.0);
    let wall = |x_m: f64, _: f64| {
        let open = Patch::open(Stribeck::ASPHALT);
        if x_m > 10.0 { open.obstructed(2.0) } else { open }
    };
    let ramp_m = |x_m: f64, _: f64| 0.1 * (-x_m).max(0.0);
    let world = Arc::new(World::from_fn("ramp and wall", geometry, ramp_m, wall).unwrap());
    for vehicle in [full_size(), rc_car()] {
        let mut plant = Plant::new(&powerless(vehicle.clone()), world.clone(), [-6.0, 0.0, 0.0]).unwrap();
        let mut before_mps = 0.0;
        while plant.collision().is_none() && plant.time_s() < 30.0 {
            before_mps = plant.motion().velocity_mps[0];
            plant.step();
        }
        assert!(before_mps > 1.0, "{}: {before_mps} m/s", vehicle.name);
        plant.advance(0.5);
        let mass_kg = vehicle.body.mass_kg + 4.0 * vehicle.wheel.mass_kg;
        let found_ns = plant.collision().unwrap().impulse_ns;
        // The wheels go on turning and push: their inertia is I / r^2 of mass, 7 % of the car's, 16 % of the small one's.
        let share = found_ns / (mass_kg * before_mps);
        println!("{}: {before_mps:.2} m/s, {found_ns:.1} N s, {share:.3}", vehicle.name);
        assert!((0.97..1.17).contains(&share), "{}: {share} of {} N s", vehicle.name, mass_kg * before_mps);
        assert!((9.9 - plant.collision().unwrap().at_m[0]) < vehicle.geometry.length_m + 0.1);
    }
}

#[test]
fn who_passes_beside_an_obstacle_has_not_touched_it() {
    let geometry = GridGeometry::centred(0.1, 200, 200, 0.0, 0.0);
    let post = |x_m: f64, y_m: f64| {
        let open = Patch::open(Stribeck::ASPHALT);
        if x_m.abs() < 0.3 && y_m > 1.3 { open.obstructed(2.0) } else { open }
    };
    let world = Arc::new(World::from_fn("post", geometry, |_, _| 0.0, post).unwrap());
    // Half of the width is 0.9 m.
    let mut plant = Plant::new(&full_size(), world.clone(), [-6.0, 0.0, 0.0]).unwrap();
    drive(&mut plant, 1.0, 0.0, 10.0);
    assert!(plant.pose().x_m > 2.0 && plant.collision().is_none(), "{:?}", plant.collision());
    let mut plant = Plant::new(&full_size(), world, [-6.0, 0.6, 0.0]).unwrap();
    drive(&mut plant, 1.0, 0.0, 10.0);
    assert!(plant.collision().is_some());
}
