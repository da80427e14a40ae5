//! Queries of the ground, the rock testbed and the arena against geometry.
#![allow(clippy::unwrap_used, reason = "helpers of tests fail the test")]

use std::f64::consts::{FRAC_PI_2, TAU};

use bicycle::Geometry;
use scenarios::{
    ARENA_GOAL_M, ARENA_START, ArenaConfig, ArenaPart, ArenaWay, MAPS_PER_SPLIT, Patch, RockFieldConfig,
    RockMap, RockPopulation, Split, Stribeck, World, WorldError, arena, arena_floor, arena_parts, arena_way,
    rock_field,
};
use terrain::{Cell, GridGeometry, GridMap, TerrainClass};

const FULL_SIZE: Geometry = Geometry {
    wheelbase_m: 2.2,
    track_m: 1.5,
    length_m: 3.4,
    width_m: 1.8,
    rear_overhang_m: 0.6,
    ground_clearance_m: 0.3,
    wheel_radius_m: 0.4,
};

fn geometry(n_rows: usize, n_cols: usize) -> GridGeometry {
    GridGeometry { resolution_m: 0.5, origin: [-3, 2], n_rows, n_cols }
}

fn world(n: usize, height_m: impl Fn(f64, f64) -> f64) -> World {
    World::from_fn("test", geometry(n, n), height_m, |_, _| Patch::open(Stribeck::DIRT)).unwrap()
}

#[test]
fn a_plane_is_reproduced_with_its_gradient_and_normal() {
    let plane = |x: f64, y: f64| 1.0 + 0.5 * x - 0.25 * y;
    let world = world(8, plane);
    for (x_m, y_m) in [(-1.1, 1.3), (0.37, 2.81), (1.2, 3.9), (2.2, 4.7)] {
        assert!((world.height_m(x_m, y_m) - plane(x_m, y_m)).abs() < 1e-6);
        let gradient = world.gradient(x_m, y_m);
        assert!((gradient[0] - 0.5).abs() < 1e-6 && (gradient[1] + 0.25).abs() < 1e-6);
        // Normal of z = a x + b y + c is (-a, -b, 1) over its length sqrt(0.25 + 0.0625 + 1).
        let normal = world.normal(x_m, y_m);
        assert!((normal.x + 0.5 / 1.3125_f64.sqrt()).abs() < 1e-6, "{normal}");
        assert!((normal.norm() - 1.0).abs() < 1e-12);
    }
}

#[test]
fn a_square_is_folded_from_south_west_to_north_east() {
    // Only the south-east centre is raised: the fold leaves the north-west triangle level.
    let geometry = GridGeometry { resolution_m: 1.0, origin: [0, 0], n_rows: 2, n_cols: 2 };
    let heights = GridMap::from_values(geometry, vec![0.0, 1.0, 0.0, 0.0]).unwrap();
    let patches = GridMap::filled(geometry, Patch::open(Stribeck::DIRT));
    let world = World::new("folded", heights, patches).unwrap();
    assert_eq!(world.height_m(0.75, 1.25), 0.0);
    assert_eq!(world.height_m(1.0, 1.0), 0.0);
    // South-east triangle: h = u - v with u = 0.75, v = 0.25.
    assert_eq!(world.height_m(1.25, 0.75), 0.5);
    assert_eq!(world.gradient(1.25, 0.75), [1.0, -1.0]);
    assert_eq!(world.gradient(0.75, 1.25), [0.0, 0.0]);
}

#[test]
fn beyond_the_edge_the_ground_goes_on_level() {
    let world = world(8, |x, _| x);
    // Centres of the outermost columns lie a quarter metre inside the bounds -1.5 .. 2.5.
    assert_eq!(world.bounds().south_west_m, [-1.5, 1.0]);
    assert_eq!(world.bounds().north_east_m, [2.5, 5.0]);
    assert!((world.height_m(100.0, 3.0) - 2.25).abs() < 1e-6);
    assert!((world.height_m(-100.0, 3.0) + 1.25).abs() < 1e-6);
    assert!(world.height_m(f64::NAN, 0.0).is_nan());
    assert!(world.bounds().contains(2.5, 1.0) && !world.bounds().contains(2.6, 1.0));
}

#[test]
fn patches_lie_where_the_cells_are() {
    let mut world = world(8, |_, _| 0.0);
    world.patches[Cell { row: 2, col: 5 }] = Patch::open(Stribeck::ICE);
    let [x_m, y_m] = world.geometry().centre_m(Cell { row: 2, col: 5 });
    assert_eq!(world.patch(x_m + 0.24, y_m - 0.24).friction, Stribeck::ICE);
    assert_eq!(world.patch(x_m + 0.26, y_m).friction, Stribeck::DIRT);
    assert_eq!(world.patch(-50.0, 50.0).friction, Stribeck::DIRT);
}

#[test]
fn a_hole_in_the_heights_is_refused_with_its_place() {
    let mut heights = GridMap::filled(geometry(4, 6), 0.0);
    heights[Cell { row: 3, col: 4 }] = f32::NAN;
    let patches = GridMap::filled(geometry(4, 6), Patch::open(Stribeck::DIRT));
    let refused = World::new("holey", heights, patches.clone()).unwrap_err();
    assert!(matches!(refused, WorldError::NonFiniteHeight { row: 3, col: 4, .. }), "{refused}");

    let mut unsound = patches.clone();
    unsound[Cell { row: 1, col: 2 }].friction.static_friction = -0.1;
    let refused = World::new("negative", GridMap::filled(geometry(4, 6), 0.0), unsound).unwrap_err();
    assert!(matches!(refused, WorldError::UnsoundPatch { row: 1, col: 2, .. }), "{refused}");

    let refused = World::new("shifted", GridMap::filled(geometry(4, 5), 0.0), patches).unwrap_err();
    assert!(matches!(refused, WorldError::OtherCells { layer: "patches", .. }), "{refused}");
}

#[test]
fn unevenness_is_the_standard_deviation_under_the_footprint() {
    let slope = world(40, |x, _| 0.2 * x);
    // Uniform over a length L, the deviation is slope L / sqrt(12), less the share of 18 strips' own width.
    let strips = (1.0 - 1.0 / 18.0_f64.powi(2)).sqrt();
    let along = slope.unevenness_m(&FULL_SIZE, 6.0, 8.0, 0.0);
    assert!((along - 0.2 * 3.4 / 12.0_f64.sqrt() * strips).abs() < 1e-4, "{along}");
    let across = slope.unevenness_m(&FULL_SIZE, 6.0, 8.0, FRAC_PI_2);
    let strips = (1.0 - 1.0 / 10.0_f64.powi(2)).sqrt();
    assert!((across - 0.2 * 1.8 / 12.0_f64.sqrt() * strips).abs() < 1e-4, "{across}");
}

fn field(split: Split, index: u32) -> World {
    rock_field(&RockFieldConfig::default(), RockMap { seed: 7, split, index }, &[]).unwrap()
}

#[test]
fn a_rock_field_is_a_function_of_seed_split_and_index() {
    let heights = |split, index| field(split, index).heights;
    assert_eq!(heights(Split::Train, 3), heights(Split::Train, 3));
    assert_ne!(heights(Split::Train, 3), heights(Split::Train, 4));
    assert_ne!(heights(Split::Train, 3), heights(Split::Validation, 3));
    let other = RockMap { seed: 8, split: Split::Train, index: 3 };
    let other = rock_field(&RockFieldConfig::default(), other, &[]).unwrap();
    assert_ne!(heights(Split::Train, 3), other.heights);
}

#[test]
fn pads_are_level_and_clear() {
    let pads_m = [[5.0, 25.0], [45.0, 25.0]];
    let config = RockFieldConfig::default();
    for index in 0..3 {
        let map = RockMap { seed: 1, split: Split::Test, index };
        let world = rock_field(&config, map, &pads_m).unwrap();
        for [x_m, y_m] in pads_m {
            let level_m = world.height_m(x_m, y_m);
            for k in 0..200 {
                let (radius_m, angle) = (3.4 * (f64::from(k) / 200.0).sqrt(), f64::from(k) * 2.4);
                let height_m = world.height_m(x_m + radius_m * angle.cos(), y_m + radius_m * angle.sin());
                assert!(
                    (height_m - level_m).abs() < 1e-6,
                    "map {index}, pad {x_m}: {height_m} at {radius_m}"
                );
            }
        }
    }
}

/// Level ground with boulders of one shape, and these alone.
fn boulders_alone(boulders: RockPopulation) -> RockFieldConfig {
    let none = RockPopulation { density_per_m2: 0.0, ..boulders };
    let (small, medium, ridges) = (none, none, none);
    RockFieldConfig { small, medium, boulders, ridges, rolling_std_m: 0.0, ..RockFieldConfig::default() }
}

#[test]
fn rocks_cover_the_share_of_ground_that_a_poisson_process_would() {
    let config = boulders_alone(RockPopulation {
        density_per_m2: 0.2,
        height_m: [0.5, 0.5],
        height_to_radius: [0.5, 0.5],
        elongation: [1.0, 1.0],
        gap_m: 0.0,
    });
    let mut covered = 0.0;
    for index in 0..4 {
        let world = rock_field(&config, RockMap { seed: 2, split: Split::Train, index }, &[]).unwrap();
        let n = world.heights.values().iter().filter(|height_m| **height_m > 0.0).count();
        covered += n as f64 / world.heights.values().len() as f64 / 4.0;
    }
    // Covered share is 1 - exp(-density x mean area). Sides at 0.8 to 1.15 m (mean 0.98) from the centre bound a
    // polygon larger than the disc: from pi x 0.98^2 = 3.0 to the pentagon's 5 tan 36 deg x 0.98^2 = 3.5,
    // more where the sides are unevenly spread: up to 4.2 m2.
    let area_m2 = -(1.0 - covered).ln() / 0.2;
    assert!((3.0..4.2).contains(&area_m2), "mean rock area {area_m2} m2");
}

#[test]
fn rocks_with_a_gap_stand_apart() {
    // Sides at up to 0.46 m from the centre, five of them up to 115 degrees apart: no corner is farther out than
    // 0.46 / cos(57.6 deg) = 0.86 m. Cells of one rock are within 1.72 m, those of two at least 8 - 1.72 m apart.
    let between = |gap_m: f64| {
        let config = boulders_alone(RockPopulation {
            density_per_m2: 0.05,
            height_m: [0.2, 0.2],
            height_to_radius: [0.5, 0.5],
            elongation: [1.0, 1.0],
            gap_m,
        });
        let world = rock_field(&config, RockMap { seed: 3, split: Split::Train, index: 0 }, &[]).unwrap();
        let geometry = *world.geometry();
        let raised = (0..geometry.n_cells()).filter(|&index| world.heights.values()[index] > 0.0);
        let raised_m: Vec<_> = raised.map(|index| geometry.centre_m(geometry.cell(index))).collect();
        assert!(raised_m.len() > 500, "{} cells are raised", raised_m.len());
        let apart_m = |a: &[f64; 2], b: &[f64; 2]| (a[0] - b[0]).hypot(a[1] - b[1]);
        let pairs = raised_m.iter().flat_map(|a| raised_m.iter().map(move |b| apart_m(a, b)));
        pairs.filter(|apart_m| (1.75..6.25).contains(apart_m)).count()
    };
    assert_eq!(between(8.0), 0);
    assert!(between(0.0) > 0);
}

/// Unevenness at a low-discrepancy spread of poses (golden ratio steps) over all maps of a split, sorted.
fn unevenness_m(split: Split) -> Vec<f64> {
    let mut values = Vec::new();
    for index in 0..MAPS_PER_SPLIT {
        let world = field(split, index);
        for k in (0..400).map(f64::from) {
            let at = |step: f64| 3.0 + 44.0 * (k * step).fract();
            let yaw_rad = (k * 0.618_034).fract() * TAU;
            values.push(world.unevenness_m(&FULL_SIZE, at(0.754_877_7), at(0.569_840_3), yaw_rad));
        }
    }
    values.sort_by(f64::total_cmp);
    values
}

#[test]
fn test_maps_are_as_much_rougher_as_the_papers() {
    let (train, test) = (unevenness_m(Split::Train), unevenness_m(Split::Test));
    let quantile = |values: &[f64], q: f64| values[(q * (values.len() - 1) as f64) as usize];
    for (name, values) in [("train", &train), ("test", &test)] {
        let row = [0.05, 0.25, 0.5, 0.75, 0.95].map(|q| quantile(values, q));
        println!("unevenness {name} [m], quantiles 5 25 50 75 95 %: {row:.3?}");
    }
    let median_m = quantile(&train, 0.5);
    let above = test.iter().filter(|value| **value > median_m).count() as f64 / test.len() as f64;
    println!("test footprints above the train median {median_m:.3} m: {above:.3}");
    assert!((0.88..0.94).contains(&above), "{above}");
}

#[test]
fn a_rock_field_that_cannot_be_is_refused_by_name() {
    let config = RockFieldConfig { friction_variation: f64::NAN, ..RockFieldConfig::default() };
    let map = RockMap { seed: 0, split: Split::Train, index: 0 };
    let refused = rock_field(&config, map, &[]).unwrap_err().to_string();
    assert_eq!(refused, "rock field friction_variation: expected from 0 to 0.3, found NaN");
    let mut config = RockFieldConfig::default();
    config.medium.height_m = [0.3, 0.2];
    let refused = rock_field(&config, map, &[]).unwrap_err().to_string();
    assert_eq!(
        refused,
        "rock field medium.height_m[1]: expected a finite number >= its lower end, found 0.2"
    );
}

/// Half the length: half of all heights and distances, four times as many of everything on a square metre.
#[test]
fn the_field_to_drive_fast_over_grows_with_the_vehicle() {
    let [full, half] = [3.4, 1.7].map(RockFieldConfig::fast);
    for field in [&full, &half] {
        field.validate().unwrap();
    }
    let of = |field: &RockFieldConfig| [field.small, field.medium, field.boulders, field.ridges];
    for (large, small) in of(&full).into_iter().zip(of(&half)) {
        assert!((small.density_per_m2 / large.density_per_m2 - 4.0).abs() < 1e-9);
        assert_eq!(small.height_m, large.height_m.map(|height_m| 0.5 * height_m));
        assert_eq!((small.height_to_radius, small.gap_m), (large.height_to_radius, 0.5 * large.gap_m));
    }
    assert_eq!((half.rolling_std_m, half.pad_radius_m), (0.5 * full.rolling_std_m, 0.5 * full.pad_radius_m));
}

#[test]
fn the_arena_has_a_ramp_bushes_crates_and_a_clear_start_and_goal() {
    let world = arena(&ArenaConfig { bush_height_m: 0.3, ..ArenaConfig::default() }).unwrap();
    assert_eq!(world.bounds().north_east_m.map(|side| (side * 1e6).round() / 1e6), [9.6, 8.0]);
    // Half way up the slope of 1.3 m to 0.2 m, on top, and half way down.
    assert!((world.height_m(3.3 + 0.65, 5.4) - 0.1).abs() < 0.004);
    assert!((world.height_m(4.9, 5.4) - 0.2).abs() < 1e-6);
    assert!((world.height_m(6.5 - 0.65, 5.4) - 0.1).abs() < 0.004);
    assert_eq!(world.height_m(4.85, 4.5), 0.0);
    for rail_y_m in [4.63, 6.17] {
        assert_eq!(world.patch(4.0, rail_y_m).class, TerrainClass::Obstacle);
    }
    let bush = world.patch(4.45, 4.0);
    assert_eq!((bush.class, bush.vegetation_height_m), (TerrainClass::Vegetation, 0.3));
    assert_eq!(world.patch(4.8, 7.0).class, TerrainClass::Obstacle);
    for (x_m, y_m) in [(ARENA_START[0], ARENA_START[1]), (ARENA_GOAL_M[0], ARENA_GOAL_M[1])] {
        assert_eq!(world.patch(x_m, y_m).class, TerrainClass::Open);
    }
    // Whoever crosses the middle of the hall meets crates, bushes or the ramp, except in the southern gap of 1.15 m.
    let closed = |y_m: f64| {
        let patch = world.patch(4.85, y_m);
        patch.class != TerrainClass::Open || world.height_m(4.85, y_m) > 0.19
    };
    let open = (0..800).filter(|k| !closed(f64::from(*k) * 0.01 + 0.005)).count() as f64 * 0.01;
    assert!((open - 1.15).abs() < 0.03, "{open} m open");
    assert!(arena(&ArenaConfig { bush_height_m: -0.1, ..ArenaConfig::default() }).is_err());
}

#[test]
fn ways_through_the_arena_are_told_apart_in_its_middle() {
    let along =
        |y_m: f64| arena_way(&[[4.0, 4.0], [4.8, y_m], [4.9, y_m], [5.6, 4.0], [4.0, 0.5], [5.0, 0.5]]);
    assert_eq!(
        [0.5, 3.0, 4.5, 4.7, 6.1].map(along),
        [ArenaWay::Floor, ArenaWay::Bushes, ArenaWay::Bushes, ArenaWay::Ramp, ArenaWay::Ramp].map(Some)
    );
    assert_eq!(arena_way(&[[1.2, 4.0], [4.8, 4.0]]), None);
    // What is drawn of the hall is what is driven on.
    let world = arena(&ArenaConfig { bush_height_m: 0.3, ..ArenaConfig::default() }).unwrap();
    for (part, [west, south, east, north]) in arena_parts() {
        let (x_m, y_m) = (0.5 * (west + east), 0.5 * (south + north));
        let there = match part {
            ArenaPart::Turf => world.patch(3.7, 3.0).vegetation_height_m == 0.01,
            ArenaPart::Bushes => world.patch(x_m, y_m).vegetation_height_m == 0.3,
            ArenaPart::Ramp => (world.height_m(x_m, y_m) - 0.2).abs() < 1e-6,
            ArenaPart::Rail | ArenaPart::Crates => world.patch(x_m, y_m).class == TerrainClass::Obstacle,
        };
        assert!(there, "{part:?}");
    }
}

#[test]
fn the_floor_to_learn_on_is_level_concrete_and_turf() {
    for seed in 1..6 {
        let world = arena_floor(seed).unwrap();
        let places =
            (0..60).flat_map(|i| (0..60).map(move |j| [0.1 + 0.2 * f64::from(i), 0.1 + 0.2 * f64::from(j)]));
        let (mut n_turf, mut n) = (0, 0);
        for [x_m, y_m] in places {
            let patch = world.patch(x_m, y_m);
            assert_eq!(world.height_m(x_m, y_m), 0.0);
            assert!(patch.vegetation_height_m <= 0.01 && patch.class != TerrainClass::Obstacle);
            n_turf += i32::from(patch.class == TerrainClass::Vegetation);
            n += 1;
        }
        let share = f64::from(n_turf) / f64::from(n);
        assert!((0.1..0.75).contains(&share), "{share} of floor {seed} is turf");
    }
}
