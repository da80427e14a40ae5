//! What rows come to, and the pass rule, fixed before the withheld seeds were driven.

use friction::Grip;
use serde::Serialize;

/// Times at the limit, by the plant's forces, below which a ground counts as never driven near its limit, and above
/// which its friction has to be found [s].
const NEVER_S: f64 = 0.6;
const SURELY_S: f64 = 4.0;
/// What counts as found.
const WITHIN: f64 = 0.2;
/// A bound may exceed the truth by so much: noise of the inertial unit, ground that is not level.
const BOUND_MARGIN: f64 = 1.1;

/// One ground of one drive.
#[derive(Clone, Debug, Serialize)]
pub struct Row {
    /// Machine.
    pub vehicle: String,
    /// Seed.
    pub seed: u64,
    /// Class.
    pub ground: &'static str,
    /// Whether it was driven hard.
    pub is_aggressive: bool,
    /// On the plant's test bench, at the speed of sliding of the answer, 1 m/s for a bound [-].
    pub true_friction: f64,
    /// The most that it holds at any speed of sliding up to that [-].
    pub true_most_friction: f64,
    /// By the plant's forces [s].
    pub true_at_limit_s: f64,
    /// Of the published table [-].
    pub published_friction: f64,
    /// Used for the answer [s].
    pub driven_s: f64,
    /// By the answer [s].
    pub at_limit_s: f64,
    /// The answer.
    pub grip: Grip,
}

/// A share of cases.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Share {
    /// Cases that hold.
    pub n: usize,
    /// Cases.
    pub of: usize,
}

impl Share {
    fn of<'a>(rows: impl Iterator<Item = &'a Row>, holds: impl Fn(&Row) -> bool) -> Self {
        rows.fold(Self { n: 0, of: 0 }, |share, row| Self {
            n: share.n + usize::from(holds(row)),
            of: share.of + 1,
        })
    }

    /// As a number; nothing of nothing is 0.
    pub fn value(self) -> f64 {
        self.n as f64 / self.of.max(1) as f64
    }

    /// Wilson's interval of 95 %.
    pub fn interval(self) -> [f64; 2] {
        let (n, p, z) = (self.of.max(1) as f64, self.value(), 1.96);
        let middle = (p + z * z / (2.0 * n)) / (1.0 + z * z / n);
        let half = z / (1.0 + z * z / n) * (p * (1.0 - p) / n + z * z / (4.0 * n * n)).sqrt();
        [(middle - half).max(0.0), (middle + half).min(1.0)]
    }
}

/// All rows together.
#[derive(Clone, Debug, Serialize)]
pub struct Score {
    /// Numbers within 20 % of the truth, of all numbers given.
    pub within: Share,
    /// The published table's, on the same rows.
    pub published_within: Share,
    /// Median of the relative error of the numbers given.
    pub median_error: f64,
    /// Intervals of 90 % that hold the truth.
    pub covered: Share,
    /// "At least" where the limit was indeed hardly met.
    pub never_right: Share,
    /// Bounds that the most the ground holds does not undercut by more than a tenth.
    pub bounds_hold: Share,
    /// Numbers given, of the grounds that were surely driven at their limit.
    pub answered: Share,
    /// Numbers given where the limit was never met; not one should be.
    pub unfounded: Share,
}

impl Row {
    fn found(&self) -> Option<(f64, f64, f64)> {
        match self.grip {
            Grip::Measured { friction, low, high, .. } => Some((friction, low, high)),
            Grip::AtLeast { .. } => None,
        }
    }

    fn error(&self) -> Option<f64> {
        self.found().map(|(friction, _, _)| friction / self.true_friction - 1.0)
    }

    fn bound(&self) -> Option<f64> {
        match self.grip {
            Grip::AtLeast { friction } => Some(friction),
            Grip::Measured { .. } => None,
        }
    }
}

impl Score {
    pub(super) fn of(rows: &[Row]) -> Self {
        let measured = || rows.iter().filter(|row| row.found().is_some());
        let bounded = || rows.iter().filter(|row| row.bound().is_some());
        let close = |found: f64, truth: f64| (found / truth - 1.0).abs() <= WITHIN;
        let mut errors: Vec<f64> = measured().filter_map(|row| Some(row.error()?.abs())).collect();
        errors.sort_by(f64::total_cmp);
        let is_covered =
            |row: &Row| row.found().is_some_and(|(_, low, high)| (low..=high).contains(&row.true_friction));
        let surely = rows.iter().filter(|row| row.true_at_limit_s >= SURELY_S);
        let never = rows.iter().filter(|row| row.true_at_limit_s == 0.0);
        Self {
            within: Share::of(measured(), |row| row.error().is_some_and(|error| error.abs() <= WITHIN)),
            published_within: Share::of(measured(), |row| close(row.published_friction, row.true_friction)),
            median_error: errors.get(errors.len() / 2).copied().unwrap_or(0.0),
            covered: Share::of(measured(), is_covered),
            never_right: Share::of(bounded(), |row| row.true_at_limit_s < NEVER_S),
            bounds_hold: Share::of(bounded(), |row| {
                row.bound().is_some_and(|bound| bound <= BOUND_MARGIN * row.true_most_friction)
            }),
            answered: Share::of(surely, |row| row.found().is_some()),
            unfounded: Share::of(never, |row| row.found().is_some()),
        }
    }
}

/// The pass rule, by part.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Verdict {
    /// Nine of ten numbers within 20 %.
    pub within: bool,
    /// Four of five intervals hold the truth.
    pub covered: bool,
    /// 19 of 20 bounds hold.
    pub bounds_hold: bool,
    /// Seven of ten grounds that were surely at their limit get a number.
    pub answered: bool,
    /// At most one of twenty grounds that never were gets one.
    pub unfounded: bool,
}

impl Verdict {
    pub(super) fn of(score: &Score) -> Self {
        Self {
            within: score.within.value() >= 0.9,
            covered: score.covered.value() >= 0.8,
            bounds_hold: score.bounds_hold.value() >= 0.95,
            answered: score.answered.value() >= 0.7,
            unfounded: score.unfounded.value() <= 0.05,
        }
    }
}
