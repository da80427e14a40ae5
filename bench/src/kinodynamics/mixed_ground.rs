//! What knowledge of the ground brings the controller on mixed ground: behind it, as a correction of its commands, or inside
//! it, as effects of its model whose strengths it learns while it drives.
//!
//! The car of the tables laps the outdoor track's smooth line on patches of all four surfaces, over a risk map that is the
//! same everywhere, so that nothing but the motion model decides. Ground, sensor noise and samples of a run are the same for
//! every method: runs are compared pair by pair.

mod pilot;
mod row;
mod run;

use std::sync::Arc;

use bicycle::lanes::Instructions;
use kinodynamics::Checkpoint;
use rayon::prelude::*;
use scenarios::seed_of;
use serde::Serialize;

use super::lap::Driver;
use super::models::prepare;
use super::{KinodynamicsError, Request, Row, SURFACES, Stage, Track, Watch, ground, lessons, walls};
pub use row::{MixedRow, Paired, SpeedReport};
pub use run::MixedRun;
use run::Run;

/// Target speeds [m/s].
pub const MIXED_MPS: [f64; 3] = [1.6, 2.0, 2.4];

/// Where knowledge of the ground comes in.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Method {
    /// Nowhere: the kinematic bicycle with the actuators' lags.
    Plain,
    /// Behind the controller: a model that learned without the inertial measurement unit corrects its curvatures.
    CorrectedBlind,
    /// The same with the unit.
    Corrected,
    /// Inside it: understeer, rear slip and drag, estimated from the odometry of the drive itself.
    Adapted,
}

impl Method {
    /// All, in the order of the tables.
    pub const ALL: [Self; 4] = [Self::Plain, Self::CorrectedBlind, Self::Corrected, Self::Adapted];

    /// Name, for reports.
    pub fn name(self) -> &'static str {
        match self {
            Self::Plain => "neither",
            Self::CorrectedBlind => "corrected, without IMU",
            Self::Corrected => "corrected, with IMU",
            Self::Adapted => "adapted model",
        }
    }

    /// Whose checkpoint it drives with.
    fn row(self) -> Option<Row> {
        match self {
            Self::Plain | Self::Adapted => None,
            Self::CorrectedBlind => Some(Row::Ablation),
            Self::Corrected => Some(Row::Learned),
        }
    }
}

/// All runs and what they add up to.
#[derive(Clone, Debug, Serialize)]
pub struct MixedGroundReport {
    /// Decides ground, random driving, noise, samples and initial weights.
    pub seed: u64,
    /// Minutes of random driving that models learned from.
    pub minutes: u32,
    /// Runs of every method at every speed.
    pub runs: u32,
    /// From the line to the walls [m].
    pub half_width_m: f64,
    /// Names of the surfaces, in the order of [`MixedRun::surface_distance_m`].
    pub surfaces: [&'static str; SURFACES.len()],
    /// By ascending speed.
    pub speeds: Vec<SpeedReport>,
}

/// Trains what the methods need, drives, and compares every method with [`Method::Plain`].
///
/// # Errors
/// See [`KinodynamicsError`].
pub fn mixed_ground(
    request: &Request,
    methods: &[Method],
    revision: &str,
    watch: &dyn Watch,
) -> Result<MixedGroundReport, KinodynamicsError> {
    let checkpoints = checkpoints(request, methods, revision, watch)?;
    let instructions = Instructions::widest();
    let middle = walls::middle_line(&Track::outdoor());
    let grounds = (0..request.laps).map(|run| {
        ground(&Track::outdoor(), seed_of(request.seed, &[0x31C5, u64::from(run)]))
            .map(|ground| (run, ground))
    });
    let grounds: Vec<_> = grounds.collect::<Result<_, _>>()?;
    let per_method = grounds.len();
    let per_speed = methods.len() * per_method;
    let n = MIXED_MPS.len() * per_speed;
    watch.stage(Stage::Laps(n as u64));
    let drive = |job: usize| {
        if watch.interrupted() {
            return Err(KinodynamicsError::Interrupted);
        }
        let (speed, rest) = (job / per_speed, job % per_speed);
        let method = rest / per_method;
        let (number, (layout, world)) = &grounds[rest % per_method];
        let run = Run {
            vehicle: &request.vehicle,
            middle: &middle,
            layout: *layout,
            world: Arc::clone(world),
            method: methods[method],
            checkpoint: checkpoints[method].as_deref(),
            speed_mps: MIXED_MPS[speed],
            half_width_m: request.half_width_m,
            seed: seed_of(request.seed, &[0x31C6, speed as u64, u64::from(*number)]),
        };
        let driven = run.drive(*number, instructions);
        watch.step();
        driven
    };
    let driven: Vec<MixedRun> = (0..n).into_par_iter().map(drive).collect::<Result<_, _>>()?;
    let speeds = MIXED_MPS.iter().zip(driven.chunks(per_speed));
    let speeds = speeds.map(|(speed_mps, runs)| SpeedReport::new(*speed_mps, methods, runs));
    let &Request { seed, minutes, laps: runs, half_width_m, .. } = request;
    let surfaces = SURFACES.map(|surface| surface.name);
    Ok(MixedGroundReport { seed, minutes, runs, half_width_m, surfaces, speeds: speeds.collect() })
}

/// The checkpoint of every method that drives with one.
fn checkpoints(
    request: &Request,
    methods: &[Method],
    revision: &str,
    watch: &dyn Watch,
) -> Result<Vec<Option<Arc<Checkpoint>>>, KinodynamicsError> {
    if methods.iter().all(|method| method.row().is_none()) {
        return Ok(vec![None; methods.len()]);
    }
    let lessons = lessons(request, watch)?;
    let checkpoint = |method: &Method| {
        let Some(row) = method.row() else { return Ok(None) };
        let (driver, _) = prepare(request, row, &lessons, (revision, watch))?;
        Ok(match driver {
            Driver::Baseline => None,
            Driver::Model { checkpoint, .. } => Some(checkpoint),
        })
    };
    methods.iter().map(checkpoint).collect()
}

#[cfg(test)]
mod tests;
