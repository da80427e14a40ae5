//! What the drives of one method and level add up to.

use std::collections::BTreeMap;

use scenarios::Outcome;
use serde::Serialize;

use super::DriveResult;
use crate::closed_loop::Method;

/// Standard normal quantile of 97.5 %: intervals cover 95 %.
pub const WILSON_Z: f64 = 1.959_963_984_540_054;

/// One row of the table.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Row {
    /// What the controller knew of the ground.
    pub method: Method,
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
    /// Drives by how they ended.
    pub outcomes: BTreeMap<Outcome, usize>,
}

impl Row {
    /// Of the drives of one method and level; `None` of no drive.
    pub fn of(drives: &[DriveResult]) -> Option<Self> {
        let first = drives.first()?;
        let mut outcomes = BTreeMap::new();
        for drive in drives {
            *outcomes.entry(drive.outcome).or_default() += 1;
        }
        let reached = drives.iter().filter(|drive| drive.outcome == Outcome::Goal);
        let times_s: Vec<f64> = reached.map(|drive| drive.time_s).collect();
        let (n, n_goal) = (drives.len(), times_s.len());
        let [wilson_low, wilson_high] = wilson_interval(n_goal, n);
        Some(Self {
            method: first.method,
            alpha: first.alpha,
            n,
            n_goal,
            success: n_goal as f64 / n as f64,
            wilson_low,
            wilson_high,
            median_time_to_goal_s: median(times_s),
            outcomes,
        })
    }
}

/// Where 95 % of such intervals hold the true probability of what came `n_hit` times in `n` > 0 trials
/// (Wilson 1927): all probabilities that a score test at 5 % would not reject.
pub fn wilson_interval(n_hit: usize, n: usize) -> [f64; 2] {
    let (n, share) = (n as f64, n_hit as f64 / n as f64);
    let z_squared_over_n = WILSON_Z * WILSON_Z / n;
    let centre = share + 0.5 * z_squared_over_n;
    let half_width = (z_squared_over_n * (share * (1.0 - share) + 0.25 * z_squared_over_n)).sqrt();
    // At no hit or no miss one end is the bound itself, up to rounding.
    [centre - half_width, centre + half_width].map(|end| (end / (1.0 + z_squared_over_n)).clamp(0.0, 1.0))
}

/// The middle value, or the mean of the two in the middle.
fn median(mut values: Vec<f64>) -> Option<f64> {
    values.sort_by(f64::total_cmp);
    let upper = values.get(values.len() / 2)?;
    let lower = values.get((values.len() - 1) / 2)?;
    Some(0.5 * (lower + upper))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn interval_is_the_published_one() {
        // Newcombe, Statistics in Medicine 17 (1998) 857, table I, method 3; and 8 of 10.
        let published = [
            (81, 263, [0.2553, 0.3662]),
            (15, 148, [0.0624, 0.1605]),
            (0, 20, [0.0, 0.1611]),
            (1, 29, [0.0061, 0.1718]),
            (8, 10, [0.4902, 0.9433]),
        ];
        for (n_hit, n, expected) in published {
            let found = wilson_interval(n_hit, n);
            for end in 0..2 {
                assert!((found[end] - expected[end]).abs() < 5.1e-5, "{n_hit} of {n}: {found:?}");
            }
        }
    }

    #[test]
    fn ends_are_where_the_score_test_just_rejects() {
        for (n_hit, n) in [(1, 20), (8, 10), (13, 20), (19, 20)] {
            for end in wilson_interval(n_hit, n) {
                let off = n_hit as f64 - n as f64 * end;
                let score = off / (n as f64 * end * (1.0 - end)).sqrt();
                assert!((score.abs() - WILSON_Z).abs() < 1e-9, "{n_hit} of {n}: {score}");
            }
        }
    }

    #[test]
    fn hits_and_misses_mirror_each_other() {
        for n_hit in 0..=20 {
            let [low, high] = wilson_interval(n_hit, 20);
            let [mirrored_high, mirrored_low] = wilson_interval(20 - n_hit, 20).map(|end| 1.0 - end);
            assert!((low - mirrored_low).abs() < 1e-12 && (high - mirrored_high).abs() < 1e-12);
            assert!(0.0 <= low && low <= n_hit as f64 / 20.0 && n_hit as f64 / 20.0 <= high && high <= 1.0);
        }
    }

    #[test]
    fn median_is_the_middle() {
        assert_eq!(median(vec![]), None);
        assert_eq!(median(vec![3.0]), Some(3.0));
        assert_eq!(median(vec![9.0, 1.0, 4.0]), Some(4.0));
        assert_eq!(median(vec![9.0, 1.0, 4.0, 5.0]), Some(4.5));
    }

    #[test]
    fn row_counts_outcomes_and_times_only_those_that_arrived() {
        let drive = |seed, outcome, time_s| DriveResult {
            method: Method::Physics,
            alpha: Some(0.6),
            seed,
            outcome,
            time_s,
            path_length_m: 44.0,
            distance_to_goal_m: 1.0,
            largest_roll_deg: 10.0,
            largest_pitch_deg: 12.0,
            failed_at_m: None,
            stops: BTreeMap::new(),
        };
        let row = Row::of(&[
            drive(1, Outcome::Goal, 50.0),
            drive(2, Outcome::Stuck, 9.0),
            drive(3, Outcome::Goal, 48.0),
            drive(4, Outcome::Stuck, 99.0),
        ])
        .unwrap();
        assert_eq!((row.n, row.n_goal, row.success), (4, 2, 0.5));
        assert_eq!(row.median_time_to_goal_s, Some(49.0));
        assert_eq!(row.outcomes, BTreeMap::from([(Outcome::Goal, 2), (Outcome::Stuck, 2)]));
        assert_eq!([row.wilson_low, row.wilson_high], wilson_interval(2, 4));
        assert_eq!(Row::of(&[]), None);
    }
}
