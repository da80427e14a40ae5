//! Maps in tiles: what comes back, what levels hold, and what a kill, a fault and a contradiction leave.

#![allow(clippy::unwrap_used, reason = "a panic is how a test fails")]

use route::{ClassFriction, FrictionCurve, GroundCell, MapKeeper, MeasuredCell, TILE_EDGE, TileMap};
use std::io::{BufRead as _, BufReader};
use std::path::Path;
use std::process::{Command, Stdio};
use terrain::{Cell, GridGeometry, GridMap, Knowledge, SurfaceCell, TerrainClass};

const RESOLUTION_M: f64 = 0.2;
const MEMORY_BYTES: usize = 8 << 20;
const FOLDER: &str = "SUREFOOT_TILE_TEST_FOLDER";

fn patch(origin: [i64; 2], n: usize, height_m: impl Fn(i64, i64) -> f32) -> GridMap<MeasuredCell> {
    let geometry = GridGeometry { resolution_m: RESOLUTION_M, origin, n_rows: n, n_cols: n };
    let cell = |index: usize| {
        let Cell { row, col } = geometry.cell(index);
        let ground = GroundCell {
            height_m: height_m(origin[0] + col as i64, origin[1] + row as i64),
            ..GroundCell::level(FrictionCurve::GRASS)
        };
        MeasuredCell { ground, deviation_m: 0.05 }
    };
    GridMap::from_values(geometry, (0..n * n).map(cell).collect()).unwrap()
}

fn window(map: &mut TileMap, level: u8, origin: [i64; 2], n: usize) -> GridMap<GroundCell> {
    let resolution_m = RESOLUTION_M * f64::from(1_u32 << level);
    map.window(level, &GridGeometry { resolution_m, origin, n_rows: n, n_cols: n }).unwrap()
}

#[test]
fn what_was_merged_comes_back_after_tiles_were_let_go_and_the_map_opened_again() {
    let folder = tempfile::tempdir().unwrap();
    let plane = |col: i64, row: i64| 0.01 * col as f32 - 0.02 * row as f32;
    // 36 tiles around the origin, of which ten are held.
    let n = 6 * TILE_EDGE;
    let origin = [-(n as i64) / 2, -(n as i64) / 2 + 40];
    let mut map = TileMap::open(folder.path(), RESOLUTION_M, MEMORY_BYTES).unwrap();
    let report = map.merge(&patch(origin, n, plane)).unwrap();
    assert_eq!((report.n_new, report.n_contradicting), (n * n, 0));
    assert!(map.n_bytes() <= MEMORY_BYTES && map.n_tiles() == 42, "{} {}", map.n_bytes(), map.n_tiles());
    drop(map);
    let mut map = TileMap::open(folder.path(), RESOLUTION_M, MEMORY_BYTES).unwrap();
    let all = window(&mut map, 0, origin, n);
    for (index, cell) in all.values().iter().enumerate() {
        let Cell { row, col } = all.geometry().cell(index);
        let expected_m = plane(origin[0] + col as i64, origin[1] + row as i64);
        assert!((cell.height_m - expected_m).abs() < 6e-4, "{cell:?} {expected_m}");
        assert_eq!(cell.friction, FrictionCurve::GRASS);
    }
    assert!(!window(&mut map, 0, [n as i64, n as i64], 4).values()[0].is_known());
    // The plane's mean over 8 x 8 cells is its height in their middle.
    let coarse = window(&mut map, 3, [-10, -5], 20);
    for (index, cell) in coarse.values().iter().enumerate() {
        let Cell { row, col } = coarse.geometry().cell(index);
        let middle = |place: i64| 8.0 * place as f32 + 3.5;
        let expected_m = 0.01 * middle(-10 + col as i64) - 0.02 * middle(-5 + row as i64);
        assert!(
            (cell.height_m - expected_m).abs() < 2e-3 && cell.roughness_m < 2e-3,
            "{cell:?} {expected_m}"
        );
    }
}

#[test]
fn a_change_reaches_every_level() {
    let folder = tempfile::tempdir().unwrap();
    let mut map = TileMap::open(folder.path(), RESOLUTION_M, MEMORY_BYTES).unwrap();
    map.merge(&patch([0, 0], TILE_EDGE, |_, _| 1.0)).unwrap();
    let seen = |map: &mut TileMap| {
        (0..=4).map(|level| window(map, level, [0, 0], 1).values()[0].height_m).collect::<Vec<_>>()
    };
    assert_eq!(seen(&mut map), [1.0; 5]);
    let mut lifted = patch([0, 0], TILE_EDGE, |_, _| 3.0);
    for cell in lifted.values_mut() {
        cell.deviation_m = 0.01;
    }
    // Two metres apart where a decimetre is uncertain: the more certain is kept.
    let report = map.merge(&lifted).unwrap();
    assert_eq!((report.n_contradicting, report.n_agreeing), (TILE_EDGE * TILE_EDGE, 0));
    assert!((report.largest_contradiction_m - 2.0).abs() < 1e-6);
    assert_eq!(seen(&mut map), [3.0; 5]);
    // And one that is less certain changes nothing.
    map.merge(&patch([0, 0], TILE_EDGE, |_, _| 1.0)).unwrap();
    assert_eq!(seen(&mut map), [3.0; 5]);
}

#[test]
fn heights_that_agree_are_averaged_by_their_variances() {
    let folder = tempfile::tempdir().unwrap();
    let mut map = TileMap::open(folder.path(), RESOLUTION_M, MEMORY_BYTES).unwrap();
    let with = |height_m: f32, deviation_m: f32| {
        let mut patch = patch([5, 5], 3, |_, _| height_m);
        for cell in patch.values_mut() {
            cell.deviation_m = deviation_m;
        }
        patch
    };
    map.merge(&with(1.0, 0.1)).unwrap();
    let report = map.merge(&with(1.1, 0.05)).unwrap();
    assert_eq!(report.n_agreeing, 9);
    // (1.0 / 0.01 + 1.1 / 0.0025) / (1 / 0.01 + 1 / 0.0025) = 1.08.
    assert!((window(&mut map, 0, [6, 6], 1).values()[0].height_m - 1.08).abs() < 1e-3);
}

#[test]
fn a_broken_tile_and_another_resolution_are_refused_with_their_file() {
    let folder = tempfile::tempdir().unwrap();
    let mut map = TileMap::open(folder.path(), RESOLUTION_M, MEMORY_BYTES).unwrap();
    map.merge(&patch([0, 0], 20, |col, _| col as f32)).unwrap();
    drop(map);
    let file = folder.path().join("0_0_0.tile");
    let whole = std::fs::read(&file).unwrap();
    let found = |bytes: &[u8]| {
        std::fs::write(&file, bytes).unwrap();
        let mut map = TileMap::open(folder.path(), RESOLUTION_M, MEMORY_BYTES).unwrap();
        let geometry = GridGeometry { resolution_m: RESOLUTION_M, origin: [0, 0], n_rows: 2, n_cols: 2 };
        map.window(0, &geometry).unwrap_err().to_string()
    };
    let mut flipped = whole.clone();
    flipped[5000] ^= 1;
    assert!(found(&flipped).contains("0_0_0.tile: checksum: expected "));
    assert!(
        found(&whole[..whole.len() - 3]).contains("0_0_0.tile: bytes: expected 45 or 786465, found 786462")
    );
    assert!(found(&[]).contains("found 0"));
    let error = TileMap::open(folder.path(), 0.5, MEMORY_BYTES).unwrap_err().to_string();
    assert!(error.ends_with("resolution_m: size of the cells [m]: expected 0.5, found 0.2"), "{error}");
    std::fs::write(&file, &whole).unwrap();
    let mut map = TileMap::open(folder.path(), RESOLUTION_M, MEMORY_BYTES).unwrap();
    let other = GridMap::filled(
        GridGeometry { resolution_m: 0.5, origin: [0, 0], n_rows: 2, n_cols: 2 },
        MeasuredCell { ground: GroundCell::level(FrictionCurve::DIRT), deviation_m: 0.1 },
    );
    assert_eq!(map.merge(&other).unwrap_err().to_string(), "patch: expected cells of 0.2 m, found 0.5 m");
}

#[test]
fn a_full_disk_leaves_the_old_tile() {
    // A folder that nothing can be written to any more stands in for a disk without room.
    let folder = tempfile::tempdir().unwrap();
    let mut map = TileMap::open(folder.path(), RESOLUTION_M, MEMORY_BYTES).unwrap();
    map.merge(&patch([0, 0], 20, |_, _| 1.0)).unwrap();
    let moved = folder.path().with_extension("gone");
    std::fs::rename(folder.path(), &moved).unwrap();
    let error = map.merge(&patch([0, 0], 20, |_, _| 1.05)).unwrap_err().to_string();
    assert!(error.contains("0_0_0.tile: expected a file or folder to write, found: "), "{error}");
    std::fs::rename(&moved, folder.path()).unwrap();
    let mut map = TileMap::open(folder.path(), RESOLUTION_M, MEMORY_BYTES).unwrap();
    assert_eq!(window(&mut map, 0, [3, 3], 1).values()[0].height_m, 1.0);
}

const CLASSES: ClassFriction =
    ClassFriction { open: FrictionCurve::DIRT, loose: FrictionCurve::SAND, vegetation: FrictionCurve::GRASS };

/// What a vehicle at a column sees of a slope of 0.01 a cell: a window of 40 cells.
fn seen_at(col: i64) -> GridMap<SurfaceCell> {
    let geometry = GridGeometry { resolution_m: RESOLUTION_M, origin: [col, 0], n_rows: 40, n_cols: 40 };
    let cell = |index: usize| {
        let Cell { row, col: place } = geometry.cell(index);
        let height_m = 0.01 * (col + place as i64) as f32;
        let class = if row < 20 { TerrainClass::Open } else { TerrainClass::Vegetation };
        SurfaceCell { height_variance_m2: 4e-4, ..SurfaceCell::certain(height_m, class, 0.0) }
    };
    GridMap::from_values(geometry, (0..1600).map(cell).collect()).unwrap()
}

#[test]
fn what_a_rolling_window_saw_is_kept_once() {
    let folder = tempfile::tempdir().unwrap();
    let map = TileMap::open(folder.path(), RESOLUTION_M, MEMORY_BYTES).unwrap();
    let mut keeper = MapKeeper::new(map, CLASSES);
    // Over three tiles; every place is seen ten times.
    for col in (0..=560).step_by(4) {
        keeper.look(&seen_at(col)).unwrap();
    }
    // The first two were left: they are on disk, whatever becomes of the keeper.
    let mut on_disk = TileMap::resume(folder.path(), MEMORY_BYTES).unwrap();
    assert_eq!(on_disk.n_tiles(), 2);
    assert!((window(&mut on_disk, 0, [100, 10], 1).values()[0].height_m - 1.0).abs() < 1e-3);
    let (mut map, report) = keeper.finish().unwrap();
    assert_eq!((report.n_new, report.n_agreeing, report.n_contradicting), (600 * 40, 0, 0));
    for (col, row, friction) in [(0, 0, FrictionCurve::DIRT), (599, 39, FrictionCurve::GRASS)] {
        let cell = window(&mut map, 0, [col, row], 1).values()[0];
        assert!((cell.height_m - 0.01 * col as f32).abs() < 1e-3 && cell.roughness_m < 2e-3, "{cell:?}");
        assert_eq!((cell.friction, cell.is_obstacle), (friction, false));
    }
    // Another mission, 5 cm higher, as sure of it: half of that. Seen ten times, it counts once.
    let mut keeper = MapKeeper::new(map, CLASSES);
    let mut lifted = seen_at(80);
    lifted.values_mut().iter_mut().for_each(|cell| cell.height_m += 0.05);
    (0..10).for_each(|_| keeper.look(&lifted).unwrap());
    let (mut map, report) = keeper.finish().unwrap();
    assert_eq!((report.n_new, report.n_agreeing), (0, 1600));
    assert!((window(&mut map, 0, [100, 10], 1).values()[0].height_m - 1.025).abs() < 2e-3);
    let other =
        GridMap::filled(GridGeometry { resolution_m: 0.3, ..*lifted.geometry() }, SurfaceCell::UNKNOWN);
    let error = MapKeeper::new(map, CLASSES).look(&other).unwrap_err().to_string();
    assert_eq!(error, "patch: expected cells of 0.2 m, found 0.3 m");
}

#[test]
fn an_obstacle_that_hides_its_ground_is_kept_and_what_was_not_seen_is_not() {
    let folder = tempfile::tempdir().unwrap();
    let map = TileMap::open(folder.path(), RESOLUTION_M, MEMORY_BYTES).unwrap();
    let mut seen = seen_at(0);
    let mut trunk = SurfaceCell { knowledge: Knowledge::Unknown, ..SurfaceCell::UNKNOWN };
    seen[Cell { row: 5, col: 5 }] = trunk;
    trunk.class_probability[TerrainClass::Obstacle as usize] = 1.0;
    seen[Cell { row: 10, col: 20 }] = trunk;
    let mut keeper = MapKeeper::new(map, CLASSES);
    keeper.look(&seen).unwrap();
    let (mut map, report) = keeper.finish().unwrap();
    assert_eq!(report.n_new, 1599);
    let trunk = window(&mut map, 0, [20, 10], 1).values()[0];
    assert!(
        trunk.is_obstacle && (trunk.height_m - 0.2).abs() < 1e-3,
        "the mean of what is around: {trunk:?}"
    );
    assert!(!window(&mut map, 0, [5, 5], 1).values()[0].is_known());
}

#[test]
fn maps_of_two_robots_become_one() {
    let folders = [tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap()];
    let mut maps =
        folders.each_ref().map(|folder| TileMap::open(folder.path(), RESOLUTION_M, MEMORY_BYTES).unwrap());
    maps[0].merge(&patch([-300, 0], 400, |_, _| 1.0)).unwrap();
    maps[1].merge(&patch([0, 0], 400, |_, _| 1.1)).unwrap();
    let [mut one, mut other] = maps;
    let report = one.merge_map(&mut other).unwrap();
    // They share 100 columns of 400 rows.
    assert_eq!((report.n_new, report.n_agreeing, report.n_contradicting), (120_000, 40_000, 0));
    let heights_m = [-200, 50, 300].map(|col| window(&mut one, 0, [col, 100], 1).values()[0].height_m);
    assert_eq!(heights_m, [1.0, 1.05, 1.1]);
    // Tiles of 256 cells from -512 to 512 and 0 to 512; in cells four times as large a quarter of it.
    let all = one.extent(0).unwrap();
    assert_eq!((all.origin, all.n_cols, all.n_rows), ([-512, 0], 1024, 512));
    let all = one.extent(2).unwrap();
    assert_eq!((all.origin, all.n_cols, all.n_rows), ([-128, 0], 256, 128));
}

#[test]
fn a_folder_without_a_map_is_not_taken_for_an_empty_one() {
    let folder = tempfile::tempdir().unwrap();
    let error = TileMap::resume(folder.path(), MEMORY_BYTES).unwrap_err().to_string();
    let told = "resolution_m: map in tiles: expected the size of its cells in metres, found no such file";
    assert!(error.ends_with(told), "{error}");
    for broken in ["", "-1", "NaN", "wide"] {
        std::fs::write(folder.path().join("resolution_m"), broken).unwrap();
        let error = TileMap::resume(folder.path(), MEMORY_BYTES).unwrap_err().to_string();
        assert!(error.ends_with(&format!("in metres, found {broken}")), "{error}");
    }
    assert!(TileMap::open(folder.path(), RESOLUTION_M, MEMORY_BYTES).is_err(), "one with broken cells");
}

/// The process that `a_kill_at_any_moment_loses_no_tile` starts and kills; without its folder there is nothing to do.
#[test]
fn merges_until_it_is_killed() {
    let Some(folder) = std::env::var_os(FOLDER) else { return };
    let mut map = TileMap::open(Path::new(&folder), RESOLUTION_M, MEMORY_BYTES).unwrap();
    for round in 1.. {
        map.merge(&patch([-100, -100], 200, |_, _| 10.0 * round as f32)).unwrap();
        println!("merged {round}");
    }
}

#[test]
fn a_kill_at_any_moment_loses_no_tile() {
    let folder = tempfile::tempdir().unwrap();
    for kill in 0..12 {
        let mut child = Command::new(std::env::current_exe().unwrap())
            .args(["--exact", "merges_until_it_is_killed", "--nocapture"])
            .env(FOLDER, folder.path())
            .stdout(Stdio::piped())
            .spawn()
            .unwrap();
        let mut lines = BufReader::new(child.stdout.take().unwrap()).lines().map_while(Result::ok);
        let merged =
            |line: String| line.split("merged ").nth(1).and_then(|round| round.trim().parse::<f32>().ok());
        let mut last = 0.0;
        while last < 2.0 + kill as f32 {
            last = lines.by_ref().find_map(merged).unwrap();
        }
        child.kill().unwrap();
        child.wait().unwrap();
        last = lines.filter_map(merged).last().unwrap_or(last);
        let mut map = TileMap::open(folder.path(), RESOLUTION_M, MEMORY_BYTES).unwrap();
        assert_eq!(map.n_tiles(), 4);
        for level in [0, 1] {
            for cell in window(&mut map, level, [-100 >> level, -100 >> level], 200 >> level).values() {
                // Equal deviations: the newer height is kept, of this round or of one that nobody was told of.
                assert!(cell.height_m >= 10.0 * last - 0.01 || level > 0, "{cell:?}, merged {last}");
                assert!(cell.is_known());
            }
        }
    }
}
