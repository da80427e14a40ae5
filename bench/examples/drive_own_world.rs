//! Everything together on a world and with a vehicle of one's own: plant, sensors, map, prior, risk map and controller
//! in a closed loop, around a rock to the goal.
//!
//! `cargo run -p bench --example drive_own_world`

use std::error::Error;
use std::sync::Arc;

use bench::closed_loop::{ClosedLoop, Drive, MapSource, Method};
use bicycle::{Decision, Model};
use formats::{ConfigText, parse_vehicle, shipped_vehicle_text};
use navigator::Config;
use scenarios::{EpisodeConfig, Outcome, Patch, Stribeck, Task, World};
use terrain::GridGeometry;
use traversability::CvarLevel;

fn main() -> Result<(), Box<dyn Error>> {
    // A shipped car with slower steering; every number of the file may be your own.
    let shipped = shipped_vehicle_text("rc_car").ok_or("expected the vehicle to ship")?;
    let own = shipped.replace("steering_rate_max_radps = 4.0", "steering_rate_max_radps = 2.0");
    let vehicle = parse_vehicle(&ConfigText::new("mine.toml", own))?;
    assert!((vehicle.limits.steering_rate_max_radps - 2.0).abs() < 1e-12);

    // 10 x 6 m of dirt with a rock of 0.4 m radius in the way.
    let rock_m = |x_m: f64, y_m: f64| (x_m - 3.0).hypot(y_m - 0.1) < 0.4;
    let geometry = GridGeometry { resolution_m: 0.05, origin: [-40, -60], n_rows: 120, n_cols: 200 };
    let dirt = Patch::open(Stribeck::DIRT);
    let patch = |x_m: f64, y_m: f64| if rock_m(x_m, y_m) { dirt.obstructed(0.5) } else { dirt };
    let world = Arc::new(World::from_fn("one rock", geometry, |_, _| 0.0, patch)?);

    let mut closed = ClosedLoop::new(Drive {
        task: Task::in_world(world, [0.0, 0.0, 0.0], [6.0, 0.0], 0.3),
        vehicle: &vehicle,
        model: Model::of(&vehicle),
        config: Config::for_vehicle(&vehicle),
        episode: EpisodeConfig::for_vehicle(&vehicle),
        method: Method::Physics,
        networks: None,
        corrector: None,
        map_source: MapSource::Sensed,
        level: CvarLevel::new(0.5)?,
        seed: 1,
    })?;
    let mut n_stops = 0;
    while closed.episode.outcome().is_none() {
        n_stops += usize::from(matches!(closed.cycle()?.decision, Decision::Stop(_)));
    }
    let detour_m =
        closed.episode.trace().iter().fold(0.0, |most: f64, row| most.max(row.motion.pose.y_m.abs()));
    println!(
        "{:?} after {:.1} s and {:.2} m, up to {detour_m:.2} m beside the straight line; {n_stops} stops",
        closed.episode.outcome(),
        closed.episode.time_s(),
        closed.episode.path_length_m()
    );
    assert_eq!(closed.episode.outcome(), Some(Outcome::Goal));
    assert!(detour_m > 0.3, "the rock is in the way of a straight drive");
    Ok(())
}
