//! Watches a run over its channels, as a stranger would, and holds every decision to the ages that a vehicle may be
//! driven on.

use std::collections::BTreeMap;
use std::time::Instant;

use bicycle::Decision;
use runtime::channel::{Bus, DECISION, Inlet, ODOMETRY};
use runtime::message::{DecisionRecord, OdometryRecord, Source, Stamp};
use runtime::status::Role;
use rustix::process::Signal;

use crate::fixture::{Run, eventually, machine};

/// Longest that a machine under load may need for anything here [s].
const LIMIT_S: f64 = 60.0;

/// What was seen of a run.
pub struct Witness {
    _bus: Bus,
    odometry: Inlet<Stamp, OdometryRecord>,
    decisions: Inlet<Stamp, DecisionRecord>,
    odometry_at_ns: BTreeMap<(u64, u64), u64>,
    pub last: Option<OdometryRecord>,
    pub decision: Option<(Stamp, DecisionRecord)>,
    /// Decisions since it was last emptied.
    pub decided: Vec<DecisionRecord>,
}

impl Witness {
    pub fn new(run: &Run) -> Self {
        let bus = Bus::join(&run.name).unwrap();
        Self {
            odometry: bus.inlet(&ODOMETRY).unwrap(),
            decisions: bus.inlet(&DECISION).unwrap(),
            _bus: bus,
            odometry_at_ns: BTreeMap::new(),
            last: None,
            decision: None,
            decided: Vec::new(),
        }
    }

    pub fn look(&mut self) {
        let (last, at_ns) = (&mut self.last, &mut self.odometry_at_ns);
        self.odometry.poll(|stamp, records| {
            *last = Some(records[0]);
            at_ns.insert((stamp.epoch_ns, stamp.sequence), stamp.valid_at_ns);
        });
        let (decision, decided) = (&mut self.decision, &mut self.decided);
        let n_before = decided.len();
        self.decisions.poll(|stamp, records| {
            *decision = Some((*stamp, records[0]));
            decided.push(records[0]);
        });
        self.decided[n_before..].iter().for_each(|decision| self.hold_to_ages(decision));
    }

    /// However late anything comes, nothing is driven on that is older than it may be when it is decided on.
    fn hold_to_ages(&self, record: &DecisionRecord) {
        if !matches!(record.command.decision(), Some(Decision::Drive(_))) {
            return;
        }
        let (_, config) = machine();
        let age_s = |at_ns: u64| record.decided_at_ns.saturating_sub(at_ns) as f64 * 1e-9;
        assert!(age_s(record.command.scan_at_ns) <= config.guard.scan_age_max_s, "an old map: {record:?}");
        let Source { epoch_ns, sequence } = record.odometry;
        if let Some(&at_ns) = self.odometry_at_ns.get(&(epoch_ns, sequence)) {
            assert!(age_s(at_ns) <= config.guard.odometry_age_max_s, "old odometry: {record:?}");
        }
    }

    /// Milliseconds until this holds; panics when it never does.
    pub fn until(&mut self, what: &str, mut holds: impl FnMut(&Self) -> bool) -> f64 {
        let found = eventually(LIMIT_S, || {
            self.look();
            holds(self).then_some(())
        });
        let (took, ()) =
            found.unwrap_or_else(|| panic!("{what}: not within {LIMIT_S} s; {:?}", self.decision));
        1e3 * took.as_secs_f64()
    }

    /// Stops a process and lets it go on again in turns of so many milliseconds, until this holds; how long that took.
    pub fn in_turns(
        &mut self,
        run: &Run,
        role: Role,
        turns_ms: [u64; 2],
        mut holds: impl FnMut(&Self) -> bool,
    ) -> f64 {
        self.decided.clear();
        let began = Instant::now();
        let mut has_held = false;
        while !has_held {
            assert!(began.elapsed().as_secs_f64() < LIMIT_S, "{} late: {:?}", role.name(), self.decision);
            for (signal, turn_ms) in [Signal::STOP, Signal::CONT].into_iter().zip(turns_ms) {
                run.signal(role, signal);
                eventually(turn_ms as f64 * 1e-3, || {
                    self.look();
                    has_held |= holds(self);
                    None::<()>
                });
            }
        }
        1e3 * began.elapsed().as_secs_f64()
    }

    pub fn until_decided(&mut self, what: &str, decision: Decision) -> f64 {
        self.until(what, |witness| witness.decision_now() == Some(decision))
    }

    pub fn speed_mps(&self) -> f64 {
        self.last.map_or(0.0, |odometry| odometry.velocity_mps[0].hypot(odometry.velocity_mps[1]))
    }

    pub fn decision_now(&self) -> Option<Decision> {
        self.decision.and_then(|(_, record)| record.command.decision())
    }

    pub fn until_driving(&mut self, why: &str) -> f64 {
        self.until(why, |witness| {
            witness.speed_mps() > 0.3 && matches!(witness.decision_now(), Some(Decision::Drive(_)))
        })
    }

    pub fn until_standing(&mut self, why: &str) -> f64 {
        self.until(why, |witness| witness.speed_mps() < 0.08)
    }

    /// Whether the last decision was made on a map of what was learned (1) or of physics alone (2).
    pub fn is_author(&self, author: u64) -> bool {
        self.decision.is_some_and(|(_, record)| record.author == author)
    }
}
