//! Two rows of the table on the same starts and goals.

use scenarios::Outcome;
use serde::Serialize;

use super::{DriveResult, Entrant, Row};
use crate::closed_loop::Method;
use crate::statistics::Paired;

/// Which methods are compared, where both are in the table: at every alpha, or once where neither knows one. With planners
/// of other people's `pietra` is.
const COMPARED: [[Method; 2]; 8] = [
    [Method::Pietra, Method::PietraAvoid],
    [Method::PietraAvoid, Method::Evora],
    [Method::Pietra, Method::Physics],
    [Method::Physics, Method::PhysicsInformed],
    [Method::PhysicsInformed, Method::Vanilla],
    [Method::Pietra, Method::Nominal],
    [Method::Truth, Method::Pietra],
    [Method::Truth, Method::Nominal],
];

/// Two rows, paired by map, start and goal.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Comparison {
    /// Who drove the one row.
    pub method: Entrant,
    /// Its risk tolerance.
    pub alpha: Option<f64>,
    /// Who drove the other.
    pub other: Entrant,
    /// Its risk tolerance.
    pub other_alpha: Option<f64>,
    /// Over the pairs that both drove.
    #[serde(flatten)]
    pub paired: Paired,
}

impl Comparison {
    /// Of two rows' drives.
    pub(super) fn of((row, drives): (&Row, &[DriveResult]), (other, others): (&Row, &[DriveResult])) -> Self {
        let arrival_s = |drive: &DriveResult| (drive.outcome == Outcome::Goal).then_some(drive.time_s);
        let pair_s = |drive: &DriveResult| {
            let other = others.iter().find(|other| (other.map, other.pair) == (drive.map, drive.pair))?;
            Some([arrival_s(drive), arrival_s(other)])
        };
        let pairs_s: Vec<[Option<f64>; 2]> = drives.iter().filter_map(pair_s).collect();
        Self {
            method: row.method.clone(),
            alpha: row.alpha,
            other: other.method.clone(),
            other_alpha: other.alpha,
            paired: Paired::of(&pairs_s),
        }
    }

    /// Of all rows that are compared.
    pub(super) fn all(rows: &[(&Row, &[DriveResult])]) -> Vec<Self> {
        let with = |who: Entrant| rows.iter().filter(move |(row, _)| row.method == who);
        let at_one_level = |one: &Row, other: &Row| match (one.alpha, other.alpha) {
            (Some(one), Some(other)) => one == other,
            _ => true,
        };
        let mut all = Vec::new();
        let ours = COMPARED.map(|pair| pair.map(Entrant::from));
        let external = rows.iter().map(|(row, _)| &row.method).filter(|who| who.method().is_none());
        let with_pietra = external.map(|who| [Method::Pietra.into(), who.clone()]);
        for [who, other] in ours.into_iter().chain(with_pietra) {
            for &one in with(who) {
                let others = with(other.clone()).filter(|(row, _)| at_one_level(one.0, row));
                all.extend(others.map(|&other| Self::of(one, other)));
            }
        }
        all
    }
}

#[cfg(test)]
mod tests {
    use super::super::drive::driven;
    use super::*;
    use crate::statistics::Mean;

    fn drives(who: impl Into<Entrant>, alpha: Option<f64>, ended: &[(Outcome, f64)]) -> Vec<DriveResult> {
        let (who, drives) = (who.into(), ended.iter().zip(0..));
        let drives =
            drives.map(|(&(outcome, time_s), pair)| driven(who.clone(), alpha, pair, outcome, time_s));
        drives.collect()
    }

    #[test]
    fn pairs_are_compared_start_by_start() {
        use Outcome::{Goal, Stuck};
        let one = drives(
            Method::Pietra,
            Some(0.6),
            &[(Goal, 40.0), (Goal, 41.0), (Goal, 42.0), (Stuck, 9.0), (Stuck, 8.0)],
        );
        let mut other =
            drives(Method::Nominal, None, &[(Goal, 43.0), (Goal, 44.0), (Stuck, 5.0), (Goal, 50.0)]);
        other.reverse();
        let rows = [Row::of(&one).unwrap(), Row::of(&other).unwrap()];
        let all = Comparison::all(&[(&rows[0], &one), (&rows[1], &other)]);
        assert_eq!(all.len(), 1);
        let (found, paired) = (&all[0], all[0].paired);
        assert_eq!((&found.method, found.alpha), (&Method::Pietra.into(), Some(0.6)));
        assert_eq!((&found.other, found.other_alpha), (&Method::Nominal.into(), None));
        // The fifth start was driven by one of them alone.
        assert_eq!((paired.n, paired.n_only_one, paired.n_only_other), (4, 1, 1));
        assert_eq!(paired.p_value, 1.0);
        assert_eq!(paired.time_difference_s, Some(Mean { value: -3.0, low: -3.0, high: -3.0 }));
    }

    #[test]
    fn levels_are_compared_with_their_like() {
        let one = [0.4, 0.8].map(|alpha| drives(Method::Pietra, Some(alpha), &[(Outcome::Goal, 40.0)]));
        let other = [0.4, 0.8].map(|alpha| drives(Method::Physics, Some(alpha), &[(Outcome::Goal, 40.0)]));
        let all: Vec<(Row, Vec<DriveResult>)> =
            one.into_iter().chain(other).map(|drives| (Row::of(&drives).unwrap(), drives)).collect();
        let rows: Vec<(&Row, &[DriveResult])> =
            all.iter().map(|(row, drives)| (row, drives.as_slice())).collect();
        let compared = Comparison::all(&rows);
        let levels: Vec<_> = compared.iter().map(|found| [found.alpha, found.other_alpha]).collect();
        assert_eq!(levels, [[Some(0.4); 2], [Some(0.8); 2]]);
    }
    #[test]
    fn planners_of_others_are_compared_with_pietra_at_every_level() {
        let goal: &[(Outcome, f64)] = &[(Outcome::Goal, 40.0)];
        let mine = Entrant::External("mine".parse().unwrap());
        let all = [
            drives(Method::Pietra, Some(0.4), goal),
            drives(Method::Pietra, Some(0.8), goal),
            drives(Method::Evora, Some(0.4), goal),
            drives(mine.clone(), None, goal),
        ];
        let rows = all.each_ref().map(|drives| Row::of(drives).unwrap());
        let rows: Vec<(&Row, &[DriveResult])> = rows.iter().zip(all.iter().map(Vec::as_slice)).collect();
        let compared = Comparison::all(&rows);
        let told: Vec<_> = compared.iter().map(|found| (&found.method, found.alpha, &found.other)).collect();
        let pietra = Entrant::from(Method::Pietra);
        assert_eq!(told, [(&pietra, Some(0.4), &mine), (&pietra, Some(0.8), &mine)]);
    }
}
