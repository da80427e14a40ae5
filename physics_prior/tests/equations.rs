//! The equations of the prior in closed form, on ground simple enough to compute by hand.

mod surfaces;

use std::f64::consts::TAU;

use physics_prior::{Assumption, PriorConfig};
use proptest::prelude::*;
use surfaces::*;
use terrain::{GridGeometry, GridMap, SurfaceCell, TerrainClass, height_at};
use traversability::{Bins, Pmf};

/// The prior without its spread: distributions are the estimates themselves.
fn sharp() -> Assumption {
    let prior = PriorConfig { uniform_weight: 0.0, ..PriorConfig::default() };
    Assumption::Physics { prior, level: level(1.0) }
}

fn uniform_share() -> f32 {
    0.2
}

#[test]
fn a_plane_gives_traction_roll_and_pitch_exactly_at_every_yaw() {
    let (east, north) = (0.21f64, -0.13f64);
    let ground = surface(window(0.1, 40, 40), |x, y| open(100.0 + east * x + north * y));
    let map = prior_map(&CAR, &sharp(), &ground, 13);
    for step in 0..40 {
        let yaw = step as f64 * TAU / 40.0;
        let belief = map.belief(2.03, 1.98, yaw).unwrap();
        // Slope along the heading and across it, to the left, where it takes its part of a friction of 0.65.
        let along = east * yaw.cos() + north * yaw.sin();
        let across = -east * yaw.sin() + north * yaw.cos();
        let left = (1.0 - (across / 0.65).powi(2)).sqrt();
        let linear = 1.0 - along.abs() / (left * 30f64.to_radians().tan());
        // Half the time the slope works against the turn, half the time for it.
        let steepness = along.abs() / 15f64.to_radians().tan();
        let turn = linear * left;
        let angular = 0.5 * (turn * (1.0 - steepness).max(0.0) + (turn * (1.0 + steepness)).min(1.0));
        // Heights near 100 m carry 8e-6 m of rounding over a wheel distance of 0.2 m.
        let close = |pmf: &Pmf, bins: &Bins, expected: f64| {
            let expected = expected.clamp(f64::from(bins.values()[0]), f64::from(bins.values()[11]));
            assert!(
                (f64::from(pmf.mean(bins)) - expected).abs() < 3e-4,
                "{} {expected} {yaw}",
                pmf.mean(bins)
            );
        };
        close(&belief.linear, &Bins::TRACTION, linear);
        close(&belief.angular, &Bins::TRACTION, angular);
        close(&belief.roll, &Bins::ATTITUDE, across.atan().abs());
        close(&belief.pitch, &Bins::ATTITUDE, along.atan().abs());
    }
}

#[test]
fn the_estimate_stands_in_the_bins_beside_it_and_nowhere_else() {
    // Along the slope tan 15 deg: linear traction 1 - tan 15 / tan 30 = 0.5359, pitch 15 deg between the values
    // 12.5 and 17.5, roll 0 in the first bin, angular traction nothing or all that doubling 0.5359 leaves.
    let ground = surface(window(0.1, 40, 40), |x, _| open(15f64.to_radians().tan() * x));
    let belief = prior_map(&CAR, &sharp(), &ground, 4).belief(2.0, 2.0, 0.0).unwrap();
    let share = (0.535_898_4 - 0.45) / 0.1;
    let mut linear = [0.0; 12];
    (linear[5], linear[6]) = (1.0 - share, share);
    let (mut angular, mut roll, mut pitch) = ([0.0; 12], [0.0; 12], [0.0; 12]);
    (angular[0], angular[11], roll[0], pitch[2], pitch[3]) = (0.5, 0.5, 1.0, 0.5, 0.5);
    let pairs =
        [(belief.linear, linear), (belief.angular, angular), (belief.roll, roll), (belief.pitch, pitch)];
    for (pmf, expected) in pairs {
        for (p, q) in pmf.probabilities().iter().zip(&expected) {
            assert!((p - q).abs() < 2e-4, "{pmf:?} {expected:?}");
        }
    }
}

#[test]
fn half_high_vegetation_halves_the_traction() {
    // (0.2 - 0.1) / 0.2 = 0.5, half-way between the values 0.45 and 0.55; the uniform share is 0.2.
    let ground =
        surface(window(0.1, 40, 40), |_, _| SurfaceCell::certain(0.0, TerrainClass::Vegetation, 0.1));
    let belief = prior_map(&CAR, &physics(0.4), &ground, 4).belief(2.0, 2.0, 0.3).unwrap();
    for pmf in [belief.linear, belief.angular] {
        for (bin, p) in pmf.probabilities().iter().enumerate() {
            let expected = uniform_share() / 12.0 + if bin == 5 || bin == 6 { 0.4 } else { 0.0 };
            assert!((p - expected).abs() < 1e-5, "bin {bin}: {p} {expected}");
        }
    }
}

#[test]
fn vegetation_beyond_the_largest_height_stops() {
    let ground =
        surface(window(0.1, 40, 40), |_, _| SurfaceCell::certain(0.0, TerrainClass::Vegetation, 0.5));
    let belief = prior_map(&CAR, &sharp(), &ground, 4).belief(2.0, 2.0, 0.3).unwrap();
    assert_eq!(belief.linear.probabilities()[0], 1.0);
}

#[test]
fn semantic_shares_weigh_dirt_against_vegetation() {
    // A quarter vegetation of half the largest height on level ground: 0.75 * 1 + 0.25 * 0.5 = 0.875.
    let mut cell = SurfaceCell::certain(0.0, TerrainClass::Open, 0.1);
    cell.class_probability = [0.5, 0.25, 0.25, 0.0];
    let ground = surface(window(0.1, 40, 40), |_, _| cell);
    let belief = prior_map(&CAR, &sharp(), &ground, 4).belief(2.0, 2.0, 1.0).unwrap();
    // Shares are kept in units of 1/255.
    assert!((belief.linear.mean(&Bins::TRACTION) - 0.875).abs() < 0.5 / 255.0);
    assert!((belief.linear.probabilities()[11] - 0.75).abs() < 1.0 / 255.0);
}

#[test]
fn equation_18_mixes_the_uniform_distribution_into_traction() {
    // Level ground: 0.8 at traction 1 and 0.2 / 12 everywhere. Left tail at 0.4: the uniform part gives the
    // eleven lower bins, 11/60 with values summing to 5; the rest of 0.4 lies at 1.
    let belief = prior_map(&CAR, &physics(0.4), &level_ground(window(0.1, 40, 40)), 4);
    let belief = belief.belief(2.0, 2.0, 0.0).unwrap();
    let tail = (5.0 * 0.2 / 12.0 + (0.4 - 11.0 / 60.0)) / 0.4;
    let risk = belief.risk(level(0.4));
    assert!((risk.linear_traction - tail).abs() < 1e-5);
    assert!((risk.angular_traction - tail).abs() < 1e-5);
    assert_eq!(belief.evidence, 12.0);
}

#[test]
fn roll_and_pitch_take_their_wheel_pairs() {
    // Only the front left wheel stands on a table 0.05 m high: one of two roll pairs and one of two pitch pairs
    // lean. Heading east from (2, 2): wheels at x 2 and 4.4, y 2 +- 0.75.
    let ground = surface(window(0.1, 80, 80), |x, y| open(if x > 3.8 && y > 2.4 { 0.2 } else { 0.0 }));
    let belief = prior_map(&TRUCK, &sharp(), &ground, 4).belief(2.0, 2.0, 0.0).unwrap();
    let (roll, pitch) = ((0.2f32 / 1.5).atan(), (0.2f32 / 2.4).atan());
    // The level pair's zero counts as the smallest bin value, 2.5 degrees.
    let mean = |lean: f32| 0.5 * (lean + 2.5f32.to_radians());
    assert!((belief.roll.mean(&Bins::ATTITUDE) - mean(roll)).abs() < 1e-5);
    assert!((belief.pitch.mean(&Bins::ATTITUDE) - mean(pitch)).abs() < 1e-5);
}

#[test]
fn level_ground_stays_drivable_at_every_level_from_005_up() {
    for (geometry, ground) in [(CAR, window(0.1, 40, 40)), (TRUCK, window(0.2, 60, 60))] {
        let map = prior_map(&geometry, &physics(0.4), &level_ground(ground), 13);
        let centre = ground.centre_m(middle(&ground));
        let belief = map.belief(centre[0], centre[1], 0.7).unwrap();
        for step in 5..=100 {
            let risk = belief.risk(level(f64::from(step) / 100.0));
            assert!(risk.roll_rad < 15f32.to_radians() && risk.pitch_rad < 15f32.to_radians());
            // At 0.05 the tail holds the three lowest bins of the uniform share: (0 + 0.05 + 0.15) / 3.
            assert!(risk.linear_traction > 0.06, "{step} {risk:?}");
        }
        assert!((belief.risk(level(0.05)).linear_traction - 0.2 / 3.0).abs() < 1e-5);
    }
}

#[test]
fn an_uncertain_height_widens_the_attitude_and_leaves_the_traction() {
    // Standard deviation 0.02 m per wheel, 0.0283 m per pair, over 0.2 m: 8.1 degrees about level.
    let noisy = |deviation_m: f64| {
        let ground = surface(window(0.1, 40, 40), |_, _| SurfaceCell {
            height_variance_m2: (deviation_m * deviation_m) as f32,
            ..open(0.0)
        });
        prior_map(&CAR, &sharp(), &ground, 4).belief(2.0, 2.0, 0.0).unwrap()
    };
    let (sure, unsure) = (noisy(0.0), noisy(0.02));
    assert_eq!(sure.linear, unsure.linear);
    // E|X| of a triangle of variance s^2 about zero is w / 3 = sqrt(6) s / 3.
    let expected = (6f64.sqrt() / 3.0 * 0.02 * 2f64.sqrt() / 0.2) as f32;
    let mean = unsure.roll.mean(&Bins::ATTITUDE);
    // What lies below the smallest bin value counts as that, which raises the mean by less than half a degree.
    assert!(mean > expected && mean < expected + 0.5f32.to_radians(), "{mean} {expected}");
    let previous = [0.0, 0.005, 0.01, 0.02, 0.04].map(|d| noisy(d).risk(level(0.2)).roll_rad);
    assert!(previous.windows(2).all(|pair| pair[0] <= pair[1]), "{previous:?}");
    assert!(noisy(1e6).roll.probabilities().iter().all(|p| p.is_finite()));
}

#[test]
fn ground_that_reaches_the_belly_takes_the_traction() {
    // A post half-way between the axles; the belly hangs 0.35 m above the plane of the wheels' contacts.
    let with_post = |height_m: f64| {
        let ground = surface(window(0.1, 80, 80), |x, y| {
            let under = (x - 3.2).abs() < 0.25 && (y - 2.0).abs() < 0.15;
            open(0.1 * x + if under { height_m } else { 0.0 })
        });
        prior_map(&TRUCK, &sharp(), &ground, 4).belief(2.0, 2.0, 0.0).unwrap()
    };
    let free = 1.0 - 0.1 / 30f32.to_radians().tan();
    // Depth over half a clearance: none, 0.0875 / 0.175, beyond.
    for (height_m, left) in [(0.34, 1.0), (0.4375, 0.5), (0.53, 0.0)] {
        let belief = with_post(height_m);
        assert!((belief.linear.mean(&Bins::TRACTION) - left * free).abs() < 2e-3, "{height_m}");
        assert_eq!(belief.pitch, with_post(0.0).pitch);
    }
    assert_eq!(with_post(0.53).angular.probabilities()[0], 1.0);
}

#[test]
fn a_belly_over_unknown_ground_is_not_judged() {
    // Level ground 300 m up that ends under the vehicle: invented heights would leave the belly hanging in it.
    let ground =
        surface(window(0.1, 80, 80), |x, _| if x < 4.0 { open(300.0) } else { SurfaceCell::UNKNOWN });
    let map = prior_map(&TRUCK, &sharp(), &ground, 4);
    for step in 0..20 {
        let belief = map.belief(2.0 + 0.1 * f64::from(step), 4.0, 0.0).unwrap();
        assert!(belief.linear.probabilities()[0] < 0.5, "{belief:?}");
    }
}

#[test]
fn beyond_sixty_degrees_everything_lies_in_the_last_bin() {
    let ground = surface(window(0.1, 40, 40), |x, _| open(70f64.to_radians().tan() * x));
    for at in [0.05, 0.4, 1.0] {
        let map = prior_map(&CAR, &physics(at), &ground, 4);
        // Heading 45 degrees off: pitch and roll atan(tan 70 / sqrt 2) = 62.8 degrees, 15 degrees of spread.
        let risk = map.risk_map().view().risk(middle(ground.geometry()), 0);
        let belief = map.belief(2.05, 2.05, 45f64.to_radians()).unwrap();
        assert!(close(risk, belief.risk(level(at)), 1e-4));
        assert!(risk.pitch_rad <= Bins::ATTITUDE.values()[11] + 1e-6);
        assert!(risk.pitch_rad > 55f32.to_radians() && risk.roll_rad > 55f32.to_radians());
    }
}

#[test]
fn a_wheel_stands_on_the_edge_of_a_step_before_its_centre_is_there() {
    // A step of 0.3 m whose first cell's centre lies at x = 4.65, 0.25 m beyond the front wheels' at x = 4.4, so
    // that wheels of 0.4 m stand 0.3 - (0.4 - sqrt(0.4^2 - 0.25^2)) = 0.2122 m high; y is on cell centres too.
    let ground = surface(window(0.1, 80, 80), |x, _| open(if x > 4.6 { 0.3 } else { 0.0 }));
    let belief = |wheel_envelope: f64| {
        let prior = PriorConfig { uniform_weight: 0.0, wheel_envelope, ..PriorConfig::default() };
        let assumption = Assumption::Physics { prior, level: level(1.0) };
        prior_map(&TRUCK, &assumption, &ground, 4).belief(2.0, 2.0, 0.0).unwrap()
    };
    // Contact points lie on cell edges in x: the mean of the rests 0.2 and 0.3 m from the step.
    let rest_m = |off_m: f32| (0.3 - (0.4 - (0.16 - off_m * off_m).sqrt())).max(0.0);
    let expected = (0.5 * (rest_m(0.2) + rest_m(0.3)) / 2.4).atan();
    assert!((belief(1.0).pitch.mean(&Bins::ATTITUDE) - expected).abs() < 1e-4);
    assert_eq!(belief(0.0).pitch.probabilities()[0], 1.0);
}

#[test]
fn the_belly_meets_the_highest_ground_under_it() {
    let ground = rough_without_holes(window(0.1, 80, 80));
    let prior = PriorConfig {
        uniform_weight: 0.0,
        linear_slope_max_rad: 89.99f64.to_radians(),
        friction: [1e3, 1e4],
        wheel_envelope: 0.0,
        ..PriorConfig::default()
    };
    let map = prior_map(&TRUCK, &Assumption::Physics { prior, level: level(1.0) }, &ground, 1);
    let mut n_touching = 0;
    for step in 0..400 {
        let (x, y) = (3.5 + 0.01 * (step % 37) as f64, 3.2 + 0.013 * (step % 41) as f64);
        let yaw = 0.0157 * step as f64;
        let depth_m = belly_depth_m(&ground, x, y, yaw);
        // Half a clearance of 0.35 m on top takes everything; slopes take next to nothing.
        let expected = (1.0 - depth_m / 0.175).clamp(0.0, 1.0);
        let found = f64::from(map.belief(x, y, yaw).unwrap().linear.mean(&Bins::TRACTION));
        assert!((found - expected).abs() < 3e-3, "{x} {y} {yaw}: {found} {expected}");
        n_touching += u32::from(expected < 1.0);
    }
    assert!((50..350).contains(&n_touching), "{n_touching}");
}

/// Waves and bumps high enough to touch a belly now and then.
fn rough_without_holes(geometry: GridGeometry) -> GridMap<SurfaceCell> {
    surface(geometry, |x, y| {
        let bump = (3.1 * x).sin() * (2.3 * y + 0.4).sin();
        open(0.25 * (0.9 * x + 0.3 * y).sin() + if bump > 0.9 { 0.4 } else { 0.0 })
    })
}

/// How far the ground reaches into the body of the truck: every cell under the belly against the regression
/// plane of the four contacts.
fn belly_depth_m(ground: &GridMap<SurfaceCell>, x: f64, y: f64, yaw: f64) -> f64 {
    let (sin, cos) = yaw.sin_cos();
    let points = [[2.4, 0.75], [0.0, 0.75], [0.0, -0.75], [2.4, -0.75]];
    let heights = points.map(|[ahead, left]| {
        f64::from(height_at(ground, x + cos * ahead - sin * left, y + sin * ahead + cos * left))
    });
    let mean = heights.iter().sum::<f64>() / 4.0;
    let slope = |axis: usize, centre: f64| {
        let off = points.map(|point| point[axis] - centre);
        let product: f64 = off.iter().zip(&heights).map(|(off, height)| off * height).sum();
        product / off.iter().map(|off| off * off).sum::<f64>()
    };
    let (per_ahead, per_left) = (slope(0, 1.2), slope(1, 0.0));
    let geometry = ground.geometry();
    let depths = (0..geometry.n_cells()).filter_map(|index| {
        let [cell_x, cell_y] = geometry.centre_m(geometry.cell(index));
        let ahead = cos * (cell_x - x) + sin * (cell_y - y);
        let left = cos * (cell_y - y) - sin * (cell_x - x);
        // From half a wheel's radius of 0.4 m behind the rear axle to as much before the front one.
        let under = (-0.2..=2.6).contains(&ahead) && left.abs() <= 0.55;
        let height = f64::from(ground.values()[index].height_m);
        under.then_some(height - (mean + per_ahead * (ahead - 1.2) + per_left * left) - 0.35)
    });
    depths.fold(0.0, f64::max)
}

proptest! {
    #[test]
    fn distributions_sum_to_one_and_turn_with_the_ground(
        slope in 0.0..1.5f64,
        direction in 0.0..TAU,
        yaw in 0.0..TAU,
        turn in 0.0..TAU,
        deviation_m in 0.0..0.1f64,
    ) {
        let tilted = |direction: f64| {
            let ground = surface(window(0.1, 20, 20), |x, y| SurfaceCell {
                height_variance_m2: (deviation_m * deviation_m) as f32,
                ..open(slope * ((x - 1.0) * direction.cos() + (y - 1.0) * direction.sin()))
            });
            prior_map(&CAR, &physics(0.4), &ground, 1)
        };
        let still = tilted(direction).belief(1.0, 1.0, yaw).unwrap();
        let turned = tilted(direction + turn).belief(1.0, 1.0, yaw + turn).unwrap();
        for pmf in [still.linear, still.angular, still.roll, still.pitch] {
            prop_assert!(Pmf::new(*pmf.probabilities()).is_ok());
        }
        prop_assert!(close(still.risk(level(0.4)), turned.risk(level(0.4)), 1e-3));
    }
}
