//! People who cross: the same drives over open ground, with walkers in the way, by how what moves is dealt with.
//!
//! Every run has a world, walkers and sensor noise of its own; both ways of dealing with what moves see the same. A run
//! is failed when the vehicle strikes somebody whom a stop would have spared, see [`scenarios::Strike`].

mod run;

use bicycle::Vehicle;
use mppi::Isa;
use navigator::{Config, MovingConfig};
use scenarios::{EpisodeConfig, Outcome};
use serde::{Deserialize, Serialize};

use crate::sweep::{SweepError, hash_of, sweep};
use run::Job;
pub use run::{Contact, Crossing, Moment};

/// Name of the machine that drives.
pub const VEHICLE: &str = "pietra_full_size";

/// How what moves is dealt with.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Handling {
    /// It is tracked, and where it will be is kept away from.
    Tracked,
    /// It is part of the map, where it stands, like all else.
    Mapped,
}

impl Handling {
    /// Name on the command line and in files.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Tracked => "tracked",
            Self::Mapped => "mapped",
        }
    }
}

/// Which runs to do, and how.
#[derive(Clone, Debug, PartialEq)]
pub struct Request {
    /// How what moves is dealt with; a row each.
    pub handlings: Vec<Handling>,
    /// Runs of each row.
    pub n_runs: u64,
    /// Number of the first of them: each number is a run of its own, whatever runs beside it.
    pub first_run: u64,
    /// Decides all runs.
    pub seed: u64,
    /// People in each run.
    pub n_walkers: usize,
    /// Longest run, simulated [s].
    pub time_limit_s: f64,
    /// Runs at a time.
    pub n_threads: usize,
    /// Instruction set of the controller.
    pub isa: Isa,
}

/// What the runs of a row add up to.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Row {
    /// How what moves was dealt with.
    pub handling: Handling,
    /// Runs.
    pub n_runs: usize,
    /// Runs that reached the goal.
    pub n_goal: usize,
    /// Runs in which somebody was struck.
    pub n_struck: usize,
    /// Of these, those that a stop would have avoided: none may be.
    pub n_avoidable: usize,
    /// How often somebody walked into the standing vehicle.
    pub n_walked_into: u64,
    /// Runs in which the vehicle stopped for something that moves.
    pub n_stopped_for: usize,
    /// Median over the runs that reached the goal [s]; null without one.
    pub median_time_s: Option<f64>,
    /// Runs that ended otherwise.
    pub n_other: usize,
}

/// All runs and what they add up to.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Report {
    /// Name of the machine.
    pub vehicle: &'static str,
    /// What decided all runs.
    pub seed: u64,
    /// Runs of each row.
    pub n_runs: u64,
    /// People in each run.
    pub n_walkers: usize,
    /// Instruction set that the controller used.
    pub isa: Isa,
    /// [`formats::config_hash`] of the pipeline's configuration, with what moves tracked.
    pub config_hash: String,
    /// One row for each way of dealing with what moves.
    pub rows: Vec<Row>,
    /// Row by row, each by ascending number.
    pub runs: Vec<Crossing>,
}

impl Report {
    /// The rule: nobody was struck whom a stop would have spared while what moves was tracked.
    pub fn is_passed(&self) -> bool {
        let tracked = self.rows.iter().filter(|row| row.handling == Handling::Tracked);
        tracked.map(|row| row.n_avoidable).sum::<usize>() == 0
    }
}

/// What all runs have in common.
struct Settings {
    vehicle: Vehicle,
    config: Config,
    episode: EpisodeConfig,
    seed: u64,
    n_walkers: usize,
}

/// Does all runs; `after_run` sees each one as it ends, in any order and on any thread.
///
/// # Errors
/// Nothing to drive, no threads to be had, or a run that could not begin or go on.
pub fn measure(request: &Request, after_run: impl Fn(&Crossing) + Sync) -> Result<Report, SweepError> {
    let jobs: Vec<Job> = request
        .handlings
        .iter()
        .flat_map(|&handling| {
            (0..request.n_runs).map(move |k| Job { handling, number: request.first_run + k })
        })
        .collect();
    if jobs.is_empty() || request.n_walkers == 0 {
        let expected = "at least one run, one walker and one way of dealing with them";
        return Err(SweepError::NoDrives { expected });
    }
    let settings = settings(request)?;
    let after = |run: &Crossing| {
        after_run(run);
        Ok(())
    };
    let runs = sweep(&jobs, request.n_threads, |job| job.drive(&settings), after)?;
    Ok(Report {
        vehicle: VEHICLE,
        seed: request.seed,
        n_runs: request.n_runs,
        n_walkers: request.n_walkers,
        isa: settings.config.controller.isa,
        config_hash: hash_of(&settings.config)?,
        rows: runs.chunks(request.n_runs as usize).filter_map(Row::of).collect(),
        runs,
    })
}

fn settings(request: &Request) -> Result<Settings, SweepError> {
    let vehicle = formats::read_vehicle(VEHICLE)?;
    let mut config = Config { moving: Some(MovingConfig::default()), ..Config::for_vehicle(&vehicle) };
    config.controller.n_threads = 1;
    config.controller.isa = request.isa;
    let mut episode = EpisodeConfig::for_vehicle(&vehicle);
    episode.rules.time_limit_s = request.time_limit_s;
    // Who waits for people is neither stuck nor stopped for good.
    (episode.rules.immobile_s, episode.rules.stopped_s) = (request.time_limit_s, request.time_limit_s);
    Ok(Settings { vehicle, config, episode, seed: request.seed, n_walkers: request.n_walkers })
}

impl Row {
    /// Of the runs of one way of dealing with what moves; `None` of no run.
    pub fn of(runs: &[Crossing]) -> Option<Self> {
        let count = |holds: &dyn Fn(&Crossing) -> bool| runs.iter().filter(|run| holds(run)).count();
        let mut times_s: Vec<f64> =
            runs.iter().filter(|run| run.outcome == Outcome::Goal).map(|run| run.time_s).collect();
        times_s.sort_by(f64::total_cmp);
        let n_struck = count(&|run| run.outcome == Outcome::WalkerStruck);
        Some(Self {
            handling: runs.first()?.handling,
            n_runs: runs.len(),
            n_goal: times_s.len(),
            n_struck,
            n_avoidable: count(&|run| run.contact.is_some_and(|contact| contact.was_avoidable)),
            n_walked_into: runs.iter().map(|run| run.n_walked_into).sum(),
            n_stopped_for: count(&|run| run.n_stops_for_moving > 0),
            median_time_s: times_s.get(times_s.len() / 2).copied(),
            n_other: runs.len() - times_s.len() - n_struck,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn request(n_runs: u64, n_threads: usize) -> Request {
        Request {
            handlings: vec![Handling::Tracked, Handling::Mapped],
            n_runs,
            first_run: 0,
            seed: 1000,
            n_walkers: 2,
            time_limit_s: 1.0,
            n_threads,
            isa: Isa::Portable,
        }
    }

    #[test]
    fn nothing_to_drive_is_told() {
        for nothing in [
            Request { handlings: Vec::new(), ..request(1, 1) },
            Request { n_walkers: 0, ..request(1, 1) },
            request(0, 1),
        ] {
            assert!(matches!(measure(&nothing, |_| ()), Err(SweepError::NoDrives { .. })));
        }
    }

    #[test]
    fn runs_do_not_depend_on_threads_and_rows_see_the_same_people() {
        let report = measure(&request(2, 1), |_| ()).unwrap();
        assert_eq!(report, measure(&request(2, 2), |_| ()).unwrap());
        assert_eq!((report.rows.len(), report.runs.len()), (2, 4));
        for (tracked, mapped) in report.runs[..2].iter().zip(&report.runs[2..]) {
            assert_eq!((tracked.number, tracked.outcome), (mapped.number, Outcome::Timeout));
            assert_eq!(tracked.trail[0].walkers_m, mapped.trail[0].walkers_m);
        }
        assert_ne!(report.runs[0].trail[0].walkers_m, report.runs[1].trail[0].walkers_m);
        let second = measure(&Request { first_run: 1, ..request(1, 1) }, |_| ()).unwrap();
        assert_eq!(
            [&second.runs[0], &second.runs[1]],
            [&report.runs[1], &report.runs[3]],
            "alone as among others"
        );
    }

    #[test]
    fn a_row_counts_what_a_stop_would_have_avoided_and_the_rule_is_about_those() {
        let run = |number, outcome, was_avoidable| Crossing {
            handling: Handling::Tracked,
            number,
            outcome,
            time_s: 20.0 + number as f64,
            contact: (outcome == Outcome::WalkerStruck).then_some(Contact {
                time_s: 5.0,
                at_m: [1.0, 2.0],
                speed_mps: 0.5,
                foreseen_at_s: Some(4.0),
                was_avoidable,
            }),
            n_walked_into: 1,
            n_stops_for_moving: number,
            least_clearance_m: 0.5,
            trail: Vec::new(),
        };
        let mut runs = vec![
            run(0, Outcome::Goal, false),
            run(1, Outcome::WalkerStruck, false),
            run(2, Outcome::Timeout, false),
            run(3, Outcome::Goal, false),
            run(4, Outcome::Goal, false),
        ];
        let report = |runs: &[Crossing]| Report {
            vehicle: VEHICLE,
            seed: 1,
            n_runs: 5,
            n_walkers: 1,
            isa: Isa::Portable,
            config_hash: String::new(),
            rows: Row::of(runs).into_iter().collect(),
            runs: runs.to_vec(),
        };
        let passed = report(&runs);
        let row = &passed.rows[0];
        assert_eq!((row.n_goal, row.n_struck, row.n_avoidable, row.n_other), (3, 1, 0, 1));
        assert_eq!((row.n_walked_into, row.n_stopped_for, row.median_time_s), (5, 4, Some(23.0)));
        assert!(passed.is_passed());
        runs[1] = run(1, Outcome::WalkerStruck, true);
        assert!(!report(&runs).is_passed());
    }
}
