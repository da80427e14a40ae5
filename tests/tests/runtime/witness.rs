//! Watches a run over its channels, as a stranger would, and holds every decision to the documented bounds: by the
//! times that messages carry and by counts of cycles, so that a machine under load changes nothing.

use std::collections::BTreeMap;
use std::time::Instant;

use bicycle::{Decision, StopReason};
use bus::channel::{Bus, DECISION, Inlet, ODOMETRY, RISK_PHYSICS};
use bus::message::{DecisionRecord, OdometryRecord, RiskHeader, Source, Stamp};
use bus::status::Role;
use rustix::process::Signal;

use crate::fixture::{Run, ages, eventually, machine};

/// Longest that a machine under load may need for anything here [s].
const LIMIT_S: f64 = 60.0;

/// Cycles of 20 ms in which a vehicle without a command comes to stand: 1 m/s at 1 m/s2, and half a second for motor,
/// slope and what was still on its way.
const BRAKING_CYCLES: u64 = 75;

/// Speed below which it stands [m/s]: the sensor's noise.
const STANDING_MPS: f64 = 0.08;

/// An odometry message.
#[derive(Clone, Copy)]
struct Seen {
    at_ns: u64,
    /// When the localisation said last what it says now, for the first time [ns].
    since_ns: u64,
    record: OdometryRecord,
}

impl Seen {
    fn speed_mps(&self) -> f64 {
        self.record.velocity_mps[0].hypot(self.record.velocity_mps[1])
    }

    fn says_the_same(&self, other: &OdometryRecord) -> bool {
        let told = |record: &OdometryRecord| {
            (record.position_m, record.attitude_rad, record.velocity_mps, record.yaw_rate_radps)
        };
        told(&self.record) == told(other)
    }
}

/// What was seen of a run.
pub struct Witness {
    _bus: Bus,
    odometry: Inlet<Stamp, OdometryRecord>,
    decisions: Inlet<Stamp, DecisionRecord>,
    physics: Inlet<RiskHeader, [f32; 4]>,
    /// By the life of its publisher and its number in it.
    seen: BTreeMap<(u64, u64), Seen>,
    /// Of every map of physics alone, when it was sent and when its scan was measured [ns].
    physics_maps: Vec<[u64; 2]>,
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
            physics: bus.inlet(&RISK_PHYSICS).unwrap(),
            _bus: bus,
            seen: BTreeMap::new(),
            physics_maps: Vec::new(),
            last: None,
            decision: None,
            decided: Vec::new(),
        }
    }

    pub fn look(&mut self) {
        let (last, seen) = (&mut self.last, &mut self.seen);
        self.odometry.poll(|stamp, records| {
            let (at_ns, record) = (stamp.valid_at_ns, records[0]);
            let before = seen.last_key_value().filter(|(_, before)| before.says_the_same(&record));
            let since_ns = before.map_or(at_ns, |(_, before)| before.since_ns);
            seen.insert((stamp.epoch_ns, stamp.sequence), Seen { at_ns, since_ns, record });
            *last = Some(record);
        });
        let maps = &mut self.physics_maps;
        self.physics.poll(|header, _| maps.push([header.stamp.published_at_ns, header.stamp.valid_at_ns]));
        let mut decided = Vec::new();
        self.decisions.poll(|stamp, records| decided.push((*stamp, records[0])));
        for (stamp, record) in decided {
            self.hold_to_ages(&record);
            self.hold_to_the_younger_map(&record);
            self.decision = Some((stamp, record));
            self.decided.push(record);
        }
    }

    /// However late anything comes, nothing is driven on that is older than it may be when it is decided on, that is no
    /// number or that repeats itself; and nobody stops for a map that is young enough.
    fn hold_to_ages(&self, record: &DecisionRecord) {
        let (_, config) = machine();
        let scan_s = record.decided_at_ns.saturating_sub(record.command.scan_at_ns) as f64 * 1e-9;
        let is_map_old = scan_s > config.guard.scan_age_max_s;
        match record.command.decision() {
            Some(Decision::Stop(StopReason::StaleScan)) => assert!(is_map_old, "a stop: {record:?}"),
            Some(Decision::Drive(_)) => {
                assert!(!is_map_old, "an old map: {record:?}");
                self.hold_to_odometry(record);
            }
            _ => {}
        }
    }

    fn hold_to_odometry(&self, record: &DecisionRecord) {
        let (_, config) = machine();
        let Source { epoch_ns, sequence } = record.odometry;
        let Some(seen) = self.seen.get(&(epoch_ns, sequence)) else { return };
        let age_s = record.decided_at_ns.saturating_sub(seen.at_ns) as f64 * 1e-9;
        assert!(age_s <= config.guard.odometry_age_max_s, "old odometry: {record:?}");
        assert!(seen.record.yaw_rate_radps.is_finite(), "odometry that is no number: {record:?}");
        let same_s = (seen.at_ns - seen.since_ns) as f64 * 1e-9;
        assert!(same_s <= config.guard.frozen_max_s, "the same odometry for {same_s} s: {record:?}");
    }

    /// From an age of its scan on, a map is decided on only while nobody has offered a younger one: a decision before
    /// at the latest, so that one which is still on its way counts as not there.
    fn hold_to_the_younger_map(&self, record: &DecisionRecord) {
        let Some((_, before)) = self.decision.filter(|(_, before)| before.cycle + 1 == record.cycle) else {
            return;
        };
        let scan_at_ns = record.command.scan_at_ns;
        if scan_at_ns == 0 || record.decided_at_ns.saturating_sub(scan_at_ns) <= ages().learned_ns {
            return;
        }
        let offered = self.physics_maps.iter().filter(|[sent_ns, _]| *sent_ns <= before.decided_at_ns);
        let newest_ns = offered.map(|[_, scan_at_ns]| *scan_at_ns).max().unwrap_or(0);
        assert!(newest_ns <= scan_at_ns, "physics knew of a younger scan: {newest_ns}, {record:?}");
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
        self.seen.last_key_value().map_or(0.0, |(_, seen)| seen.speed_mps())
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
        self.until(why, |witness| witness.speed_mps() < STANDING_MPS)
    }

    /// The same where nobody commands any more: counted in the vehicle's own cycles from the first in which the last
    /// command is too old to be followed.
    pub fn until_standing_alone(&mut self, why: &str) -> f64 {
        let took_ms = self.until_standing(why);
        let (sent, record) = self.decision.unwrap();
        let of_ns = match record.command.decision() {
            Some(Decision::Drive(_)) => record.command.odometry_at_ns,
            _ => sent.published_at_ns,
        };
        let alone_ns = of_ns + ages().command_ns;
        let mut alone = self.seen.iter().filter(|(_, seen)| seen.at_ns > alone_ns);
        let Some((&(_, first), _)) = alone.clone().next() else { return took_ms };
        let stands = alone.find(|(_, seen)| seen.speed_mps() < STANDING_MPS);
        let n_cycles = stands.unwrap().0.1 - first;
        assert!(n_cycles <= BRAKING_CYCLES, "{why}: stood after {n_cycles} cycles of its own");
        took_ms
    }

    /// Whether the last decision was made on a map of what was learned (1) or of physics alone (2).
    pub fn drives_on(&self, map_source: u64) -> bool {
        self.decision.is_some_and(|(_, record)| record.map_source == map_source)
    }
}
