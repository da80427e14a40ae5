//! What a ranging sensor cannot see stays unknown, and what its rays refute goes: shadows, ditches, drops, ghosts.

use crate::lidar::{Lidar, pose_at};
use crate::points::plain_map;
use terrain::TerrainClass::{Obstacle, Open};
use terrain::{
    Cell, ElevationConfig, ElevationMap, Knowledge, Pose, RangePoint, Scan, SurfaceCell, TerrainClass,
};

const NOISE_M: f64 = 0.01;
/// Time between scans.
const PERIOD_NS: u64 = 100_000_000;

fn map() -> ElevationMap {
    ElevationMap::new(ElevationConfig { n_rows: 120, n_cols: 120, ..ElevationConfig::default() }).unwrap()
}

/// Fuses `n_scans` scans of a world seen from one place.
fn watch(
    map: &mut ElevationMap,
    lidar: &mut Lidar,
    pose: &Pose,
    n_scans: u64,
    world: (impl Fn(f64, f64) -> f64, impl Fn(f64, f64, f64) -> TerrainClass),
) {
    for i in 0..n_scans {
        let scan = lidar.scan(pose, i * PERIOD_NS, &world.0, &world.1);
        map.fuse(&scan, pose).unwrap();
    }
}

/// Cells whose centres satisfy a condition.
fn cells_where(map: &ElevationMap, inside: impl Fn(f64, f64) -> bool) -> Vec<(Cell, SurfaceCell)> {
    let geometry = *map.surface().geometry();
    (0..geometry.n_cells())
        .map(|index| geometry.cell(index))
        .filter(|&cell| {
            let [x_m, y_m] = geometry.centre_m(cell);
            inside(x_m, y_m)
        })
        .map(|cell| (cell, map.surface()[cell]))
        .collect()
}

fn share_of(cells: &[(Cell, SurfaceCell)], is_so: impl Fn(&SurfaceCell) -> bool) -> f64 {
    cells.iter().filter(|(_, cell)| is_so(cell)).count() as f64 / cells.len() as f64
}

#[test]
fn rolling_ground_is_mapped_with_errors_that_its_variance_covers() {
    let height_m = |x: f64, y: f64| 0.4 * (0.5 * x).sin() * (0.4 * y).cos();
    let (mut map, mut lidar) = (map(), Lidar::new(360, NOISE_M));
    for i in 0..15 {
        let x_m = 0.3 * f64::from(i);
        let pose = Pose { z_m: height_m(x_m, 0.0), ..pose_at(x_m, 0.0) };
        let scan = lidar.scan(&pose, i as u64 * PERIOD_NS, height_m, |_, _, _| Open);
        map.fuse(&scan, &pose).unwrap();
    }
    for (knowledge, rms_limit_m) in [(Knowledge::Measured, 0.015), (Knowledge::Interpolated, 0.05)] {
        let cells = cells_where(&map, |_, _| true);
        let errors: Vec<(f64, f64)> = (cells.iter().filter(|(_, cell)| cell.knowledge == knowledge))
            .map(|(cell, seen)| {
                let [x_m, y_m] = map.surface().geometry().centre_m(*cell);
                (f64::from(seen.height_m) - height_m(x_m, y_m), f64::from(seen.height_variance_m2))
            })
            .collect();
        let n = errors.len() as f64;
        let rms_m = (errors.iter().map(|(error_m, _)| error_m * error_m).sum::<f64>() / n).sqrt();
        let far_off = errors.iter().filter(|(error_m, m2)| error_m * error_m > 9.0 * m2).count() as f64 / n;
        assert!(n > 500.0 && rms_m < rms_limit_m, "{knowledge:?}: {n} cells, {rms_m} m");
        assert!(far_off < 0.02, "{knowledge:?}: {far_off} beyond three standard deviations");
    }
}

#[test]
fn rings_of_a_spinning_sensor_close_but_its_blind_zone_stays_a_hole() {
    let (mut map, mut lidar) = (map(), Lidar::new(360, NOISE_M));
    watch(&mut map, &mut lidar, &pose_at(0.0, 0.0), 3, (|x, y| 0.1 * x - 0.05 * y, |_, _, _| Open));
    // The lowest ray meets level ground at 1.5 m / tan 30 deg = 2.6 m.
    let blind = cells_where(&map, |x, y| x.hypot(y) < 1.5);
    assert_eq!(share_of(&blind, |cell| cell.is_known()), 0.0);
    let ring = cells_where(&map, |x, y| (3.5..7.0).contains(&x.hypot(y)));
    assert!(share_of(&ring, |cell| cell.is_known()) > 0.97);
    for (cell, seen) in ring.iter().filter(|(_, cell)| cell.knowledge == Knowledge::Interpolated) {
        let [x_m, y_m] = map.surface().geometry().centre_m(*cell);
        assert!((f64::from(seen.height_m) - 0.1 * x_m + 0.05 * y_m).abs() < 0.04, "{seen:?}");
    }
}

#[test]
fn what_lies_behind_a_wall_is_unknown() {
    let wall = |x: f64, y: f64| if (4.0..4.6).contains(&x) && y.abs() < 2.0 { 2.5 } else { 0.0 };
    let class = |_, _, z: f64| if z > 0.02 { Obstacle } else { Open };
    let (mut map, mut lidar) = (map(), Lidar::new(360, NOISE_M));
    watch(&mut map, &mut lidar, &pose_at(0.0, 0.0), 5, (wall, class));
    // The shadow of the wall's inner part; cells are 0.2 m, gaps close over 0.5 m.
    let shadow = cells_where(&map, |x, y| (5.3..10.0).contains(&x) && (y / x).abs() < 0.3);
    assert!(shadow.len() > 200 && share_of(&shadow, |cell| !cell.is_known()) == 1.0);
    let face = cells_where(&map, |x, y| (4.0..4.2).contains(&x) && y.abs() < 1.8);
    assert!(share_of(&face, |cell| cell.class() == Obstacle) > 0.95);
}

#[test]
fn a_drop_behind_an_edge_is_unknown_or_lower_but_never_flat() {
    let cliff = |x: f64, _: f64| if x > 5.0 { -3.0 } else { 0.0 };
    let (mut map, mut lidar) = (map(), Lidar::new(360, NOISE_M));
    watch(&mut map, &mut lidar, &pose_at(0.0, 0.0), 5, (cliff, |_, _, _| Open));
    let beyond = cells_where(&map, |x, y| x > 5.1 && y.abs() < x);
    assert_eq!(share_of(&beyond, |cell| cell.is_known() && cell.height_m > -0.3), 0.0);
    let before = cells_where(&map, |x, y| (3.0..4.8).contains(&x) && y.abs() < 2.0);
    assert!(share_of(&before, |cell| cell.is_known() && cell.height_m.abs() < 0.05) > 0.97);
}

/// A ditch across the way, 0.8 m wide and 0.6 m deep, seen from the given distances one after the other: shares
/// of its inner cells that are unknown or at least 5 cm low, and that pass for flat ground.
fn ditch_seen_from(distances_m: &[f64]) -> (f64, f64) {
    let ditch = move |x: f64, _: f64| if (0.0..0.8).contains(&x) { -0.6 } else { 0.0 };
    let (mut map, mut lidar) = (map(), Lidar::new(180, NOISE_M));
    for distance_m in distances_m {
        watch(&mut map, &mut lidar, &pose_at(-distance_m, 0.0), 2, (ditch, |_, _, _| Open));
    }
    let inner = cells_where(&map, |x, y| (0.2..0.6).contains(&x) && y.abs() < 2.0);
    let careful = share_of(&inner, |cell| !cell.is_known() || cell.height_m < -0.05);
    (careful, share_of(&inner, |cell| cell.is_known() && cell.height_m > -0.03))
}

#[test]
fn a_ditch_is_unknown_or_lower_once_rays_can_tell() {
    // At 7 m, a ray over the near edge has sunk by 1.5 m / 7 m x 0.4 m = 9 cm in the ditch's middle, and rays are
    // 36 cm apart.
    assert!(ditch_seen_from(&[7.0; 4]).1 < 0.2);
    let closer: [&[f64]; 3] = [&[5.0; 4], &[3.5; 4], &[9.0, 8.0, 7.0, 6.0, 5.0, 4.0]];
    for distances_m in closer {
        let (careful, flat) = ditch_seen_from(distances_m);
        assert!(careful >= 0.9 && flat == 0.0, "{distances_m:?}: careful {careful}, flat {flat}");
    }
}

/// The map of flat ground on which something stood for ten scans and then was gone for `n_after`.
fn after_a_ghost(class_of_ghost: TerrainClass, n_after: u64) -> ElevationMap {
    let stands = |x: f64, y: f64| (x - 4.0).abs() < 0.3 && y.abs() < 0.3;
    let ghost = move |x, y| if stands(x, y) { 1.2 } else { 0.0 };
    let class = move |_, _, z: f64| if z > 0.02 { class_of_ghost } else { Open };
    let (mut map, mut lidar) = (map(), Lidar::new(360, NOISE_M));
    watch(&mut map, &mut lidar, &pose_at(0.0, 0.0), 10, (ghost, class));
    let seen = cells_where(&map, stands);
    let tall = |cell: &SurfaceCell| cell.class() == Obstacle || cell.height_m > 0.5;
    assert!(share_of(&seen, tall) > 0.3, "the ghost was there");
    watch(&mut map, &mut lidar, &pose_at(0.0, 0.0), n_after, (|_, _| 0.0, |_, _, _| Open));
    map
}

#[test]
fn what_has_left_leaves_the_map_within_two_seconds() {
    for class in [Obstacle, Open] {
        let map = after_a_ghost(class, 20);
        let there = cells_where(&map, |x, y| (x - 4.0).abs() < 0.5 && y.abs() < 0.5);
        let gone = |cell: &SurfaceCell| cell.class() != Obstacle && (!cell.is_known() || cell.height_m < 0.1);
        assert_eq!(share_of(&there, gone), 1.0, "{class:?}: {there:?}");
        assert!(share_of(&there, |cell| cell.is_known() && cell.height_m.abs() < 0.1) > 0.9, "{class:?}");
    }
}

/// What a map holds at (3.25, 0.25), where `points` were seen once, after `n_scans` whose rays pass there at
/// 0.84 m above the ground, from 1.5 m at the origin to the ground at (7.25, 0.25), and hit nothing there.
fn after_passing_rays(points: &[[f32; 3]], class: TerrainClass, n_scans: usize) -> SurfaceCell {
    let mut map = plain_map(|config| config.gap_radius_m = 0.0);
    let scan = |points: &[[f32; 3]], class| Scan {
        valid_at_ns: 0,
        origin_m: [0.25, 0.25, 1.5],
        points: points.iter().map(|&position_m| RangePoint { position_m, class }).collect(),
    };
    map.fuse(&scan(points, class), &Pose::default()).unwrap();
    for _ in 0..n_scans {
        map.fuse(&scan(&[[7.25, 0.25, 0.0]], Open), &Pose::default()).unwrap();
    }
    *map.surface().at(3.25, 0.25).unwrap()
}

#[test]
fn two_scans_whose_rays_pass_below_a_height_refute_it() {
    let ghost = [[3.25, 0.25, 1.3]; 5];
    assert!((after_passing_rays(&ghost, Open, 1).height_m - 1.3).abs() < 1e-6);
    assert!(!after_passing_rays(&ghost, Open, 2).is_known());
    // A ray above a height says nothing against it, nor does one just below it.
    assert!((after_passing_rays(&[[3.25, 0.25, 1.0]; 5], Open, 50).height_m - 1.0).abs() < 1e-6);
    assert!((after_passing_rays(&[[3.25, 0.25, 0.7]; 5], Open, 50).height_m - 0.7).abs() < 1e-6);
}

#[test]
fn a_gap_stays_a_hole_when_a_ray_passes_deep_below_its_rim() {
    for (end_m, is_filled) in [([3.75, 0.25, 0.0], true), ([7.25, 0.25, -3.0], false)] {
        let mut points = vec![end_m];
        for (dx, dy) in (-1..=1).flat_map(|i| (-1..=1).map(move |j| (i, j))).filter(|place| *place != (0, 0))
        {
            points.push([3.25 + 0.5 * dx as f32, 0.25 + 0.5 * dy as f32, 0.0]);
        }
        let points = points.iter().map(|&position_m| RangePoint { position_m, class: Open }).collect();
        let mut map = plain_map(|_| {});
        // The deep ray passes the gap at 1.5 m - 3 m x 4.5 / 7 = -0.43 m.
        let scan = Scan { valid_at_ns: 0, origin_m: [0.25, 0.25, 1.5], points };
        map.fuse(&scan, &Pose::default()).unwrap();
        let gap = map.surface().at(3.25, 0.25).unwrap();
        assert_eq!(gap.knowledge == Knowledge::Interpolated, is_filled, "{gap:?}");
        assert!(!is_filled || gap.height_m.abs() < 1e-6);
    }
}

#[test]
fn rays_wear_an_obstacle_away_step_by_step() {
    let post: Vec<[f32; 3]> = (0..12).map(|i| [3.25, 0.25, 0.1 * i as f32]).collect();
    let class_after = |n_scans| after_passing_rays(&post, Obstacle, n_scans).class();
    assert_eq!((class_after(1), class_after(3)), (Obstacle, Obstacle));
    assert_eq!(class_after(10), Open);
    let low: Vec<[f32; 3]> = (0..12).map(|i| [3.25, 0.25, 0.05 * i as f32]).collect();
    assert_eq!(after_passing_rays(&low, Obstacle, 50).class(), Obstacle);
}

#[test]
fn what_stands_still_stays_even_when_thin() {
    // A trunk of 12 cm, 5 m away, where rays are 9 cm apart; some rays pass through its cell.
    let trunk = |x: f64, y: f64| if (x - 5.1).hypot(y - 0.1) < 0.06 { 3.0 } else { 0.0 };
    let class = |_, _, z: f64| if z > 0.02 { Obstacle } else { Open };
    let (mut map, mut lidar) = (map(), Lidar::new(360, NOISE_M));
    watch(&mut map, &mut lidar, &pose_at(0.0, 0.0), 5, (trunk, class));
    for _ in 0..30 {
        watch(&mut map, &mut lidar, &pose_at(0.0, 0.0), 1, (trunk, class));
        let around = cells_where(&map, |x, y| (x - 5.1).hypot(y - 0.1) < 0.25);
        assert!(around.iter().any(|(_, cell)| cell.class() == Obstacle), "{around:?}");
    }
}

#[test]
fn steep_rocks_are_not_worn_away_by_grazing_rays() {
    let rocks = |x: f64, y: f64| 0.35 * ((2.1 * x).sin() * (1.7 * y).cos()).max(0.0).sqrt();
    let (mut map, mut lidar) = (map(), Lidar::new(360, NOISE_M));
    let mut known = 0.0;
    for i in 0..20 {
        watch(&mut map, &mut lidar, &pose_at(0.05 * f64::from(i), 0.0), 1, (rocks, |_, _, _| Open));
        let near = cells_where(&map, |x, y| (3.5..6.0).contains(&x) && y.abs() < 2.0);
        let now = share_of(&near, |cell| cell.knowledge == Knowledge::Measured);
        assert!(now > known - 0.03, "scan {i}: {now} measured after {known}");
        known = now;
    }
    assert!(known > 0.8, "{known}");
}
