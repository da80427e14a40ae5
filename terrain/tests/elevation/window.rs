//! The window rolls, is re-anchored, seeded and tells what changed.

use crate::points::{plain_config, scan_of};
use proptest::prelude::*;
use terrain::TerrainClass::{Obstacle, Open, Vegetation};
use terrain::{
    AssumedGround, Cell, CellRegion, ElevationConfig, ElevationMap, Footprint, FuseError, GridMap, Knowledge,
    Pose, SurfaceCell,
};

fn pose_at(x_m: f64, y_m: f64) -> Pose {
    Pose { x_m, y_m, ..Pose::default() }
}

/// A map of 40 x 40 cells of 0.5 m without inference between cells.
fn rolling_map(recentre_m: f64) -> ElevationMap {
    ElevationMap::new(ElevationConfig { recentre_m, gap_radius_m: 0.0, ..plain_config() }).unwrap()
}

/// Bumpy ground with plants and rocks on it, one to three points per half metre square.
fn bumpy_scan(pose: &Pose) -> terrain::Scan {
    let back = pose.isometry().inverse();
    let mut points = Vec::new();
    for i in -40..40 {
        for j in -40..40 {
            let [x_m, y_m] = [pose.x_m + 0.5 * f64::from(i) + 0.21, pose.y_m + 0.5 * f64::from(j) + 0.13];
            let z_m = pose.z_m + 0.2 * (x_m.sin() + (1.3 * y_m).cos());
            let class = if (i + 2 * j) % 7 == 0 { Vegetation } else { Open };
            let body = back * nalgebra::Point3::new(x_m, y_m, z_m);
            points.push(([body.x, body.y, body.z], class));
        }
    }
    scan_of(points)
}

fn bits(cell: &SurfaceCell) -> (u32, u32, u32, [u32; 4], Knowledge) {
    (
        cell.height_m.to_bits(),
        cell.height_variance_m2.to_bits(),
        cell.vegetation_height_m.to_bits(),
        cell.class_probability.map(f32::to_bits),
        cell.knowledge,
    )
}

/// The cell at a place of the lattice, if it is in the window.
fn on_lattice(surface: &GridMap<SurfaceCell>, [x, y]: [i64; 2]) -> Option<SurfaceCell> {
    let geometry = surface.geometry();
    let (col, row) = (x - geometry.origin[0], y - geometry.origin[1]);
    let inside = (0..geometry.n_cols as i64).contains(&col) && (0..geometry.n_rows as i64).contains(&row);
    inside.then(|| surface[Cell { row: row as usize, col: col as usize }])
}

fn lattice_places(surface: &GridMap<SurfaceCell>) -> impl Iterator<Item = [i64; 2]> + use<> {
    let geometry = *surface.geometry();
    (0..geometry.n_cells()).map(move |index| {
        let cell = geometry.cell(index);
        [geometry.origin[0] + cell.col as i64, geometry.origin[1] + cell.row as i64]
    })
}

#[test]
fn what_stays_in_the_window_stays_bit_for_bit() {
    let mut map = rolling_map(1.0);
    map.fuse(&bumpy_scan(&pose_at(3.0, -2.0)), &pose_at(3.0, -2.0)).unwrap();
    let before = map.surface().clone();
    map.fuse(&scan_of([]), &pose_at(6.3, -7.9)).unwrap();
    let after = map.surface();
    assert_eq!(
        after.geometry().origin,
        [(6.3_f64 / 0.5 - 20.0).round() as i64, (-7.9_f64 / 0.5 - 20.0).round() as i64]
    );
    for place in lattice_places(after) {
        let now = on_lattice(after, place).unwrap();
        match on_lattice(&before, place) {
            Some(then) => assert_eq!(bits(&then), bits(&now)),
            None => assert!(!now.is_known()),
        }
    }
}

#[test]
fn the_window_waits_until_the_vehicle_left_its_middle() {
    let mut map = rolling_map(2.0);
    let origin_after = |map: &mut ElevationMap, x_m: f64| {
        map.fuse(&scan_of([]), &pose_at(x_m, 0.0)).unwrap();
        map.surface().geometry().origin
    };
    let start = origin_after(&mut map, 0.0);
    assert_eq!(origin_after(&mut map, 1.9), start);
    assert_eq!(origin_after(&mut map, 2.6), [start[0] + 5, start[1]]);
    let mut fixed = rolling_map(f64::INFINITY);
    let start = origin_after(&mut fixed, 100.0);
    assert_eq!(start, [180, -20], "the first pose places the window");
    assert_eq!(origin_after(&mut fixed, 1e4), start);
}

#[test]
fn entering_strips_count_as_changed() {
    let mut map = rolling_map(1.0);
    map.fuse(&scan_of([]), &pose_at(0.0, 0.0)).unwrap();
    map.take_changed();
    map.fuse(&scan_of([]), &pose_at(2.0, 0.0)).unwrap();
    assert_eq!(map.take_changed(), Some(CellRegion { rows: 0..40, cols: 36..40 }));
    map.fuse(&scan_of([]), &pose_at(2.0, -1.5)).unwrap();
    assert_eq!(map.take_changed(), Some(CellRegion { rows: 0..3, cols: 0..40 }));
    for odd in [
        AssumedGround { axle_height_m: f64::NAN, ..ASSUMED },
        AssumedGround { height_std_m: 0.0, ..ASSUMED },
        AssumedGround { height_std_m: f64::INFINITY, ..ASSUMED },
    ] {
        assert!(matches!(map.assume_ground(&Pose::default(), &odd), Err(FuseError::Assumption { .. })));
    }
    let on_its_side = Pose { roll_rad: 1.55, ..Pose::default() };
    assert!(map.assume_ground(&on_its_side, &ASSUMED).is_err());
    assert_eq!(map.take_changed(), None);
}

fn contains(region: &Option<CellRegion>, cell: Cell) -> bool {
    region.as_ref().is_some_and(|r| r.rows.contains(&cell.row) && r.cols.contains(&cell.col))
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(40))]
    #[test]
    fn no_change_escapes_the_changed_rectangle(
        hits in prop::collection::vec(((-12.0..12.0_f64), (-12.0..12.0_f64), (-0.5..1.5_f64), 0..4_usize), 0..60),
        steps in prop::collection::vec(((-2.0..2.0_f64), (-2.0..2.0_f64), (0..4_000_000_000_u64)), 1..6),
        publish_step_m in prop::sample::select(vec![0.0_f32, 0.003]),
        publish_period_scans in 1..4_u8,
    ) {
        let config = ElevationConfig {
            recentre_m: 1.0, fading_m2ps: 1e-5, publish_step_m, publish_period_scans, ..plain_config()
        };
        let mut map = ElevationMap::new(config).unwrap();
        let mut consumer = map.surface().clone();
        let (mut pose, mut now_ns) = (Pose::default(), 0);
        for (dx_m, dy_m, elapsed_ns) in steps {
            (pose.x_m, pose.y_m) = (pose.x_m + dx_m, pose.y_m + dy_m);
            now_ns += elapsed_ns;
            let points = hits.iter().map(|&(x, y, z, class)| ([x, y, z], terrain::TerrainClass::ALL[class]));
            map.fuse(&terrain::Scan { valid_at_ns: now_ns, ..scan_of(points) }, &pose).unwrap();
            let changed = map.take_changed();
            consumer.roll_to(map.surface().geometry().origin, SurfaceCell::UNKNOWN);
            for index in 0..consumer.geometry().n_cells() {
                let cell = consumer.geometry().cell(index);
                if contains(&changed, cell) {
                    consumer[cell] = map.surface()[cell];
                }
                prop_assert_eq!(bits(&consumer[cell]), bits(&map.surface()[cell]));
            }
        }
    }

    #[test]
    fn every_published_cell_makes_sense(
        hits in prop::collection::vec(((-9.0..9.0_f64), (-9.0..9.0_f64), (-1.0..3.0_f64), 0..4_usize), 1..200),
    ) {
        let mut map = ElevationMap::new(plain_config()).unwrap();
        for half in hits.chunks(hits.len().div_ceil(2)) {
            let points = half.iter().map(|&(x, y, z, class)| ([x, y, z], terrain::TerrainClass::ALL[class]));
            map.fuse(&scan_of(points), &Pose::default()).unwrap();
        }
        for cell in map.surface().values() {
            let total: f32 = cell.class_probability.iter().sum();
            prop_assert!(cell.is_known() == cell.height_m.is_finite());
            prop_assert!(cell.is_known() == cell.height_variance_m2.is_finite());
            prop_assert!(cell.height_variance_m2 > 0.0);
            prop_assert!(cell.vegetation_height_m >= 0.0 && cell.vegetation_height_m.is_finite());
            prop_assert!((total - 1.0).abs() < 1e-5 || (total == 0.0 && !cell.is_known()));
            // Least squares inside the hull of heights within [-1, 3] may overshoot, but not by their range.
            prop_assert!(!cell.is_known() || (-5.0..7.0).contains(&cell.height_m), "{:?}", cell);
        }
    }
}

const ASSUMED: AssumedGround = AssumedGround {
    footprint: Footprint { front_m: 3.0, rear_m: 1.0, half_width_m: 1.0 },
    axle_height_m: 0.4,
    height_std_m: 0.05,
};

#[test]
fn the_ground_under_the_start_lies_in_the_plane_of_the_wheels() {
    let pose = Pose {
        x_m: 1.0,
        y_m: 2.0,
        z_m: 5.0,
        roll_rad: 0.1,
        pitch_rad: -0.2,
        yaw_rad: std::f64::consts::FRAC_PI_2,
    };
    let mut map = rolling_map(f64::INFINITY);
    map.assume_ground(&pose, &ASSUMED).unwrap();
    let motion = pose.isometry();
    let mut n = 0;
    for (index, cell) in map.surface().values().iter().enumerate() {
        let [x_m, y_m] = map.surface().geometry().centre_m(map.surface().geometry().cell(index));
        // Yaw of 90 degrees: forward is north, left is west.
        let covered = (-1.0..=3.0).contains(&(y_m - 2.0)) && (x_m - 1.0).abs() <= 1.0;
        assert_eq!(cell.is_known(), covered);
        if covered {
            n += 1;
            let body = motion.inverse() * nalgebra::Point3::new(x_m, y_m, f64::from(cell.height_m));
            assert!((body.z + 0.4).abs() < 1e-5, "{body}");
            assert_eq!(cell.knowledge, Knowledge::Interpolated);
            assert!((cell.height_variance_m2 - 0.0025).abs() < 1e-8);
            assert_eq!(cell.class_probability, [1.0, 0.0, 0.0, 0.0]);
        }
    }
    assert_eq!(n, 32, "4 m x 2 m in cells of 0.25 m2");
}

#[test]
fn what_is_seen_replaces_what_was_assumed_and_not_the_other_way_round() {
    let mut map = rolling_map(f64::INFINITY);
    let pose = Pose::default();
    map.assume_ground(&pose, &ASSUMED).unwrap();
    map.fuse(&scan_of([([1.3, 0.3, 0.1], Open)]), &pose).unwrap();
    let seen = *map.surface().at(1.3, 0.3).unwrap();
    assert_eq!((seen.knowledge, seen.height_m), (Knowledge::Measured, 0.1));
    map.assume_ground(&pose, &ASSUMED).unwrap();
    assert_eq!(map.surface().at(1.3, 0.3), Some(&seen));
    assert_eq!(map.surface().at(0.3, 0.3).map(|cell| cell.height_m), Some(-0.4));
}

#[test]
fn a_correction_by_whole_cells_moves_the_map_bit_for_bit() {
    let before = pose_at(3.0, -2.0);
    let mut map = rolling_map(1.0);
    map.fuse(&bumpy_scan(&before), &before).unwrap();
    let old = map.surface().clone();
    let after = Pose { x_m: before.x_m + 1.5, y_m: before.y_m - 1.0, ..before };
    map.take_changed();
    map.reanchor(&before, &after).unwrap();
    assert_eq!(map.take_changed(), Some(CellRegion { rows: 0..40, cols: 0..40 }));
    for [x, y] in lattice_places(&old) {
        let then = on_lattice(&old, [x, y]).unwrap();
        let now = on_lattice(map.surface(), [x + 3, y - 2]).expect("the window moves along");
        assert_eq!(bits(&then), bits(&now));
    }
}

#[test]
fn a_correction_lifts_and_turns_the_map_about_the_vehicle() {
    let before = pose_at(2.25, 1.25);
    let mut map = rolling_map(1.0);
    let spot = |forward_m: f64, left_m: f64, z_m: f64| ([forward_m, left_m, z_m], Open);
    map.fuse(&scan_of([spot(4.0, 0.0, 0.2), spot(0.0, 3.0, 0.7), spot(4.0, 3.0, 0.4)]), &before).unwrap();
    let after =
        Pose { x_m: 3.25, y_m: -0.75, z_m: 0.5, yaw_rad: std::f64::consts::FRAC_PI_2, ..Pose::default() };
    map.reanchor(&before, &after).unwrap();
    // Seen from the corrected pose, all lies where it lay: forward is north now, left is west.
    for (x_m, y_m, height_m) in [(3.25, 3.25, 0.7), (0.25, -0.75, 1.2), (0.25, 3.25, 0.9)] {
        let cell = map.surface().at(x_m, y_m).unwrap();
        assert!(cell.is_known() && (cell.height_m - height_m).abs() < 1e-6, "{x_m}, {y_m}: {cell:?}");
    }
    assert_eq!(map.surface().values().iter().filter(|cell| cell.is_known()).count(), 3);
}

#[test]
fn a_correction_in_pitch_tilts_the_map() {
    let before = pose_at(0.25, 0.25);
    let mut map = rolling_map(1.0);
    map.fuse(&scan_of([([6.0, 0.0, 0.0], Open), ([0.0, 6.0, 0.0], Obstacle)]), &before).unwrap();
    map.reanchor(&before, &Pose { pitch_rad: 0.05, ..before }).unwrap();
    // Nose down by 0.05 rad lowers what is 6 m ahead by 6 sin(0.05).
    let ahead = map.surface().at(6.25, 0.25).unwrap();
    assert!((f64::from(ahead.height_m) + 6.0 * 0.05_f64.sin()).abs() < 1e-5, "{ahead:?}");
}

#[test]
fn poses_that_are_no_numbers_change_nothing() {
    let mut map = rolling_map(1.0);
    let broken = Pose { y_m: f64::NAN, ..Pose::default() };
    assert!(map.assume_ground(&broken, &ASSUMED).is_err());
    assert!(map.reanchor(&broken, &Pose::default()).is_err());
    assert!(map.reanchor(&Pose::default(), &broken).is_err());
    for odd in [
        AssumedGround { axle_height_m: f64::NAN, ..ASSUMED },
        AssumedGround { height_std_m: 0.0, ..ASSUMED },
        AssumedGround { height_std_m: f64::INFINITY, ..ASSUMED },
    ] {
        assert!(matches!(map.assume_ground(&Pose::default(), &odd), Err(FuseError::Assumption { .. })));
    }
    let on_its_side = Pose { roll_rad: 1.55, ..Pose::default() };
    assert!(map.assume_ground(&on_its_side, &ASSUMED).is_err());
    assert_eq!(map.take_changed(), None);
}
