//! Planners of other people's: what whoever has the way to them does for the table, and what their cycles took.

use std::collections::BTreeMap;
use std::error::Error;

use bicycle::StopReason;
use scenarios::Episode;
use serde::{Deserialize, Serialize};

use super::row::median;
use super::{DriveResult, PlannerName};

/// Why a planner did not drive an episode to its end.
pub type ExternalError = Box<dyn Error + Send + Sync>;

/// Drives an episode to its end with the planner of this name, and gives it back with what was answered in it.
pub type External<'a> =
    dyn Fn(&PlannerName, Episode) -> Result<(Episode, Answers), ExternalError> + Sync + 'a;

/// What a planner answered in an episode.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Answers {
    /// Cycles in which it asked for a stop, by reason.
    pub stops: BTreeMap<StopReason, u64>,
    /// How long it took for each command, by the machine's clock [ms].
    pub cycles_ms: Vec<f64>,
}

/// How long a planner took for its commands, by the machine's clock. No simulated time passes meanwhile.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ComputeTime {
    /// Commands.
    pub n_cycles: usize,
    /// Half of them took no longer; of several drives, the median of theirs [ms].
    pub median_ms: f64,
    /// 99 of 100 took no longer; of several drives, the largest of theirs [ms].
    pub p99_ms: f64,
}

impl ComputeTime {
    /// Of one drive; `None` without a cycle.
    pub(super) fn of(cycles_ms: &[f64]) -> Option<Self> {
        let mut ascending_ms = cycles_ms.to_vec();
        ascending_ms.sort_by(f64::total_cmp);
        let rank = (0.99 * ascending_ms.len() as f64).ceil() as usize;
        let p99_ms = *ascending_ms.get(rank.checked_sub(1)?)?;
        Some(Self { n_cycles: ascending_ms.len(), median_ms: median(ascending_ms)?, p99_ms })
    }

    /// Of the drives of a row that know theirs; `None` where none does.
    pub(super) fn over(drives: &[DriveResult]) -> Option<Self> {
        let known = || drives.iter().filter_map(|drive| drive.compute);
        Some(Self {
            n_cycles: known().map(|compute| compute.n_cycles).sum(),
            median_ms: median(known().map(|compute| compute.median_ms).collect())?,
            p99_ms: known().map(|compute| compute.p99_ms).fold(0.0, f64::max),
        })
    }
}

/// For a table without planners of other people's.
///
/// # Errors
/// Always: there is none of that name.
pub fn nobody(name: &PlannerName, _: Episode) -> Result<(Episode, Answers), ExternalError> {
    Err(format!("expected a planner of the name {name}, found none").into())
}

#[cfg(test)]
mod tests {
    use super::super::drive::driven;
    use super::*;
    use scenarios::Outcome;

    #[test]
    fn compute_of_a_row_is_the_middle_drive_and_the_worst_cycles() {
        let cycles_ms: Vec<f64> = (1..=200).map(f64::from).rev().collect();
        let one = ComputeTime::of(&cycles_ms).unwrap();
        assert_eq!(one, ComputeTime { n_cycles: 200, median_ms: 100.5, p99_ms: 198.0 });
        assert_eq!(ComputeTime::of(&[]), None);
        let name = super::super::Entrant::External("mine".parse().unwrap());
        let drive = |compute| DriveResult { compute, ..driven(name.clone(), None, 0, Outcome::Goal, 40.0) };
        let slow = ComputeTime { n_cycles: 10, median_ms: 300.5, p99_ms: 301.0 };
        assert_eq!(
            ComputeTime::over(&[drive(Some(one)), drive(Some(slow)), drive(None)]),
            Some(ComputeTime { n_cycles: 210, median_ms: 200.5, p99_ms: 301.0 })
        );
        assert_eq!(ComputeTime::over(&[drive(None)]), None);
    }
}
