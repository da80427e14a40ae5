//! How much the networks that come with the program count, on ground like that of their training and on ground that
//! they have never seen: there the physics prior takes over by itself.
//!
//! `cargo run -p evidential --example learned_weight`

use std::error::Error;
use std::sync::Arc;

use bicycle::lanes::Instructions;
use evidential::{BeliefMap, Learned, Method, PARAMETER_NAMES, Unfamiliar, shipped};
use terrain::{GridGeometry, GridMap, SurfaceCell, TerrainClass};
use traversability::CvarLevel;

fn main() -> Result<(), Box<dyn Error>> {
    let vehicle = formats::read_vehicle("pietra_full_size")?.geometry;
    let learned = Learned {
        checkpoint: Arc::new(shipped(Method::Pietra, &vehicle)?),
        unfamiliar: Unfamiliar::Fuse,
        obstacle_margin_m: 0.0,
        level: CvarLevel::new(0.6)?,
    };
    // 40 x 20 m in cells of 0.2 m: gently rolling in the west, steps of a metre every two metres in the east.
    let geometry = GridGeometry { resolution_m: 0.2, origin: [0, 0], n_rows: 100, n_cols: 200 };
    let cells = (0..geometry.n_cells()).map(|index| {
        let [x_m, y_m] = geometry.centre_m(geometry.cell(index));
        let rolling_m = 0.05 * (x_m / 3.0).sin() * (y_m / 3.0).cos();
        let height_m = if x_m < 20.0 { rolling_m } else { (x_m / 2.0).floor() % 2.0 };
        SurfaceCell::certain(height_m as f32, TerrainClass::Open, 0.0)
    });
    let surface =
        GridMap::from_values(geometry, cells.collect()).ok_or("expected one value for every cell")?;
    let mut map = BeliefMap::new(&vehicle, &learned, 0.2, geometry, 4, Instructions::widest())?;
    map.update_all(&surface)?;

    let share = |name: &str, x_m: f64| {
        let belief = map.belief(x_m, 10.0, 0.0).ok_or("expected a footprint on the map")?;
        for (parameter, share) in PARAMETER_NAMES.iter().zip(belief.learned_share) {
            println!("{name:<8} {parameter:<17} weight of what was learned {share:.3}");
        }
        Ok::<f32, Box<dyn Error>>(belief.learned_share.into_iter().fold(0.0, f32::max))
    };
    let (familiar, steps) = (share("rolling", 9.0)?, share("steps", 30.0)?);
    assert!(familiar > 0.5, "ground like that of the training: {familiar}");
    assert!(steps < 0.1, "ground unlike any of it: {steps}");
    Ok(())
}
