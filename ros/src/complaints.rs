//! What is wrong with what comes, said once and then seldom, however often it comes.

use std::collections::BTreeMap;
use std::fmt::Display;

/// Time after which the same is said again [ns].
const AGAIN_NS: u64 = 10_000_000_000;
/// Kinds that are told apart at the most.
const KINDS_MAX: usize = 256;

/// Counts what was refused, by topic and by what was expected.
#[derive(Clone, Debug, Default)]
pub struct Complaints {
    kinds: BTreeMap<(String, String), Kind>,
    n: u64,
}

#[derive(Clone, Debug)]
struct Kind {
    said_at_ns: u64,
    n: u64,
    n_said: u64,
}

impl Complaints {
    /// Counts a refusal, and returns the line to be said, if one is.
    pub fn note(&mut self, topic: &str, why: &dyn Display, now_ns: u64) -> Option<String> {
        self.n += 1;
        let text = why.to_string();
        // What was found may differ from message to message; what was expected is what is wrong.
        let expected = text.split(", found").next().unwrap_or_default().to_owned();
        let key = (topic.to_owned(), expected);
        if self.kinds.len() >= KINDS_MAX && !self.kinds.contains_key(&key) {
            return None;
        }
        let kind = self.kinds.entry(key).or_insert(Kind { said_at_ns: 0, n: 0, n_said: 0 });
        kind.n += 1;
        let is_due = kind.n_said == 0 || now_ns.saturating_sub(kind.said_at_ns) >= AGAIN_NS;
        if !is_due {
            return None;
        }
        kind.said_at_ns = now_ns;
        kind.n_said += 1;
        let n = kind.n;
        Some(if n == 1 { format!("{topic}: {text}") } else { format!("{topic}: {text} ({n} times so far)") })
    }

    /// Messages refused so far.
    pub fn n(&self) -> u64 {
        self.n
    }

    /// What was refused within the last seconds, newest kinds included, as lines without numbers of their own.
    pub fn recent(&self, now_ns: u64) -> impl Iterator<Item = String> + '_ {
        let is_recent = move |kind: &Kind| now_ns.saturating_sub(kind.said_at_ns) < AGAIN_NS;
        self.kinds
            .iter()
            .filter(move |(_, kind)| is_recent(kind))
            .map(|((topic, text), _)| format!("{topic}: {text}"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_same_fault_is_said_once_in_ten_seconds_whatever_its_numbers() {
        let mut complaints = Complaints::default();
        let mut note = |found: u32, at_s: u64| {
            complaints.note("points", &format!("data: expected 9 bytes, found {found}"), at_s * 1_000_000_000)
        };
        assert_eq!(note(3, 1).unwrap(), "points: data: expected 9 bytes, found 3");
        assert_eq!((note(4, 2), note(5, 10)), (None, None));
        assert_eq!(note(6, 11).unwrap(), "points: data: expected 9 bytes, found 6 (4 times so far)");
        assert!(complaints.note("points", &"fields: expected x, found y", 11).is_some(), "another fault");
        assert!(complaints.note("odom", &"data: expected 9 bytes, found 6", 11).is_some(), "another topic");
        assert_eq!(complaints.n(), 6);
        assert_eq!(complaints.recent(12_000_000_000).count(), 1);
    }

    #[test]
    fn a_flood_of_faults_of_all_kinds_is_bounded() {
        let mut complaints = Complaints::default();
        for k in 0..10 * KINDS_MAX {
            complaints.note("points", &format!("frame {k}: expected"), 0);
        }
        assert_eq!(complaints.kinds.len(), KINDS_MAX);
    }
}
