//! Whether decisions were made on the risk maps that they had to be made on.

use std::collections::BTreeMap;
use std::ops::Bound;

use super::records::Key;
use crate::mapping::{LEARNED, PHYSICS};
use bus::clock::SECOND_NS;
use bus::message::{DecisionRecord, RiskHeader, Source, Stamp, TrackRecord, TracksHeader};
use navigator::is_learned;

/// How long a map may be on its way: its sender may be interrupted between stamping and handing it over [ns].
const ON_THE_WAY_NS: u64 = SECOND_NS / 4;
const SOURCES: [(u64, &str); 2] = [(LEARNED, "learned"), (PHYSICS, "physics'")];

/// Follows what one life of control says that it had, decision by decision.
pub(super) struct Choice<'a> {
    risks: &'a [BTreeMap<Key, RiskHeader>; 2],
    tracks: &'a Tracks,
    learned_max_ns: u64,
    /// When control began to hear of maps [ns].
    began_ns: u64,
    held: [Option<Key>; 2],
    held_tracks: Option<Key>,
}

/// What moved, message by message.
type Tracks = BTreeMap<Key, (TracksHeader, Vec<TrackRecord>)>;

impl<'a> Choice<'a> {
    pub fn new(
        risks: &'a [BTreeMap<Key, RiskHeader>; 2],
        tracks: &'a Tracks,
        learned_max_ns: u64,
        began_ns: u64,
    ) -> Self {
        Self { risks, tracks, learned_max_ns, began_ns, held: [None; 2], held_tracks: None }
    }

    /// Says how a decision contradicts the rule: it had the newest map of each source and the newest of what moves, and was
    /// made on the one of the two maps that is to be driven on.
    pub fn check(&mut self, decision: &DecisionRecord) -> Result<(), String> {
        self.check_tracks(decision)?;
        let held = [decision.learned, decision.physics].map(key_of);
        let before = std::mem::replace(&mut self.held, held);
        for (place, (_, name)) in SOURCES.into_iter().enumerate() {
            if held[place] < before[place] {
                let [before, held] = [before[place], held[place]].map(told);
                return Err(format!(
                    "expected {name} risk map {before} or a later one, which it had, found {held}"
                ));
            }
            let later = self.risks[place].range(later_than(held[place]));
            let sent = later.map(|(key, header)| (key, &header.stamp));
            if let Some(missed) = self.overdue(sent, decision.decided_at_ns) {
                let held = told(held[place]);
                return Err(format!(
                    "expected {name} risk map {}, which was there, found {held}",
                    missed.sequence
                ));
            }
        }
        self.check_used(decision, held)
    }

    fn check_tracks(&mut self, decision: &DecisionRecord) -> Result<(), String> {
        let held = key_of(decision.tracks);
        let before = std::mem::replace(&mut self.held_tracks, held);
        if held < before {
            let [before, held] = [before, held].map(told);
            return Err(format!("expected tracks {before} or later ones, which it had, found {held}"));
        }
        let later = self.tracks.range(later_than(held));
        let sent = later.map(|(key, (header, _))| (key, &header.stamp));
        match self.overdue(sent, decision.decided_at_ns) {
            Some(missed) => {
                let held = told(held);
                Err(format!("expected tracks {}, which were there, found {held}", missed.sequence))
            }
            None => Ok(()),
        }
    }

    fn check_used(&self, decision: &DecisionRecord, held: [Option<Key>; 2]) -> Result<(), String> {
        let headers = [0, 1].map(|place| held[place].map(|key| self.risks[place].get(&key)));
        // Nothing is known of a map whose header was not recorded.
        if headers.contains(&Some(None)) {
            return Ok(());
        }
        let [learned_at_ns, physics_at_ns] =
            headers.map(|header| header.flatten().map(|header| header.stamp.valid_at_ns));
        let is_learned =
            is_learned(learned_at_ns, physics_at_ns, decision.decided_at_ns, self.learned_max_ns);
        let place = usize::from(!is_learned);
        let (map_source, name) = SOURCES[place];
        let expected = held[place];
        // Without a place to go to no map is asked for.
        let is_idle = decision.tolerance_m == 0.0 && decision.risk == Source::default();
        if is_idle {
            return Ok(());
        }
        let map_source = if expected.is_some() { map_source } else { 0 };
        if key_of(decision.risk) == expected && decision.map_source == map_source {
            return Ok(());
        }
        let (expected, found) = (told(expected), told(key_of(decision.risk)));
        Err(format!(
            "expected to be made on {name} risk map {expected}, found {found} of source {}",
            decision.map_source
        ))
    }

    /// The first of the messages later than the one it had that it must have had.
    fn overdue<'b>(
        &self,
        mut later: impl Iterator<Item = (&'b Key, &'b Stamp)>,
        decided_at_ns: u64,
    ) -> Option<Key> {
        let was_there = |stamp: &Stamp| {
            let sent_at_ns = stamp.published_at_ns;
            sent_at_ns >= self.began_ns + ON_THE_WAY_NS && sent_at_ns + ON_THE_WAY_NS < decided_at_ns
        };
        later.find(|(_, stamp)| was_there(stamp)).map(|(key, _)| *key)
    }
}

/// The messages after this one; all of them after none.
fn later_than(held: Option<Key>) -> (Bound<Key>, Bound<Key>) {
    (held.map_or(Bound::Unbounded, Bound::Excluded), Bound::Unbounded)
}

fn key_of(source: Source) -> Option<Key> {
    (source != Source::default()).then(|| Key::from(source))
}

fn told(key: Option<Key>) -> String {
    key.map_or("none".to_owned(), |key| key.sequence.to_string())
}

#[cfg(test)]
mod tests {
    use super::*;
    use bus::message::Stamp;

    const MILLISECOND_NS: u64 = 1_000_000;
    const BEGAN_NS: u64 = 10 * SECOND_NS;
    static NOTHING: Tracks = BTreeMap::new();

    /// A map every 200 ms of each map_source, of a scan 100 ms before; learned ones end after a second.
    fn risks() -> [BTreeMap<Key, RiskHeader>; 2] {
        [5, 25].map(|n| {
            let header = |sequence: u64| {
                let published_at_ns = BEGAN_NS + 200 * MILLISECOND_NS * sequence;
                let valid_at_ns = published_at_ns - 100 * MILLISECOND_NS;
                let stamp = Stamp { epoch_ns: 1, sequence, valid_at_ns, published_at_ns, ..Stamp::default() };
                (Key::from(stamp.source()), RiskHeader { stamp, ..RiskHeader::default() })
            };
            (1..=n).map(header).collect()
        })
    }

    /// What control decides on when it hears of every map at once.
    fn decision(after_ms: u64) -> DecisionRecord {
        let newest = after_ms / 200;
        let source = |sequence: u64| match sequence {
            0 => Source::default(),
            sequence => Source { epoch_ns: 1, sequence },
        };
        let (learned, physics) = (source(newest.min(5)), source(newest));
        // The last learned map is of a scan of 900 ms.
        let is_learned = after_ms <= 900 + 600;
        DecisionRecord {
            decided_at_ns: BEGAN_NS + after_ms * MILLISECOND_NS,
            risk: if is_learned { learned } else { physics },
            map_source: if newest == 0 { 0 } else { 2 - u64::from(is_learned) },
            learned,
            physics,
            tolerance_m: 1.0,
            ..DecisionRecord::default()
        }
    }

    /// What is said of decisions every 100 ms, one of them changed.
    fn verdict(at_ms: u64, change: impl Fn(&mut DecisionRecord)) -> Result<(), String> {
        let risks = risks();
        let mut choice = Choice::new(&risks, &NOTHING, 600 * MILLISECOND_NS, BEGAN_NS);
        (1..30).map(|k| 100 * k).try_for_each(|after_ms| {
            let mut decision = decision(after_ms);
            if after_ms == at_ms {
                change(&mut decision);
            }
            choice.check(&decision)
        })
    }

    #[test]
    fn decisions_by_the_rule_pass() {
        assert_eq!(verdict(0, |_| ()), Ok(()));
    }

    #[test]
    fn decisions_on_another_map_than_that_of_the_rule_are_told() {
        let told = |at_ms, change: &dyn Fn(&mut DecisionRecord)| verdict(at_ms, change).unwrap_err();
        let other = told(800, &|decision| (decision.risk, decision.map_source) = (decision.physics, 2));
        assert_eq!(other, "expected to be made on learned risk map 4, found 4 of source 2");
        let aged = told(1600, &|decision| (decision.risk, decision.map_source) = (decision.learned, 1));
        assert_eq!(aged, "expected to be made on physics' risk map 8, found 5 of source 1");
        let none = told(800, &|decision| (decision.risk, decision.map_source) = (Source::default(), 0));
        assert_eq!(none, "expected to be made on learned risk map 4, found none of source 0");
    }

    #[test]
    fn decisions_that_pretend_to_have_had_older_maps_are_told() {
        let older = |decision: &mut DecisionRecord| {
            decision.physics.sequence -= 1;
            decision.risk = decision.physics;
        };
        let told = verdict(2500, older).unwrap_err();
        assert_eq!(told, "expected physics' risk map 12 or a later one, which it had, found 11");
        let long_ago = |decision: &mut DecisionRecord| decision.physics = Source::default();
        assert!(verdict(1000, long_ago).is_err());
        // From the first decision on: nothing went back, and yet there was a later one.
        let risks = risks();
        let mut choice = Choice::new(&risks, &NOTHING, 600 * MILLISECOND_NS, BEGAN_NS);
        let mut first = decision(2500);
        first.physics.sequence = 9;
        first.risk = first.physics;
        assert_eq!(
            choice.check(&first).unwrap_err(),
            "expected physics' risk map 10, which was there, found 9"
        );
    }

    #[test]
    fn maps_that_may_still_be_on_their_way_are_not_asked_for() {
        let late = |decision: &mut DecisionRecord| {
            decision.physics.sequence -= 2;
            decision.risk = decision.physics;
        };
        let risks = risks();
        let mut choice = Choice::new(&risks, &NOTHING, 600 * MILLISECOND_NS, BEGAN_NS);
        // Map 11 was sent at 2200 ms.
        for (after_ms, is_right) in [(2400, true), (2500, false)] {
            let mut decision = decision(after_ms);
            late(&mut decision);
            assert_eq!(choice.check(&decision).is_ok(), is_right, "{after_ms} ms");
        }
    }

    /// Tracks every 200 ms, as many as maps of physics.
    #[test]
    fn decisions_that_pretend_to_have_known_less_of_what_moves_are_told() {
        let header = |sequence: u64| {
            let published_at_ns = BEGAN_NS + 200 * MILLISECOND_NS * sequence;
            let stamp = Stamp { epoch_ns: 1, sequence, published_at_ns, ..Stamp::default() };
            (Key::from(stamp.source()), (TracksHeader { stamp, ..TracksHeader::default() }, Vec::new()))
        };
        let (risks, tracks): (_, Tracks) = (risks(), (1..=25).map(header).collect());
        let verdict = |at_ms: u64, less: u64| {
            let mut choice = Choice::new(&risks, &tracks, 600 * MILLISECOND_NS, BEGAN_NS);
            (1..30).map(|k| 100 * k).try_for_each(|after_ms| {
                let mut decision = decision(after_ms);
                let sequence = (after_ms / 200).saturating_sub(if after_ms == at_ms { less } else { 0 });
                decision.tracks =
                    if sequence == 0 { Source::default() } else { Source { epoch_ns: 1, sequence } };
                choice.check(&decision)
            })
        };
        assert_eq!(verdict(0, 0), Ok(()));
        assert_eq!(verdict(2500, 1).unwrap_err(), "expected tracks 12 or later ones, which it had, found 11");
        let mut choice = Choice::new(&risks, &tracks, 600 * MILLISECOND_NS, BEGAN_NS);
        let first = DecisionRecord { tracks: Source { epoch_ns: 1, sequence: 9 }, ..decision(2500) };
        assert_eq!(choice.check(&first).unwrap_err(), "expected tracks 10, which were there, found 9");
    }
}
