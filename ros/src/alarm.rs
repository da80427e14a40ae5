//! Whether anybody says that there is an emergency.

/// Publishers that are told apart.
const PUBLISHERS_MAX: usize = 64;

/// What a word changes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Turn {
    /// There is an emergency now.
    On,
    /// There is none any more.
    Off,
}

/// Emergencies by what publishers of the type `P` say. Anybody may say that there is one. That it is over counts from one
/// who has just come or who has said the opposite: who only goes on saying that all is well ends nobody else's emergency.
#[derive(Clone, Debug)]
pub(crate) struct Alarm<P> {
    is_on: bool,
    last: Vec<Word<P>>,
}

/// What a publisher said last.
#[derive(Clone, Copy, Debug)]
struct Word<P> {
    publisher: P,
    sequence: i64,
    is_emergency: bool,
}

impl<P> Default for Alarm<P> {
    fn default() -> Self {
        Self { is_on: false, last: Vec::new() }
    }
}

impl<P: Copy + PartialEq> Alarm<P> {
    /// Takes in a publisher's word, and returns what it changes. What comes by several ways counts once, and what comes
    /// after later words of its publisher no more.
    pub(crate) fn hear(&mut self, publisher: P, sequence: i64, is_emergency: bool) -> Option<Turn> {
        let word = Word { publisher, sequence, is_emergency };
        let before = self.last.iter().position(|last| last.publisher == publisher);
        let before = before.map(|place| self.last.swap_remove(place));
        if let Some(before) = before.filter(|before| before.sequence >= sequence) {
            self.last.push(before);
            return None;
        }
        if self.last.len() == PUBLISHERS_MAX {
            self.last.remove(0);
        }
        self.last.push(word);
        let is_repeated = before.is_some_and(|before| before.is_emergency == is_emergency);
        match (self.is_on, is_emergency) {
            (false, true) => self.turn(Turn::On),
            (true, false) if !is_repeated => self.turn(Turn::Off),
            _ => None,
        }
    }

    fn turn(&mut self, turn: Turn) -> Option<Turn> {
        self.is_on = turn == Turn::On;
        Some(turn)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_word_counts_once_and_in_its_order() {
        let mut alarm = Alarm::default();
        assert_eq!(alarm.hear('a', 1, false), None, "there was none");
        assert_eq!(alarm.hear('a', 2, true), Some(Turn::On));
        assert_eq!(alarm.hear('a', 2, true), None, "by the other way");
        assert_eq!(alarm.hear('a', 3, false), Some(Turn::Off));
        assert_eq!(alarm.hear('a', 2, true), None, "by the other way, late");
        assert_eq!(alarm.hear('a', 3, false), None);
        assert_eq!(alarm.hear('a', 4, true), Some(Turn::On));
    }

    #[test]
    fn who_always_says_that_all_is_well_ends_nobodys_emergency() {
        let mut alarm = Alarm::default();
        assert_eq!(alarm.hear('b', 1, false), None);
        assert_eq!(alarm.hear('a', 1, true), Some(Turn::On));
        assert_eq!((alarm.hear('b', 2, false), alarm.hear('b', 3, false)), (None, None));
        assert_eq!(alarm.hear('c', 1, false), Some(Turn::Off), "somebody who has come to say so");
        assert_eq!(alarm.hear('a', 2, true), Some(Turn::On), "and it is said again");
    }

    #[test]
    fn a_flood_of_publishers_is_bounded() {
        let mut alarm = Alarm::default();
        assert_eq!(alarm.hear(0, 1, true), Some(Turn::On));
        let turns = (1..1000).filter_map(|publisher| alarm.hear(publisher, 1, true));
        assert_eq!(turns.count(), 0);
        assert_eq!(alarm.last.len(), PUBLISHERS_MAX);
    }
}
