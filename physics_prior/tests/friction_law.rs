//! The prior's law of friction on a slope: in closed form, and against the plant of `scenarios`, whose tyres and axles
//! know of no prior.
#![allow(clippy::unwrap_used, reason = "a panic is how a test fails")]

mod surfaces;

use std::f64::consts::{FRAC_PI_2, TAU};
use std::sync::Arc;

use bicycle::{AxleDemand, Command, Geometry, Vehicle};
use physics_prior::{Assumption, PriorBelief, PriorConfig, SlopeLaw};
use scenarios::{Patch, Plant, Stribeck, World};
use surfaces::{CAR, full_size, level, open, prior_map, surface, window};
use terrain::GridGeometry;
use traversability::{Bins, Pmf};

fn rear_driven() -> Vehicle {
    toml::from_str(include_str!("../../scenarios/vehicles/sedan.toml")).unwrap()
}

fn mean(pmf: &Pmf) -> f64 {
    f64::from(pmf.mean(&Bins::TRACTION))
}

/// What the law without its spread says in the middle of 8 by 8 m of ground, heading east.
fn belief_on(
    height_m: impl Fn(f64, f64) -> f64,
    geometry: &Geometry,
    slope_law: SlopeLaw,
    friction: [f64; 2],
) -> PriorBelief {
    let cell_m = geometry.length_m / 17.0;
    let ground = surface(window(cell_m, 120, 120), |x, y| open(height_m(x, y)));
    let prior = PriorConfig { uniform_weight: 0.0, slope_law, friction, ..PriorConfig::default() };
    let assumption = Assumption::Physics { prior, level: level(1.0) };
    prior_map(geometry, &assumption, &ground, 4).belief(60.0 * cell_m, 60.0 * cell_m, 0.0).unwrap()
}

/// All wheels hold alike, tyres of the stiffness 12.
const EVEN: SlopeLaw = SlopeLaw::Friction { slip_stiffness: 12.0, axle: AxleDemand::EVEN };

/// On a plane that rises by `along` ahead and by `across` to the left.
fn on_plane(along: f64, across: f64, slope_law: SlopeLaw, friction: [f64; 2]) -> PriorBelief {
    belief_on(|x, y| along * x + across * y, &CAR, slope_law, friction)
}

#[test]
fn a_slope_costs_the_slip_of_the_tyres_and_the_way_up() {
    // Of a friction of 0.6 a slope of 0.3 takes one half: 3 0.6 / 12 (1 - cbrt(1/2)) = 0.15 0.2063 = 0.0309 of slip,
    // and 1 / sqrt(1 + 0.3^2) = 0.9578 of the way is level.
    let known = [0.6 - 1e-6, 0.6];
    for along in [0.3, -0.3] {
        let belief = on_plane(along, 0.0, EVEN, known);
        assert!((mean(&belief.linear) - 0.9691 * 0.9578).abs() < 1e-3, "{:?}", belief.linear);
        // A plane turns nobody, and nothing is asked for across.
        assert!((mean(&belief.angular) - mean(&belief.linear)).abs() < 1e-4, "{:?}", belief.angular);
    }
    // 0.24 ahead and 0.18 to the left make 0.3; four fifths of the slip lie along, and across 0.18 is 0.3 of the
    // friction: sqrt(1 - 0.3^2) = 0.9539 is left to turn with.
    let belief = on_plane(0.24, -0.18, EVEN, known);
    let linear = (1.0 - 0.8 * 0.0309) / 1.0576f64.sqrt();
    assert!((mean(&belief.linear) - linear).abs() < 1e-3, "{linear}: {:?}", belief.linear);
    assert!((mean(&belief.angular) - linear * 0.9539).abs() < 1e-3, "{:?}", belief.angular);
}

#[test]
fn it_holds_with_the_probability_of_enough_friction() {
    // Friction from 0.5 to 0.8; the slope asks for the root of the sum of the squares, here 0.56, 0.65 and 0.77.
    for (asked, sliding) in [(0.45f64, 0.0), (0.56, 0.2), (0.65, 0.5), (0.77, 0.9), (0.85, 1.0)] {
        for heading in [0.0f64, 0.5, 1.1, FRAC_PI_2] {
            let belief = on_plane(asked * heading.cos(), asked * heading.sin(), EVEN, [0.5, 0.8]);
            for pmf in [&belief.linear, &belief.angular] {
                assert!(
                    (f64::from(pmf.probabilities()[0]) - sliding).abs() < 1e-4,
                    "{asked} {heading}: {pmf:?}"
                );
            }
        }
    }
}

#[test]
fn the_axle_that_a_slope_unloads_slides_first() {
    // 1360 kg at 0.75 m and 140 kg at 0.45 m: 0.722 m over half of 2.5 m = 0.5776. On tan 25 = 0.4663 the front axle,
    // which pulls half, asks for 0.4663 / (1 - 0.5776 0.4663) = 0.6382.
    let AxleDemand { share, unloading } = full_size().axle_demand();
    assert!((share - 1.0).abs() < 1e-9 && (unloading - 0.5776).abs() < 1e-4, "{share} {unloading}");
    let asked = full_size().axle_demand().friction(25f64.to_radians().tan());
    assert!((asked - 0.6382).abs() < 1e-4, "{asked}");
    assert_eq!(AxleDemand { share: 1.0, unloading: 0.5 }.friction(2.0), f64::INFINITY);
    // A sedan of 2303.1 kg, its centre of gravity 0.5408 m high and 1.4992 m ahead of the rear axle of 3.02 m, pulls with
    // the rear axle alone, which carries 0.5036 of it: 1 / 0.5036 and -0.5408 / 3.02 / 0.5036.
    let AxleDemand { share, unloading } = rear_driven().axle_demand();
    assert!((share - 1.9857).abs() < 1e-3 && (unloading + 0.3556).abs() < 1e-3, "{share} {unloading}");
}

#[test]
fn the_law_asks_for_what_the_axle_needs() {
    // The axle's 0.4 / (1 - 0.5 0.4) = 0.5 is all of a friction that is known: beyond, and not before, it slides.
    let axle = AxleDemand { share: 1.0, unloading: 0.5 };
    let law = SlopeLaw::Friction { slip_stiffness: 12.0, axle };
    let known = [0.5 - 1e-6, 0.5];
    assert_eq!(on_plane(0.398, 0.0, law, known).linear.probabilities()[0], 0.0);
    assert_eq!(on_plane(0.402, 0.0, law, known).linear.probabilities()[0], 1.0);
    assert_eq!(on_plane(0.402, 0.0, EVEN, known).linear.probabilities()[0], 0.0);
}

#[test]
fn only_what_the_wheels_do_not_share_turns() {
    // The same slope of 0.2 under all wheels, and on a roof whose ridge lies under the middle of the car.
    let known = [0.6 - 1e-6, 0.6];
    let plane = belief_on(|x, _| 0.2 * x, &CAR, EVEN, known);
    let middle_m = 60.0 * CAR.length_m / 17.0 + 0.5 * CAR.wheelbase_m;
    let roof = belief_on(|x, _| -0.2 * (x - middle_m).abs(), &CAR, EVEN, known);
    let linear = mean(&plane.linear);
    assert!((mean(&roof.linear) - linear).abs() < 1e-3, "{:?}", roof.linear);
    // 0.2 / tan 15 = 0.7464 more than what the wheels share: one half turns by 1 - 0.7464 of it, the other by all.
    let angular = 0.5 * (linear * (1.0 - 0.7464) + 1.0);
    assert!((mean(&roof.angular) - angular).abs() < 2e-3, "{angular}: {:?}", roof.angular);
    assert!((mean(&plane.angular) - linear).abs() < 1e-4, "{:?}", plane.angular);
}

/// Time to gather speed, and time over which the plant is watched [s].
const START_S: f64 = 2.5;
const WATCHED_S: f64 = 2.0;

/// Level way of the plant along its heading over the way asked for, on a plane that rises northwards.
fn driven(slope: f64, friction: f64, yaw_rad: f64) -> f64 {
    let geometry = GridGeometry::centred(0.5, 400, 400, 0.0, 0.0);
    let ground = Patch::open(Stribeck {
        static_friction: friction as f32,
        dynamic_friction: friction as f32,
        viscous_friction: 0.0,
        stribeck_speed_mps: 0.25,
    });
    let world = World::from_fn("plane", geometry, |_, y_m| y_m * slope, |_, _| ground).unwrap();
    let mut plant = Plant::new(&full_size(), Arc::new(world), [0.0, 0.0, yaw_rad]).unwrap();
    plant.set_command(Command { speed_mps: 1.0, steering_rad: 0.0 }).unwrap();
    plant.advance(START_S);
    let before = plant.pose();
    plant.advance(WATCHED_S);
    let after = plant.pose();
    let (sin, cos) = before.yaw_rad.sin_cos();
    (cos * (after.x_m - before.x_m) + sin * (after.y_m - before.y_m)) / WATCHED_S
}

/// Up, down, across and between, at frictions of which the slope asks for less than 0.85.
#[test]
fn the_plant_climbs_as_the_law_says() {
    let law = SlopeLaw::of(&full_size());
    let axle = full_size().axle_demand();
    let mut n_compared = 0;
    for slope in [10f64, 15.0, 20.0, 25.0, 28.0].map(|degrees| degrees.to_radians().tan()) {
        for friction in [0.5, 0.65, 0.8] {
            for eighth in 0..8 {
                let yaw_rad = f64::from(eighth) * TAU / 8.0;
                let (along, across) = (slope * yaw_rad.sin(), slope * yaw_rad.cos());
                if axle.friction(along.abs()).hypot(across) > 0.85 * friction {
                    continue;
                }
                let ground = |x: f64, y: f64| along * x + across * y;
                let said = belief_on(ground, &full_size().geometry, law, [friction - 1e-6, friction]);
                let (said, found) = (mean(&said.linear), driven(slope, friction, yaw_rad));
                n_compared += 1;
                // What the plant makes more of going down counts as full traction.
                assert!(
                    (said - found.min(1.0)).abs() < 0.06 + 0.15 * f64::from(along < 0.0),
                    "slope {slope:.3}, friction {friction}, yaw {yaw_rad:.2}: said {said:.3}, found {found:.3}"
                );
            }
        }
    }
    assert!(n_compared > 70, "{n_compared}");
}

/// The wheels have a radius of 0.45 m and are 0.775 m to the left and right of the middle.
#[test]
fn the_plant_stops_at_the_faces_before_one_wheel_that_the_prior_says() {
    let law = SlopeLaw::of(&full_size());
    let geometry = full_size().geometry;
    for slope in [1.5, 3.0] {
        for (face_m, stops) in [(0.35, false), (0.8, true)] {
            // A bank on the right from 4 m ahead on.
            let height_m = move |x: f64, y: f64| {
                if y < -0.3 { (slope * (x - 4.0)).clamp(0.0, face_m) } else { 0.0 }
            };
            let world_cells =
                GridGeometry { resolution_m: 0.1, origin: [-100, -100], n_rows: 200, n_cols: 250 };
            let rock = |_, _| Patch::open(Stribeck::ROCK);
            let world = World::from_fn("bank", world_cells, height_m, rock).unwrap();
            let mut plant = Plant::new(&full_size(), Arc::new(world), [0.0; 3]).unwrap();
            plant.set_command(Command { speed_mps: 1.0, steering_rad: 0.0 }).unwrap();
            plant.advance(5.0);
            let plant_m = plant.pose().x_m;
            // The same ground around the front axle, place by place.
            let at_zero = |x_m: f64| {
                let ahead = |x: f64, y: f64| height_m(x + x_m - 12.0, y - 12.0);
                f64::from(belief_on(ahead, &geometry, law, [0.5, 0.8]).linear.probabilities()[0])
            };
            let most = (10..25).map(|k| at_zero(0.1 * f64::from(k))).fold(0.0, f64::max);
            let face = format!("{face_m} m, {slope}");
            assert_eq!(plant_m < 2.5, stops, "{face}: the plant ends at {plant_m}");
            assert_eq!(most > 0.5, stops, "{face}: without traction {most}");
        }
    }
}
