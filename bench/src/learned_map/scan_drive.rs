//! Maps along a way past ground that one real scan has seen.

use std::sync::Arc;

use bicycle::Vehicle;
use bicycle::lanes::{Instructions, Isa};
use evidential::{BeliefMap, Learned, Unfamiliar};
use serde::Serialize;
use terrain::{ElevationConfig, ElevationMap, GridGeometry, Pose, RangePoint, Scan, TerrainClass};
use traversability::CvarLevel;

use super::{Sizes, untrained};
use crate::prior_map::{CVAR_LEVEL, N_YAWS, SEED, WINDOW};
use crate::stopwatch::timed_ms;
use crate::{BenchError, Spread};

/// Way between two scans [m].
const STEP_M: f64 = 0.1;
/// The window of the risk map follows after so many cells.
const RECENTRE_CELLS: i64 = 4;
/// First scans that are not counted.
const N_WARM_UP: usize = 2;
/// Margin of the elevation map around the risk map [cells].
const MARGIN: usize = 20;
/// Returns within this distance of the sensor are of the machine that carried it [m].
const OWN_BODY_M: f64 = 2.2;

/// A scan, and how to drive past it.
#[derive(Clone, Debug, PartialEq)]
pub struct ScanDrive {
    /// Points in the sensor's frame [m].
    pub points_m: Vec<[f32; 3]>,
    /// Scans along the way.
    pub n_scans: usize,
    /// Threads that share the work.
    pub n_threads: usize,
    /// Sizes of the networks.
    pub sizes: Sizes,
    /// Instruction set.
    pub isa: Isa,
}

/// What the maps along the way cost.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct ScanDriveReport {
    /// Points of every scan.
    pub points: usize,
    /// Scans along the way, after a first one.
    pub scans: usize,
    /// A change of a height below this is not published [m].
    pub publish_step_m: f32,
    /// Share of the poses that was judged anew, mean over the scans.
    pub judged_share: f64,
    /// Fusing a scan into the elevation map [ms].
    pub fuse_ms: Spread,
    /// Bringing the risk map up to date with what the scan changed [ms].
    pub update_ms: Spread,
}

/// Drives straight ahead past what the scan has seen. The ground stands still: seen from every next place, its points
/// are so much nearer.
///
/// # Errors
/// No scan asked for, networks that make no sense, or no threads to be had.
pub fn measure_scan_drive(drive: &ScanDrive) -> Result<ScanDriveReport, BenchError> {
    if drive.n_scans == 0 {
        return Err(BenchError::NoUpdates);
    }
    let pool = rayon::ThreadPoolBuilder::new().num_threads(drive.n_threads).build()?;
    let vehicle = formats::read_vehicle("rc_car")?;
    pool.install(|| along_the_way(drive, &vehicle))
}

fn along_the_way(drive: &ScanDrive, vehicle: &Vehicle) -> Result<ScanDriveReport, BenchError> {
    let mut elevation = ElevationMap::new(elevation_config())?;
    let publish_step_m = elevation_config().publish_step_m;
    let learned = Learned {
        checkpoint: Arc::new(untrained(&vehicle.geometry, &vehicle.name, &drive.sizes, SEED)?),
        unfamiliar: Unfamiliar::Fuse,
        obstacle_margin_m: 0.0,
        level: CvarLevel::new(CVAR_LEVEL)?,
    };
    let instructions = Instructions::find(drive.isa).map_err(mppi::ConfigError::from)?;
    let resolution_m = WINDOW.resolution_m;
    let mut map = BeliefMap::new(&vehicle.geometry, &learned, resolution_m, WINDOW, N_YAWS, instructions)?;
    let (mut fuse_ms, mut update_all_ms) = (Vec::new(), Vec::new());
    let mut n_judged = 0;
    for step in 0..drive.n_scans + N_WARM_UP {
        let pose = Pose { x_m: STEP_M * step as f64, ..Pose::default() };
        let scan = scan_from(&drive.points_m, &pose, step);
        let (fused_ms, fused) = timed_ms(|| elevation.fuse(&scan, &pose));
        fused?;
        follow(&mut map, &pose);
        let (update_ms, judged) = timed_ms(|| map.update(elevation.surface()));
        let judged = judged?;
        if step >= N_WARM_UP {
            fuse_ms.push(fused_ms);
            update_all_ms.push(update_ms);
            n_judged += judged;
        }
    }
    Ok(ScanDriveReport {
        points: drive.points_m.len(),
        scans: drive.n_scans,
        publish_step_m,
        judged_share: n_judged as f64 / (drive.n_scans * WINDOW.n_cells() * N_YAWS) as f64,
        fuse_ms: Spread::of(fuse_ms),
        update_ms: Spread::of(update_all_ms),
    })
}

/// A map of the risk map's resolution that covers it with a margin.
fn elevation_config() -> ElevationConfig {
    ElevationConfig {
        resolution_m: WINDOW.resolution_m,
        n_rows: WINDOW.n_rows + MARGIN,
        n_cols: WINDOW.n_cols + MARGIN,
        recentre_m: RECENTRE_CELLS as f64 * WINDOW.resolution_m,
        own_body_m: OWN_BODY_M,
        ..ElevationConfig::default()
    }
}

/// Moves the risk map's window along with the vehicle.
fn follow(map: &mut BeliefMap, pose: &Pose) {
    let now = *map.risk_map().geometry();
    let wanted = GridGeometry::centred(now.resolution_m, now.n_rows, now.n_cols, pose.x_m, pose.y_m);
    if (wanted.origin[0] - now.origin[0]).abs() >= RECENTRE_CELLS {
        map.place_at(wanted.origin);
    }
}

fn scan_from(points_m: &[[f32; 3]], pose: &Pose, step: usize) -> Scan {
    let driven_m = pose.x_m as f32;
    let point = |&[x_m, y_m, z_m]: &[f32; 3]| RangePoint {
        position_m: [x_m - driven_m, y_m, z_m],
        class: TerrainClass::Open,
    };
    Scan {
        valid_at_ns: step as u64 * 100_000_000,
        origin_m: [0.0; 3],
        points: points_m.iter().map(point).collect(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_flat_scan_is_driven_past() {
        let ring = |k: usize| {
            let (angle, far_m) = ((k as f32 * 0.01).sin_cos(), 2.5 + 0.003 * k as f32);
            [far_m * angle.0, far_m * angle.1, -0.8]
        };
        let sizes = Sizes { encoder_hidden: vec![4], n_latent: 2, ..Sizes::default() };
        let points_m = (0..1500).map(ring).collect();
        let drive = ScanDrive { points_m, n_scans: 5, n_threads: 1, sizes, isa: Isa::Auto };
        let report = measure_scan_drive(&drive).unwrap();
        assert_eq!((report.points, report.scans), (1500, 5));
        assert!(report.fuse_ms.min > 0.0 && report.update_ms.min > 0.0);
        assert!(0.0 < report.judged_share && report.judged_share <= 1.0, "{}", report.judged_share);
    }

    #[test]
    fn no_scan_is_refused() {
        let points_m = vec![[3.0, 0.0, -1.0]];
        let drive = ScanDrive { points_m, n_scans: 0, n_threads: 1, sizes: Sizes::default(), isa: Isa::Auto };
        assert!(matches!(measure_scan_drive(&drive), Err(BenchError::NoUpdates)));
    }
}
