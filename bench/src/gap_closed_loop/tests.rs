//! A small version of the table.
#![allow(clippy::unwrap_used, reason = "a panic is how a test fails")]

use std::sync::atomic::{AtomicUsize, Ordering};

use super::*;

fn request() -> Request {
    Request {
        vehicle: VEHICLES[0],
        grounds: Ground::ALL.to_vec(),
        gaps: vec![Gap::None, Gap::SteerLag],
        n_seeds: 2,
        n_threads: 2,
        isa: Isa::Portable,
    }
}

#[test]
fn every_cell_has_its_seeds_and_no_gap_has_no_truth() {
    // On the course three beliefs without a gap and four with one, among the rocks one less, two seeds.
    assert_eq!(request().n_drives(), (3 + 4 + 2 + 3) * 2);
    let nothing = Request { n_seeds: 0, ..request() };
    assert!(matches!(measure(&nothing, |_| ()), Err(ClosedLoopError::NoDrives)));
}

/// A slow servo is found in recorded drives, and the model that knows of it follows the course better.
#[test]
fn slow_servo_is_found_and_driven_with() {
    let request =
        Request { grounds: vec![Ground::Course], gaps: vec![Gap::SteerLag], n_seeds: 1, ..request() };
    let n_told = AtomicUsize::new(0);
    let report = measure(&request, |_| {
        n_told.fetch_add(1, Ordering::Relaxed);
    })
    .unwrap();
    assert_eq!(n_told.into_inner(), 1 + 4, "a diagnosis and four drives");
    let [found] = &report.diagnoses[..] else { panic!("{:?}", report.diagnoses) };
    assert!(found.found.iter().any(|effect| effect.description().id == "steer_lag"), "{found:?}");
    let beliefs: Vec<Belief> = report.rows.iter().map(|row| row.belief).collect();
    assert_eq!(beliefs, Belief::ALL);
    let across_m = |index: usize| report.rows[index].across_rms_m.unwrap().value;
    assert!(across_m(2) < 0.7 * across_m(1), "repaired {} m, nominal {} m", across_m(2), across_m(1));
    assert_eq!(report.rows[2].n_goal, 1);
    let less_m = report.rows[2].less_nominal.across_rms_m.unwrap().value;
    assert!((less_m - (across_m(2) - across_m(1))).abs() < 1e-12);
}
