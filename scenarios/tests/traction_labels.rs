//! What a drive teaches of the ground does not depend on how fast it was driven.
#![allow(clippy::unwrap_used, reason = "helpers of tests fail the test")]

#[allow(dead_code, reason = "each test file takes what it needs")]
mod plant_machines;

use std::sync::Arc;

use bicycle::{Differential, Vehicle};
use plant_machines::*;
use scenarios::{Patch, Plant, Stribeck, Truth, World};
use terrain::GridGeometry;

/// Speeds of collection [m/s].
const SPEEDS_MPS: [f32; 3] = [1.0, 2.0, 4.0];

/// Achieved over commanded speed and, with a steering angle, yaw rate, as traction is labelled: means over 4 m of a
/// steady drive.
fn label(vehicle: &Vehicle, world: &Arc<World>, speed_mps: f32, steering_rad: f32) -> [f64; 2] {
    let mut plant = Plant::new(vehicle, Arc::clone(world), [0.0; 3]).unwrap();
    drive(&mut plant, speed_mps, steering_rad, 8.0);
    let speed_mps = f64::from(speed_mps);
    let geometric_radps = speed_mps * f64::from(steering_rad).tan() / vehicle.geometry.wheelbase_m;
    let n = (4.0 / speed_mps / 0.01).round();
    let samples = (0..n as usize).map(|_| {
        plant.advance(0.01);
        let motion = plant.motion();
        [motion.velocity_mps[0] / speed_mps / n, motion.angular_rate_radps[2] / geometric_radps / n]
    });
    samples.fold([0.0; 2], |sum, sample| [sum[0] + sample[0], sum[1] + sample[1]])
}

fn spread(values: [f64; 3]) -> f64 {
    values.into_iter().fold(f64::MIN, f64::max) - values.into_iter().fold(f64::MAX, f64::min)
}

fn meadow(height_m: f32) -> Arc<World> {
    let geometry = GridGeometry::centred(0.5, 400, 400, 0.0, 0.0);
    let patch = Patch::open(Stribeck::GRASS).overgrown(height_m);
    Arc::new(World::from_fn("meadow", geometry, |_, _| 0.0, |_, _| patch).unwrap())
}

#[test]
fn linear_traction_is_the_same_at_one_two_and_four_metres_per_second() {
    let grounds = [
        ("level asphalt", level(Stribeck::ASPHALT)),
        ("asphalt of 15 degrees", incline(15f64.to_radians(), Stribeck::ASPHALT)),
        ("dirt of 20 degrees", incline(20f64.to_radians(), Stribeck::DIRT)),
        ("sand of 10 degrees", incline(10f64.to_radians(), Stribeck::SAND)),
        ("plants of 0.3 m", meadow(0.3)),
    ];
    for (name, world) in grounds {
        let labels = SPEEDS_MPS.map(|speed_mps| label(&full_size(), &world, speed_mps, 0.0)[0]);
        println!("{name}: {labels:.4?}");
        // What is left of speed: the standing tread's damping, 0.3 % of the slip at 1 m/s; dirt, whose sliding friction
        // grows from 0.68 to 0.76 with the slip speed; wheels that the servo holds to a thousandth.
        assert!(spread(labels) < 0.005, "{name}: {labels:?}");
    }
}

#[test]
fn a_climb_of_fifteen_degrees_slips_as_much_as_the_brush_has_to() {
    // tan 15 = 0.268 of the load takes 3 m / 12 (1 - cbrt(1 - 0.268 / m)): 2.5 % on asphalt, 2.6 % on dirt of 0.68.
    for (friction, expected) in [(Stribeck::ASPHALT, 0.0248), (Stribeck::DIRT, 0.0262)] {
        let slip = 1.0 - label(&full_size(), &incline(15f64.to_radians(), friction), 1.0, 0.0)[0];
        assert!((slip - expected).abs() < 0.003, "{slip}");
    }
}

#[test]
fn angular_traction_is_the_same_at_one_two_and_four_metres_per_second_but_for_the_differentials() {
    let labels = |differential: Differential| {
        let mut vehicle = full_size();
        vehicle.drivetrain.differential = differential;
        let labels =
            SPEEDS_MPS.map(|speed_mps| label(&vehicle, &level(Stribeck::ASPHALT), speed_mps, 0.1)[1]);
        println!("{differential:?}: {labels:.4?}");
        labels
    };
    assert!(spread(labels(Differential::Open)) < 0.005);
    // Limited slip holds on to the wheels the harder the more their speeds differ: 1 / (1 + 0.384 (v / 12) / (4 + v / 12))
    // falls from 0.992 to 0.971 between 1 and 4 m/s.
    let limited = labels(Differential::LimitedSlip);
    assert!((limited[0] - limited[2] - 0.021).abs() < 0.005, "{limited:?}");
}

#[test]
fn the_truth_is_the_same_for_machines_of_every_top_speed() {
    let truths = SPEEDS_MPS.map(|speed_mps| {
        let mut vehicle = full_size();
        vehicle.limits.speed_max_mps = f64::from(speed_mps);
        let truth = Truth::new(&vehicle, incline(15f64.to_radians(), Stribeck::ASPHALT));
        truth.traversability(0.0, 0.0, 0.0).linear_traction
    });
    // The slower the machine, the less its differentials even out the slip of the lighter front wheels.
    assert!(spread(truths) < 1e-3, "{truths:?}");
}
