//! `surefoot route` as its users call it.

#![allow(clippy::unwrap_used, reason = "a panic is how a test fails")]

mod ground;

use std::path::Path;
use std::process::{Command, Output, Stdio};
use std::time::Duration;

use tempfile::TempDir;
use tiff::encoder::TiffEncoder;
use tiff::encoder::colortype::Gray32Float;
use tiff::tags::Tag;

/// A plain of 120 m with a pond from 40 to 60 m east that leaves a ford between 80 and 90 m north, and, east of 100 m,
/// ground that nobody measured.
fn ford() -> (TempDir, String) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("ford.npz");
    let height_m = |x: f64, _: f64| if x > 100.0 { f64::NAN } else { 2.0 };
    let is_pond = |x: f64, y: f64| (40.0..60.0).contains(&x) && !(80.0..90.0).contains(&y);
    let water = |x: f64, y: f64| f64::from(is_pond(x, y));
    ground::write(&path, 120, &[("elevation", &height_m), ("water", &water)]);
    let path = path.to_str().unwrap().to_owned();
    (folder, path)
}

fn route(world: &str, out: &Path, words: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_surefoot"));
    command.args(["route", "--world", world, "--out"]).arg(out).args(words).output().unwrap()
}

#[test]
fn a_route_takes_the_ford_and_leaves_text_table_and_picture() {
    let (folder, world) = ford();
    let out = folder.path().join("out");
    let found = route(&world, &out, &["--start", "20,20,0", "--goal", "80,20", "--speed", "3"]);
    let told = String::from_utf8(found.stdout).unwrap();
    assert!(found.status.success(), "{}", String::from_utf8_lossy(&found.stderr));
    assert!(told.contains("expected time") && told.contains("corners"), "{told}");
    let summary: serde_json::Value =
        serde_json::from_slice(&std::fs::read(out.join("route.json")).unwrap()).unwrap();
    // From (20, 20) through (40, 80) and (60, 80) to (80, 20) it is 2 hypot(20, 60) + 20 = 146.5 m at least.
    let length_m = summary["length_m"].as_f64().unwrap();
    assert!((146.5..175.0).contains(&length_m), "{length_m}");
    assert!(summary["duration_s"].as_f64().unwrap() > length_m / 3.0);
    // Other ways, too, lead through the ford.
    let others = summary["alternatives"].as_array().unwrap();
    assert!(!others.is_empty() && told.contains("another way"), "{told}");
    assert!(others.iter().all(|other| other["length_m"].as_f64().unwrap() > 146.5), "{others:?}");
    let table = std::fs::read_to_string(out.join("route.csv")).unwrap();
    let places = table.lines().skip(1).map(|line| {
        let numbers: Vec<f64> = line.split(',').map(|word| word.parse().unwrap()).collect();
        assert!(numbers.len() == 8 && numbers.iter().all(|number| number.is_finite()), "{line}");
        [numbers[0], numbers[1]]
    });
    let is_in_the_pond = |[x, y]: &[f64; 2]| (40.0..60.0).contains(x) && !(80.0..90.0).contains(y);
    assert!(!places.into_iter().any(|place| is_in_the_pond(&place)));
    assert!(std::fs::read(out.join("route.png")).unwrap().starts_with(b"\x89PNG"));
}

/// A plain of 40 m whose south-west corner lies on the equator, where zone 33 of UTM has its middle.
fn plain_on_the_globe(path: &Path) {
    let mut encoder = TiffEncoder::new(std::fs::File::create(path).unwrap()).unwrap();
    let mut image = encoder.new_image::<Gray32Float>(40, 40).unwrap();
    let tags = image.encoder();
    tags.write_tag(Tag::ModelPixelScaleTag, [1.0, 1.0, 0.0].as_slice()).unwrap();
    tags.write_tag(Tag::ModelTiepointTag, [0.0, 0.0, 0.0, 500_000.0, 40.0, 0.0].as_slice()).unwrap();
    tags.write_tag(Tag::GeoKeyDirectoryTag, [1_u16, 1, 0, 1, 3072, 0, 1, 32633].as_slice()).unwrap();
    image.write_data(&[2.0; 40 * 40]).unwrap();
}

#[test]
fn where_the_file_tells_its_reference_system_the_route_is_one_of_the_globe() {
    let folder = tempfile::tempdir().unwrap();
    let world = folder.path().join("plain.tif");
    plain_on_the_globe(&world);
    let out = folder.path().join("out");
    let found = route(world.to_str().unwrap(), &out, &["--start", "10,20,0", "--goal", "30,20"]);
    assert!(found.status.success(), "{}", String::from_utf8_lossy(&found.stderr));
    assert!(String::from_utf8(found.stdout).unwrap().contains("route.geojson"));
    let told: serde_json::Value =
        serde_json::from_slice(&std::fs::read(out.join("route.geojson")).unwrap()).unwrap();
    let way = &told["features"][0];
    assert!((way["properties"]["length_m"].as_f64().unwrap() - 20.0).abs() < 0.5, "{way}");
    let line = way["geometry"]["coordinates"].as_array().unwrap();
    let end = line.last().unwrap();
    // 30 m east of the middle, in a projection of scale 0.9996, on a circle of 6378137 m.
    let longitude_deg = 15.0 + (30.0_f64 / 0.9996 / 6_378_137.0).to_degrees();
    assert!((end[0].as_f64().unwrap() - longitude_deg).abs() < 1e-8, "{end}");
    // 20 m north, where a degree of latitude is 110 574 m.
    assert!((end[1].as_f64().unwrap() - 20.0 / 0.9996 / 110_574.0).abs() < 1e-7, "{end}");
}

#[test]
fn what_cannot_be_is_told_in_one_line_and_leaves_nothing() {
    let (folder, world) = ford();
    let out = folder.path().join("out");
    let refused = |words: &[&str], code: i32, told: &str| {
        let found = route(&world, &out, words);
        let error = String::from_utf8(found.stderr).unwrap();
        assert_eq!(found.status.code(), Some(code), "{words:?}: {error}");
        assert!(error.lines().count() == 1 && error.contains(told), "{words:?}: {error}");
        assert!(!out.join("route.png").exists(), "{words:?} left a picture behind");
    };
    let start = ["--start", "20,20,0", "--goal"];
    let with = |goal: &'static str| [start[0], start[1], start[2], goal];
    refused(&with("500,20"), 2, "goal: expected a point of the map, found (500.0, 20.0)");
    refused(&with("110,20"), 2, "goal at (110.0, 20.0) m: nothing is known of the ground");
    refused(&with("50,20"), 2, "goal at (50.0, 20.0) m: an obstacle stands in the way");
    refused(
        &["--start", "20,20,0", "--goal", "80,20", "--cell", "0.001"],
        2,
        "resolution_m: expected 0.05 to 100 m",
    );
    refused(
        &["--start", "20,20,0", "--goal", "80,20", "--speed", "-1"],
        2,
        "speed_max_mps: expected 0.1 to 100 m/s",
    );
    // Cells of 20 m do not show the ford.
    refused(&["--start", "20,20,0", "--goal", "80,20", "--cell", "20"], 1, "no route: ");
}

fn surefoot(words: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_surefoot")).args(words).output().unwrap()
}

/// The ford as of two robots, one of which measured it 100 m farther north.
#[test]
fn files_become_a_map_in_tiles_that_routes_are_searched_on() {
    let (folder, world) = ford();
    let path = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let (map, out) = (path("map"), path("out"));
    let merged = surefoot(&["map", &map, &world, "--cell", "0.5", "--out", &out]);
    let told = String::from_utf8(merged.stdout).unwrap();
    assert!(merged.status.success(), "{}", String::from_utf8_lossy(&merged.stderr));
    // 120 m in tiles of 128 m; 100 of them were measured, but for what lies nearest to the border.
    assert!(
        told.contains("1 tiles in cells of 0.5 m") && told.contains("from (0, 0) to (128, 128) m"),
        "{told}"
    );
    let summary: serde_json::Value =
        serde_json::from_slice(&std::fs::read(Path::new(&out).join("map.json")).unwrap()).unwrap();
    let n_new = summary["merged"][0]["new"].as_u64().unwrap();
    assert!((47_000..=48_500).contains(&n_new), "{summary}");
    assert!(std::fs::read(Path::new(&out).join("map.png")).unwrap().starts_with(b"\x89PNG"));
    let inspected = String::from_utf8(surefoot(&["inspect", &map]).stdout).unwrap();
    assert!(inspected.contains("map in tiles") && inspected.contains("\"rows\": 256"), "{inspected}");
    // Another robot's, 100 m north of it, in a folder that is there.
    let other = path("other");
    std::fs::create_dir(&other).unwrap();
    let north = surefoot(&["map", &other, &world, "--cell", "0.5", "--at", "0,100", "--out", &out]);
    assert!(north.status.success(), "{}", String::from_utf8_lossy(&north.stderr));
    let both = surefoot(&["map", &map, &other, "--out", &out]);
    let told = String::from_utf8(both.stdout).unwrap();
    assert!(told.contains("2 tiles") && told.contains("agree, 0 contradict"), "{told}");
    let summary: serde_json::Value =
        serde_json::from_slice(&std::fs::read(Path::new(&out).join("map.json")).unwrap()).unwrap();
    // They share 20 m north of 100 m, of one height: 200 x 40 cells.
    let n_agreeing = summary["merged"][0]["agreeing"].as_u64().unwrap();
    assert!((7_800..=8_100).contains(&n_agreeing), "{summary}");
    let found = route(&map, Path::new(&out), &["--start", "20,20,0", "--goal", "80,180", "--speed", "3"]);
    let told = String::from_utf8(found.stdout).unwrap();
    assert!(found.status.success(), "{}", String::from_utf8_lossy(&found.stderr));
    assert!(told.contains("over map") && told.contains("expected time"), "{told}");
}

#[test]
fn what_makes_no_map_in_tiles_is_told_in_one_line() {
    let (folder, world) = ford();
    let map = folder.path().join("map");
    let out = folder.path().join("out");
    let refused = |words: &[&str], told: &str| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_surefoot"));
        let found = command.args(words).arg("--out").arg(&out).output().unwrap();
        let error = String::from_utf8(found.stderr).unwrap();
        assert_eq!((found.status.code(), error.lines().count()), (Some(2), 1), "{words:?}: {error}");
        assert!(error.contains(told), "{words:?}: {error}");
    };
    let folder = folder.path().to_str().unwrap();
    let tiles = map.to_str().unwrap();
    refused(&["map", tiles], "resolution_m: map in tiles: expected the size of its cells in metres");
    refused(&["map", tiles, "nowhere.npz"], "nowhere.npz");
    refused(&["map", tiles, "nowhere.npz", "--cell", "1"], "nowhere.npz");
    refused(&["map", tiles, &world, "--cell", "0"], "--cell: expected 0.05 to 100 m, found 0");
    refused(&["map", tiles, &world, "--deviation", "nan"], "--deviation: expected 0.01 to 2.5 m, found NaN");
    refused(
        &["map", tiles, &world, "--at", "1e300,0"],
        "--at: expected at most 20000000 m, found [1e300, 0.0]",
    );
    refused(&["map", tiles, &world, "--listen", "field"], "--listen");
    refused(&["map", tiles, "--listen", "nobody-is-here"], "expected a run that is there, found none named");
    assert!(!map.exists(), "nothing was merged");
    let ways = ["--start", "20,20,0", "--goal", "80,20"];
    let with = |words: &[&'static str]| [&["route", "--world", folder][..], &ways, words].concat();
    refused(&with(&[]), "map in tiles: expected the size of its cells in metres, found no such file");
    assert!(surefoot(&["map", tiles, &world, "--out", out.to_str().unwrap()]).status.success());
    refused(&["map", tiles, tiles], "expected another map to merge, found the map itself");
    let with = |words: &[&'static str]| [&["route", "--world", tiles][..], &ways, words].concat();
    refused(&with(&["--bare", "mud"]), "--bare: expected with a file");
    refused(&with(&["--cell", "0.3"]), "--cell: expected 1 to 1024 m, as");
    std::fs::write(map.join("0_0_0.tile"), "torn").unwrap();
    refused(&with(&[]), "0_0_0.tile: bytes: expected 45 or 786465, found 4");
}

#[test]
fn an_interrupted_merge_keeps_what_it_has_and_says_how_much() {
    let (folder, world) = ford();
    let map = folder.path().join("map");
    let out = folder.path().join("out");
    let (tiles, out) = (map.to_str().unwrap(), out.to_str().unwrap());
    let mut words = vec!["map", tiles, "--cell", "0.5", "--out", out];
    words.extend([world.as_str(); 2000]);
    let mut command = Command::new(env!("CARGO_BIN_EXE_surefoot"));
    let merging = command.args(words).stderr(Stdio::piped()).stdout(Stdio::null()).spawn().unwrap();
    let is_tile = |path: &Path| path.extension().is_some_and(|ending| ending == "tile");
    let has_tiles =
        || std::fs::read_dir(&map).is_ok_and(|mut files| files.any(|file| is_tile(&file.unwrap().path())));
    // Not longer than a minute.
    for _ in 0..12_000 {
        if has_tiles() {
            break;
        }
        std::thread::sleep(Duration::from_millis(5));
    }
    let interrupted = Command::new("kill").args(["-INT", &merging.id().to_string()]).status().unwrap();
    let ended = merging.wait_with_output().unwrap();
    let told = String::from_utf8(ended.stderr).unwrap();
    assert!(interrupted.success() && ended.status.code() == Some(1), "{told}");
    assert!(told.contains("interrupted by the user; ") && told.ends_with(" of 2000 are merged\n"), "{told}");
    let again = String::from_utf8(surefoot(&["map", tiles, &world, "--out", out]).stdout).unwrap();
    assert!(again.contains(": 0 cells new, ") && again.contains(" agree, 0 contradict"), "{again}");
}
