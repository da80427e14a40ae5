//! A drive that never happened, drawn: an arc over a hill with its speed and attitude, as the picture that
//! `surefoot drive` leaves.
//!
//! `cargo run -p report --example draw_a_drive`

use std::error::Error;

use bicycle::Vehicle;
use report::drive::{DrivePicture, PathSample, picture};
use scenarios::{Patch, Stribeck, World, WorldError};
use terrain::GridGeometry;

/// 24 x 20 m with a hill of 1.5 m in the middle.
fn hill() -> Result<World, WorldError> {
    let geometry = GridGeometry { resolution_m: 0.2, origin: [0, 0], n_rows: 100, n_cols: 120 };
    let height_m = |x_m: f64, y_m: f64| 1.5 * (-((x_m - 12.0).powi(2) + (y_m - 10.0).powi(2)) / 20.0).exp();
    World::from_fn("hill", geometry, height_m, |_, _| Patch::open(Stribeck::DIRT))
}

/// 12 m of a circle at 1.5 m/s, on the ground.
fn driven(world: &World) -> Vec<PathSample> {
    let sample = |step: u32| {
        let time_s = 0.1 * f64::from(step);
        let angle_rad = 1.5 * time_s / 12.0;
        let (x_m, y_m) = (4.0 + 12.0 * angle_rad.sin(), 4.0 + 12.0 * (1.0 - angle_rad.cos()));
        let [east, north] = world.gradient(x_m, y_m);
        let (sin, cos) = angle_rad.sin_cos();
        let (roll_rad, pitch_rad) = ((north * cos - east * sin).atan(), -(east * cos + north * sin).atan());
        PathSample { time_s, x_m, y_m, yaw_rad: angle_rad, speed_mps: 1.5, roll_rad, pitch_rad }
    };
    (0..=80).map(sample).collect()
}

fn main() -> Result<(), Box<dyn Error>> {
    let vehicle: Vehicle = formats::read_vehicle("rc_car")?;
    let world = hill()?;
    let driven = driven(&world);
    let end = driven.last().ok_or("no samples")?;
    let png = picture(&DrivePicture {
        title: "An arc over a hill",
        subtitles: &["rc_car, 12 m at 1.5 m/s".to_owned()],
        world: &world,
        risk: None,
        known: None,
        unfamiliar: None,
        driven: &driven,
        walked: &[],
        planned: &[],
        areas: None,
        start_m: [4.0, 4.0],
        goal_m: [end.x_m, end.y_m],
        goal_radius_m: 0.3,
        failure: None,
        vehicle: &vehicle,
    })?;
    println!("a PNG of {} kB", png.len() / 1024);
    // PNG's signature, then IHDR with the width as the first number.
    assert_eq!(png[..8], *b"\x89PNG\r\n\x1a\n");
    assert_eq!(png[16..20], 1600_u32.to_be_bytes());
    // With a folder after it, the picture goes there.
    if let Some(folder) = std::env::args_os().nth(1) {
        std::fs::write(std::path::Path::new(&folder).join("drive.png"), png)?;
    }
    Ok(())
}
