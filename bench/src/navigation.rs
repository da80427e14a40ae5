//! The navigation table: the same drives over the default rock field with every method and risk tolerance.
//!
//! Drives run beside each other, each with a controller of one thread, so that the table depends neither on the number
//! of threads nor on the order in which drives end. Drives of the same seed share world, start, goal and sensor noise:
//! their results are paired.

mod drive;
mod row;

use bicycle::Vehicle;
use mppi::Isa;
use navigator::Config;
use scenarios::{EpisodeConfig, RockFieldConfig};
use serde::Serialize;
use traversability::CvarLevel;

use crate::closed_loop::Method;
use crate::sweep::{SweepError, hash_of, sweep};
pub use drive::{DriveResult, name_of_outcome};
use drive::{Finished, Job};
pub use row::{Row, WILSON_Z, wilson_interval};

/// Name of the machine that drives.
pub const VEHICLE: &str = "pietra_full_size";

/// Which drives to do, and how.
#[derive(Clone, Debug, PartialEq)]
pub struct Request {
    /// What the controller knows of the ground; a row each, for every level where there are levels.
    pub methods: Vec<Method>,
    /// Risk tolerances of the methods that know distributions, see [`Method::has_level`].
    pub levels: Vec<CvarLevel>,
    /// Seeds 1 to this.
    pub n_seeds: u64,
    /// Longest drive, simulated [s].
    pub time_limit_s: f64,
    /// Drives at a time.
    pub n_threads: usize,
    /// Instruction set of the controller.
    pub isa: Isa,
}

impl Request {
    /// How many drives that are.
    pub fn n_drives(&self) -> u64 {
        jobs(self).len() as u64
    }
}

/// All drives and what they add up to.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Report {
    /// Kind of world.
    pub world: &'static str,
    /// Name of the machine.
    pub vehicle: &'static str,
    /// Seeds were 1 to this.
    pub n_seeds: u64,
    /// Longest drive, simulated [s].
    pub time_limit_s: f64,
    /// Instruction set that the controller used; another one may differ in the last bits, and then in a drive's course.
    pub isa: Isa,
    /// [`formats::config_hash`] of the pipeline's configuration.
    pub config_hash: String,
    /// One row for each method and level.
    pub rows: Vec<Row>,
    /// Drives row by row, each row by ascending seed.
    pub drives: Vec<DriveResult>,
}

impl Report {
    /// Every row with its drives, by ascending seed.
    pub fn rows_with_drives(&self) -> impl Iterator<Item = (&Row, &[DriveResult])> {
        self.rows.iter().zip(self.drives.chunks(self.n_seeds.max(1) as usize))
    }
}

/// What all drives have in common.
struct Settings {
    field: RockFieldConfig,
    vehicle: Vehicle,
    config: Config,
    episode: EpisodeConfig,
}

/// Does all drives; `after_drive` sees each one as it ends, in any order and on any thread.
///
/// # Errors
/// Nothing to drive, no threads to be had, or a drive that could not begin or go on.
pub fn measure(request: &Request, after_drive: impl Fn(&DriveResult) + Sync) -> Result<Report, SweepError> {
    let jobs = jobs(request);
    if jobs.is_empty() {
        return Err(SweepError::NoDrives {
            expected: "at least one seed, one method and, for physics, one alpha",
        });
    }
    let settings = settings(request)?;
    let after = |finished: &Finished| after_drive(&finished.result);
    let finished = sweep(&jobs, request.n_threads, |job| job.drive(&settings), after)?;
    let isa = finished.first().map_or(request.isa, |finished| finished.isa);
    let drives: Vec<DriveResult> = finished.into_iter().map(|finished| finished.result).collect();
    Ok(Report {
        world: "rocks",
        vehicle: VEHICLE,
        n_seeds: request.n_seeds,
        time_limit_s: request.time_limit_s,
        isa,
        config_hash: hash_of(&settings.config)?,
        rows: drives.chunks(request.n_seeds as usize).filter_map(Row::of).collect(),
        drives,
    })
}

/// Row by row, each row by ascending seed.
fn jobs(request: &Request) -> Vec<Job> {
    let rows = request.methods.iter().flat_map(|&method| match method.has_level() {
        true => request.levels.iter().map(|&level| (method, Some(level))).collect(),
        false => vec![(method, None)],
    });
    rows.flat_map(|(method, level)| (1..=request.n_seeds).map(move |seed| Job { method, level, seed }))
        .collect()
}

fn settings(request: &Request) -> Result<Settings, SweepError> {
    let vehicle = formats::read_vehicle(VEHICLE)?;
    let mut config = Config::for_vehicle(&vehicle);
    config.controller.n_threads = 1;
    config.controller.isa = request.isa;
    let mut episode = EpisodeConfig::for_vehicle(&vehicle);
    episode.rules.time_limit_s = request.time_limit_s;
    Ok(Settings { field: RockFieldConfig::default(), vehicle, config, episode })
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::{AtomicUsize, Ordering};

    use super::*;
    use scenarios::Outcome;

    fn request(methods: &[Method], levels: &[f64], n_seeds: u64) -> Request {
        Request {
            methods: methods.to_vec(),
            levels: levels.iter().map(|&level| CvarLevel::new(level).unwrap()).collect(),
            n_seeds,
            time_limit_s: 1.0,
            n_threads: 1,
            isa: Isa::Portable,
        }
    }

    #[test]
    fn only_physics_is_driven_once_for_each_level() {
        let all = request(&[Method::Truth, Method::Physics, Method::Nominal], &[0.4, 0.8], 3);
        let told: Vec<String> = jobs(&all).iter().step_by(3).map(ToString::to_string).collect();
        assert_eq!(
            told,
            ["truth, seed 1", "physics, alpha 0.4, seed 1", "physics, alpha 0.8, seed 1", "nominal, seed 1"]
        );
        assert_eq!(jobs(&all).iter().map(|job| job.seed).collect::<Vec<_>>(), [1, 2, 3].repeat(4));
    }

    #[test]
    fn nothing_to_drive_is_told() {
        for nothing in [
            request(&[], &[0.4], 1),
            request(&[Method::Physics], &[], 1),
            request(&[Method::Physics], &[0.4], 0),
        ] {
            assert!(matches!(measure(&nothing, |_| ()), Err(SweepError::NoDrives { .. })));
        }
    }

    #[test]
    fn table_does_not_depend_on_threads_and_its_drives_obey_the_rules() {
        let alone = request(&[Method::Nominal], &[], 2);
        let n_seen = AtomicUsize::new(0);
        let report = measure(&alone, |_| {
            n_seen.fetch_add(1, Ordering::Relaxed);
        })
        .unwrap();
        assert_eq!(n_seen.into_inner(), 2);
        assert_eq!(report.isa, Isa::Portable);
        assert_eq!(report.rows.len(), 1);
        for (drive, seed) in report.drives.iter().zip(1..) {
            assert_eq!((drive.seed, drive.outcome), (seed, Outcome::Timeout));
            assert!((drive.time_s - 1.0).abs() < 0.01, "{}", drive.time_s);
            // 40 m as the crow flies, 1 m of tolerance, at most 1.5 m/s for one second.
            assert!((38.0..=40.01).contains(&drive.distance_to_goal_m), "{}", drive.distance_to_goal_m);
            assert!(drive.path_length_m < 1.5, "{}", drive.path_length_m);
            let [x_m, y_m] = drive.failed_at_m.unwrap();
            // The start lies 20 m from the middle of a field of 50 m.
            assert!(((x_m - 25.0).hypot(y_m - 25.0) - 20.0).abs() < 1.5, "{x_m}, {y_m}");
        }
        let shared = measure(&Request { n_threads: 2, ..alone }, |_| ()).unwrap();
        assert_eq!(shared, report);
    }

    #[test]
    fn drive_that_cannot_be_is_told_by_name() {
        let mut never = request(&[Method::Nominal], &[], 1);
        never.time_limit_s = -1.0;
        let told = measure(&never, |_| ()).unwrap_err().to_string();
        assert!(told.starts_with("nominal, seed 1: ") && told.contains("time_limit_s"), "{told}");
    }
}
