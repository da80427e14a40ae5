//! The prior across a slope: in closed form, and against the plant of `scenarios`, whose tyres know of no prior.
#![allow(clippy::unwrap_used, reason = "a panic is how a test fails")]

mod surfaces;

use std::f64::consts::{FRAC_PI_2, TAU};
use std::sync::Arc;

use bicycle::Command;
use physics_prior::{Assumption, PriorBelief, PriorConfig};
use scenarios::{Patch, Plant, Stribeck, World};
use surfaces::{CAR, full_size, level, open, prior_map, surface, window};
use terrain::{GridGeometry, SurfaceCell, TerrainClass};
use traversability::Bins;

/// The prior without its spread, on ground of a friction.
fn sharp(friction: [f64; 2]) -> Assumption {
    let prior = PriorConfig { uniform_weight: 0.0, friction, ..PriorConfig::default() };
    Assumption::Physics { prior, level: level(1.0) }
}

/// What the prior without its spread says of a plane, at 2 m east and north of its corner.
fn on_plane([east, north]: [f64; 2], yaw_rad: f64, friction: [f64; 2]) -> PriorBelief {
    let ground = surface(window(0.1, 40, 40), |x, y| open(east * x + north * y));
    prior_map(&CAR, &sharp(friction), &ground, 4).belief(2.0, 2.0, yaw_rad).unwrap()
}

#[test]
fn ground_that_is_level_across_the_heading_takes_nothing_of_the_friction_that_holds() {
    let slippery = [0.31, 0.32];
    for (gradient, yaw_rad) in [([0.0, 0.0], 0.7), ([0.3, 0.0], 0.0), ([0.0, -0.2], 0.25 * TAU)] {
        let [usual, slippery] = [[0.5, 0.8], slippery].map(|friction| on_plane(gradient, yaw_rad, friction));
        assert_eq!(usual, slippery, "{gradient:?}");
    }
    assert_ne!(on_plane([0.0, 0.3], 0.0, slippery), on_plane([0.0, 0.3], 0.0, [0.5, 0.8]));
}

#[test]
fn a_face_before_one_wheel_stops_all_four() {
    // A face of 0.7 under the front right wheel alone: of frictions from 0.5 to 0.8 two thirds hold no wheel there. With
    // the others its outcome, a quarter, is beyond tan 30 = 0.577 and nothing; the other wheels turn as on level ground.
    let ground = surface(window(0.02, 100, 100), |x, y| {
        let [ahead_m, left_m] = [x - 1.26, y - 0.9];
        open(if ahead_m.abs().max(left_m.abs()) < 0.095 { 0.7 * ahead_m } else { 0.0 })
    });
    let prior = PriorConfig {
        uniform_weight: 0.0,
        wheel_envelope: 0.0,
        high_centred_clearances: 1e6,
        ..PriorConfig::default()
    };
    let assumption = Assumption::Physics { prior, level: level(1.0) };
    let belief = prior_map(&CAR, &assumption, &ground, 4).belief(1.0, 1.0, 0.0).unwrap();
    let linear = belief.linear.probabilities();
    assert!((f64::from(linear[0]) - (2.0 / 3.0 + 1.0 / 12.0)).abs() < 1e-3, "{linear:?}");
    assert!((f64::from(linear[11]) - 0.25).abs() < 1e-3, "{linear:?}");
    assert!((f64::from(belief.angular.probabilities()[0]) - 0.75).abs() < 1e-3, "{:?}", belief.angular);
}

#[test]
fn nothing_is_left_where_the_slope_across_exceeds_the_friction() {
    let known = [0.6, 0.600_001];
    for side in [-1.0, 1.0] {
        // Nearly all of the friction is needed to stay: rolling on takes nothing, turning has hardly any left.
        let holding = on_plane([0.0, side * 0.599], 0.0, known);
        assert_eq!(holding.linear.probabilities()[11], 1.0);
        assert!(holding.angular.mean(&Bins::TRACTION) < 0.06, "{holding:?}");
        assert_eq!(holding.angular.probabilities()[3..], [0.0; 9]);
        let sliding = on_plane([0.0, side * 0.61], 0.0, known);
        assert_eq!([sliding.linear.probabilities()[0], sliding.angular.probabilities()[0]], [1.0; 2]);
    }
}

#[test]
fn the_vehicle_slides_with_the_probability_of_too_little_friction() {
    for (across, sliding) in [(0.45f64, 0.0), (0.56, 0.2), (0.65, 0.5), (0.77, 0.9), (0.85, 1.0)] {
        let belief = on_plane([0.0, across], 0.0, [0.5, 0.8]);
        let linear = belief.linear.probabilities();
        assert!((f64::from(linear[0]) - sliding).abs() < 1e-4, "{across}: {linear:?}");
        assert!((f64::from(linear[11]) - (1.0 - sliding)).abs() < 1e-4, "{across}: {linear:?}");
        // What holds has the mean of its friction.
        let taken = across / (0.5 * (across.max(0.5) + 0.8));
        let angular = (1.0 - sliding) * (1.0 - taken * taken).max(0.0).sqrt();
        assert!(
            (f64::from(belief.angular.mean(&Bins::TRACTION)) - angular).abs() < 2e-4,
            "{across}: {angular}"
        );
    }
    // Grass of half the largest height holds no better.
    let green = surface(window(0.1, 40, 40), |_, y| {
        SurfaceCell::certain((0.65 * y) as f32, TerrainClass::Vegetation, 0.1)
    });
    let linear = prior_map(&CAR, &sharp([0.5, 0.8]), &green, 4).belief(2.0, 2.0, 0.0).unwrap().linear;
    assert!(
        (linear.probabilities()[0] - 0.5).abs() < 1e-4 && (linear.mean(&Bins::TRACTION) - 0.25).abs() < 1e-4
    );
}

#[test]
fn a_slope_across_leaves_the_rest_of_the_circle_of_friction_to_the_climb() {
    // Across 0.39 of 0.65: sqrt(1 - 0.6^2) = 0.8 of the circle is left, so that 0.8 tan 30 = 0.4619 takes everything.
    // 0.47 ahead makes 0.6107 in all, which 0.631 of the friction holds, 0.7054 in the mean: 0.8333 of that circle is
    // left, and 1 - 0.47 / (0.8333 tan 30) = 0.0231.
    let steep = (0.47, 0.631 * 0.0231);
    for (along, linear) in [(0.0, 1.0), (0.1, 1.0 - 0.1 / 0.4619), (0.3, 1.0 - 0.3 / 0.4619), steep] {
        let belief = on_plane([along, 0.39], 0.0, [0.5, 0.8]);
        assert!((belief.linear.mean(&Bins::TRACTION) - linear).abs() < 2e-4, "{along}: {linear}");
        for mirrored in [[along, -0.39], [-along, 0.39]] {
            let mirrored = on_plane(mirrored, 0.0, [0.5, 0.8]);
            let means = [&belief, &mirrored]
                .map(|belief| [&belief.linear, &belief.angular].map(|pmf| pmf.mean(&Bins::TRACTION)));
            assert!((0..2).all(|k| (means[0][k] - means[1][k]).abs() < 1e-5), "{means:?}");
        }
    }
}

#[test]
fn a_vehicle_that_leans_on_level_contacts_does_not_slide() {
    // The left wheels stand on a table of 0.1 m, which leans the car by 27 degrees; it slides where they stand on a bank.
    let on_ground = |height_m: fn(f64) -> f64| {
        let ground = surface(window(0.02, 100, 100), |_, y| open(height_m(y)));
        let prior = PriorConfig {
            uniform_weight: 0.0,
            friction: [0.2, 0.21],
            wheel_envelope: 0.0,
            ..PriorConfig::default()
        };
        let assumption = Assumption::Physics { prior, level: level(1.0) };
        prior_map(&CAR, &assumption, &ground, 4).belief(1.0, 1.0, 0.0).unwrap()
    };
    let table = on_ground(|y| if y > 1.0 { 0.1 } else { 0.0 });
    let bank = on_ground(|y| 0.5 * y);
    assert!(table.roll.mean(&Bins::ATTITUDE) > 25f32.to_radians(), "{table:?}");
    assert!((table.roll.mean(&Bins::ATTITUDE) - bank.roll.mean(&Bins::ATTITUDE)).abs() < 1e-3);
    assert_eq!(table.linear.probabilities()[0], 0.0);
    assert_eq!(bank.linear.probabilities()[0], 1.0);
}

/// Time to gather speed, and time over which the plant is watched [s].
const START_S: f64 = 1.5;
const WATCHED_S: f64 = 3.0;
const STEERING_RAD: f32 = 0.15;

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
