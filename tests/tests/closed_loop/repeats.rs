//! The same drive is the same drive, bit for bit, however many threads share the work.

use scenarios::Outcome;

use crate::course::Course;

fn bits_with(n_controller_threads: usize, n_pool_threads: usize) -> Vec<[u64; 5]> {
    let mut course = Course::rocks(5.0, 2);
    course.config.controller.n_threads = n_controller_threads;
    let pool = rayon::ThreadPoolBuilder::new().num_threads(n_pool_threads).build().unwrap();
    let driven = pool.install(|| course.drive());
    assert_eq!(driven.outcome, Outcome::Goal, "{:?}", driven.stops());
    driven.bits()
}

#[test]
fn drive_does_not_depend_on_the_number_of_threads() {
    let alone = bits_with(1, 1);
    assert!(alone.len() > 30, "a drive of 4 m takes some cycles, found {}", alone.len());
    for (n_controller_threads, n_pool_threads) in [(1, 1), (1, 3), (2, 3), (3, 1)] {
        let shared = bits_with(n_controller_threads, n_pool_threads);
        let differs = alone.iter().zip(&shared).position(|(a, b)| a != b);
        assert_eq!(
            (differs, alone.len()),
            (None, shared.len()),
            "{n_controller_threads} controller threads, {n_pool_threads} others"
        );
    }
}

#[test]
fn another_seed_is_another_drive() {
    let drive = |seed| Course { seed, ..Course::flat(3.0) }.drive().bits();
    assert_ne!(drive(1), drive(2));
}
