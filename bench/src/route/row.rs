//! What drives come to, by method.

use scenarios::LandscapeKind;
use serde::Serialize;

use super::method::Method;
use super::track::End;
use crate::statistics::{Mean, mcnemar_p_value, wilson_interval};

/// Who follows the line.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Tracking {
    /// Proportional and differential, as in the paper.
    Pd,
    /// The shipping controller.
    Mppi,
}

impl Tracking {
    /// Its name in tables.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Pd => "PD",
            Self::Mppi => "MPPI",
        }
    }
}

/// One task of one method.
#[derive(Clone, Debug, Serialize)]
pub struct Drive {
    /// Where.
    pub landscape: LandscapeKind,
    /// Who planned.
    pub method: Method,
    /// Who followed.
    pub tracking: Tracking,
    /// Number of the task.
    pub task: usize,
    /// How it ended.
    pub end: End,
    /// Until then [s].
    pub time_s: f64,
    /// What the plan takes to the place that counts as the goal [s]; none without a route, and of whoever drives at
    /// one speed.
    pub expected_s: Option<f64>,
    /// Length of the route [m].
    pub length_m: f64,
    /// Farthest from it [m].
    pub off_max_m: f64,
    /// Where it ended [m].
    pub at_m: [f64; 2],
    /// Why there is no route, in words.
    pub refused: Option<String>,
}

impl Drive {
    fn is_success(&self) -> bool {
        self.end == End::Goal
    }

    /// Driven over expected time.
    pub fn ratio(&self) -> Option<f64> {
        self.expected_s.filter(|_| self.is_success()).map(|expected_s| self.time_s / expected_s)
    }
}

/// All tasks of one method in one landscape.
#[derive(Clone, Debug, Serialize)]
pub struct Row {
    /// Where.
    pub landscape: LandscapeKind,
    /// Who planned.
    pub method: Method,
    /// Who followed.
    pub tracking: Tracking,
    /// Tasks.
    pub n: usize,
    /// At the goal.
    pub n_success: usize,
    /// Wilson's interval of the share [-].
    pub success_interval: [f64; 2],
    /// Over the successful ones [s].
    pub time_s: Option<Mean>,
    /// Driven over expected time, over the successful ones [-].
    pub ratio: Option<Mean>,
    /// How the others ended.
    pub failures: Vec<(End, usize)>,
}

impl Row {
    pub(super) fn of(drives: &[&Drive]) -> Option<Self> {
        let first = drives.first()?;
        let n_success = drives.iter().filter(|drive| drive.is_success()).count();
        let times: Vec<f64> =
            drives.iter().filter(|drive| drive.is_success()).map(|drive| drive.time_s).collect();
        let ratios: Vec<f64> = drives.iter().filter_map(|drive| drive.ratio()).collect();
        let count = |end: End| (end, drives.iter().filter(|drive| drive.end == end).count());
        let failures = End::ALL.into_iter().filter(|end| *end != End::Goal).map(count);
        Some(Self {
            landscape: first.landscape,
            method: first.method,
            tracking: first.tracking,
            n: drives.len(),
            n_success,
            success_interval: wilson_interval(n_success, drives.len()),
            time_s: Mean::of(&times),
            ratio: Mean::of(&ratios),
            failures: failures.filter(|(_, n)| *n > 0).collect(),
        })
    }

    /// Successful tasks over all.
    pub fn success(&self) -> f64 {
        self.n_success as f64 / self.n as f64
    }
}

/// Another row beside ours, task by task.
#[derive(Clone, Debug, Serialize)]
pub struct Comparison {
    /// Where.
    pub landscape: LandscapeKind,
    /// The other's planner.
    pub method: Method,
    /// The other's follower.
    pub tracking: Tracking,
    /// Tasks of both.
    pub n: usize,
    /// Tasks in which only ours arrived.
    pub n_only_ours: usize,
    /// Tasks in which only the other did.
    pub n_only_other: usize,
    /// Probability of a split as uneven by chance (McNemar, exact).
    pub p_value: f64,
    /// Time of the other over ours, where both arrived [-].
    pub time_ratio: Option<Mean>,
}

impl Comparison {
    pub(super) fn of(other: &[&Drive], ours: &[&Drive]) -> Option<Self> {
        let first = other.first()?;
        let same = |drive: &&Drive| ours.iter().find(|ours| ours.task == drive.task).copied();
        let pairs: Vec<(&Drive, &Drive)> =
            other.iter().filter_map(|drive| Some((*drive, same(drive)?))).collect();
        let count = |of_other: bool, of_ours: bool| {
            pairs.iter().filter(|(a, b)| (a.is_success(), b.is_success()) == (of_other, of_ours)).count()
        };
        let (n_only_ours, n_only_other) = (count(false, true), count(true, false));
        let both = pairs.iter().filter(|(a, b)| a.is_success() && b.is_success());
        let ratios: Vec<f64> = both.map(|(a, b)| a.time_s / b.time_s).collect();
        Some(Self {
            landscape: first.landscape,
            method: first.method,
            tracking: first.tracking,
            n: pairs.len(),
            n_only_ours,
            n_only_other,
            p_value: mcnemar_p_value(n_only_ours, n_only_other),
            time_ratio: Mean::of(&ratios),
        })
    }
}
