//! Which of two risk maps is driven on: the rule of control, by which replay judges it.

/// Whether the learned map is the one to drive on: while its scan is at most `learned_max_ns` old, and after that unless
/// physics' map knows of a younger one. Times of the scans that the maps end with [ns]; `None` without a map.
pub(crate) fn is_learned(
    learned_at_ns: Option<u64>,
    physics_at_ns: Option<u64>,
    now_ns: u64,
    learned_max_ns: u64,
) -> bool {
    let age_ns = |at_ns: Option<u64>| at_ns.map_or(u64::MAX, |at_ns| now_ns.saturating_sub(at_ns));
    let learned_ns = age_ns(learned_at_ns);
    learned_ns <= learned_max_ns || learned_ns <= age_ns(physics_at_ns)
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
}
