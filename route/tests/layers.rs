//! Maps for a route from measured elevation.

#![allow(clippy::unwrap_used, reason = "a panic is how a test fails")]

use route::{FrictionCurve, GroundLayers};
use terrain::{Cell, GridGeometry, GridMap};

fn elevation(resolution_m: f64, n: usize, height_m: impl Fn(f64, f64) -> f64) -> GridMap<f32> {
    let geometry = GridGeometry { resolution_m, origin: [0, 0], n_rows: n, n_cols: n };
    let height = |index: usize| {
        let [x_m, y_m] = geometry.centre_m(geometry.cell(index));
        height_m(x_m, y_m) as f32
    };
    GridMap::from_values(geometry, (0..n * n).map(height).collect()).unwrap()
}

fn layers(elevation_m: &GridMap<f32>) -> GroundLayers<'_> {
    GroundLayers {
        elevation_m,
        low_vegetation_fraction: None,
        water: None,
        ground_gap_m: None,
        bare: FrictionCurve::DIRT,
        grass: FrictionCurve::GRASS,
    }
}

#[test]
fn a_plane_stays_a_plane_without_roughness_in_cells_of_any_size() {
    let plane = |x: f64, y: f64| 3.0 + 0.2 * x - 0.1 * y;
    let fine = elevation(0.5, 80, plane);
    let coarse = elevation(5.0, 8, plane);
    for (elevation_m, resolution_m) in [(&fine, 2.0), (&fine, 0.5), (&coarse, 1.0)] {
        let ground = layers(elevation_m).ground(resolution_m).unwrap();
        let geometry = *ground.geometry();
        assert_eq!(geometry.n_rows, (40.0 / resolution_m) as usize);
        for (index, cell) in ground.values().iter().enumerate() {
            let [x_m, y_m] = geometry.centre_m(geometry.cell(index));
            // Beyond the outermost centres there is nothing to go by.
            let is_inside = [x_m, y_m].iter().all(|m| (5.0..35.0).contains(m));
            let off_m = (f64::from(cell.height_m) - plane(x_m, y_m)).abs();
            // A larger cell's mean is that of the cell that holds its centre: half a small cell off.
            assert!(!is_inside || off_m < 0.08, "{resolution_m}: {cell:?} off by {off_m}");
            assert!(cell.roughness_m < 1e-4, "{cell:?}");
        }
    }
}

#[test]
fn rough_plants_and_water_become_what_they_are_to_a_route() {
    let bumps = elevation(0.25, 80, |x, y| 0.1 * ((8.0 * x).sin() + (8.0 * y).sin()));
    let mut plants = GridMap::filled(*bumps.geometry(), 0.0_f32);
    let mut water = plants.clone();
    for row in 0..80 {
        for col in 0..40 {
            plants[Cell { row, col }] = 0.5;
        }
        water[Cell { row, col: 70 }] = 1.0;
    }
    let with_layers =
        GroundLayers { low_vegetation_fraction: Some(&plants), water: Some(&water), ..layers(&bumps) };
    let ground = with_layers.ground(1.0).unwrap();
    let (west, east) = (ground.at(5.5, 10.5).unwrap(), ground.at(13.5, 10.5).unwrap());
    assert_eq!((west.friction, east.friction), (FrictionCurve::GRASS, FrictionCurve::DIRT));
    // Two sines of 0.1 m deviate by 0.1 m; 0.05 m of what plants hide come on top of it, squared.
    assert!((east.roughness_m - 0.1).abs() < 0.04, "{east:?}");
    assert!((west.roughness_m.powi(2) - 0.05_f32.powi(2)).sqrt() > 0.05, "{west:?}");
    assert!(ground.at(17.6, 3.5).unwrap().is_obstacle && !east.is_obstacle);
    let mut holed = bumps.clone();
    holed.values_mut().fill(f32::NAN);
    assert!(layers(&holed).ground(1.0).unwrap().values().iter().all(|cell| !cell.is_known()));
    let error = layers(&bumps).ground(0.001).unwrap_err().to_string();
    assert_eq!(error, "resolution_m: expected 0.05 to 100 m, found 0.001");
}
