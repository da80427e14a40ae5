//! Inputs that a long run found a fault with, brought down to what was wrong with them.

use crate::harness::try_on;
use crate::{TARGETS, runs};

/// Every part of a dotted key is a table of its own; once, two documents of them were held.
#[test]
fn a_document_is_held_once_while_it_is_read() {
    let text = [1, 2, 3].map(|key| format!("a{key}{} = 1\n", ".1".repeat(70))).concat();
    let once = allocation_counter::measure(|| drop(toml::de::DeTable::parse(&text))).bytes_max;
    let held = try_on(TARGETS, "gap_case", text.as_bytes()).unwrap();
    assert!(held < once + once / 2, "{held} bytes, of which {once} would do");
}

/// Its window has more cells than there are numbers to count them.
#[test]
fn a_body_beyond_all_measure_is_refused() {
    let input = runs::with_body_length("9223372036854775807");
    try_on(TARGETS, "pipeline", &input).unwrap();
}
