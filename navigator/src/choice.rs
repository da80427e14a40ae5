//! Which of two risk maps is driven on, and when the second one is made.

/// Whether the learned map is the one to drive on: while its scan is at most `learned_max_ns` old, and after that unless
/// physics' map knows of a younger one. Times of the scans that the maps end with [ns]; `None` without a map.
pub fn is_learned(
    learned_at_ns: Option<u64>,
    physics_at_ns: Option<u64>,
    now_ns: u64,
    learned_max_ns: u64,
) -> bool {
    let age_ns = |at_ns: Option<u64>| at_ns.map_or(u64::MAX, |at_ns| now_ns.saturating_sub(at_ns));
    let learned_ns = age_ns(learned_at_ns);
    learned_ns <= learned_max_ns || learned_ns <= age_ns(physics_at_ns)
}

/// When physics stands in for whoever judges the ground as the method says.
#[derive(Clone, Copy, Debug)]
pub struct StandIn {
    silence_max_ns: u64,
    heard_at_ns: u64,
}

impl StandIn {
    /// From `began_ns` on nobody has been heard; physics stands in after `silence_max_ns` without a map.
    pub fn new(began_ns: u64, silence_max_ns: u64) -> Self {
        Self { silence_max_ns, heard_at_ns: began_ns }
    }

    /// A map of the other was heard.
    pub fn note_heard(&mut self, at_ns: u64) {
        self.heard_at_ns = at_ns;
    }

    /// Whether physics' map is wanted now.
    pub fn is_needed(&self, now_ns: u64) -> bool {
        now_ns.saturating_sub(self.heard_at_ns) > self.silence_max_ns
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn learned_maps_are_preferred_while_they_are_fresh_and_then_the_younger_one() {
        let learned = |learned_at_ns, physics_at_ns| is_learned(learned_at_ns, physics_at_ns, 1000, 600);
        assert!(learned(Some(400), Some(900)), "fresh");
        assert!(!learned(Some(399), Some(900)), "too old, and physics knows more");
        assert!(
            learned(Some(399), Some(399)) && learned(Some(399), None),
            "too old, and physics knows no more"
        );
        assert!(!learned(None, Some(1)));
        assert!(learned(Some(2000), Some(1000)), "a clock that is ahead is no age");
    }

    #[test]
    fn physics_stands_in_after_the_silence_and_until_a_map_is_heard() {
        let mut stand_in = StandIn::new(100, 400);
        assert!(!stand_in.is_needed(500) && stand_in.is_needed(501));
        stand_in.note_heard(501);
        assert!(!stand_in.is_needed(901) && stand_in.is_needed(902));
    }
}
