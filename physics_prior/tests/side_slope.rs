//! The prior across a slope against the plant of `scenarios`, whose tyres know of no prior.
#![allow(clippy::unwrap_used, reason = "a panic is how a test fails")]

mod surfaces;

use std::f64::consts::FRAC_PI_2;
use std::sync::Arc;

use bicycle::{Command, Vehicle};
use physics_prior::{Assumption, PriorBelief, PriorConfig};
use scenarios::{Patch, Plant, Stribeck, World};
use surfaces::{level, open, prior_map, surface, window};
use terrain::GridGeometry;
use traversability::Bins;

/// Time to gather speed, and time over which the plant is watched [s].
const START_S: f64 = 1.5;
const WATCHED_S: f64 = 3.0;
const STEERING_RAD: f32 = 0.15;

fn full_size() -> Vehicle {
    toml::from_str(include_str!("../../scenarios/vehicles/pietra_full_size.toml")).unwrap()
}

/// A plane that rises northwards, of a friction that does not depend on the sliding speed.
fn plane(slope: f64, friction: f64) -> Arc<World> {
    let geometry = GridGeometry::centred(0.5, 400, 400, 0.0, 0.0);
    let ground = Patch::open(Stribeck {
        static_friction: friction as f32,
        dynamic_friction: friction as f32,
        viscous_friction: 0.0,
        stribeck_speed_mps: 0.25,
    });
    Arc::new(World::from_fn("plane", geometry, |_, y_m| y_m * slope, |_, _| ground).unwrap())
}

/// What the plant makes good of 1 m/s across the slope.
struct Driven {
    /// Way along the body over the way commanded, and the way to the left [m].
    linear: f64,
    left_m: f64,
    /// Change of yaw over the one commanded; only where it steers.
    angular: f64,
}

fn drive(slope: f64, friction: f64, steering_rad: f32) -> Driven {
    let vehicle = full_size();
    let mut plant = Plant::new(&vehicle, plane(slope, friction), [0.0; 3]).unwrap();
    plant.set_command(Command { speed_mps: 1.0, steering_rad }).unwrap();
    plant.advance(START_S);
    let before = plant.pose();
    let (mut ahead_m, mut left_m) = (0.0, 0.0);
    for _ in 0..(WATCHED_S * 100.0) as usize {
        let velocity_mps = plant.motion().velocity_mps;
        ahead_m += velocity_mps[0] * 0.01;
        left_m += velocity_mps[1] * 0.01;
        plant.advance(0.01);
    }
    let commanded_rad = WATCHED_S * f64::from(steering_rad).tan() / vehicle.geometry.wheelbase_m;
    let angular = (plant.pose().yaw_rad - before.yaw_rad) / commanded_rad;
    Driven { linear: ahead_m / WATCHED_S, left_m, angular }
}

/// The prior without its spread, heading along the contour lines of the plane.
fn belief(slope: f64, friction: [f64; 2]) -> PriorBelief {
    let ground = surface(window(0.2, 80, 80), |_, y_m| open(slope * y_m));
    let prior =
        PriorConfig { uniform_weight: 0.0, friction, ..PriorConfig::for_vehicle(&full_size().geometry) };
    let assumption = Assumption::Physics { prior, level: level(1.0) };
    prior_map(&full_size().geometry, &assumption, &ground, 4).belief(8.0, 8.0, 0.0).unwrap()
}

/// Slopes of 10 to 30 degrees at five frictions. Where the slope takes less than 92 % of the friction, the plant goes
/// where it heads; from 100 % on, it slides. In between, load that moves to the lower wheels and lessens their
/// friction decides.
#[test]
fn the_plant_holds_and_slides_where_the_prior_says() {
    for slope in [10f64, 15.0, 20.0, 25.0, 30.0].map(|degrees| degrees.to_radians().tan()) {
        for friction in [0.4, 0.5, 0.6, 0.7, 0.9] {
            let said = belief(slope, [friction - 1e-6, friction]);
            let [linear, angular] =
                [said.linear, said.angular].map(|pmf| f64::from(pmf.mean(&Bins::TRACTION)));
            let straight = drive(slope, friction, 0.0);
            let told = format!("slope {slope:.3}, friction {friction}: {linear:.3} {angular:.3}");
            if slope > friction {
                assert!(linear < 1e-3 && angular < 1e-3, "{told}");
                assert!(straight.left_m < -2.0, "{told}: the plant slides {:.2} m", straight.left_m);
            } else if slope < 0.92 * friction {
                assert!((linear - straight.linear).abs() < 0.02, "{told}: the plant {:.3}", straight.linear);
                // A tyre that does not slide as a whole drifts by less than 3 friction / stiffness, here an eighth.
                assert!(
                    straight.left_m.abs() < 0.08 * WATCHED_S,
                    "{told}: it drifts {:.3} m",
                    straight.left_m
                );
            }
        }
    }
}

/// Turning up and down the slope, in the mean: what is left of the circle of friction is never more than the plant
/// makes good by 0.05, and less by up to 0.2, as long as a sixth of the friction is not needed to stay.
#[test]
fn the_plant_turns_no_less_than_the_prior_says() {
    let mut n_compared = 0;
    for slope in [10f64, 20.0, 25.0, 30.0].map(|degrees| degrees.to_radians().tan()) {
        for friction in [0.5, 0.6, 0.7, 0.9] {
            if slope > 0.83 * friction {
                continue;
            }
            let said = f64::from(belief(slope, [friction - 1e-6, friction]).angular.mean(&Bins::TRACTION));
            let found =
                [STEERING_RAD, -STEERING_RAD].map(|steering_rad| drive(slope, friction, steering_rad));
            let found = 0.5 * (found[0].angular + found[1].angular);
            n_compared += 1;
            assert!((-0.2..0.05).contains(&(said - found)), "{slope:.3} {friction}: {said:.3} {found:.3}");
        }
    }
    assert!(n_compared > 10, "{n_compared}");
}

#[test]
fn the_body_leans_on_its_springs_as_the_vehicle_says() {
    let vehicle = full_size();
    let [roll, pitch] = vehicle.lean();
    for slope_rad in [5f64, 15.0, 22.0].map(f64::to_radians) {
        let stand = |yaw_rad: f64| {
            let world = plane(slope_rad.tan(), 0.9);
            Plant::new(&vehicle, world, [0.0, 0.0, yaw_rad]).unwrap().pose()
        };
        let leans = [(stand(0.0).roll_rad, roll), (stand(FRAC_PI_2).pitch_rad, pitch)];
        for (found_rad, lean) in leans {
            let found = found_rad.abs() / slope_rad;
            assert!((found - lean).abs() < 0.03, "{slope_rad}: {found} against {lean}");
        }
    }
    let ground = surface(window(0.2, 80, 80), |_, y_m| open(0.3 * y_m));
    let believed = |lean: [f64; 2]| {
        let prior = PriorConfig { uniform_weight: 0.0, lean, ..PriorConfig::default() };
        let assumption = Assumption::Physics { prior, level: level(1.0) };
        let belief = prior_map(&vehicle.geometry, &assumption, &ground, 4).belief(8.0, 8.0, 0.4).unwrap();
        [belief.roll, belief.pitch].map(|pmf| f64::from(pmf.mean(&Bins::ATTITUDE)))
    };
    let (stiff, soft) = (believed([1.0; 2]), believed([roll, pitch]));
    assert!((soft[0] / stiff[0] - roll).abs() < 1e-3 && (soft[1] / stiff[1] - pitch).abs() < 1e-3);
}

#[test]
fn stiff_springs_do_not_lean_and_what_hardly_stands_leans_no_further_than_told() {
    let mut stiff = full_size();
    stiff.tyre.radial_stiffness_n_per_m = 1e9;
    for axle in [&mut stiff.front, &mut stiff.rear] {
        axle.suspension.stiffness_n_per_m = 1e9;
    }
    assert!(stiff.lean().iter().all(|lean| (1.0..1.001).contains(lean)), "{:?}", stiff.lean());
    let mut tall = full_size();
    tall.body.cog_height_m = 5.0;
    assert_eq!(tall.lean()[0], 3.0, "it falls over on level ground");
}
