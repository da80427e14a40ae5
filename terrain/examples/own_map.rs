//! A map of one's own: heights from any source become a surface that the rest of the pipeline reads.
//!
//! `cargo run -p terrain --example own_map`

use std::error::Error;

use terrain::{GridGeometry, GridMap, SurfaceCell, TerrainClass, height_at, slope_at};

const RAMP_DEG: f64 = 15.0;

/// Level up to x = 5 m, then a ramp that rises eastwards.
fn ground_m(x_m: f64) -> f64 {
    (x_m - 5.0).max(0.0) * RAMP_DEG.to_radians().tan()
}

fn main() -> Result<(), Box<dyn Error>> {
    // 20 m east, 10 m north in cells of 0.2 m; the south-west corner lies at the origin of the map frame.
    let geometry = GridGeometry { resolution_m: 0.2, origin: [0, 0], n_rows: 50, n_cols: 100 };
    let cells = (0..geometry.n_cells()).map(|index| {
        let [x_m, y_m] = geometry.centre_m(geometry.cell(index));
        // A bush of 0.4 m stands in the north; what nobody measured stays a hole.
        match (x_m, y_m) {
            (..1.0, ..1.0) => SurfaceCell::UNKNOWN,
            (_, 8.0..) => SurfaceCell::certain(ground_m(x_m) as f32, TerrainClass::Vegetation, 0.4),
            _ => SurfaceCell::certain(ground_m(x_m) as f32, TerrainClass::Open, 0.0),
        }
    });
    let surface =
        GridMap::from_values(geometry, cells.collect()).ok_or("expected one value for every cell")?;

    for x_m in [2.0, 10.0, 15.0] {
        let cell = geometry.cell_at(x_m, 5.0).ok_or("expected a place on the map")?;
        let slope_deg = slope_at(&surface, cell, 2).angle_rad().to_degrees();
        println!(
            "x = {x_m:4.1} m: height {:.2} m, slope {slope_deg:.1} degrees",
            height_at(&surface, x_m, 5.0)
        );
        let expected_deg = if x_m > 5.5 { RAMP_DEG } else { 0.0 };
        assert!((f64::from(slope_deg) - expected_deg).abs() < 0.1);
    }
    let bush = surface.at(3.0, 9.0).ok_or("expected a place on the map")?;
    println!("at (3, 9) m: {:?}, {:.1} m high", bush.class(), bush.vegetation_height_m);
    assert_eq!(bush.class(), TerrainClass::Vegetation);
    assert!(height_at(&surface, 0.5, 0.5).is_nan(), "a hole has no height");
    Ok(())
}
