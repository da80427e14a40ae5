//! The map: every pose, obstacles, holes, partial updates, threads.

mod surfaces;

use bicycle::lanes::Instructions;
use std::f64::consts::PI;

use physics_prior::{Assumption, BlockPrior, PoseLine, PriorConfig, PriorField, PriorMap, PriorMapError};
use proptest::prelude::*;
use surfaces::*;
use terrain::{Cell, CellRegion, GridGeometry, GridMap, SettingError, SurfaceCell, TerrainClass};
use traversability::{Bins, GroundFlags, PartialMoments, Risk};

const NOMINAL: Assumption = Assumption::Nominal { obstacle_margin_m: 0.0 };

/// The map takes its CVaR straight from the outcomes; the belief spreads them over bins first.
#[test]
fn the_map_is_the_belief_of_every_pose() {
    let ground = rough(window(0.1, 40, 44), 3);
    for (resolution_m, at) in [(0.1, 0.3), (0.2, 1.0), (0.05, 0.05), (0.25, 0.6)] {
        let risk = GridGeometry { resolution_m, origin: [3, 5], n_rows: 12, n_cols: 10 };
        let mut map = PriorMap::new(&CAR, &physics(at), 0.1, risk, 7, Instructions::widest()).unwrap();
        map.update_all(&ground).unwrap();
        let view = map.risk_map().view();
        for (row, col) in (1..11).flat_map(|row| (1..9).map(move |col| (row, col))) {
            let [x_m, y_m] = risk.centre_m(Cell { row, col });
            for yaw in 0..7 {
                let found = view.risk(Cell { row, col }, yaw);
                // A hair to the north-east, so that rounding cannot take the pose to another surface cell.
                let belief = map.belief(x_m + 1e-9, y_m + 1e-9, view.yaw_rad(yaw)).unwrap();
                let expected = belief.risk(level(at));
                let [is_touching, is_blocked] =
                    [2.0, 1.0].map(|turns| found.roll_rad >= turns * Risk::BLOCKED_RAD);
                let expected = match (is_touching, is_blocked) {
                    (true, _) => expected.touching(),
                    (_, true) => expected.blocked(),
                    _ => expected,
                };
                assert!(
                    close(found, expected, 1e-4),
                    "{resolution_m} {row} {col} {yaw} {found:?} {expected:?}"
                );
            }
        }
    }
}

#[test]
fn mirrored_ground_gives_the_mirrored_map() {
    let geometry = GridGeometry { resolution_m: 0.1, origin: [-20, -20], n_rows: 40, n_cols: 40 };
    let ground = rough(geometry, 11);
    let mirrored = GridMap::from_values(
        geometry,
        (0..geometry.n_cells())
            .map(|i| {
                let Cell { row, col } = geometry.cell(i);
                ground[Cell { row: geometry.n_rows - 1 - row, col }]
            })
            .collect(),
    )
    .unwrap();
    let [map, mirror] = [&ground, &mirrored].map(|ground| prior_map(&CAR, &physics(0.5), ground, 12));
    for row in 0..40 {
        for col in 0..40 {
            for yaw in 0..12 {
                let risk = map.risk_map().view().risk(Cell { row, col }, yaw);
                let reflected = mirror.risk_map().view().risk(Cell { row: 39 - row, col }, 11 - yaw);
                assert!(close(risk, reflected, 1e-4), "{row} {col} {yaw} {risk:?} {reflected:?}");
            }
        }
    }
}

#[test]
fn uphill_is_as_bad_as_downhill() {
    let ground = surface(window(0.1, 40, 40), |x, y| open(0.2 * x - 0.1 * y));
    let map = prior_map(&CAR, &physics(0.5), &ground, 12);
    let centre = middle(ground.geometry());
    for yaw in 0..6 {
        let view = map.risk_map().view();
        assert!(close(view.risk(centre, yaw), view.risk(centre, yaw + 6), 1e-5));
    }
}

#[test]
fn obstacles_block_every_pose_whose_footprint_touches_them() {
    let geometry = window(0.1, 80, 80);
    let post = Cell { row: 41, col: 37 };
    let mut ground = level_ground(geometry);
    ground[post] = SurfaceCell::certain(0.0, TerrainClass::Obstacle, 0.0);
    let [post_x_m, post_y_m] = geometry.centre_m(post);
    for assumption in [physics(0.4), NOMINAL] {
        let map = prior_map(&TRUCK, &assumption, &ground, 16);
        let view = map.risk_map().view();
        for index in 0..geometry.n_cells() {
            let cell = geometry.cell(index);
            if cell.row == 0 || cell.row == 79 || cell.col == 0 || cell.col == 79 {
                continue;
            }
            let [x_m, y_m] = geometry.centre_m(cell);
            // How far the centre of the post's cell lies outside the rectangle [-0.5, 2.9] x [-0.9, 0.9]:
            // closer than half an edge it surely touches, further than half a diagonal of 0.0707 m surely not.
            let outside_m = |yaw_rad: f64| {
                let (sin, cos) = yaw_rad.sin_cos();
                let forward_m = cos * (post_x_m - x_m) + sin * (post_y_m - y_m);
                let left_m = -sin * (post_x_m - x_m) + cos * (post_y_m - y_m);
                let ahead_m = (forward_m - 2.9).max(-0.5 - forward_m).max(0.0);
                ahead_m.hypot((left_m.abs() - 0.9).max(0.0))
            };
            for yaw in 0..16 {
                // A pose stands for every heading of its bin, 11.25 degrees to either side. It is laid down every 1.4
                // degrees; between two of these a corner at (2.9, 0.9) m stands out by 0.9 m times half of that: 11 mm
                // at most; 6 mm of it are asked for here, so that a coarser sweep is found out.
                let headings = (-40..=40).map(|step| view.yaw_rad(yaw) + PI / 16.0 * f64::from(step) / 40.0);
                let at_the_middle_m = outside_m(view.yaw_rad(yaw));
                let outside_m = headings.map(&outside_m).fold(f64::INFINITY, f64::min);
                let is_touching = view.risk(cell, yaw).roll_rad >= 2.0 * Risk::BLOCKED_RAD;
                assert!(is_touching || at_the_middle_m >= 0.049, "{cell:?} {yaw} {at_the_middle_m}");
                assert!(!is_touching || at_the_middle_m <= 0.0708, "{cell:?} {yaw} {at_the_middle_m}");
                let blocked = view.risk(cell, yaw).is_blocked();
                if outside_m < 0.043 {
                    assert!(blocked, "{cell:?} {yaw} {outside_m}");
                } else if outside_m > 0.0708 {
                    assert!(!blocked, "{cell:?} {yaw} {outside_m}");
                }
            }
        }
    }
}

#[test]
fn the_margin_widens_the_footprint_on_every_side() {
    let geometry = window(0.1, 40, 40);
    // Heading west from the centre of cell (20, 20) at (2.05, 2.05), the car reaches 0.295 m west, 0.035 m east and
    // 0.125 m to either side; the obstacles' near edges lie 0.55, 0.25 and 0.25 m away. Half a degree to either side,
    // for which the middle one of 361 headings stands, adds 3 mm.
    let sides = [(20, 14, 0.255), (20, 23, 0.215), (23, 20, 0.125), (17, 20, 0.125)];
    for (row, col, gap_m) in sides {
        let mut ground = level_ground(geometry);
        ground[Cell { row, col }] = SurfaceCell::certain(0.0, TerrainClass::Obstacle, 0.0);
        let blocked = |obstacle_margin_m: f64| {
            let map = prior_map(&CAR, &Assumption::Nominal { obstacle_margin_m }, &ground, 361);
            map.risk_map().view().risk(Cell { row: 20, col: 20 }, 180).is_blocked()
        };
        assert!(!blocked(gap_m - 0.005) && blocked(gap_m + 0.005), "{row} {col}");
    }
}

#[test]
fn the_nominal_map_is_full_traction_on_level_ground_whatever_the_ground() {
    let ground = rough(window(0.1, 40, 40), 5);
    let map = prior_map(&CAR, &NOMINAL, &ground, 13);
    let inside = |index: usize| {
        let cell = ground.geometry().cell(index / 13);
        (1..39).contains(&cell.row) && (1..39).contains(&cell.col)
    };
    let (mut n_free, mut n_blocked) = (0, 0);
    for (index, &risk) in map.risk_map().view().risks.iter().enumerate() {
        if !inside(index) {
            assert_eq!(risk, Risk::OUTSIDE);
            continue;
        }
        assert!([Risk::NONE, Risk::NONE.blocked(), Risk::NONE.touching()].contains(&risk));
        if risk.is_blocked() { n_blocked += 1 } else { n_free += 1 }
    }
    assert!(n_free > 1000 && n_blocked > 1000);
    assert!(map.belief(2.0, 2.0, 0.0).is_none());
}

#[test]
fn unknown_ground_can_be_approached_and_is_never_preferred() {
    let geometry = window(0.2, 60, 60);
    // Nothing is known east of x = 6.
    let ground = surface(geometry, |x, _| if x < 6.0 { open(0.0) } else { SurfaceCell::UNKNOWN });
    for at in [0.05, 0.2, 0.4, 0.6, 0.8, 1.0] {
        let map = prior_map(&TRUCK, &physics(at), &ground, 8);
        let view = map.risk_map().view();
        let risk_at = |x_m: f64| view.risk_at(x_m, 6.1, 0.1);
        let (known, frontier, unknown) = (risk_at(2.1), risk_at(4.7), risk_at(9.1));
        for risk in [frontier, unknown] {
            assert!(
                risk.roll_rad < 30f32.to_radians() && risk.pitch_rad < 30f32.to_radians(),
                "{at} {risk:?}"
            );
            assert!(risk.linear_traction > 0.06 && risk.angular_traction > 0.06, "{at} {risk:?}");
        }
        // At 0.05 the tail lies in the uniform share of equation 18, which is the same everywhere.
        assert!(known.linear_traction >= frontier.linear_traction - 1e-6, "{at}");
        assert!(frontier.linear_traction >= unknown.linear_traction - 1e-6, "{at}");
        if at > 0.05 {
            assert!(known.linear_traction > 1.2 * frontier.linear_traction, "{at}");
        }
        assert!(known.roll_rad < frontier.roll_rad && known.roll_rad < unknown.roll_rad);
    }
    // In the mean: 0.2 * 0.5 of the uniform share and 0.8 * 0.3 of unknown ground.
    let mean = prior_map(&TRUCK, &physics(1.0), &ground, 8).risk_map().view().risk_at(9.1, 6.1, 0.1);
    assert!((mean.linear_traction - 0.34).abs() < 1e-5);
}

#[test]
fn a_footprint_of_which_too_little_is_known_is_unknown_ground() {
    // Only the ground within 0.3 m of the four contacts is known, for the truck heading east from (2, 2).
    let contacts = [[4.4, 2.75], [2.0, 2.75], [2.0, 1.25], [4.4, 1.25]];
    let ground = surface(window(0.1, 60, 60), |x, y| {
        let near = contacts.iter().any(|[wheel_x, wheel_y]| (x - wheel_x).hypot(y - wheel_y) < 0.3);
        if near { open(0.0) } else { SurfaceCell::UNKNOWN }
    });
    let mean_traction = |unknown_share_max: f64| {
        let prior = PriorConfig { uniform_weight: 0.0, unknown_share_max, ..PriorConfig::default() };
        let map = prior_map(&TRUCK, &Assumption::Physics { prior, level: level(1.0) }, &ground, 4);
        map.belief(2.0, 2.0, 0.0).unwrap().linear.mean(&Bins::TRACTION)
    };
    assert!((mean_traction(0.5) - 0.3).abs() < 1e-6);
    assert!((mean_traction(1.0) - 1.0).abs() < 1e-6);
}

#[test]
fn beside_a_hole_heights_come_from_the_known_side() {
    let mut ground = surface(window(0.1, 40, 40), |_, _| open(50.0));
    ground[Cell { row: 20, col: 20 }] = SurfaceCell::UNKNOWN;
    let prior = PriorConfig { uniform_weight: 0.0, ..PriorConfig::default() };
    let map = prior_map(&CAR, &Assumption::Physics { prior, level: level(1.0) }, &ground, 4);
    for step in 0..400 {
        let (x_m, y_m) = (1.7 + 0.03 * (step % 20) as f64, 1.7 + 0.03 * (step / 20) as f64);
        let belief = map.belief(x_m, y_m, 0.1 * step as f64).unwrap();
        // Level where known, at most 25 degrees where not: nothing above the bin value 27.5.
        for pmf in [belief.roll, belief.pitch] {
            assert!(pmf.probabilities()[6..].iter().all(|p| *p < 1e-5), "{pmf:?}");
        }
    }
}

#[test]
fn holes_and_numbers_that_are_none_never_reach_the_map() {
    let mut ground = rough(window(0.1, 40, 40), 9);
    let poison = SurfaceCell {
        height_m: f32::NAN,
        height_variance_m2: f32::NAN,
        vegetation_height_m: f32::NAN,
        ..open(0.0)
    };
    for (i, value) in [(400, f32::NAN), (700, f32::INFINITY), (900, f32::NEG_INFINITY)] {
        ground.values_mut()[i] = SurfaceCell { height_m: value, ..poison };
        ground.values_mut()[i + 60] = SurfaceCell { height_variance_m2: value, ..open(0.0) };
        ground.values_mut()[i + 120] = SurfaceCell { vegetation_height_m: value, ..open(0.0) };
        ground.values_mut()[i + 180] = SurfaceCell { class_probability: [value; 4], ..open(0.0) };
    }
    let map = prior_map(&CAR, &physics(0.4), &ground, 13);
    let view = map.risk_map().view();
    for risk in view.risks {
        assert!((0.0..=1.0).contains(&risk.linear_traction) && (0.0..=1.0).contains(&risk.angular_traction));
        // Ground that touches an obstacle, a whole turn more, may stand upright.
        let angles = 0.0..=7.9;
        assert!(angles.contains(&risk.roll_rad) && angles.contains(&risk.pitch_rad));
    }
    assert!(view.ground.iter().all(|ground| ground.gradient.iter().all(|g| g.is_finite())));
    assert!(view.ground[400].flags.contains(GroundFlags::UNKNOWN));
}

#[test]
fn the_ground_carries_gradient_class_and_flags() {
    let fine = window(0.1, 40, 40);
    let mut ground = surface(fine, |x, y| SurfaceCell {
        class_probability: if y < 2.0 { [0.3, 0.7, 0.0, 0.0] } else { [0.2, 0.2, 0.6, 0.0] },
        ..open(0.25 * x - 0.125 * y)
    });
    ground[Cell { row: 10, col: 11 }] = SurfaceCell::certain(0.0, TerrainClass::Obstacle, 0.0);
    for (row, col) in [(20, 20), (20, 21), (21, 20), (30, 30)] {
        ground[Cell { row, col }] = SurfaceCell::UNKNOWN;
    }
    let coarse = GridGeometry { resolution_m: 0.2, origin: [0, 0], n_rows: 20, n_cols: 20 };
    let mut map = PriorMap::new(&CAR, &physics(0.4), 0.1, coarse, 4, Instructions::widest()).unwrap();
    map.update_all(&ground).unwrap();
    let at = |row, col| map.risk_map().view().ground[coarse.index(Cell { row, col })];
    assert!((at(4, 13).gradient[0] - 0.25).abs() < 1e-5 && (at(4, 13).gradient[1] + 0.125).abs() < 1e-5);
    assert_eq!(at(4, 13).class, TerrainClass::Loose as u8);
    assert_eq!(at(15, 4).class, TerrainClass::Vegetation as u8);
    assert!(at(5, 5).flags.contains(GroundFlags::OBSTACLE));
    assert_eq!(at(10, 10).flags, GroundFlags::UNKNOWN);
    assert_eq!(at(15, 15).flags, GroundFlags::default());
}

#[test]
fn the_map_does_not_depend_on_the_number_of_threads() {
    let ground = rough(window(0.1, 40, 40), 21);
    let in_pool = |n_threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(n_threads).build().unwrap();
        pool.install(|| prior_map(&CAR, &physics(0.4), &ground, 13).risk_map().clone())
    };
    let one = in_pool(1);
    for n_threads in [2, 3, 7] {
        assert_eq!(one, in_pool(n_threads));
    }
}

#[test]
fn a_moved_window_and_a_new_level_are_taken_over_whole() {
    let ground = rough(window(0.1, 60, 60), 2);
    let risk = GridGeometry { resolution_m: 0.1, origin: [0, 0], n_rows: 20, n_cols: 20 };
    let mut map = PriorMap::new(&CAR, &physics(0.4), 0.1, risk, 5, Instructions::widest()).unwrap();
    map.update_all(&ground).unwrap();
    let fresh = |at: f64, origin: [i64; 2]| {
        let risk = GridGeometry { origin, ..risk };
        let mut map = PriorMap::new(&CAR, &physics(at), 0.1, risk, 5, Instructions::widest()).unwrap();
        map.update_all(&ground).unwrap();
        map
    };
    map.place_at([25, 30]);
    map.update(&ground).unwrap();
    assert_eq!(map.risk_map(), fresh(0.4, [25, 30]).risk_map());
    map.set_level(level(0.8));
    map.update(&ground).unwrap();
    assert_eq!(map.risk_map(), fresh(0.8, [25, 30]).risk_map());
    // Far from the surface everything is unknown, and nothing panics.
    map.place_at([-100_000, 7_000_000]);
    map.update_all(&ground).unwrap();
    assert!(map.risk_map().view().ground.iter().all(|ground| ground.flags == GroundFlags::UNKNOWN));
}

#[test]
fn what_cannot_be_mapped_is_refused() {
    let geometry = window(0.1, 10, 10);
    let new = |assumption: &Assumption, surface_m: f64, n_yaws: usize| {
        PriorMap::new(&CAR, assumption, surface_m, geometry, n_yaws, Instructions::widest()).map(|_| ())
    };
    assert_eq!(new(&physics(0.4), 0.1, 0), Err(PriorMapError::NoYaws));
    assert_eq!(new(&physics(0.4), 0.0, 4), Err(PriorMapError::Resolution { surface_m: 0.0, risk_m: 0.1 }));
    assert!(new(&physics(0.4), 0.1 * PI, 4).is_err());
    let prior = PriorConfig { evidence: -1.0, ..PriorConfig::default() };
    let found = new(&Assumption::Physics { prior, level: level(0.4) }, 0.1, 4);
    assert!(matches!(found, Err(PriorMapError::Config(SettingError { field: "evidence", .. }))));
    let mut map = PriorMap::new(&CAR, &physics(0.4), 0.1, geometry, 4, Instructions::widest()).unwrap();
    let error = map.update_all(&level_ground(window(0.2, 10, 10))).unwrap_err();
    assert_eq!(error.to_string(), "resolution of the surface: expected 0.1 m, found 0.2 m");
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]
    #[test]
    fn a_partial_update_is_bit_equal_to_a_full_one(
        seed in 0..1000u64,
        rows in (0..40usize, 1..12usize),
        cols in (0..40usize, 1..12usize),
        resolution_m in prop::sample::select(vec![0.1, 0.2, 0.05]),
    ) {
        let geometry = window(0.1, 40, 40);
        let before = rough(geometry, seed);
        let other = rough(geometry, seed + 1000);
        let changed =
            CellRegion { rows: rows.0..(rows.0 + rows.1).min(40), cols: cols.0..(cols.0 + cols.1).min(40) };
        let mut after = before.clone();
        for row in changed.rows.clone() {
            for col in changed.cols.clone() {
                after[Cell { row, col }] = other[Cell { row, col }];
            }
        }
        let risk = GridGeometry { resolution_m, origin: [2, 4], n_rows: 30, n_cols: 24 };
        let mut partial = PriorMap::new(&CAR, &physics(0.4), 0.1, risk, 5, Instructions::widest()).unwrap();
        partial.update_all(&before).unwrap();
        partial.update(&after).unwrap();
        let mut full = PriorMap::new(&CAR, &physics(0.4), 0.1, risk, 5, Instructions::widest()).unwrap();
        full.update_all(&after).unwrap();
        prop_assert_eq!(partial.risk_map(), full.risk_map());
        // Later partial updates build on what the first one left.
        partial.update(&before).unwrap();
        full.update_all(&before).unwrap();
        prop_assert_eq!(partial.risk_map(), full.risk_map());
    }
}

/// What others mix with the prior is what the prior's own map is made of.
#[test]
fn a_pose_prior_has_the_risk_of_the_map() {
    let geometry = window(0.1, 30, 34);
    let ground = rough(geometry, 21);
    let assumption = physics(0.3);
    let map = prior_map(&CAR, &assumption, &ground, 5);
    let mut field = PriorField::new(&CAR, &assumption, 0.1, geometry, 5, Instructions::widest()).unwrap();
    field.read_all(&ground).unwrap();
    let mut block = BlockPrior::default();
    let mut n_unknown = 0;
    for (row, yaw) in (1..29).flat_map(|row| (0..5).map(move |yaw| (row, yaw))) {
        // Two lines of a block, neither of whole spans.
        let [first, second] = [1, 22].map(|col| PoseLine { cell: [col, row], yaw, n_lanes: 21 });
        field.read_line(&first, 0, &mut block);
        field.read_line(&PoseLine { n_lanes: 11, ..second }, 21, &mut block);
        for lane in 0..32 {
            let found = map.risk_map().view().risk(Cell { row: row as usize, col: 1 + lane }, yaw);
            let moments = block.moments.each_ref().map(|moments| moments.each_ref().map(|bin| bin.0[lane]));
            let free = PartialMoments { moments }.risk(level(0.3));
            let is_blocked = block.obstruction.0[lane] > 0.0;
            assert_eq!(is_blocked, found.is_blocked());
            let expected = block.obstructed(lane, free);
            assert!(close(found, expected, 1e-5), "{row} {lane} {yaw} {found:?} {expected:?}");
            n_unknown += usize::from(block.unknown.0[lane] > 0.0);
        }
    }
    assert!(0 < n_unknown && n_unknown < 28 * 32 * 5 / 2, "{n_unknown}");
}
