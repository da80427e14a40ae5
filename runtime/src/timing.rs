//! How control kept its times: what its decisions say of themselves, as percentiles.

use std::collections::BTreeMap;

use bicycle::{Decision, HoldReason, StopReason};
use kinodynamics::CorrectionCounts;
use serde::Serialize;

use bus::message::{DecisionRecord, Stamp};

use crate::convert::correction_effect;

/// How a time was distributed [ms].
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Percentiles {
    /// Half of all were at most this.
    pub p50_ms: f64,
    /// 99 in a hundred were.
    pub p99_ms: f64,
    /// 999 in a thousand were.
    pub p99_9_ms: f64,
    /// All were.
    pub max_ms: f64,
}

impl Percentiles {
    /// Nearest-rank percentiles; `None` of nothing.
    pub fn of(samples_ms: &[f32]) -> Option<Self> {
        let mut sorted = samples_ms.to_vec();
        sorted.sort_by(f32::total_cmp);
        let last = sorted.len().checked_sub(1)?;
        // The smallest sample that at least this share of all does not exceed.
        let rank = |share: f64| (share * sorted.len() as f64).ceil() as usize;
        let at = |share: f64| f64::from(sorted[rank(share).clamp(1, last + 1) - 1]);
        Some(Self { p50_ms: at(0.5), p99_ms: at(0.99), p99_9_ms: at(0.999), max_ms: at(1.0) })
    }
}

impl std::fmt::Display for Percentiles {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self { p50_ms, p99_ms, p99_9_ms, max_ms } = self;
        write!(formatter, "{p50_ms:8.2} {p99_ms:8.2} {p99_9_ms:8.2} {max_ms:8.2}")
    }
}

/// How control kept its times.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ControlTiming {
    /// Decisions.
    pub n_decisions: u64,
    /// Of these, to drive.
    pub n_drive: u64,
    /// Of these, to stand still for now, by reason.
    pub holds: BTreeMap<HoldReason, u64>,
    /// Of these, to stop, by reason.
    pub stops: BTreeMap<StopReason, u64>,
    /// Time between two deadlines [ms].
    pub period_ms: f64,
    /// Deadlines that passed without a decision.
    pub n_missed: u64,
    /// By how much the time between two decisions differs from that between their deadlines.
    pub jitter: Option<Percentiles>,
    /// From a deadline to the beginning of its cycle.
    pub lateness: Option<Percentiles>,
    /// From the beginning of a cycle to its command.
    pub decision: Option<Percentiles>,
    /// Age of the scan that the map ends with, when a decision is made on it.
    pub map_age: Option<Percentiles>,
    /// Fewest and most futures that a decision to drive sampled.
    pub n_rollouts: Option<[u64; 2]>,
    /// What became of the commands on their way to the vehicle; none where nobody corrects them.
    pub correction: Option<CorrectionCounts>,
}

impl std::fmt::Display for ControlTiming {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self { n_decisions, n_drive, period_ms, n_missed, .. } = self;
        write!(formatter, "{n_decisions} decisions, {n_drive} to drive, every {period_ms:.0} ms, ")?;
        write!(formatter, "{n_missed} deadlines missed")?;
        if let Some([least, most]) = self.n_rollouts {
            write!(formatter, ", {least} to {most} futures")?;
        }
        for (reason, n) in &self.holds {
            write!(formatter, ", {n} to hold ({reason:?})")?;
        }
        for (reason, n) in &self.stops {
            write!(formatter, ", {n} to stop ({reason:?})")?;
        }
        if let Some(correction) = &self.correction {
            write!(formatter, "\ncorrected for the ground: {correction}")?;
        }
        write!(formatter, "\n{:26} {:>8} {:>8} {:>8} {:>8}", "", "p50", "p99", "p99.9", "max")?;
        let rows = [
            ("jitter of the period [ms]", self.jitter),
            ("lateness [ms]", self.lateness),
            ("time of a decision [ms]", self.decision),
            ("age of its map [ms]", self.map_age),
        ];
        for (name, percentiles) in rows {
            let Some(percentiles) = percentiles else { continue };
            write!(formatter, "\n{name:26} {percentiles}")?;
        }
        Ok(())
    }
}

/// Collects decisions, in their order.
#[derive(Clone, Debug, Default)]
pub struct Timing {
    last: Option<(Stamp, DecisionRecord)>,
    n_decisions: u64,
    n_drive: u64,
    holds: BTreeMap<HoldReason, u64>,
    stops: BTreeMap<StopReason, u64>,
    n_rollouts: Option<[u64; 2]>,
    correction: Option<CorrectionCounts>,
    /// Between the deadlines of decisions that follow one another [ms].
    apart_ms: Vec<f32>,
    jitter_ms: Vec<f32>,
    lateness_ms: Vec<f32>,
    decision_ms: Vec<f32>,
    map_age_ms: Vec<f32>,
}

impl Timing {
    /// Takes in a decision.
    pub fn take(&mut self, stamp: &Stamp, decision: &DecisionRecord) {
        self.n_decisions += 1;
        self.lateness_ms.push(milliseconds(decision.lateness_ns));
        self.decision_ms.push(milliseconds(decision.duration_ns));
        let scan_at_ns = decision.command.scan_at_ns;
        if scan_at_ns > 0 {
            self.map_age_ms.push(milliseconds(decision.decided_at_ns.saturating_sub(scan_at_ns)));
        }
        if let Some(effect) = correction_effect(decision) {
            self.correction.get_or_insert_default().count(effect);
        }
        match decision.command.decision() {
            Some(Decision::Drive(_)) => {
                let n = decision.n_rollouts;
                self.n_drive += 1;
                self.n_rollouts =
                    Some(self.n_rollouts.map_or([n, n], |[least, most]| [least.min(n), most.max(n)]));
            }
            Some(Decision::Hold(reason)) => *self.holds.entry(reason).or_default() += 1,
            Some(Decision::Stop(reason)) => *self.stops.entry(reason).or_default() += 1,
            None => {}
        }
        let before = self.last.replace((*stamp, *decision));
        // Over a restart, or a decision that was lost, nothing is known.
        let follows = |(of, before): &(Stamp, DecisionRecord)| {
            of.epoch_ns == stamp.epoch_ns && before.cycle.checked_add(1) == Some(decision.cycle)
        };
        if let Some((_, before)) = before.filter(follows) {
            self.pair(&before, decision);
        }
    }

    /// What they come to; `None` before the first.
    pub fn report(&self) -> Option<ControlTiming> {
        if self.n_decisions == 0 {
            return None;
        }
        let period_ms = Percentiles::of(&self.apart_ms).map_or(0.0, |apart| apart.p50_ms);
        let missed = |apart_ms: &f32| ((f64::from(*apart_ms) / period_ms).round() as u64).saturating_sub(1);
        Some(ControlTiming {
            n_decisions: self.n_decisions,
            n_drive: self.n_drive,
            holds: self.holds.clone(),
            stops: self.stops.clone(),
            period_ms,
            n_missed: self.apart_ms.iter().map(missed).fold(0, u64::saturating_add),
            jitter: Percentiles::of(&self.jitter_ms),
            lateness: Percentiles::of(&self.lateness_ms),
            decision: Percentiles::of(&self.decision_ms),
            map_age: Percentiles::of(&self.map_age_ms),
            n_rollouts: self.n_rollouts,
            correction: self.correction.clone(),
        })
    }

    fn pair(&mut self, before: &DecisionRecord, decision: &DecisionRecord) {
        let deadline_ns = |of: &DecisionRecord| of.decided_at_ns.saturating_sub(of.lateness_ns);
        let apart_ns = deadline_ns(decision).saturating_sub(deadline_ns(before));
        let took_ns = decision.decided_at_ns.saturating_sub(before.decided_at_ns);
        self.apart_ms.push(milliseconds(apart_ns));
        self.jitter_ms.push(milliseconds(took_ns.abs_diff(apart_ns)));
    }
}

fn milliseconds(duration_ns: u64) -> f32 {
    (duration_ns as f64 * 1e-6) as f32
}

#[cfg(test)]
mod tests {
    use super::*;
    use bus::message::CommandRecord;

    #[test]
    fn percentiles_are_samples_by_their_rank() {
        let samples: Vec<f32> = (1..=1000).rev().map(|k| k as f32).collect();
        let found = Percentiles::of(&samples).unwrap();
        assert_eq!(found, Percentiles { p50_ms: 500.0, p99_ms: 990.0, p99_9_ms: 999.0, max_ms: 1000.0 });
        let one = Percentiles::of(&[7.0]).unwrap();
        assert_eq!((one.p50_ms, one.max_ms), (7.0, 7.0));
        assert_eq!(Percentiles::of(&[]), None);
    }

    /// Deadlines every 100 ms from 1 s on.
    fn decision(cycle: u64, deadline: u64, lateness_ms: u64) -> DecisionRecord {
        let lateness_ns = lateness_ms * 1_000_000;
        let decided_at_ns = 1_000_000_000 + 100_000_000 * deadline + lateness_ns;
        DecisionRecord {
            cycle,
            decided_at_ns,
            lateness_ns,
            duration_ns: 2_000_000,
            n_rollouts: 64 * (1 + cycle),
            command: CommandRecord {
                decision: 1,
                scan_at_ns: decided_at_ns - 300_000_000,
                ..CommandRecord::default()
            },
            ..DecisionRecord::default()
        }
    }

    #[test]
    fn lateness_jitter_and_misses_are_those_of_the_deadlines() {
        let mut timing = Timing::default();
        assert_eq!(timing.report(), None);
        let stamp = Stamp { epoch_ns: 5, ..Stamp::default() };
        // On time, 4 ms late, on time, then two deadlines missed and 1 ms late.
        for (cycle, deadline, lateness_ms) in [(0, 0, 0), (1, 1, 4), (2, 2, 0), (3, 5, 1)] {
            timing.take(&stamp, &decision(cycle, deadline, lateness_ms));
        }
        // Another life begins anew.
        timing.take(&Stamp { epoch_ns: 9, ..stamp }, &decision(0, 50, 0));
        let report = timing.report().unwrap();
        assert_eq!((report.n_decisions, report.n_drive, report.n_missed), (5, 5, 2));
        assert_eq!((report.period_ms, report.n_rollouts), (100.0, Some([64, 256])));
        let jitter = report.jitter.unwrap();
        assert_eq!((jitter.p50_ms, jitter.max_ms), (4.0, 4.0), "4, 4, 1 ms");
        assert_eq!(report.lateness.unwrap().max_ms, 4.0);
        assert_eq!(report.decision.unwrap().p50_ms, 2.0);
        assert_eq!(report.map_age.unwrap().p50_ms, 300.0);
    }

    #[test]
    fn decisions_to_stand_are_counted_by_their_reason() {
        let mut timing = Timing::default();
        let lost = Decision::Stop(StopReason::StaleMission);
        let over = Decision::Hold(HoldReason::NoMission);
        for (cycle, standing) in [lost, over, lost].iter().enumerate() {
            let cycle = cycle as u64;
            let command = CommandRecord::from(standing);
            timing.take(&Stamp::default(), &DecisionRecord { command, ..decision(cycle, cycle, 0) });
        }
        let report = timing.report().unwrap();
        assert_eq!(report.stops, BTreeMap::from([(StopReason::StaleMission, 2)]));
        assert_eq!(report.holds, BTreeMap::from([(HoldReason::NoMission, 1)]));
        let told = report.to_string();
        assert!(told.contains("1 to hold (NoMission), 2 to stop (StaleMission)"), "{told}");
    }
}
