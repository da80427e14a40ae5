//! EVORA's semantic-grid benchmark (Cai et al.): how the risk tolerance decides whether a planner goes through bushes
//! that may stop it, or around them.
//!
//! A unicycle drives from corner to corner of nine by nine metres within 150 steps. Every cell has a traction that the
//! planner knows as a distribution, and plans with its worst share. The paper's planner takes that share in whole bins,
//! ours exactly: both drive the same worlds with the same samples, the first beside the published numbers.
//!
//! The plant is the unicycle's own equation ([`step`]), not the controller's model.

mod belief;
mod cell;
mod drive;
mod mixture;
mod published;
mod world;

use bicycle::lanes::{Instructions, IsaAbsent};
use mppi::Isa;
use serde::Serialize;
use traversability::CvarLevel;

use crate::sweep::in_turns;
pub use belief::{Method, risk_map, whole_bin_cvar};
pub use cell::{Cell, Difference, Paired, Row};
use drive::Job;
pub use drive::{MOST_STEPS, STEP_S, TOLERANCE_M, step};
pub use mixture::{Component, Mixture, N_BINS};
pub use published::Published;
pub use world::{CELL_M, Cover, GOAL_M, N_CELLS, START, World};

/// Which runs to do, and how.
#[derive(Clone, Debug, PartialEq)]
pub struct Request {
    /// Probabilities of a bush, in [0, 1].
    pub densities: Vec<f64>,
    /// Risk tolerances.
    pub levels: Vec<CvarLevel>,
    /// Runs of each density, risk tolerance and method.
    pub n_runs: u64,
    /// Seed of the first; the others follow.
    pub first_seed: u64,
    /// Runs at a time.
    pub n_threads: usize,
    /// Instruction set of the controller.
    pub isa: Isa,
}

impl Request {
    /// How many runs that are.
    pub fn n_drives(&self) -> u64 {
        self.jobs().len() as u64
    }

    /// Cell by cell, in each first whole bins, then the exact CVaR, by ascending seed.
    fn jobs(&self) -> Vec<Job> {
        let seeds = (0..self.n_runs).map(|run| self.first_seed.wrapping_add(run));
        let of_cell = |(density, level)| {
            let seeds = seeds.clone();
            let job = move |method, seed| Job { density, level, method, seed };
            Method::ALL.into_iter().flat_map(move |method| seeds.clone().map(move |seed| job(method, seed)))
        };
        self.cells().flat_map(of_cell).collect()
    }

    fn cells(&self) -> impl Iterator<Item = (f64, CvarLevel)> {
        self.densities.iter().flat_map(|&density| self.levels.iter().map(move |&level| (density, level)))
    }
}

/// All runs and what they add up to.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Report {
    /// Runs of each density, risk tolerance and method.
    pub n_runs: u64,
    /// Seed of the first.
    pub first_seed: u64,
    /// Instruction set that the controller used; another one may differ in the last bits, and then in a run's course.
    pub isa: Isa,
    /// Density by density, each by the risk tolerances as they were asked for.
    pub cells: Vec<Cell>,
}

/// Why there is no table.
#[derive(Debug, thiserror::Error)]
pub enum RiskError {
    /// Nothing to drive.
    #[error("expected at least one density, one alpha and one run, found none")]
    NoRuns,
    /// The forced instruction set is not there.
    #[error(transparent)]
    Isa(#[from] IsaAbsent),
    /// The controller refused its settings.
    #[error(transparent)]
    Controller(#[from] mppi::ConfigError),
    /// The system refused the threads.
    #[error("threads: {0}")]
    Threads(#[from] rayon::ThreadPoolBuildError),
}

/// Does all runs; `after_run` is called as each one ends, in any order and on any thread.
///
/// # Errors
/// Nothing to drive, no threads to be had, or an instruction set that the machine lacks.
pub fn measure(request: &Request, after_run: impl Fn() + Sync) -> Result<Report, RiskError> {
    let jobs = request.jobs();
    if jobs.is_empty() {
        return Err(RiskError::NoRuns);
    }
    let isa = Instructions::find(request.isa)?.isa();
    let pool = rayon::ThreadPoolBuilder::new().num_threads(request.n_threads).build()?;
    let times_s = in_turns(&pool, jobs.len(), |index| {
        let time_s = jobs[index].drive(isa)?;
        after_run();
        Ok::<_, RiskError>(time_s)
    })?;
    let n_runs = request.n_runs as usize;
    let add_up = |((density, level), times_s): ((f64, CvarLevel), &[Option<f64>])| {
        let (whole_bin, exact) = times_s.split_at(n_runs);
        Cell::new([density, level.get()], whole_bin.to_vec(), exact.to_vec())
    };
    let mut cells: Vec<Cell> = request.cells().zip(times_s.chunks(2 * n_runs)).map(add_up).collect();
    Cell::correct(&mut cells);
    Ok(Report { n_runs: request.n_runs, first_seed: request.first_seed, isa, cells })
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::atomic::{AtomicU64, Ordering};

    fn request(densities: &[f64], levels: &[f64], n_runs: u64) -> Request {
        Request {
            densities: densities.to_vec(),
            levels: levels.iter().map(|&level| CvarLevel::new(level).unwrap()).collect(),
            n_runs,
            first_seed: 1001,
            n_threads: 1,
            isa: Isa::Portable,
        }
    }

    #[test]
    fn nothing_to_drive_is_told() {
        for nothing in [request(&[], &[0.4], 1), request(&[0.4], &[], 1), request(&[0.4], &[0.4], 0)] {
            assert!(matches!(measure(&nothing, || ()), Err(RiskError::NoRuns)));
        }
    }

    #[test]
    fn runs_of_a_cell_are_paired_and_lie_together() {
        let asked = request(&[0.1, 1.0], &[0.2, 0.4], 3);
        let jobs = asked.jobs();
        assert_eq!(jobs.len() as u64, asked.n_drives());
        for pair in jobs.chunks(6) {
            for (whole_bin, exact) in pair[..3].iter().zip(&pair[3..]) {
                assert_eq!(*exact, Job { method: Method::Exact, ..*whole_bin });
                assert_eq!(whole_bin.method, Method::WholeBin);
            }
        }
        assert_eq!(jobs.iter().map(|job| job.seed).collect::<Vec<_>>(), [1001, 1002, 1003].repeat(8));
    }

    #[test]
    fn table_does_not_depend_on_threads() {
        let alone = Request { isa: Isa::Auto, ..request(&[0.1, 0.4], &[0.4], 2) };
        let n_seen = AtomicU64::new(0);
        let count = || {
            n_seen.fetch_add(1, Ordering::Relaxed);
        };
        let report = measure(&alone, count).unwrap();
        assert_eq!(n_seen.into_inner(), 8);
        let told: Vec<[f64; 2]> = report.cells.iter().map(|cell| [cell.density, cell.alpha]).collect();
        assert_eq!(told, [[0.1, 0.4], [0.4, 0.4]]);
        assert_ne!(report.isa, Isa::Auto);
        assert_eq!(measure(&Request { n_threads: 3, ..alone }, || ()).unwrap(), report);
    }
}
