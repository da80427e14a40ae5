//! The navigation benchmark: the same drives over the same rock fields with every method and risk tolerance
//! (PIETRA, section V-D and figure 7).
//!
//! A [`Plan`] says which drives there are, in what order; [`Plan::drive`] does those of a part of the work that are not
//! known yet, [`Plan::report`] makes the table of whatever drives there are. Drives run beside each other, each with a
//! controller of one thread, so that the table depends neither on the number of threads nor on the order in which drives
//! end, nor on how often the work was broken off or in how many parts it was done. Drives of one map and pair share
//! world, start, goal and sensor noise whatever the method: their results are paired.

mod comparison;
mod drive;
mod entrant;
mod external;
mod plan;
mod row;
mod rules;

use serde::Serialize;
use traversability::CvarLevel;

use crate::Verdict;
pub use comparison::Comparison;
pub use drive::{DriveResult, Place, name_of_outcome};
pub use entrant::{Entrant, PlannerName, PlannerNameError};
pub use external::{Answers, ComputeTime, External, ExternalError, nobody};
pub use plan::{Plan, Request, Shard, ShardError};
pub use row::{JUMP_S, Row};

/// Drives and what they add up to.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Report {
    /// Which drives there are in all.
    #[serde(flatten)]
    pub plan: Plan,
    /// Drives of the plan that are not among [`Report::drives`].
    pub n_missing: usize,
    /// One row for each method and level that was driven.
    pub rows: Vec<Row>,
    /// Rows against one another.
    pub comparisons: Vec<Comparison>,
    /// The rules that the rows allow to judge.
    pub verdicts: Vec<Verdict>,
    /// Drives row by row, each row by ascending map and pair.
    pub drives: Vec<DriveResult>,
}

impl Plan {
    /// The table of drives of this plan, given in any order; a drive that is given twice counts once.
    pub fn report(&self, drives: &[DriveResult]) -> Report {
        let jobs = self.jobs(Shard::WHOLE);
        let drives: Vec<DriveResult> =
            jobs.filter_map(|job| drives.iter().find(|drive| job.is_of(drive)).cloned()).collect();
        let mut report = Report {
            plan: self.clone(),
            n_missing: self.n_drives(Shard::WHOLE) - drives.len(),
            rows: self.rows().filter_map(|(who, level)| Row::of(of_row(&drives, &who, level))).collect(),
            comparisons: Vec::new(),
            verdicts: Vec::new(),
            drives,
        };
        let rows: Vec<_> = report.rows_with_drives().collect();
        let (comparisons, verdicts) = (Comparison::all(&rows), rules::verdicts(&rows));
        (report.comparisons, report.verdicts) = (comparisons, verdicts);
        report
    }
}

impl Report {
    /// Every row with its drives, by ascending map and pair.
    pub fn rows_with_drives(&self) -> impl Iterator<Item = (&Row, &[DriveResult])> {
        let ends = self.rows.iter().scan(0, |end, row| {
            *end += row.n;
            Some(*end)
        });
        self.rows.iter().zip(ends).map(|(row, end)| (row, &self.drives[end - row.n..end]))
    }
}

/// The stretch of sorted drives that belongs to an entrant and level.
fn of_row<'a>(drives: &'a [DriveResult], who: &Entrant, level: Option<CvarLevel>) -> &'a [DriveResult] {
    let is_of = |drive: &DriveResult| (&drive.method, drive.alpha) == (who, level.map(CvarLevel::get));
    let first = drives.iter().position(is_of).unwrap_or(0);
    let n = drives[first..].iter().take_while(|drive| is_of(drive)).count();
    &drives[first..first + n]
}

#[cfg(test)]
mod tests {
    use std::sync::Mutex;

    use super::*;
    use crate::closed_loop::Method;
    use crate::sweep::SweepError;
    use mppi::Isa;
    use scenarios::{Outcome, RockFieldConfig};

    fn plan(time_limit_s: f64) -> Plan {
        let request = Request {
            vehicle: "pietra_full_size".to_owned(),
            speed_mps: None,
            methods: vec![Method::Nominal, Method::Physics],
            planners: Vec::new(),
            levels: vec![CvarLevel::new(0.5).unwrap()],
            field: RockFieldConfig::default(),
            seed: 1,
            n_maps: 2,
            n_pairs: 1,
            time_limit_s,
            isa: Isa::Portable,
            plant: scenarios::Engine::Rapier,
            settings: String::new(),
        };
        Plan::new(&request).unwrap()
    }

    fn nothing(_: &DriveResult) -> Result<(), SweepError> {
        Ok(())
    }

    #[test]
    fn table_depends_on_neither_threads_nor_parts_nor_breaks() {
        let plan = plan(1.0);
        let seen = Mutex::new(Vec::new());
        let alone = plan.drive(Shard::WHOLE, &[], 1, &nobody, |drive| {
            seen.lock().unwrap().push(drive.clone());
            Ok(())
        });
        let alone = alone.unwrap();
        assert_eq!(seen.into_inner().unwrap(), alone);
        let report = plan.report(&alone);
        assert_eq!((report.n_missing, report.rows.len(), report.drives.len()), (0, 2, 4));
        for drive in &report.drives {
            assert_eq!(drive.outcome, Outcome::Timeout);
            assert!((drive.time_s - 1.0).abs() < 0.01, "{}", drive.time_s);
            // 40 m as the crow flies, at most 1.5 m/s for one second.
            assert!((38.0..=40.01).contains(&drive.distance_to_goal_m), "{}", drive.distance_to_goal_m);
            assert!(drive.path_length_m < 1.5, "{}", drive.path_length_m);
        }

        let halves =
            ["2/2", "1/2"].map(|half| plan.drive(half.parse().unwrap(), &[], 2, &nobody, nothing).unwrap());
        assert_eq!(halves[0].len(), 2);
        let half = plan.report(&halves[0]);
        assert_eq!((half.n_missing, half.rows[0].n, half.rows[1].n), (2, 1, 1));
        assert_eq!(plan.report(&halves.concat()), report);

        // Broken off after three drives, and taken up again.
        let rest = plan.drive(Shard::WHOLE, &alone[..3], 1, &nobody, nothing).unwrap();
        assert_eq!(rest, alone[3..]);
        let twice = [rest, alone].concat();
        assert_eq!(plan.report(&twice), report);
    }

    #[test]
    fn drive_that_cannot_be_is_told_by_name() {
        let told = plan(-1.0).drive(Shard::WHOLE, &[], 1, &nobody, nothing).unwrap_err().to_string();
        assert!(told.starts_with("nominal, map 1, pair 1: ") && told.contains("time_limit_s"), "{told}");
    }
}
