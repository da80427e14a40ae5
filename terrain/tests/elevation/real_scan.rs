//! One real 64-beam scan on grassland with trees and bushes: what must be true of its map, whatever the terrain was.

use ndarray::Array2;
use ndarray_npy::NpzReader;
use std::fs::File;
use terrain::{
    Cell, ElevationConfig, ElevationMap, FuseReport, Knowledge, Pose, RangePoint, Scan, SurfaceCell,
    TerrainClass, height_at, slope_at,
};

/// Returns of the robot's own body end here; the ground begins at 3 m.
const OWN_BODY_M: f64 = 2.2;

/// The points, in the sensor frame: z up, the sensor 1.2 to 1.5 m above the ground.
fn real_points() -> Vec<[f32; 3]> {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../shared/data/terrain/rellis_scan.npz");
    let mut archive = NpzReader::new(File::open(path).unwrap()).unwrap();
    let xyz: Array2<f32> = archive.by_name("xyz").unwrap();
    xyz.rows().into_iter().map(|row| [row[0], row[1], row[2]]).collect()
}

fn scan_of(points: &[[f32; 3]]) -> Scan {
    let open = |&position_m: &[f32; 3]| RangePoint { position_m, class: TerrainClass::Open };
    Scan { valid_at_ns: 0, origin_m: [0.0; 3], points: points.iter().map(open).collect() }
}

/// The map of the scan fused `n_times`, one by one.
fn real_map(points: &[[f32; 3]], n_times: usize) -> (ElevationMap, FuseReport) {
    let config =
        ElevationConfig { own_body_m: OWN_BODY_M, publish_step_m: 0.0, ..ElevationConfig::default() };
    let mut map = ElevationMap::new(config).unwrap();
    let mut report = FuseReport::default();
    for _ in 0..n_times {
        report = map.fuse(&scan_of(points), &Pose::default()).unwrap();
    }
    (map, report)
}

/// Cells whose centre is so far from the sensor.
fn cells_between(map: &ElevationMap, near_m: f64, far_m: f64) -> Vec<(Cell, SurfaceCell)> {
    let geometry = *map.surface().geometry();
    (0..geometry.n_cells())
        .map(|index| geometry.cell(index))
        .filter(|&cell| {
            let [x_m, y_m] = geometry.centre_m(cell);
            (near_m..far_m).contains(&x_m.hypot(y_m))
        })
        .map(|cell| (cell, map.surface()[cell]))
        .collect()
}

fn share_of(cells: &[(Cell, SurfaceCell)], is_so: impl Fn(&SurfaceCell) -> bool) -> f64 {
    cells.iter().filter(|(_, cell)| is_so(cell)).count() as f64 / cells.len() as f64
}

/// The value that a share of all values lies below.
fn quantile(mut values: Vec<f32>, share: f64) -> f32 {
    values.sort_by(f32::total_cmp);
    values[((values.len() - 1) as f64 * share) as usize]
}

#[test]
#[ignore = "needs the shared data"]
fn every_point_is_accounted_for() {
    let points = real_points();
    let (_, report) = real_map(&points, 1);
    let own = points.iter().filter(|[x, y, z]| f64::from(x.hypot(*y).hypot(*z)) < OWN_BODY_M).count();
    let outside = points.iter().filter(|[x, y, _]| x.abs().max(y.abs()) >= 20.0).count();
    assert_eq!((report.n_points, report.n_rejected_non_finite), (77_708, 0));
    assert!(report.n_own_body.abs_diff(own) < 10 && own > 10_000, "{report:?}, {own}");
    assert!(report.n_out_of_window.abs_diff(outside) < 10, "{report:?}, {outside}");
}

#[test]
#[ignore = "needs the shared data"]
fn the_ground_near_the_sensor_lies_below_it_and_is_gentle() {
    let (map, _) = real_map(&real_points(), 1);
    let near = cells_between(&map, 3.0, 6.0);
    let heights: Vec<f32> = near.iter().filter(|(_, c)| c.is_known()).map(|(_, c)| c.height_m).collect();
    let median_m = quantile(heights, 0.5);
    assert!((-1.5..-1.2).contains(&median_m), "{median_m}");
    let slopes: Vec<f32> = (near.iter().map(|&(cell, _)| slope_at(map.surface(), cell, 2).angle_rad()))
        .filter(|angle_rad| !angle_rad.is_nan())
        .collect();
    assert!(quantile(slopes.clone(), 0.5).to_degrees() < 5.0);
    assert!(quantile(slopes, 0.75).to_degrees() < 12.0);
}

#[test]
#[ignore = "needs the shared data"]
fn near_ground_is_known_the_blind_zone_is_not_and_knowledge_thins_out_with_range() {
    let (map, _) = real_map(&real_points(), 1);
    assert_eq!(share_of(&cells_between(&map, 0.0, 2.0), SurfaceCell::is_known), 0.0);
    let known = [(4.0, 8.0), (8.0, 12.0), (12.0, 19.0)]
        .map(|(near_m, far_m)| share_of(&cells_between(&map, near_m, far_m), SurfaceCell::is_known));
    assert!(known[0] > 0.75 && known[0] > known[1] && known[1] > known[2] && known[2] > 0.1, "{known:?}");
}

#[test]
#[ignore = "needs the shared data"]
fn nothing_is_made_up_in_the_shadow_of_trees_and_bushes() {
    let points = real_points();
    let (map, _) = real_map(&points, 1);
    // The farthest return of each degree of azimuth: beyond it, nothing was seen.
    let degree = |x: f64, y: f64| (y.atan2(x).to_degrees().rem_euclid(360.0)) as usize % 360;
    let mut farthest_m = [0.0_f64; 360];
    for [x, y, _] in &points {
        let (x, y) = (f64::from(*x), f64::from(*y));
        let degree = degree(x, y);
        farthest_m[degree] = farthest_m[degree].max(x.hypot(y));
    }
    let shadow: Vec<(Cell, SurfaceCell)> = (cells_between(&map, 5.0, 19.0).into_iter())
        .filter(|&(cell, _)| {
            let [x_m, y_m] = map.surface().geometry().centre_m(cell);
            let around = (degree(x_m, y_m) + 357..=degree(x_m, y_m) + 363).map(|d| farthest_m[d % 360]);
            x_m.hypot(y_m) > around.fold(0.0, f64::max) + 0.3
        })
        .collect();
    assert!(shadow.len() > 500, "{}", shadow.len());
    assert_eq!(share_of(&shadow, |cell| cell.knowledge == Knowledge::Measured), 0.0);
    assert!(share_of(&shadow, SurfaceCell::is_known) < 0.01);
}

#[test]
#[ignore = "needs the shared data"]
fn the_points_lie_close_to_the_map_they_made() {
    let points = real_points();
    let (map, _) = real_map(&points, 1);
    let residuals = |near_m: f32, far_m: f32| -> Vec<f32> {
        (points.iter().filter(|[x, y, _]| (near_m..far_m).contains(&x.hypot(*y))))
            .map(|[x, y, z]| (z - height_at(map.surface(), f64::from(*x), f64::from(*y))).abs())
            .filter(|residual_m| !residual_m.is_nan())
            .collect()
    };
    // Within a cell of 20 cm, grass and branches spread; on bare ground next to nothing does.
    assert!(quantile(residuals(3.0, 5.0), 0.9) < 0.05);
    assert!(quantile(residuals(3.0, 20.0), 0.5) < 0.03);
    assert!(quantile(residuals(3.0, 20.0), 0.75) < 0.1);
}

#[test]
#[ignore = "needs the shared data"]
fn trees_are_obstacles_though_nobody_named_them() {
    let (map, _) = real_map(&real_points(), 1);
    let is_obstacle = |cell: &SurfaceCell| cell.class() == TerrainClass::Obstacle;
    assert!(share_of(&cells_between(&map, 4.0, 20.0), is_obstacle) > 0.005);
    // Ahead lies open grassland.
    let ahead: Vec<_> = (cells_between(&map, 3.0, 12.0).into_iter())
        .filter(|&(cell, _)| {
            let [x_m, y_m] = map.surface().geometry().centre_m(cell);
            x_m > y_m.abs()
        })
        .collect();
    let (obstacles, known) = (share_of(&ahead, is_obstacle), share_of(&ahead, SurfaceCell::is_known));
    assert!(obstacles < 0.03 && known > 0.4, "{obstacles} obstacles, {known} known");
}

#[test]
#[ignore = "needs the shared data"]
fn the_same_scan_again_confirms_the_map() {
    let points = real_points();
    let ((once, _), (often, _)) = (real_map(&points, 1), real_map(&points, 10));
    let measured = |map: &ElevationMap| {
        map.surface().values().iter().filter(|c| c.knowledge == Knowledge::Measured).count()
    };
    let ratio = measured(&often) as f64 / measured(&once) as f64;
    assert!((0.98..=1.02).contains(&ratio), "{ratio}: rays must not wear away what they hit");
    let moved: Vec<f32> = (once.surface().values().iter().zip(often.surface().values()))
        .map(|(a, b)| (a.height_m - b.height_m).abs())
        .filter(|moved_m| !moved_m.is_nan())
        .collect();
    assert!(quantile(moved, 0.98) < 0.01);
}

#[test]
#[ignore = "needs the shared data"]
fn broken_points_among_good_ones_change_nothing_else() {
    let points = real_points();
    let mut broken = points.clone();
    for index in (0..broken.len()).step_by(10) {
        broken.insert(index, [f32::NAN, 1.0, f32::INFINITY]);
    }
    let ((good, _), (bad, report)) = (real_map(&points, 1), real_map(&broken, 1));
    assert_eq!(report.n_rejected_non_finite, points.len().div_ceil(10));
    for (a, b) in good.surface().values().iter().zip(bad.surface().values()) {
        assert_eq!((a.height_m.to_bits(), a.knowledge), (b.height_m.to_bits(), b.knowledge));
    }
}
