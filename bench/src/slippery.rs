//! What friction that is known cell by cell brings the local planner: the same courses over ice, mud and wet grass, by what
//! the controller is told of the ground's friction.

mod course;
mod run;

use bicycle::Vehicle;
use mppi::Isa;
use navigator::Config;
use scenarios::{EpisodeConfig, Outcome};
use serde::{Deserialize, Serialize};

use crate::Verdict;
use crate::statistics::{Mean, mcnemar_p_value, wilson_interval};
use crate::sweep::{SweepError, hash_of, sweep};
pub use course::{Course, Slick};
use run::Job;
pub use run::{Moment, Run};

/// Name of the machine that drives.
pub const VEHICLE: &str = "sedan";
/// Probability by chance below which two rows differ.
const P_MOST: f64 = 0.05;

/// What the controller is told of the ground's friction.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Told {
    /// Nothing: the limit of lateral acceleration is that of the vehicle's description.
    Nothing,
    /// That all ground holds what ice does as it is published.
    Least,
    /// The friction of every cell, at a sliding speed of 1 m/s.
    Cells,
}

impl Told {
    /// All of them, in the order of the rows.
    pub const ALL: [Self; 3] = [Self::Nothing, Self::Least, Self::Cells];

    /// Name on the command line and in files.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Nothing => "nothing",
            Self::Least => "least",
            Self::Cells => "cells",
        }
    }
}

/// Which courses to drive, and how.
#[derive(Clone, Debug, PartialEq)]
pub struct Request {
    /// Courses.
    pub n_courses: u64,
    /// Decides all courses, noise and samples.
    pub seed: u64,
    /// Fastest speed that is commanded [m/s].
    pub speed_mps: f64,
    /// Longest drive, simulated [s].
    pub time_limit_s: f64,
    /// Drives at a time.
    pub n_threads: usize,
    /// Instruction set of the controller.
    pub isa: Isa,
}

/// What the drives of a row add up to.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Row {
    /// What the controller was told.
    pub told: Told,
    /// Drives.
    pub n: usize,
    /// Drives that went through all goals.
    pub n_goal: usize,
    /// The same as a share, with its 95 % interval (Wilson).
    pub goal: [f64; 3],
    /// Drives in which the vehicle slid, see [`Run::slid_s`].
    pub n_slid: usize,
    /// The same as a share, with its 95 % interval (Wilson).
    pub slid: [f64; 3],
    /// Drives that ended beyond the attitude limit, or rolled over.
    pub n_attitude: usize,
    /// Drives that ended at an obstacle.
    pub n_collision: usize,
    /// Sliding of a drive [s].
    pub slid_s: Option<Mean>,
    /// Time of the drives that went through all goals [s].
    pub time_s: Option<Mean>,
}

/// A row beside that of the cells, on the same courses.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Comparison {
    /// What the other controller was told.
    pub other: Told,
    /// Courses on which only that of the cells slid.
    pub n_only_cells: usize,
    /// Courses on which only the other did.
    pub n_only_other: usize,
    /// Probability of so uneven a split by chance (McNemar, exact).
    pub p_value: f64,
    /// Time of that of the cells less that of the other, where both went through all goals [s].
    pub time_difference_s: Option<Mean>,
}

/// All drives and what they add up to.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Report {
    /// Name of the machine.
    pub vehicle: &'static str,
    /// What decided all drives.
    pub seed: u64,
    /// Courses.
    pub n_courses: u64,
    /// Fastest speed that was commanded [m/s].
    pub speed_mps: f64,
    /// Instruction set that the controller used.
    pub isa: Isa,
    /// [`formats::config_hash`] of the pipeline's configuration, without friction.
    pub config_hash: String,
    /// A row for each thing that was told.
    pub rows: Vec<Row>,
    /// That of the cells beside the others.
    pub comparisons: Vec<Comparison>,
    /// Rules that were settled before the first drive.
    pub verdicts: Vec<Verdict>,
    /// The courses.
    pub courses: Vec<Course>,
    /// Row by row, by course.
    pub runs: Vec<Run>,
}

/// What all drives have in common.
struct Settings {
    vehicle: Vehicle,
    config: Config,
    episode: EpisodeConfig,
    seed: u64,
}

/// Does all drives; `after_run` sees each one as it ends, in any order and on any thread.
///
/// # Errors
/// Nothing to drive, no threads to be had, or a drive that could not begin or go on.
pub fn measure(request: &Request, after_run: impl Fn(&Run) + Sync) -> Result<Report, SweepError> {
    let jobs: Vec<Job> = Told::ALL
        .into_iter()
        .flat_map(|told| (0..request.n_courses).map(move |course| Job { told, course }))
        .collect();
    if jobs.is_empty() {
        return Err(SweepError::NoDrives { expected: "at least one course" });
    }
    let settings = settings(request)?;
    let after = |run: &Run| {
        after_run(run);
        Ok(())
    };
    let runs = sweep(&jobs, request.n_threads, |job| job.drive(&settings), after)?;
    let rows: Vec<Row> = runs.chunks(request.n_courses as usize).filter_map(Row::of).collect();
    let comparisons = [Told::Nothing, Told::Least].map(|other| Comparison::of(other, &runs)).to_vec();
    Ok(Report {
        vehicle: VEHICLE,
        seed: request.seed,
        n_courses: request.n_courses,
        speed_mps: request.speed_mps,
        isa: settings.config.controller.isa,
        config_hash: hash_of(&settings.config)?,
        verdicts: verdicts(&rows, &comparisons),
        rows,
        comparisons,
        courses: (0..request.n_courses).map(|number| Course::draw(request.seed, number)).collect(),
        runs,
    })
}

fn settings(request: &Request) -> Result<Settings, SweepError> {
    let mut vehicle = formats::read_vehicle(VEHICLE)?;
    vehicle.limits.speed_max_mps = request.speed_mps;
    let mut config = Config::for_vehicle(&vehicle);
    config.controller.n_threads = 1;
    config.controller.isa = request.isa;
    let mut episode = EpisodeConfig::for_vehicle(&vehicle);
    episode.rules.time_limit_s = request.time_limit_s;
    Ok(Settings { vehicle, config, episode, seed: request.seed })
}

impl Row {
    /// Of the drives of one thing that was told; `None` of no drive.
    fn of(runs: &[Run]) -> Option<Self> {
        let count = |holds: &dyn Fn(&Run) -> bool| runs.iter().filter(|run| holds(run)).count();
        let share = |n: usize| {
            let [low, high] = wilson_interval(n, runs.len());
            [n as f64 / runs.len() as f64, low, high]
        };
        let (n_goal, n_slid) = (count(&Run::arrived), count(&Run::slid));
        let slid_s: Vec<f64> = runs.iter().map(|run| run.slid_s).collect();
        let times_s: Vec<f64> = runs.iter().filter(|run| run.arrived()).map(|run| run.time_s).collect();
        Some(Self {
            told: runs.first()?.told,
            n: runs.len(),
            n_goal,
            goal: share(n_goal),
            n_slid,
            slid: share(n_slid),
            n_attitude: count(&|run| matches!(run.outcome, Outcome::RolledOver | Outcome::AttitudeLimit)),
            n_collision: count(&|run| run.outcome == Outcome::Collision),
            slid_s: Mean::of(&slid_s),
            time_s: Mean::of(&times_s),
        })
    }
}

impl Comparison {
    fn of(other: Told, runs: &[Run]) -> Self {
        let of = |told: Told| runs.iter().filter(move |run| run.told == told);
        let pairs: Vec<(&Run, &Run)> = of(Told::Cells).zip(of(other)).collect();
        let n_slid = |cells: bool, other: bool| {
            pairs.iter().filter(|(a, b)| (a.slid(), b.slid()) == (cells, other)).count()
        };
        let (n_only_cells, n_only_other) = (n_slid(true, false), n_slid(false, true));
        let both = pairs.iter().filter(|(a, b)| a.arrived() && b.arrived());
        let differences_s: Vec<f64> = both.map(|(a, b)| a.time_s - b.time_s).collect();
        Self {
            other,
            n_only_cells,
            n_only_other,
            p_value: mcnemar_p_value(n_only_cells, n_only_other),
            time_difference_s: Mean::of(&differences_s),
        }
    }
}

fn verdicts(rows: &[Row], comparisons: &[Comparison]) -> Vec<Verdict> {
    let row = |told: Told| rows.iter().find(|row| row.told == told);
    let beside = |told: Told| comparisons.iter().find(|comparison| comparison.other == told);
    let verdict =
        |rule: &str, (is_passed, found): (bool, String)| Verdict { rule: rule.to_owned(), found, is_passed };
    let unmeasured = || (false, "not measured".to_owned());
    let slides = beside(Told::Nothing).map(|beside| {
        let Comparison { n_only_cells, n_only_other, p_value, .. } = *beside;
        let found =
            format!("only with cells {n_only_cells}, only with nothing {n_only_other}, p = {p_value:.4}");
        (n_only_cells < n_only_other && p_value < P_MOST, found)
    });
    let ends = row(Told::Cells).zip(row(Told::Nothing)).map(|(cells, nothing)| {
        let [of_cells, of_nothing] = [cells, nothing].map(|row| row.n_attitude + row.n_collision);
        let found = format!(
            "arrived {} and {}, broken off {of_cells} and {of_nothing}",
            cells.n_goal, nothing.n_goal
        );
        (cells.n_goal >= nothing.n_goal && of_cells <= of_nothing, found)
    });
    let difference = |told: Told, holds: fn(&Mean) -> bool| {
        let difference = beside(told).and_then(|comparison| comparison.time_difference_s);
        difference
            .map(|mean| (holds(&mean), format!("{:+.2} s [{:+.2}, {:+.2}]", mean.value, mean.low, mean.high)))
    };
    [
        ("told cells, fewer drives slide than told nothing, beyond chance", slides),
        ("told cells, no fewer arrive than told nothing, no more leave limits or collide", ends),
        (
            "told cells, no slower than told nothing, within the interval",
            difference(Told::Nothing, |mean| mean.low <= 0.0),
        ),
        ("told cells, faster than told the least", difference(Told::Least, |mean| mean.high < 0.0)),
    ]
    .map(|(rule, found)| verdict(rule, found.unwrap_or_else(unmeasured)))
    .to_vec()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn run(told: Told, course: u64, (outcome, slid_s, time_s): (Outcome, f64, f64)) -> Run {
        Run {
            told,
            course,
            outcome,
            time_s,
            slid_s,
            largest_slip_rad: 0.0,
            fastest_mps: 4.0,
            trail: Vec::new(),
        }
    }

    #[test]
    fn rows_count_and_rules_compare_the_same_courses() {
        let ends = |told: Told| -> Vec<Run> {
            (0..8)
                .map(|course| {
                    let end = match told {
                        Told::Nothing if course == 0 => (Outcome::Collision, 1.0, 5.0),
                        Told::Nothing => (Outcome::Goal, 0.8, 10.0),
                        Told::Least => (Outcome::Goal, 0.0, 20.0),
                        Told::Cells if course == 1 => (Outcome::Goal, 0.6, 11.0),
                        Told::Cells => (Outcome::Goal, 0.1, 9.0),
                    };
                    run(told, course, end)
                })
                .collect()
        };
        let runs: Vec<Run> = Told::ALL.into_iter().flat_map(ends).collect();
        let rows: Vec<Row> = runs.chunks(8).filter_map(Row::of).collect();
        assert_eq!(
            rows.iter().map(|row| (row.n_goal, row.n_slid)).collect::<Vec<_>>(),
            [(7, 8), (8, 0), (8, 1)]
        );
        assert_eq!([rows[0].n_collision, rows[2].n_collision], [1, 0]);
        let comparison = Comparison::of(Told::Nothing, &runs);
        assert_eq!((comparison.n_only_cells, comparison.n_only_other), (0, 7));
        // 2 / 2^7.
        assert!((comparison.p_value - 0.015_625).abs() < 1e-12);
        // Six courses a second less, one a second more.
        let difference_s = comparison.time_difference_s.unwrap().value;
        assert!((difference_s + 5.0 / 7.0).abs() < 1e-12, "{difference_s}");
        let comparisons = [comparison, Comparison::of(Told::Least, &runs)];
        assert!(verdicts(&rows, &comparisons).iter().all(|verdict| verdict.is_passed));
        let worse = [Comparison { n_only_cells: 9, ..comparisons[0].clone() }, comparisons[1].clone()];
        assert!(!verdicts(&rows, &worse)[0].is_passed);
    }

    #[test]
    fn nothing_to_drive_is_told() {
        let request = Request {
            n_courses: 0,
            seed: 1,
            speed_mps: 4.0,
            time_limit_s: 1.0,
            n_threads: 1,
            isa: Isa::Portable,
        };
        assert!(matches!(measure(&request, |_| ()), Err(SweepError::NoDrives { .. })));
    }

    #[test]
    fn drives_do_not_depend_on_threads() {
        let request = |n_threads| Request {
            n_courses: 1,
            seed: 1000,
            speed_mps: 4.0,
            time_limit_s: 1.0,
            n_threads,
            isa: Isa::Portable,
        };
        let report = measure(&request(1), |_| ()).unwrap();
        assert_eq!(report, measure(&request(2), |_| ()).unwrap());
        assert_eq!((report.rows.len(), report.runs.len()), (3, 3));
    }
}
