//! What physics says of ground that nobody has driven on: a ramp of one's own, judged for a vehicle of one's own.
//!
//! `cargo run -p physics_prior --example judge_a_ramp`

use std::error::Error;

use bicycle::Geometry;
use bicycle::lanes::Instructions;
use physics_prior::{Assumption, PriorConfig, PriorMap};
use terrain::{GridGeometry, GridMap, SurfaceCell, TerrainClass};
use traversability::{Bins, CvarLevel};

const BUGGY: Geometry = Geometry {
    wheelbase_m: 1.2,
    track_m: 0.9,
    length_m: 1.7,
    width_m: 1.1,
    rear_overhang_m: 0.25,
    ground_clearance_m: 0.2,
    wheel_radius_m: 0.2,
};
const RAMP_DEG: f64 = 10.0;

fn main() -> Result<(), Box<dyn Error>> {
    // 16 x 8 m in cells of 0.1 m: level in the west, a ramp that rises eastwards from x = 8 m.
    let geometry = GridGeometry { resolution_m: 0.1, origin: [0, 0], n_rows: 80, n_cols: 160 };
    let cells = (0..geometry.n_cells()).map(|index| {
        let [x_m, _] = geometry.centre_m(geometry.cell(index));
        let height_m = (x_m - 8.0).max(0.0) * RAMP_DEG.to_radians().tan();
        SurfaceCell::certain(height_m as f32, TerrainClass::Open, 0.0)
    });
    let surface =
        GridMap::from_values(geometry, cells.collect()).ok_or("expected one value for every cell")?;

    let prior = PriorConfig::for_vehicle(&BUGGY);
    let level = CvarLevel::new(0.4)?;
    let mut map = PriorMap::new(
        &BUGGY,
        &Assumption::Physics { prior, level },
        0.1,
        geometry,
        8,
        Instructions::widest(),
    )?;
    map.update_all(&surface)?;

    let mean_traction = |x_m: f64| {
        let belief = map.belief(x_m, 4.0, 0.0).ok_or("expected a footprint on the map")?;
        let risk = belief.risk(level);
        println!(
            "x = {x_m:4.1} m, eastwards: linear traction {:.2} (worst {:.1}: {:.2}), worst |pitch| {:.0} degrees",
            belief.linear.mean(&Bins::TRACTION),
            level.get(),
            risk.linear_traction,
            risk.pitch_rad.to_degrees()
        );
        Ok::<f64, Box<dyn Error>>(f64::from(belief.linear.mean(&Bins::TRACTION)))
    };
    let (level_ground, ramp) = (mean_traction(3.0)?, mean_traction(12.0)?);
    // Equations 15 and 18 by hand: 1 - tan(slope) / tan(30 degrees), a fifth of it spread over all bins.
    let share = prior.uniform_weight;
    let by_hand = |slope_deg: f64| {
        let kept = 1.0 - slope_deg.to_radians().tan() / prior.linear_slope_max_rad.tan();
        (1.0 - share) * kept + share * 0.5
    };
    assert!((level_ground - by_hand(0.0)).abs() < 0.01);
    assert!((ramp - by_hand(RAMP_DEG)).abs() < 0.01);
    Ok(())
}
