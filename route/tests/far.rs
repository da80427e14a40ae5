//! Routes over maps in tiles.

#![allow(clippy::unwrap_used, reason = "a panic is how a test fails")]

use route::{FrictionCurve, GroundCell, MeasuredCell, Planner, RouteConfig, SpeedLimits, TileMap, far_route};
use terrain::{Cell, GridGeometry, GridMap};

const RESOLUTION_M: f64 = 0.5;

/// Rolling ground with a lake across the way, 600 x 600 m, in tiles of a folder.
fn lakeside(folder: &std::path::Path) -> TileMap {
    let mut map = TileMap::open(folder, RESOLUTION_M, 16 << 20).unwrap();
    for (east, north) in (0..6).flat_map(|east| (0..6).map(move |north| (east, north))) {
        let geometry = GridGeometry {
            resolution_m: RESOLUTION_M,
            origin: [200 * east, 200 * north],
            n_rows: 200,
            n_cols: 200,
        };
        let cell = |index: usize| {
            let [x_m, y_m] = geometry.centre_m(geometry.cell(index));
            let height_m = 4.0 * ((x_m / 60.0).sin() + (y_m / 80.0).cos());
            let is_obstacle = ((x_m - 300.0) / 60.0).powi(2) + ((y_m - 280.0) / 140.0).powi(2) < 1.0;
            let ground = GroundCell {
                height_m: height_m as f32,
                is_obstacle,
                ..GroundCell::level(FrictionCurve::GRASS)
            };
            MeasuredCell { ground, deviation_m: 0.05 }
        };
        let values = (0..geometry.n_cells()).map(cell).collect();
        map.merge(&GridMap::from_values(geometry, values).unwrap()).unwrap();
    }
    map
}

#[test]
fn a_far_route_is_hardly_dearer_than_one_over_the_whole_map_at_once() {
    let folder = tempfile::tempdir().unwrap();
    let mut map = lakeside(folder.path());
    let (config, limits) = (RouteConfig::default(), SpeedLimits::default());
    let (start, goal_m) = (([60.2, 250.2], 0.0), [540.2, 300.2]);
    let far = far_route(&mut map, 1, &config, start, goal_m, &limits).unwrap();
    assert!(far.n_legs >= 4, "{}", far.n_legs);
    let geometry = GridGeometry { resolution_m: 1.0, origin: [0, 0], n_rows: 600, n_cols: 600 };
    let whole = map.window(1, &geometry).unwrap();
    let at_once = Planner::new(whole.clone(), config).unwrap().route(start, goal_m, &limits).unwrap();
    assert!(
        far.line.duration_s < 1.1 * at_once.line.duration_s,
        "{} {}",
        far.line.duration_s,
        at_once.line.duration_s
    );
    for (point, expected_m) in
        [(far.line.points[0], start.0), (far.line.points[far.line.points.len() - 1], goal_m)]
    {
        assert!((0..2).all(|axis| (point.at_m[axis] - expected_m[axis]).abs() < 1e-9), "{point:?}");
        assert!(point.speed_mps.abs() < 1e-9);
    }
    for ends in far.line.points.windows(2) {
        let gap_m = (ends[1].at_m[0] - ends[0].at_m[0]).hypot(ends[1].at_m[1] - ends[0].at_m[1]);
        assert!((gap_m - far.line.spacing_m).abs() < 0.02, "{gap_m}");
        let Cell { row, col } = geometry.cell_at(ends[0].at_m[0], ends[0].at_m[1]).unwrap();
        assert!(!whole[Cell { row, col }].is_obstacle, "{:?}", ends[0]);
    }
}

#[test]
fn a_goal_beyond_what_is_known_is_told_with_its_place() {
    let folder = tempfile::tempdir().unwrap();
    let mut map = lakeside(folder.path());
    let refused = |map: &mut TileMap, goal_m: [f64; 2]| {
        let start = ([60.2, 250.2], 0.0);
        far_route(map, 1, &RouteConfig::default(), start, goal_m, &SpeedLimits::default())
            .unwrap_err()
            .to_string()
    };
    assert_eq!(refused(&mut map, [700.0, 300.0]), "goal at (700.0, 300.0) m: nothing is known of the ground");
    for far_m in [1e12, f64::INFINITY, f64::NAN] {
        assert!(
            refused(&mut map, [far_m, 300.0]).starts_with("goal: expected a point of the map, found ("),
            "{far_m}"
        );
    }
    assert_eq!(refused(&mut map, [300.0, 280.0]), "goal at (300.0, 280.0) m: an obstacle stands in the way");
}

/// Posts a metre apart across a strip of 60 m, but for a gap from 10 to 20 m north: cells of a metre and more show no
/// posts, so that the way over them leads straight on at 30 m north, and only the last search meets them.
#[test]
fn small_cells_find_the_gap_in_what_large_ones_do_not_show() {
    let folder = tempfile::tempdir().unwrap();
    let mut map = TileMap::open(folder.path(), RESOLUTION_M, 64 << 20).unwrap();
    let geometry = GridGeometry { resolution_m: RESOLUTION_M, origin: [0, 0], n_rows: 120, n_cols: 8000 };
    let cell = |index: usize| {
        let Cell { row, col } = geometry.cell(index);
        let is_obstacle = col == 4000 && row % 2 == 0 && !(20..40).contains(&row);
        let ground = GroundCell { is_obstacle, ..GroundCell::level(FrictionCurve::GRASS) };
        MeasuredCell { ground, deviation_m: 0.05 }
    };
    let values = (0..geometry.n_cells()).map(cell).collect();
    map.merge(&GridMap::from_values(geometry, values).unwrap()).unwrap();
    let (config, limits) = (RouteConfig::default(), SpeedLimits::default());
    let far = far_route(&mut map, 0, &config, ([200.2, 30.2], 0.0), [3800.2, 30.2], &limits).unwrap();
    let crossing = far.line.points.iter().find(|point| point.at_m[0] >= 2000.0).unwrap();
    assert!((10.0..20.0).contains(&crossing.at_m[1]), "{crossing:?}");
    assert!((3600.0..3625.0).contains(&far.line.length_m()), "{}", far.line.length_m());
    // 36 legs of 100 m, and 90 of 40 m along them.
    assert!((110..140).contains(&far.n_legs), "{}", far.n_legs);
}
