//! What laps add up to.

use serde::Serialize;

use super::Row;
use super::lap::DrivenLap;
use super::track::Track;
use crate::statistics::wilson_interval;

/// The laps on one track.
#[derive(Clone, Debug, Serialize)]
pub struct TrackReport {
    /// Name of the track.
    pub track: &'static str,
    /// Target speeds [m/s].
    pub speeds_mps: Vec<f64>,
    /// The models.
    pub rows: Vec<RowReport>,
}

/// One model's laps.
#[derive(Clone, Debug, Serialize)]
pub struct RowReport {
    /// Which.
    pub row: Row,
    /// Turns that were tried.
    pub n: usize,
    /// Turns that failed.
    pub failures: usize,
    /// Share of turns that did not.
    pub success: f64,
    /// 95 % Wilson interval of it.
    pub success_interval: [f64; 2],
    /// Share of failed turns at each speed.
    pub failed_per_speed: Vec<f64>,
    /// Share of failed attempts at each turn.
    pub failed_per_turn: Vec<f64>,
    /// Failures at each speed and turn.
    pub failures_at: Vec<Vec<usize>>,
    /// Quartiles of the laps' mean distance to the path, at each speed [m].
    pub distance_m: Vec<Quartiles>,
    /// All laps, by speed and then by number.
    pub laps: Vec<DrivenLap>,
}

/// Least, quarter, middle, three quarters, largest.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Quartiles(pub [f64; 5]);

impl Quartiles {
    /// Of at least one value, between ranks linearly.
    pub fn of(mut values: Vec<f64>) -> Self {
        values.sort_by(f64::total_cmp);
        let at = |share: f64| {
            let place = share * (values.len().max(1) - 1) as f64;
            let below = place as usize;
            let pick = |k: usize| values.get(k).or(values.last()).copied().unwrap_or(f64::NAN);
            pick(below) + (place - below as f64) * (pick(below + 1) - pick(below))
        };
        Self([0.0, 0.25, 0.5, 0.75, 1.0].map(at))
    }
}

impl RowReport {
    pub(super) fn new(row: Row, track: &Track, speeds_mps: &[f64], laps: Vec<DrivenLap>) -> Self {
        let per_speed = laps.len() / speeds_mps.len();
        let count =
            |laps: &[DrivenLap], turn: usize| laps.iter().filter(|lap| lap.turns[turn].is_some()).count();
        let failures_at: Vec<Vec<usize>> = laps
            .chunks(per_speed)
            .map(|laps| (0..track.n_turns()).map(|turn| count(laps, turn)).collect())
            .collect();
        let n = laps.len() * track.n_turns();
        let failures = failures_at.iter().flatten().sum();
        let share = |failures: usize, n: usize| failures as f64 / n as f64;
        let at_turn = |turn: usize| failures_at.iter().map(|row| row[turn]).sum();
        let distances =
            |laps: &[DrivenLap]| Quartiles::of(laps.iter().map(|lap| lap.mean_distance_m).collect());
        Self {
            row,
            n,
            failures,
            success: share(n - failures, n),
            success_interval: wilson_interval(n - failures, n),
            failed_per_speed: failures_at
                .iter()
                .map(|row| share(row.iter().sum(), per_speed * track.n_turns()))
                .collect(),
            failed_per_turn: (0..track.n_turns()).map(|turn| share(at_turn(turn), laps.len())).collect(),
            failures_at,
            distance_m: laps.chunks(per_speed).map(distances).collect(),
            laps,
        }
    }

    /// Failed turns of each lap, in order.
    pub(super) fn failures_of_laps(&self) -> Vec<usize> {
        self.laps.iter().map(|lap| lap.turns.iter().flatten().count()).collect()
    }
}

impl TrackReport {
    /// A model's laps.
    pub fn row(&self, row: Row) -> Option<&RowReport> {
        self.rows.iter().find(|report| report.row == row)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kinodynamics::Failure;

    #[test]
    fn failures_are_counted_by_speed_and_by_turn() {
        let lap = |speed_mps: f64, failed: &[usize]| DrivenLap {
            speed_mps,
            lap: 0,
            turns: (0..4).map(|turn| failed.contains(&turn).then_some(Failure::Collision)).collect(),
            mean_distance_m: 0.1,
            path_m: Vec::new(),
        };
        let laps = vec![lap(1.0, &[]), lap(1.0, &[2]), lap(2.0, &[2, 3]), lap(2.0, &[0, 2])];
        let report = RowReport::new(Row::Baseline, &Track::indoor(), &[1.0, 2.0], laps);
        assert_eq!((report.n, report.failures, report.success), (16, 5, 11.0 / 16.0));
        assert_eq!(report.failed_per_speed, [1.0 / 8.0, 4.0 / 8.0]);
        assert_eq!(report.failed_per_turn, [0.25, 0.0, 0.75, 0.25]);
        assert_eq!(report.failures_of_laps(), [0, 1, 2, 2]);
    }

    #[test]
    fn quartiles_lie_between_ranks() {
        assert_eq!(Quartiles::of(vec![3.0, 1.0, 2.0, 4.0]).0, [1.0, 1.75, 2.5, 3.25, 4.0]);
        assert_eq!(Quartiles::of(vec![7.0]).0, [7.0; 5]);
    }
}
