use std::fs;

use super::*;

const VEHICLE: &str = "\
name = \"v\"
reference_point = \"rear_axle\"
wheelbase = 2.5
max_steer = 0.6
max_speed = 7.0
log_rate_hz = 50.0
[noise]
x = 0.01
y = 0.02
z = 0.5
yaw = 0.003
vx = 0.03
wz = 0.008
[map]
heightmap = \"h.csv\"
terrain_class = \"c.csv\"
resolution = 0.5
origin_x = -1.0
origin_y = 2.0
index = \"row = x, column = y\"
classes = { 0 = \"open\" }
";

/// Reads `vehicle` beside grids of two rows (x) and three columns (y).
fn read(vehicle: &str, heights: &str, classes: &str) -> Result<GapVehicle, String> {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("vehicle.toml"), vehicle).unwrap();
    fs::write(folder.path().join("h.csv"), heights).unwrap();
    fs::write(folder.path().join("c.csv"), classes).unwrap();
    read_gap_vehicle(&folder.path().join("vehicle.toml")).map_err(|error| error.to_string())
}

const HEIGHTS: &str = "0,0.5,1\n2,2.5,3\n";
const CLASSES: &str = "0,1,2\n0,0,1\n";

#[test]
fn rows_go_east_and_columns_north() {
    let vehicle = read(VEHICLE, HEIGHTS, CLASSES).unwrap();
    assert_eq!((vehicle.wheelbase_m, vehicle.steering_max_rad), (2.5, Some(0.6)));
    assert_eq!((vehicle.noise.y, vehicle.noise.wz), (Some(0.02), Some(0.008)));
    let ground = vehicle.ground.unwrap();
    assert_eq!((ground.n_nodes, ground.origin_m, ground.resolution_m), ([2, 3], [-1.0, 2.0], 0.5));
    // Node one step east and two north.
    assert_eq!((ground.height_m[3 + 2], ground.class[3 + 2]), (3.0, 1));
    // One step north, and one east: neither is where the other order has it.
    assert_eq!((ground.height_m[1], ground.class[1]), (0.5, 1));
    assert_eq!((ground.height_m[3], ground.class[3]), (2.0, 0));
}

#[test]
fn noise_map_limits_and_classes_may_be_absent() {
    let bare = read("name = \"v\"\nwheelbase = 1\nskid = true\n", "", "").unwrap();
    assert_eq!(
        (bare.wheelbase_m, bare.noise, bare.ground, bare.speed_max_mps),
        (1.0, GapNoise::default(), None, None)
    );
    let unclassed = VEHICLE.replace("terrain_class = \"c.csv\"\n", "");
    assert_eq!(read(&unclassed, HEIGHTS, "").unwrap().ground.unwrap().class, [0; 6]);
}

#[test]
fn what_no_vehicle_can_be_is_refused_with_its_place() {
    let with = |from: &str, to: &str| VEHICLE.replace(from, to);
    let vehicles = [
        (with("wheelbase = 2.5\n", ""), "wheelbase: expected a value, found no such key"),
        (
            with("wheelbase = 2.5", "wheelbase = -1"),
            "vehicle.toml:3: wheelbase: expected a finite number > 0, found -1",
        ),
        (with("wheelbase = 2.5", "wheelbase = nan"), "wheelbase: expected a finite number > 0, found NaN"),
        (
            with("max_steer = 0.6", "max_steer = 35"),
            "max_steer: expected an angle below 1.5 rad (degrees?), found 35",
        ),
        (
            with("yaw = 0.003", "yaw = -0.1"),
            "vehicle.toml:11: noise.yaw: expected a finite number >= 0, found -0.1",
        ),
        (with("yaw = 0.003", "yaw = \"low\""), "noise.yaw: expected"),
        (with("origin_x = -1.0\n", ""), "map.origin_x: expected a value, found no such key"),
        (with("origin_x = -1.0", "origin_x = inf"), "map.origin_x: expected a finite number, found inf"),
        (with("resolution = 0.5", "resolution = 0"), "map.resolution: expected a finite number > 0, found 0"),
        (with("rear_axle", "centre"), "reference_point: expected rear_axle, found centre"),
        (
            with("row = x, column = y", "row = y, column = x"),
            "map.index: expected row = x, column = y, found row = y",
        ),
    ];
    for (vehicle, expected) in vehicles {
        let told = read(&vehicle, HEIGHTS, CLASSES).unwrap_err();
        assert!(told.contains(expected), "{told}");
    }
}

#[test]
fn what_no_grid_can_be_is_refused_with_line_and_column() {
    let grids = [
        ("0,1,2\n3,nan,5\n", CLASSES, "h.csv:2: column 2: expected a finite height in metres, found 'nan'"),
        ("0,1,2\n3,,5\n", CLASSES, "h.csv:2: column 2: expected a finite height in metres, found ''"),
        ("0,1,2\n3,4\n", CLASSES, "h.csv:2: column 2: expected 3 columns as above, found 2"),
        (
            "0,1,2\n",
            CLASSES,
            "h.csv:1: column 1: expected at least 2 rows (x) and 2 columns (y), found 1 x 3",
        ),
        (HEIGHTS, "0,1,2\n0,-1,1\n", "c.csv:2: column 2: expected a class from 0 to 255, found '-1'"),
        (
            HEIGHTS,
            "0,1\n2,0\n",
            "map.terrain_class: expected 2 x 3 nodes as in map.heightmap, found 2 x 2 nodes",
        ),
    ];
    for (heights, classes, expected) in grids {
        let told = read(VEHICLE, heights, classes).unwrap_err();
        assert!(told.contains(expected), "{told}");
    }
    let told = read(&VEHICLE.replace("h.csv", "none.csv"), HEIGHTS, CLASSES).unwrap_err();
    assert!(told.contains("none.csv: expected a readable grid in CSV, found: "), "{told}");
}
