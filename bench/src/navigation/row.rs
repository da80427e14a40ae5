//! What the drives of one entrant and level add up to.

use std::collections::BTreeMap;

use scenarios::Outcome;
use serde::Serialize;

use super::{ComputeTime, DriveResult, Entrant};
use crate::statistics::{Mean, wilson_interval};

/// So long without a wheel on the ground is a jump [s]: it falls by 5 cm meanwhile, or rises by 1 and falls again.
pub const JUMP_S: f64 = 0.1;

/// One row of the table.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Row {
    /// Who drove.
    pub method: Entrant,
    /// Risk tolerance (CVaR level); null where the method knows no distribution and one row holds for every level.
    pub alpha: Option<f64>,
    /// Drives.
    pub n: usize,
    /// Drives that reached the goal.
    pub n_goal: usize,
    /// Share of drives that reached the goal.
    pub success: f64,
    /// Lower end of the share's 95 % Wilson interval.
    pub wilson_low: f64,
    /// Upper end of the share's 95 % Wilson interval.
    pub wilson_high: f64,
    /// Median over the drives that reached the goal [s]; null without one. Rows with other successes took other
    /// drives into it.
    pub median_time_to_goal_s: Option<f64>,
    /// Largest |roll| or |pitch| of each drive, however it ended [deg].
    pub largest_tilt_deg: Mean,
    /// Drives in which all wheels were off the ground for at least [`JUMP_S`].
    pub n_jumped: usize,
    /// Drives by how they ended.
    pub outcomes: BTreeMap<Outcome, usize>,
    /// How long a planner of other people's took for its commands.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub compute: Option<ComputeTime>,
}

impl Row {
    /// Of the drives of one entrant and level; `None` of no drive.
    pub fn of(drives: &[DriveResult]) -> Option<Self> {
        let first = drives.first()?;
        let mut outcomes = BTreeMap::new();
        for drive in drives {
            *outcomes.entry(drive.outcome).or_default() += 1;
        }
        let reached = drives.iter().filter(|drive| drive.outcome == Outcome::Goal);
        let times_s: Vec<f64> = reached.map(|drive| drive.time_s).collect();
        let tilt_deg = |drive: &DriveResult| drive.largest_roll_deg.max(drive.largest_pitch_deg);
        let tilts_deg: Vec<f64> = drives.iter().map(tilt_deg).collect();
        let (n, n_goal) = (drives.len(), times_s.len());
        let [wilson_low, wilson_high] = wilson_interval(n_goal, n);
        Some(Self {
            method: first.method.clone(),
            alpha: first.alpha,
            n,
            n_goal,
            success: n_goal as f64 / n as f64,
            wilson_low,
            wilson_high,
            median_time_to_goal_s: median(times_s),
            largest_tilt_deg: Mean::of(&tilts_deg)?,
            n_jumped: drives.iter().filter(|drive| drive.longest_flight_s >= JUMP_S).count(),
            outcomes,
            compute: ComputeTime::over(drives),
        })
    }
}

/// The middle value, or the mean of the two in the middle.
pub(super) fn median(mut values: Vec<f64>) -> Option<f64> {
    values.sort_by(f64::total_cmp);
    let upper = values.get(values.len() / 2)?;
    let lower = values.get((values.len() - 1) / 2)?;
    Some(0.5 * (lower + upper))
}

#[cfg(test)]
mod tests {
    use super::super::drive::driven;
    use super::*;
    use crate::closed_loop::Method;

    #[test]
    fn median_is_the_middle() {
        assert_eq!(median(vec![]), None);
        assert_eq!(median(vec![3.0]), Some(3.0));
        assert_eq!(median(vec![9.0, 1.0, 4.0]), Some(4.0));
        assert_eq!(median(vec![9.0, 1.0, 4.0, 5.0]), Some(4.5));
    }

    #[test]
    fn row_counts_outcomes_and_times_only_those_that_arrived() {
        let drive = |pair, outcome, time_s| driven(Method::Physics, Some(0.6), pair, outcome, time_s);
        let row = Row::of(&[
            drive(1, Outcome::Goal, 50.0),
            drive(2, Outcome::Stuck, 9.0),
            drive(3, Outcome::Goal, 48.0),
            drive(4, Outcome::Stuck, 99.0),
        ])
        .unwrap();
        assert_eq!((row.n, row.n_goal, row.success), (4, 2, 0.5));
        assert_eq!(row.median_time_to_goal_s, Some(49.0));
        // 10 degrees of roll and 12 of pitch in every drive.
        assert_eq!(row.largest_tilt_deg, Mean { value: 12.0, low: 12.0, high: 12.0 });
        assert_eq!(row.outcomes, BTreeMap::from([(Outcome::Goal, 2), (Outcome::Stuck, 2)]));
        assert_eq!([row.wilson_low, row.wilson_high], wilson_interval(2, 4));
        assert_eq!(Row::of(&[]), None);
    }
}
