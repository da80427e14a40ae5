//! What the drives of one ground, gap and belief add up to.

use serde::Serialize;

use super::belief::Belief;
use super::drive::{DriveResult, End, Ground};
use super::gap::Gap;
use crate::statistics::{Mean, wilson_interval};

/// One row of the table.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Row {
    /// What was driven.
    pub ground: Ground,
    /// What the plant does and its simulator does not.
    pub gap: Gap,
    /// What the controller believed.
    pub belief: Belief,
    /// Drives.
    pub n: usize,
    /// Drives that reached the goal.
    pub n_goal: usize,
    /// Lower and upper end of the share's 95 % Wilson interval.
    pub wilson: [f64; 2],
    /// Time to the goal over the drives that reached it [s].
    pub time_s: Option<Mean>,
    /// Root mean square distance from the course [m].
    pub across_rms_m: Option<Mean>,
    /// Largest distance from the course [m].
    pub across_max_m: Option<Mean>,
    /// Root mean square difference from the speed to hold [m/s].
    pub speed_rms_mps: Option<Mean>,
    /// Root mean square distance between a plan half a second ahead and what became of it [m].
    pub plan_rms_m: Option<Mean>,
    /// The same four less those of the nominal model, seed by seed.
    pub less_nominal: Differences,
}

/// Differences to the nominal model's drives of the same seeds.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Differences {
    /// Of [`Row::across_rms_m`] [m].
    pub across_rms_m: Option<Mean>,
    /// Of [`Row::across_max_m`] [m].
    pub across_max_m: Option<Mean>,
    /// Of [`Row::speed_rms_mps`] [m/s].
    pub speed_rms_mps: Option<Mean>,
    /// Of [`Row::plan_rms_m`] [m].
    pub plan_rms_m: Option<Mean>,
}

type Read = fn(&DriveResult) -> Option<f64>;

impl Row {
    /// Of the drives of one cell, with those of the nominal model in the same order of seeds; `None` of no drive.
    pub(super) fn of(drives: &[DriveResult], nominal: &[DriveResult]) -> Option<Self> {
        let job = drives.first()?.job;
        let at_goal = drives.iter().filter(|drive| drive.end == End::Goal);
        let times_s: Vec<f64> = at_goal.map(|drive| drive.time_s).collect();
        let mean = |read: Read| Mean::of(&drives.iter().filter_map(read).collect::<Vec<_>>());
        let difference = |read: Read| {
            let pairs = drives.iter().zip(nominal);
            let less = pairs.filter_map(|(own, other)| Some(read(own)? - read(other)?));
            Mean::of(&less.collect::<Vec<_>>())
        };
        let across_rms: Read = |drive| drive.across_rms_m;
        let across_max: Read = |drive| drive.across_max_m;
        let speed_rms: Read = |drive| drive.speed_rms_mps;
        let plan_rms: Read = |drive| Some(drive.plan_rms_m);
        Some(Self {
            ground: job.ground,
            gap: job.gap,
            belief: job.belief,
            n: drives.len(),
            n_goal: times_s.len(),
            wilson: wilson_interval(times_s.len(), drives.len()),
            time_s: Mean::of(&times_s),
            across_rms_m: mean(across_rms),
            across_max_m: mean(across_max),
            speed_rms_mps: mean(speed_rms),
            plan_rms_m: mean(plan_rms),
            less_nominal: Differences {
                across_rms_m: difference(across_rms),
                across_max_m: difference(across_max),
                speed_rms_mps: difference(speed_rms),
                plan_rms_m: difference(plan_rms),
            },
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gap_closed_loop::Job;

    fn drive(belief: Belief, seed: u64, end: End, across_m: f64) -> DriveResult {
        DriveResult {
            job: Job { ground: Ground::Course, gap: Gap::SteerLag, belief, seed },
            end,
            time_s: 10.0 * seed as f64,
            path_length_m: 1.0,
            across_rms_m: Some(across_m),
            across_max_m: Some(2.0 * across_m),
            speed_rms_mps: None,
            plan_rms_m: 0.5,
        }
    }

    #[test]
    fn means_are_means_and_their_intervals_hold_them() {
        let mean = Mean::of(&[1.0, 2.0, 6.0]).unwrap();
        assert_eq!(mean.value, 3.0);
        // Of 27 draws one is all the least and one all the largest: both lie outside of the middle 95 %... at 3.7 %.
        assert!((1.0..3.0).contains(&mean.low) && mean.high > 3.0 && mean.high <= 6.0, "{mean:?}");
        assert_eq!(Mean::of(&[4.0]), Some(Mean { value: 4.0, low: 4.0, high: 4.0 }));
        assert_eq!(Mean::of(&[]), None);
    }

    #[test]
    fn row_counts_goals_and_pairs_seeds() {
        let own = [
            drive(Belief::Repaired, 1, End::Goal, 0.2),
            drive(Belief::Repaired, 2, End::LeftCourse, 0.5),
            drive(Belief::Repaired, 3, End::Goal, 0.4),
        ];
        let nominal = [0.5, 0.8, 0.7].map(|across_m| drive(Belief::Nominal, 1, End::Goal, across_m));
        let row = Row::of(&own, &nominal).unwrap();
        assert_eq!((row.n, row.n_goal), (3, 2));
        assert_eq!(row.time_s.unwrap().value, 20.0, "those that arrived: 10 and 30 s");
        let less = row.less_nominal.across_rms_m.unwrap();
        // Every seed is better by 0.3: there is nothing to be unsure of.
        assert!([less.value, less.low, less.high].iter().all(|value| (value + 0.3).abs() < 1e-12));
        assert_eq!(row.less_nominal.speed_rms_mps, None);
        assert_eq!(row.less_nominal.plan_rms_m.unwrap().value, 0.0);
        assert_eq!(Row::of(&[], &nominal), None);
    }
}
