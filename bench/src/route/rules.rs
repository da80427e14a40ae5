//! The rules of the table, fixed before the first drive.

use scenarios::LandscapeKind;

use super::method::Method;
use super::row::{Comparison, Row, Tracking};
use crate::Verdict;

/// How far below the best row ours may be, and how far the rows of too much confidence must fall [-].
const BEHIND: f64 = 0.03;
const DROP: f64 = 0.12;
/// What turns without a cost take more, at least [-].
const WITHOUT_STEERING: f64 = 1.05;
/// Driven over expected time of ours.
const RATIO: [f64; 2] = [0.95, 1.15];

/// Rows, and comparisons with ours.
pub(super) struct Table<'a> {
    pub rows: &'a [Row],
    pub comparisons: &'a [Comparison],
}

impl Table<'_> {
    fn row(&self, landscape: LandscapeKind, method: Method) -> Option<&Row> {
        let is_it =
            |row: &&Row| (row.landscape, row.method, row.tracking) == (landscape, method, Tracking::Pd);
        self.rows.iter().find(is_it)
    }

    fn success(&self, landscape: LandscapeKind, method: Method) -> f64 {
        self.row(landscape, method).map_or(f64::NAN, Row::success)
    }

    /// Time of a row over ours, where both arrived.
    fn time_ratio(&self, landscape: LandscapeKind, method: Method) -> f64 {
        let of_pd = self.comparisons.iter().filter(|comparison| comparison.tracking == Tracking::Pd);
        let mut found =
            of_pd.filter(|comparison| (comparison.landscape, comparison.method) == (landscape, method));
        found.next().and_then(|comparison| comparison.time_ratio).map_or(f64::NAN, |mean| mean.value)
    }

    fn ratio(&self, landscape: LandscapeKind, method: Method) -> f64 {
        self.row(landscape, method).and_then(|row| row.ratio).map_or(f64::NAN, |mean| mean.value)
    }

    pub fn verdicts(&self) -> Vec<Verdict> {
        LandscapeKind::ALL
            .into_iter()
            .flat_map(|landscape| self.of_landscape(landscape))
            .chain([Method::Friction150, Method::Speed125].map(|method| self.overconfident(method)))
            .collect()
    }

    fn of_landscape(&self, landscape: LandscapeKind) -> Vec<Verdict> {
        let at = landscape.name();
        let percent = |share: f64| format!("{:.0} %", 100.0 * share);
        let ours = self.success(landscape, Method::Ours);
        let best = Method::ALL.map(|method| self.success(landscape, method)).into_iter().fold(0.0, f64::max);
        let mut verdicts = vec![Verdict {
            rule: format!("{at}: ours within 3 points of the best row's success"),
            found: format!("{} of {}", percent(ours), percent(best)),
            is_passed: ours >= best - BEHIND,
        }];
        for method in [Method::Friction50, Method::Speed75] {
            let (success, time) = (self.success(landscape, method), self.time_ratio(landscape, method));
            verdicts.push(Verdict {
                rule: format!("{at}: {} slower at no less success", method.name()),
                found: format!("{} success, time {time:.2} of ours", percent(success)),
                is_passed: success >= ours && time > 1.0,
            });
        }
        for method in [Method::Binary, Method::Appearance] {
            let success = self.success(landscape, method);
            verdicts.push(Verdict {
                rule: format!("{at}: {} with less success", method.name()),
                found: percent(success),
                is_passed: success < ours,
            });
        }
        let winding = self.time_ratio(landscape, Method::NoSteering);
        verdicts.push(Verdict {
            rule: format!("{at}: slower by 5 % without the steering cost"),
            found: format!("time {winding:.3} of ours"),
            is_passed: winding >= WITHOUT_STEERING,
        });
        let (ratio, hasty) = (self.ratio(landscape, Method::Ours), self.ratio(landscape, Method::Speed125));
        verdicts.push(Verdict {
            rule: format!("{at}: driven over expected time 0.95 to 1.15"),
            found: format!("{ratio:.3}"),
            is_passed: (RATIO[0]..=RATIO[1]).contains(&ratio),
        });
        verdicts.push(Verdict {
            rule: format!("{at}: the same above 1.15 at 1.25 times the speed"),
            found: format!("{hasty:.3}"),
            is_passed: hasty > RATIO[1],
        });
        verdicts
    }

    fn overconfident(&self, method: Method) -> Verdict {
        let drops = LandscapeKind::ALL
            .map(|landscape| self.success(landscape, Method::Ours) - self.success(landscape, method));
        Verdict {
            rule: format!("{} loses 12 points of success in one landscape at least", method.name()),
            found: format!("{:.0} and {:.0} points", 100.0 * drops[0], 100.0 * drops[1]),
            is_passed: drops.into_iter().any(|drop| drop >= DROP),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::statistics::Mean;

    fn row(method: Method, n_success: usize, ratio: f64) -> [Row; 2] {
        LandscapeKind::ALL.map(|landscape| Row {
            landscape,
            method,
            tracking: Tracking::Pd,
            n: 50,
            n_success,
            success_interval: [0.0, 1.0],
            time_s: None,
            ratio: Mean::of(&[ratio]),
            failures: Vec::new(),
        })
    }

    fn comparison(method: Method, time: f64) -> [Comparison; 2] {
        LandscapeKind::ALL.map(|landscape| Comparison {
            landscape,
            method,
            tracking: Tracking::Pd,
            n: 50,
            n_only_ours: 0,
            n_only_other: 0,
            p_value: 1.0,
            time_ratio: Mean::of(&[time]),
        })
    }

    /// The paper's table passes, and what is asked for is what fails when it is not there.
    #[test]
    fn each_rule_can_hold_and_fail() {
        let rows = |ours: usize, hasty: usize, ratio: f64| {
            [
                row(Method::Ours, ours, ratio),
                row(Method::Binary, 36, 1.1),
                row(Method::Appearance, 13, 1.0),
                row(Method::Friction50, 50, 1.0),
                row(Method::Speed75, 50, 0.94),
                row(Method::Friction150, 43, 1.16),
                row(Method::Speed125, hasty, 1.23),
            ]
            .concat()
        };
        let comparisons = |winding: f64| {
            [
                comparison(Method::Friction50, 1.32),
                comparison(Method::Speed75, 1.21),
                comparison(Method::NoSteering, winding),
            ]
            .concat()
        };
        let n_failed = |rows: &[Row], comparisons: &[Comparison]| {
            let verdicts = Table { rows, comparisons }.verdicts();
            assert_eq!(verdicts.len(), 18);
            verdicts.iter().filter(|verdict| !verdict.is_passed).count()
        };
        assert_eq!(n_failed(&rows(50, 41, 1.037), &comparisons(1.09)), 0);
        // 48 of 50 are 4 points behind; 1.25 v drops by 14 of them, still.
        assert_eq!(n_failed(&rows(48, 41, 1.037), &comparisons(1.09)), 2 + 1);
        assert_eq!(n_failed(&rows(50, 45, 1.037), &comparisons(1.09)), 1);
        assert_eq!(n_failed(&rows(50, 41, 1.2), &comparisons(1.09)), 2);
        assert_eq!(n_failed(&rows(50, 41, 1.037), &comparisons(1.04)), 2);
    }
}
