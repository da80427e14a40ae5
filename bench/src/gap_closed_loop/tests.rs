//! A small version of the table.
#![allow(clippy::unwrap_used, reason = "a panic is how a test fails")]

use super::*;

#[test]
fn every_cell_has_its_seeds_and_no_gap_has_no_truth() {
    let request = Request {
        grounds: Ground::ALL.to_vec(),
        gaps: vec![Gap::None, Gap::SteerLag],
        n_seeds: 2,
        n_threads: 1,
        isa: Isa::Portable,
    };
    // On the course three beliefs without a gap and four with one, among the rocks one less, two seeds.
    assert_eq!(request.n_drives(), (3 + 4 + 2 + 3) * 2);
    let nothing = Request { n_seeds: 0, ..request };
    assert!(matches!(measure(&nothing, |_| ()), Err(ClosedLoopError::NoDrives)));
}
