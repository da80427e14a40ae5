//! The rules that were fixed before the hall was driven (PIETRA, figures 9 and 10), as far as the rows allow to judge
//! them.

use scenarios::ArenaWay;

use super::{Row, Run};
use crate::Verdict;
use crate::closed_loop::Method;
use crate::statistics::wilson_interval;

/// Shares of twenty drives that reached the goal, as they are published.
const PUBLISHED: [(Method, f64); 3] =
    [(Method::Pietra, 0.95), (Method::Evora, 0.85), (Method::Physics, 0.80)];
/// Height of the bushes from which the ramp is the better way, and how far off it may be found [m].
const FLIP_M: f64 = 0.1;
const FLIP_WITHIN_M: f64 = 0.05;

/// All rules that the rows allow to judge.
pub(super) fn verdicts(rows: &[Row], runs: &[Run]) -> Vec<Verdict> {
    let mut verdicts: Vec<Verdict> =
        PUBLISHED.iter().filter_map(|&published| share(rows, published)).collect();
    verdicts.extend(PUBLISHED.windows(2).filter_map(|pair| order(rows, pair[0].0, pair[1].0)));
    verdicts.extend(PUBLISHED[1..].iter().filter_map(|&(other, _)| faster(rows, other)));
    verdicts.extend(flip(runs));
    verdicts
}

/// Drives of a method that reached the goal, and all of its drives.
fn arrived(rows: &[Row], method: Method) -> Option<(usize, usize)> {
    let rows = rows.iter().filter(|row| row.method == method);
    let (n_goal, n) = rows.fold((0, 0), |(n_goal, n), row| (n_goal + row.n_goal, n + row.n));
    (n > 0).then_some((n_goal, n))
}

fn told((n_goal, n): (usize, usize)) -> String {
    let [low, high] = wilson_interval(n_goal, n).map(|end| 100.0 * end);
    format!("{n_goal} of {n} [{low:.0}, {high:.0} %]")
}

fn share(rows: &[Row], (method, published): (Method, f64)) -> Option<Verdict> {
    let (n_goal, n) = arrived(rows, method)?;
    let [low, high] = wilson_interval(n_goal, n);
    Some(Verdict {
        rule: format!("{} arrives as often as published, {:.0} %", method.name(), 100.0 * published),
        found: told((n_goal, n)),
        is_passed: (low..=high).contains(&published),
    })
}

fn order(rows: &[Row], more: Method, fewer: Method) -> Option<Verdict> {
    let [one, other] = [arrived(rows, more)?, arrived(rows, fewer)?];
    let share = |(n_goal, n): (usize, usize)| n_goal as f64 / n as f64;
    Some(Verdict {
        rule: format!("{} arrives at least as often as {}", more.name(), fewer.name()),
        found: format!("{}, {}", told(one), told(other)),
        is_passed: share(one) >= share(other),
    })
}

fn faster(rows: &[Row], other: Method) -> Option<Verdict> {
    let of = |method: Method| rows.iter().filter(move |row| row.method == method);
    // Whoever never arrives takes for ever.
    let time_s = |row: &Row| row.time_s.map_or(f64::INFINITY, |mean| mean.value);
    let pairs: Vec<(f64, f64)> =
        of(Method::Pietra).zip(of(other)).map(|(pietra, other)| (time_s(pietra), time_s(other))).collect();
    let found: Vec<String> =
        pairs.iter().map(|(pietra_s, other_s)| format!("{pietra_s:.1} and {other_s:.1} s")).collect();
    (!pairs.is_empty()).then(|| Verdict {
        rule: format!("pietra is faster than {}, in the mean of each mission", other.name()),
        found: found.join("; "),
        is_passed: pairs.iter().all(|(pietra_s, other_s)| pietra_s < other_s),
    })
}

/// The height that parts drives of `pietra` through the bushes from those around them with the fewest on its wrong side.
fn flip(runs: &[Run]) -> Option<Verdict> {
    let chose = runs.iter().filter(|run| run.method == Method::Pietra && run.way.is_some());
    let mut chose: Vec<(f64, bool)> =
        chose.map(|run| (run.bush_height_m, run.way == Some(ArenaWay::Bushes))).collect();
    chose.sort_by(|a, b| a.0.total_cmp(&b.0));
    let n_bushes = chose.iter().filter(|(_, is_through)| *is_through).count();
    // Below all heights: every drive through the bushes is on the wrong side.
    let mut n_wrong = n_bushes;
    let mut best = (n_wrong, 0.0);
    for &(height_m, is_through) in &chose {
        n_wrong = if is_through { n_wrong - 1 } else { n_wrong + 1 };
        if n_wrong < best.0 {
            best = (n_wrong, height_m);
        }
    }
    let (n_wrong, height_m) = best;
    let n = chose.len();
    (n > 0).then(|| Verdict {
        rule: format!("pietra leaves the bushes for another way where they are {FLIP_M} m high, within {FLIP_WITHIN_M} m"),
        found: format!("{height_m:.3} m, {n_wrong} of {n} drives on the other side; {n_bushes} through the bushes"),
        is_passed: 0 < n_bushes && n_bushes < n && (height_m - FLIP_M).abs() <= FLIP_WITHIN_M,
    })
}

#[cfg(test)]
mod tests {
    use super::super::run::Mission;
    use super::*;
    use scenarios::Outcome;

    /// Of 60 runs a mission `n_goal` arrive in `time_s`; `pietra` takes the bushes up to a height [m].
    fn driven(method: Method, n_goal: u64, time_s: f64, flip_m: f64) -> Vec<Run> {
        let runs = Mission::ALL.into_iter().flat_map(|mission| (0..60).map(move |number| (mission, number)));
        runs.map(|(mission, number)| {
            let share = (number as f64 + 0.5) / 60.0;
            let [low_m, high_m] = if mission == Mission::Short { [0.02, 0.1] } else { [0.1, 0.3] };
            let bush_height_m = low_m + share * (high_m - low_m);
            let way = if bush_height_m < flip_m { ArenaWay::Bushes } else { ArenaWay::Ramp };
            Run {
                mission,
                method,
                number,
                bush_height_m,
                outcome: if number < n_goal { Outcome::Goal } else { Outcome::Stuck },
                time_s,
                way: Some(way),
                largest_roll_deg: 1.0,
                largest_pitch_deg: 1.0,
                path_m: Vec::new(),
            }
        })
        .collect()
    }

    fn failed(methods: &[Vec<Run>; 3]) -> Vec<usize> {
        let of = |mission: Mission, runs: &[Run]| {
            Row::of(&runs.iter().filter(|run| run.mission == mission).cloned().collect::<Vec<_>>()).unwrap()
        };
        let rows: Vec<Row> = Mission::ALL
            .into_iter()
            .flat_map(|mission| methods.iter().map(move |runs| of(mission, runs)))
            .collect();
        let verdicts = verdicts(&rows, &methods.concat());
        assert_eq!(verdicts.len(), 8);
        (0..verdicts.len()).filter(|&rule| !verdicts[rule].is_passed).collect()
    }

    #[test]
    fn every_rule_can_hold_and_can_fail() {
        let held = [
            driven(Method::Pietra, 57, 9.0, 0.1),
            driven(Method::Evora, 51, 12.0, 0.0),
            driven(Method::Physics, 48, 10.0, 0.1),
        ];
        assert_eq!(failed(&held), Vec::<usize>::new());
        let with = |place: usize, runs: Vec<Run>| {
            let mut methods = held.clone();
            methods[place] = runs;
            failed(&methods)
        };
        // Half of 120 is neither what is published nor as many as the others.
        assert_eq!(with(0, driven(Method::Pietra, 30, 9.0, 0.1)), [0, 3]);
        assert_eq!(with(1, driven(Method::Evora, 58, 12.0, 0.0)), [1, 3]);
        assert_eq!(with(2, driven(Method::Physics, 56, 10.0, 0.1)), [2, 4]);
        assert_eq!(with(0, driven(Method::Pietra, 57, 11.0, 0.1)), [6]);
        assert_eq!(with(1, driven(Method::Evora, 51, 8.0, 0.0)), [5]);
        assert_eq!(with(0, driven(Method::Pietra, 0, 9.0, 0.1)), [0, 3, 5, 6]);
        for flip_m in [0.0, 0.04, 0.16, 1.0] {
            assert_eq!(with(0, driven(Method::Pietra, 57, 9.0, flip_m)), [7], "{flip_m} m");
        }
    }

    #[test]
    fn flip_is_where_fewest_drives_lie_on_the_wrong_side() {
        let mut runs = driven(Method::Pietra, 57, 9.0, 0.1);
        // One through bushes of nearly 30 cm.
        runs.last_mut().unwrap().way = Some(ArenaWay::Bushes);
        let found = flip(&runs).unwrap().found;
        assert!(
            found.starts_with("0.099 m, 1 of 120") && found.ends_with("61 through the bushes"),
            "{found}"
        );
        assert_eq!(flip(&driven(Method::Evora, 57, 9.0, 0.1)), None);
    }
}
