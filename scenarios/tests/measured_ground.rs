//! Worlds from elevation layers, and starts and goals on them.
#![allow(clippy::unwrap_used, reason = "helpers of tests fail the test")]

mod machines;

use std::path::Path;
use std::sync::Arc;

use bicycle::Vehicle;
use machines::full_size;
use scenarios::{
    Bounds, End, LayerConfig, LayersError, LayersTaskError, Pair, PairError, PairWish, Patch, Stribeck, Task,
    World, WorldError, WorldLayers, check_pair, feasible_pair, world_from_layers,
};
use terrain::{Cell, GridGeometry, GridMap, Knowledge, TerrainClass};

fn coarse(n: usize) -> GridGeometry {
    GridGeometry { resolution_m: 1.0, origin: [0, 0], n_rows: n, n_cols: n }
}

fn layer(n: usize, value: impl Fn(f64, f64) -> f64) -> GridMap<f32> {
    let geometry = coarse(n);
    let at = |index: usize| {
        let [x_m, y_m] = geometry.centre_m(geometry.cell(index));
        value(x_m, y_m) as f32
    };
    GridMap::from_values(geometry, (0..geometry.n_cells()).map(at).collect()).unwrap()
}

fn bare(elevation_m: GridMap<f32>) -> WorldLayers {
    WorldLayers::bare(elevation_m)
}

fn built(layers: &WorldLayers) -> World {
    world_from_layers("built", layers, &LayerConfig::with_resolution(0.2), 3).unwrap()
}

#[test]
fn a_plane_stays_a_plane_and_measured_heights_stay() {
    let plane = |x: f64, y: f64| 3.0 + 0.3 * x - 0.1 * y;
    let world = built(&bare(layer(20, plane)));
    assert_eq!((world.geometry().n_rows, world.geometry().resolution_m), (100, 0.2));
    // Beyond the second centre from the border a spline knows neighbours on both sides.
    for (x_m, y_m) in [(2.1, 3.3), (7.77, 9.1), (15.2, 2.6), (17.9, 17.9)] {
        assert!((world.height_m(x_m, y_m) - plane(x_m, y_m)).abs() < 1e-5);
    }
    let bumps = layer(20, |x, y| (x * 1.7).sin() + (y * 2.3).cos());
    let world = built(&bare(bumps.clone()));
    for (row, col) in [(4, 7), (0, 0), (19, 3)] {
        // Five fine cells a coarse one: the middle one holds the measurement.
        let fine = Cell { row: 5 * row + 2, col: 5 * col + 2 };
        assert!((world.heights[fine] - bumps[Cell { row, col }]).abs() < 1e-5);
    }
}

#[test]
fn what_was_measured_and_what_was_interpolated_stays_apart() {
    let mut layers = bare(layer(10, |_, _| 0.0));
    layers.elevation_m[Cell { row: 5, col: 5 }] = f32::NAN;
    let mut gap_m = layer(10, |_, _| 0.3);
    gap_m[Cell { row: 2, col: 2 }] = 2.6;
    layers.ground_gap_m = Some(gap_m);
    let world = built(&layers);
    let knowledge = |x_m: f64, y_m: f64| world.patch(x_m, y_m).knowledge;
    assert_eq!(knowledge(3.5, 3.5), Knowledge::Measured);
    assert_eq!(knowledge(3.3, 3.5), Knowledge::Interpolated);
    assert_eq!(knowledge(5.5, 5.5), Knowledge::Interpolated);
    assert_eq!(knowledge(2.5, 2.5), Knowledge::Interpolated);
    let measured = world.patches.values().iter().filter(|p| p.knowledge == Knowledge::Measured).count();
    assert_eq!(measured, 98);
}

#[test]
fn a_hole_is_filled_between_the_heights_of_its_rim() {
    let mut layers = bare(layer(30, |x, _| 0.5 * x));
    for row in 10..18 {
        for col in 12..20 {
            layers.elevation_m[Cell { row, col }] = f32::NAN;
        }
    }
    let world = built(&layers);
    // The rim's columns have centres at 11.5 and 20.5 m.
    let inside = (0..80).map(|k| world.height_m(12.0 + 0.1 * f64::from(k), 14.0));
    for height_m in inside {
        assert!((5.75..=10.25).contains(&height_m), "{height_m}");
    }
    // Laplace's equation across a square hole in a slope: the slope goes on.
    assert!((world.height_m(16.0, 14.0) - 8.0).abs() < 0.3, "{}", world.height_m(16.0, 14.0));
}

#[test]
fn layers_become_plants_water_and_stems() {
    let mut layers = bare(layer(60, |_, _| 0.0));
    layers.low_vegetation_fraction = Some(layer(60, |x, _| if x < 20.0 { 0.5 } else { 0.0 }));
    layers.canopy_height_m = Some(layer(60, |x, _| {
        if x < 10.0 {
            0.4
        } else if x < 40.0 {
            12.0
        } else {
            0.0
        }
    }));
    layers.water = Some(layer(60, |x, _| f64::from(x > 50.0)));
    let world = built(&layers);
    // Half of all returns from plants: half of 1.2 m below tall canopy, half of 0.4 m where that is all there is.
    let shrub = world.patch(5.0, 30.0);
    assert_eq!((shrub.class, shrub.vegetation_height_m), (TerrainClass::Vegetation, 0.2));
    let understory = (0..200).map(|k| world.patch(15.0, 10.0 + 0.2 * f64::from(k)));
    assert!(understory.filter(|p| p.vegetation_height_m == 0.6).count() > 150);
    assert_eq!(world.patch(45.0, 30.0).class, TerrainClass::Open);
    let water = world.patch(55.0, 30.0);
    assert_eq!((water.class, water.obstacle_height_m), (TerrainClass::Obstacle, 0.0));

    let stems: Vec<_> = (0..world.geometry().n_cells())
        .filter(|&index| world.patches.values()[index].obstacle_height_m > 1.0)
        .map(|index| world.geometry().centre_m(world.geometry().cell(index)))
        .collect();
    assert!(stems.iter().all(|[x_m, _]| (9.8..40.2).contains(x_m)));
    // 30 x 60 m of canopy at 0.035 stems/m2: 63 +- 8 stems; a disc of 0.15 m on cells of 0.2 m covers one to four.
    assert!((55..=250).contains(&stems.len()), "{}", stems.len());
}

#[test]
fn a_stem_stands_at_the_same_place_in_every_window() {
    let mut layers = bare(layer(60, |x, y| 0.1 * (x * 0.5).sin() * y));
    layers.canopy_height_m = Some(layer(60, |_, _| 10.0));
    let whole = built(&layers);
    let window = Bounds { south_west_m: [13.3, 21.7], north_east_m: [40.0, 55.0] };
    let config = LayerConfig { window: Some(window), ..LayerConfig::with_resolution(0.2) };
    let part = world_from_layers("part", &layers, &config, 3).unwrap();
    assert!(part.geometry().n_cells() < whole.geometry().n_cells() / 3);
    for index in 0..part.geometry().n_cells() {
        let [x_m, y_m] = part.geometry().centre_m(part.geometry().cell(index));
        assert_eq!(part.patches.values()[index], *whole.patch(x_m, y_m), "at {x_m} {y_m}");
        let height_m = *whole.heights.at(x_m, y_m).unwrap();
        assert!((part.heights.values()[index] - height_m).abs() < 1e-5);
    }
    let other = world_from_layers("other", &layers, &LayerConfig::with_resolution(0.2), 4).unwrap();
    assert_ne!(other.patches, whole.patches);
}

#[test]
fn layers_that_make_no_world_are_refused() {
    let config = LayerConfig::with_resolution(0.2);
    let refused = |layers: &WorldLayers, config: &LayerConfig| {
        world_from_layers("refused", layers, config, 0).unwrap_err()
    };
    let mut other = bare(layer(10, |_, _| 0.0));
    other.water = Some(layer(9, |_, _| 0.0));
    let error = refused(&other, &config);
    assert!(matches!(error, LayersError::World(WorldError::OtherCells { layer: "water", .. })), "{error}");
    assert_eq!(refused(&bare(layer(10, |_, _| f64::NAN)), &config), LayersError::NoHeight);
    let far = Bounds { south_west_m: [50.0, 50.0], north_east_m: [60.0, 60.0] };
    let layers = bare(layer(10, |_, _| 0.0));
    let error = refused(&layers, &LayerConfig { window: Some(far), ..config });
    assert!(matches!(error, LayersError::WindowOutside { .. }), "{error}");
    let error = refused(&layers, &LayerConfig { resolution_m: 0.001, ..config });
    assert!(matches!(error, LayersError::TooLarge { .. }), "{error}");
    let error = refused(&layers, &LayerConfig { resolution_m: f64::NAN, ..config });
    assert!(matches!(error, LayersError::Setting { field: "resolution_m", .. }), "{error}");
}

fn ground(height_m: impl Fn(f64, f64) -> f64, patch: impl Fn(f64, f64) -> Patch) -> Arc<World> {
    let geometry = GridGeometry { resolution_m: 0.2, origin: [0, 0], n_rows: 200, n_cols: 250 };
    Arc::new(World::from_fn("ground", geometry, height_m, patch).unwrap())
}

const ROCK: Patch = Patch::open(Stribeck::ROCK);
const ACROSS: Pair = Pair { start: [8.0, 20.0, 0.0], goal_m: [40.0, 20.0] };

#[test]
fn flat_ground_is_fine_and_ends_off_the_map_are_not() {
    let flat = ground(|_, _| 0.0, |_, _| ROCK);
    assert_eq!(check_pair(&flat, &full_size(), &ACROSS), Ok(()));
    let off = Pair { goal_m: [60.0, 20.0], ..ACROSS };
    let error = check_pair(&flat, &full_size(), &off).unwrap_err();
    assert!(matches!(error, PairError::OutOfMap { end: End::Goal, .. }), "{error}");
}

#[test]
fn ends_on_obstacles_slopes_and_ice_are_refused_with_the_reason() {
    let vehicle = full_size();
    // The goal lies 1 m beside a post that the body covers whichever way it heads.
    let post = |x: f64, y: f64| (x - 40.3).abs() < 0.2 && (y - 20.0).abs() < 0.2;
    let posted = ground(|_, _| 0.0, |x, y| if post(x, y) { ROCK.obstructed(2.0) } else { ROCK });
    let error = check_pair(&posted, &vehicle, &ACROSS).unwrap_err();
    assert!(matches!(error, PairError::OnObstacle { end: End::Goal, .. }), "{error}");

    // A cross slope of 32 degrees at the start.
    let slope = 32.0_f64.to_radians().tan();
    let steep = ground(|x, y| if x < 14.0 { slope * y } else { 0.0 }, |_, _| ROCK);
    let error = check_pair(&steep, &vehicle, &ACROSS).unwrap_err();
    let PairError::TooSteep { end: End::Start, roll_deg, pitch_deg, roll_max_deg, .. } = error else {
        panic!("{error}");
    };
    // The springs add what the weight's shift to the lower side compresses them: a few degrees more than the slope.
    assert!((32.0..40.0).contains(&roll_deg) && pitch_deg < 0.5, "{roll_deg} {pitch_deg}");
    assert!((roll_max_deg - 27.0).abs() < 0.01, "{roll_max_deg}");

    // Up 24 degrees on ice: tan = 0.45 > 0.40.
    let icy = Patch::open(Stribeck::ICE);
    let icy = ground(|x, _| 0.45 * x.min(14.0), |x, _| if x < 14.0 { icy } else { ROCK });
    let error = check_pair(&icy, &vehicle, &ACROSS).unwrap_err();
    assert!(matches!(error, PairError::NoTraction { end: End::Start, .. }), "{error}");
}

#[test]
fn a_start_where_the_parked_vehicle_slides_is_refused() {
    // Down 21.8 degrees, where statics ask for no pull.
    let start = |friction: f32| {
        let constant = Stribeck {
            static_friction: friction,
            dynamic_friction: friction,
            viscous_friction: 0.0,
            stribeck_speed_mps: 0.25,
        };
        let bank = ground(|x, _| -0.4 * x.min(14.0), |_, _| Patch::open(constant));
        check_pair(&bank, &full_size(), &ACROSS)
    };
    let Err(PairError::Slides { at_m: [8.0, 20.0], moved_m }) = start(0.3) else { panic!("it slides") };
    // From rest with g (sin - 0.3 cos) = 0.91 m/s2, for 1.5 s of settling before the 2 s.
    assert!((2.0..6.0).contains(&moved_m), "{moved_m}");
    assert!(!matches!(start(0.6), Err(PairError::Slides { .. })), "it stays");
}

#[test]
fn a_vehicle_with_a_turning_circle_leaves_a_yard_ahead_and_not_to_the_side() {
    // A yard in which the vehicle could turn on the spot, with its farthest corner 3.1 m from the rear axle, and a lane
    // that leaves it. Its tightest circle has a radius of 4.3 m.
    let through_lane = |heading_rad: f64| {
        let is_free = move |x: f64, y: f64| {
            let (x, y) = (x - 24.0, y - 20.0);
            let ahead = x * heading_rad.cos() + y * heading_rad.sin();
            let left = y * heading_rad.cos() - x * heading_rad.sin();
            x.hypot(y) < 3.6 || (ahead > 0.0 && left.abs() < 2.0)
        };
        let yard = ground(|_, _| 0.0, move |x, y| if is_free(x, y) { ROCK } else { ROCK.obstructed(2.0) });
        let goal_m = [24.0 + 12.0 * heading_rad.cos(), 20.0 + 12.0 * heading_rad.sin()];
        check_pair(&yard, &full_size(), &Pair { start: [24.0, 20.0, 0.0], goal_m })
    };
    assert_eq!(through_lane(0.0), Ok(()));
    assert!(matches!(through_lane(std::f64::consts::FRAC_PI_2), Err(PairError::Unreachable { .. })));
}

#[test]
fn a_wall_cuts_off_and_a_gate_lets_through() {
    let walled = |gate_m: f64| {
        let wall = move |x: f64, y: f64| (24.0..24.5).contains(&x) && (y - 30.0).abs() > 0.5 * gate_m;
        ground(|_, _| 0.0, move |x, y| if wall(x, y) { ROCK.obstructed(2.0) } else { ROCK })
    };
    let reach = |gate_m: f64| check_pair(&walled(gate_m), &full_size(), &ACROSS);
    // The vehicle is 1.8 m wide.
    assert!(matches!(reach(1.4), Err(PairError::Unreachable { .. })));
    assert_eq!(reach(3.0), Ok(()));
    // A ridge of 45 degrees closes a way as well as a wall, a bank of 15 degrees does not.
    let ridge = |slope: f64| ground(move |x, _| (3.0 - (x - 24.0).abs()).max(0.0) * slope, |_, _| ROCK);
    let over = |slope: f64| check_pair(&ridge(slope), &full_size(), &ACROSS);
    assert!(matches!(over(1.0), Err(PairError::Unreachable { .. })));
    assert_eq!(over(0.27), Ok(()));
}

/// 1000 x 1000 m of gentle waves on cells of 5 m, of which the product builds no more than a drive needs.
fn waves() -> WorldLayers {
    let geometry = GridGeometry { resolution_m: 5.0, origin: [0, 0], n_rows: 200, n_cols: 200 };
    let height_m = |index: usize| {
        let [x_m, y_m] = geometry.centre_m(geometry.cell(index));
        ((0.02 * x_m).sin() + (0.03 * y_m).cos()) as f32
    };
    bare(GridMap::from_values(geometry, (0..geometry.n_cells()).map(height_m).collect()).unwrap())
}

fn side_m(task: &Task) -> f64 {
    let Bounds { south_west_m, north_east_m } = task.bounds;
    (0..2).map(|k| north_east_m[k] - south_west_m[k]).fold(0.0, f64::max)
}

#[test]
fn of_a_large_map_the_part_around_the_drive_is_built_wherever_the_seed_puts_it() {
    let (vehicle, layers) = (full_size(), waves());
    let wish = PairWish { distance_m: 40.0, ..PairWish::default() };
    let task = |wish: &PairWish, seed: u64| Task::in_layers("waves", &layers, &vehicle, wish, seed);
    let [one, other] = [1, 2].map(|seed| task(&wish, seed).unwrap());
    for drive in [&one, &other] {
        let [x_m, y_m, _] = drive.start;
        assert!((drive.distance_to_goal_m(x_m, y_m) - 40.0).abs() < 1e-9);
        // 30 m and the distance on all sides of a place.
        assert!((139.0..141.0).contains(&side_m(drive)), "{}", side_m(drive));
    }
    assert!((one.start[0] - other.start[0]).hypot(one.start[1] - other.start[1]) > 100.0);
    // Between ends that are given, the part reaches 30 m beyond both.
    let both = PairWish { start: Some([200.0, 500.0, 0.0]), goal_m: Some([320.0, 500.0]), ..wish };
    let between = task(&both, 1).unwrap();
    assert_eq!((between.start, between.goal_m), ([200.0, 500.0, 0.0], [320.0, 500.0]));
    assert!((179.0..181.0).contains(&side_m(&between)), "{}", side_m(&between));
    let outside = PairWish { goal_m: Some([-5.0, 20.0]), ..wish };
    let error = task(&outside, 1).unwrap_err();
    assert!(matches!(error, LayersTaskError::Pair(PairError::OutOfMap { end: End::Goal, .. })), "{error}");
}

#[test]
fn a_small_map_is_built_whole() {
    let layers = bare(layer(60, |x, _| 0.01 * x));
    let wish = PairWish { distance_m: 20.0, ..PairWish::default() };
    let task = Task::in_layers("meadow", &layers, &full_size(), &wish, 1).unwrap();
    // To whole cells of the planning resolution.
    assert!((59.8..=60.0).contains(&side_m(&task)), "{}", side_m(&task));
}

/// The layers of a file, as `surefoot drive --world` reads them.
fn layers_of(file: &str) -> WorldLayers {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/../../shared/data/terrain");
    let read = formats::read_elevation(&Path::new(folder).join(file)).unwrap();
    WorldLayers {
        elevation_m: read.elevation,
        canopy_height_m: read.layers.canopy_height_m,
        low_vegetation_fraction: read.layers.low_vegetation_fraction,
        water: read.layers.water,
        ground_gap_m: read.layers.ground_gap_m,
    }
}

fn drive_on(file: &str, vehicle: &Vehicle, wish: &PairWish, seed: u64) -> Result<Task, LayersTaskError> {
    Task::in_layers(file, &layers_of(file), vehicle, wish, seed)
}

#[test]
#[ignore = "needs the shared data"]
fn a_pair_is_found_in_the_forest_in_the_badlands_and_by_the_gully() {
    let vehicle = full_size();
    let wish = PairWish { distance_m: 40.0, ..PairWish::default() };
    for file in ["lidr_topography.npz", "usgs_1m.npz", "bijou_gully_5m.npz"] {
        for seed in 0..2 {
            let task = drive_on(file, &vehicle, &wish, seed).unwrap();
            let [x_m, y_m, _] = task.start;
            assert!((task.distance_to_goal_m(x_m, y_m) - 40.0).abs() < 1e-9);
            let pair = Pair { start: task.start, goal_m: task.goal_m };
            assert_eq!(check_pair(&task.world, &vehicle, &pair), Ok(()), "{file} {seed}");
            let again = drive_on(file, &vehicle, &wish, seed).unwrap();
            assert_eq!((again.start, again.goal_m), (task.start, task.goal_m));
        }
    }
}

#[test]
#[ignore = "needs the shared data"]
fn the_forest_has_trees_plants_and_water() {
    let layers = layers_of("lidr_topography.npz");
    let window = Bounds { south_west_m: [60.0, 60.0], north_east_m: [220.0, 220.0] };
    let config = LayerConfig { window: Some(window), ..LayerConfig::for_vehicle(&full_size()) };
    let world = world_from_layers("forest", &layers, &config, 1).unwrap();
    let n = world.patches.values().len() as f64;
    let share =
        |of: &dyn Fn(&Patch) -> bool| world.patches.values().iter().filter(|p| of(p)).count() as f64 / n;
    let shares = [
        share(&|p| p.obstacle_height_m > 2.0),
        share(&|p| p.class == TerrainClass::Vegetation),
        share(&|p| p.knowledge == Knowledge::Measured),
    ];
    println!("stems, plants, measured: {shares:.4?}");
    assert!((0.0005..0.02).contains(&shares[0]) && (0.02..0.9).contains(&shares[1]));
    // At most one fine cell of 25 holds a coarse centre.
    assert!((0.001..=0.04).contains(&shares[2]));
}

#[test]
#[ignore = "needs the shared data"]
fn given_ends_are_kept_and_bad_ones_named() {
    let vehicle = full_size();
    let wish = PairWish { distance_m: 40.0, ..PairWish::default() };
    let file = "lidr_topography.npz";
    let found = drive_on(file, &vehicle, &wish, 5).unwrap();
    let from = PairWish { start: Some(found.start), ..wish };
    let onwards = drive_on(file, &vehicle, &from, 8).unwrap();
    assert_eq!(onwards.start, found.start);
    let both = PairWish { start: Some(found.start), goal_m: Some(found.goal_m), ..wish };
    assert_eq!(drive_on(file, &vehicle, &both, 5).unwrap().goal_m, found.goal_m);
    let outside = PairWish { goal_m: Some([-5.0, 20.0]), ..wish };
    let error = drive_on(file, &vehicle, &outside, 5).unwrap_err();
    assert!(matches!(error, LayersTaskError::Pair(PairError::OutOfMap { end: End::Goal, .. })), "{error}");
    assert!(feasible_pair(&found.world, &vehicle, &PairWish { distance_m: 500.0, ..wish }, 1).is_err());
}
