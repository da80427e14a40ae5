//! A route around a frozen pond.
//!
//! `cargo run -p route --example around_ice`

use route::{FrictionCurve, GroundCell, Planner, RouteConfig, SpeedLimits};
use terrain::{GridGeometry, GridMap};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let geometry = GridGeometry { resolution_m: 1.0, origin: [0, 0], n_rows: 60, n_cols: 100 };
    let cell = |index: usize| {
        let [x_m, y_m] = geometry.centre_m(geometry.cell(index));
        let is_frozen = (x_m - 50.0).hypot(y_m - 30.0) < 12.0;
        GroundCell::level(if is_frozen { FrictionCurve::ICE } else { FrictionCurve::GRASS })
    };
    let values = (0..geometry.n_cells()).map(cell).collect();
    let ground = GridMap::from_values(geometry, values).ok_or("a value for every cell")?;
    let planner = Planner::new(ground, RouteConfig::default())?;
    let route = planner.route(([10.5, 30.5], 0.0), [90.5, 30.5], &SpeedLimits::default())?;
    for point in route.line.points.iter().step_by(10) {
        println!("({:5.1}, {:5.1}) m at {:.1} m/s", point.at_m[0], point.at_m[1], point.speed_mps);
    }
    println!("{:.1} m in {:.1} s", route.line.length_m(), route.line.duration_s);
    assert!(route.line.points.iter().all(|point| point.bend.friction > 0.3));
    Ok(())
}
