//! A person who crosses, seen five times a second: after a few scans it is known where he will be in two seconds.
//!
//! `cargo run -p tracking --example track_a_walker`

use std::error::Error;

use terrain::{BodyBox, GridGeometry, GridMap, Pose, RangePoint, Scan, SurfaceCell, TerrainClass};
use tracking::{Tracker, TrackingConfig};

const SPEED_MPS: f64 = 1.4;

/// The side of a person that faces a sensor in the south: five columns of points, half a metre wide.
fn seen_at(time_s: f64) -> Scan {
    let columns =
        (-2..=2).flat_map(|column| (1..=5).map(move |height| (f64::from(column), f64::from(height))));
    let points = columns.map(|(column, height)| RangePoint {
        position_m: [-3.0 + SPEED_MPS * time_s + 0.12 * column, 6.0 + 0.06 * column.abs(), 0.3 * height]
            .map(|value| value as f32),
        class: TerrainClass::Obstacle,
    });
    Scan { valid_at_ns: (time_s * 1e9) as u64, origin_m: [0.0, 0.0, 1.5], points: points.collect() }
}

fn main() -> Result<(), Box<dyn Error>> {
    let geometry = GridGeometry::centred(0.2, 120, 120, 0.0, 0.0);
    let ground = GridMap::filled(geometry, SurfaceCell::certain(0.0, TerrainClass::Open, 0.0));
    let config = TrackingConfig::default();
    let mut tracker = Tracker::new(config, BodyBox::EMPTY)?;
    for scan in 0..12 {
        let time_s = 0.2 * f64::from(scan);
        tracker.observe(&seen_at(time_s), &Pose::default(), &ground);
        let Some(track) = tracker.moving().first() else {
            println!("{time_s:.1} s: nothing that moves");
            continue;
        };
        let then = track.predicted(2.0, config.acceleration_density_m2ps3);
        let ([east_mps, north_mps], [x_m, y_m]) = (track.velocity_mps, then.position_m);
        println!(
            "{time_s:.1} s: {east_mps:.2}, {north_mps:.2} m/s; in 2 s at ({x_m:.1}, {y_m:.1}) m, \
             give or take {:.1} m",
            then.std_m
        );
    }
    let track = tracker.moving().first().ok_or("expected a track after 12 scans")?;
    assert!((track.velocity_mps[0] - SPEED_MPS).abs() < 0.1 && track.velocity_mps[1].abs() < 0.1);
    Ok(())
}
