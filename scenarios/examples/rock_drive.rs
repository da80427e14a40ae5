//! The plant alone, weaving over rocks for as long as asked. The machine's clock stays outside:
//!
//! `time cargo run --release -p scenarios --example rock_drive -- 600`
//!
//! less the same with 0 is what ten minutes of driving cost; 600 s over that is how many times faster than real time
//! the plant runs on one core.

use std::error::Error;
use std::sync::Arc;

use bicycle::{Command, Vehicle};
use scenarios::{Plant, RockFieldConfig, RockMap, Split, rock_field};

/// Driving from one place before the next drive begins [s].
const DRIVE_S: f64 = 20.0;
/// Commands per second [Hz].
const COMMAND_HZ: f64 = 10.0;

fn main() -> Result<(), Box<dyn Error>> {
    let asked = std::env::args().nth(1).unwrap_or_else(|| "60".to_owned());
    let duration_s: f64 = asked.parse().map_err(|_| format!("expected seconds to drive, found {asked}"))?;
    let vehicle: Vehicle = toml::from_str(include_str!("../vehicles/pietra_full_size.toml"))?;
    let map = RockMap { seed: 11, split: Split::Test, index: 0 };
    let pads_m = [[10.0, 10.0], [10.0, 25.0], [10.0, 40.0], [25.0, 25.0]];
    let world = Arc::new(rock_field(&RockFieldConfig::default(), map, &pads_m)?);
    let mut driven_m = 0.0;
    for drive in 0..(duration_s / DRIVE_S).round() as usize {
        let [x_m, y_m] = pads_m[drive % pads_m.len()];
        let mut plant = Plant::new(&vehicle, Arc::clone(&world), [x_m, y_m, 0.9 * drive as f64])?;
        let start = plant.pose();
        for cycle in 0..(DRIVE_S * COMMAND_HZ) as usize {
            let steering_rad = (0.4 * (0.07 * cycle as f64).sin()) as f32;
            plant.set_command(Command { speed_mps: 1.0, steering_rad })?;
            plant.advance(1.0 / COMMAND_HZ);
        }
        let end = plant.pose();
        driven_m += (end.x_m - start.x_m).hypot(end.y_m - start.y_m);
    }
    println!("{duration_s} s over rocks, {driven_m:.3} m from where the drives began");
    Ok(())
}
