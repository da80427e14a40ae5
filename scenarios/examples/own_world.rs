//! A world of one's own, and the plant on it: a car on four sprung wheels drives over a hill with its steering straight,
//! once as described and once with its linkage mounted askew.
//!
//! `cargo run -p scenarios --example own_world`

use std::error::Error;
use std::f64::consts::PI;
use std::ops::ControlFlow;
use std::sync::Arc;

use bicycle::{Command, Decision, Vehicle};
use scenarios::{Deviation, Episode, EpisodeConfig, Outcome, Patch, Stribeck, Task, World, WorldError};
use terrain::GridGeometry;

/// 12 x 8 m of dirt with a rise of half a metre around x = 4.5 m.
fn hill() -> Result<World, WorldError> {
    let geometry = GridGeometry { resolution_m: 0.1, origin: [-10, -40], n_rows: 80, n_cols: 120 };
    let height_m = |x_m: f64, _: f64| 0.25 * (1.0 + (PI * (x_m - 4.5) / 4.0).clamp(-PI, PI).cos());
    World::from_fn("hill", geometry, height_m, |_, _| Patch::open(Stribeck::DIRT))
}

fn main() -> Result<(), Box<dyn Error>> {
    let vehicle: Vehicle = toml::from_str(include_str!("../vehicles/rc_car.toml"))?;
    let world = Arc::new(hill()?);
    let straight = Decision::Drive(Command { speed_mps: 1.0, steering_rad: 0.0 });
    let mut offsets_m = Vec::new();
    for (name, deviations) in [
        ("as described", Vec::new()),
        ("askew by 0.01 rad", vec![Deviation::SteeringTrim { angle_rad: 0.01 }]),
    ] {
        let task = Task::in_world(Arc::clone(&world), [0.0; 3], [10.0, 0.0], 0.1);
        let config = EpisodeConfig { deviations, range_sensor: None, ..EpisodeConfig::for_vehicle(&vehicle) };
        let mut episode = Episode::new(task, &vehicle, config, 1)?;
        let outcome = episode.run(
            |_observation| straight,
            |episode| match episode.plant().pose().x_m > 8.0 {
                true => ControlFlow::Break(()),
                false => ControlFlow::Continue(()),
            },
        )?;
        let (pose, time_s) = (episode.plant().pose(), episode.time_s());
        let pitch_deg = episode.largest_pitch_rad().to_degrees();
        println!(
            "{name}: ({:.2}, {:.2}) m after {time_s:.1} s, pitch up to {pitch_deg:.0} degrees",
            pose.x_m, pose.y_m
        );
        assert_eq!(outcome, Outcome::Stopped, "broken off beyond the hill, not before");
        // The steepest part of the hill rises by 0.25 PI / 4, 11 degrees; the body rocks a little more.
        assert!((8.0..17.0).contains(&pitch_deg));
        offsets_m.push(pose.y_m);
    }
    // A bicycle of 0.18 m on an arc of radius 0.18 / 0.01 = 18 m is 1.9 m to the left after 8 m; tyres give a little.
    assert!(offsets_m[0].abs() < 0.1);
    assert!((1.0..2.2).contains(&offsets_m[1]));
    Ok(())
}
