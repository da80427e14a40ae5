//! Scans put together point by point; the body frame is the map frame.

use terrain::{ElevationConfig, ElevationMap, RangePoint, Scan, TerrainClass};

/// A scan whose rays start high above the map's origin.
pub fn scan_of(points: impl IntoIterator<Item = ([f64; 3], TerrainClass)>) -> Scan {
    let points = points
        .into_iter()
        .map(|(position, class)| RangePoint { position_m: position.map(|v| v as f32), class })
        .collect();
    Scan { valid_at_ns: 0, origin_m: [0.0, 0.0, 10.0], points }
}

/// 40 x 40 cells of 0.5 m that never move and publish every change; no noise but a point's own 2 cm.
pub fn plain_config() -> ElevationConfig {
    ElevationConfig {
        resolution_m: 0.5,
        n_rows: 40,
        n_cols: 40,
        recentre_m: f64::INFINITY,
        noise_floor_m: 0.02,
        noise_per_range: 0.0,
        scan_noise_m: 0.0,
        scan_tilt_rad: 0.0,
        fading_m2ps: 0.0,
        gap_radius_m: 1.0,
        publish_step_m: 0.0,
        ..ElevationConfig::default()
    }
}

/// A map of [`plain_config`], changed as wished.
pub fn plain_map(change: impl FnOnce(&mut ElevationConfig)) -> ElevationMap {
    let mut config = plain_config();
    change(&mut config);
    ElevationMap::new(config).unwrap()
}

/// Centres of all cells of the window of [`plain_config`].
pub fn all_centres() -> impl Iterator<Item = [f64; 2]> + Clone {
    (0..40).flat_map(|row| (0..40).map(move |col| [f64::from(col) * 0.5 - 9.75, f64::from(row) * 0.5 - 9.75]))
}
