//! Every order in which the threads may see each other's writes, as far as the bound on preemptions goes.

use loom::model::Builder;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Runs the model under every interleaving with at most so many preemptions, and says how many there were.
fn check(what: &str, n_preemptions: Option<usize>, model: impl Fn() + Sync + Send + 'static) -> usize {
    static N_RUNS: AtomicUsize = AtomicUsize::new(0);
    let before = N_RUNS.load(Ordering::Relaxed);
    let mut builder = Builder::new();
    builder.preemption_bound = n_preemptions;
    builder.check(move || {
        N_RUNS.fetch_add(1, Ordering::Relaxed);
        model();
    });
    let n_runs = N_RUNS.load(Ordering::Relaxed) - before;
    println!("{what}: {n_runs} interleavings");
    n_runs
}

/// One test, because the count of runs is one for all.
#[test]
fn every_chunk_is_worked_on_once_a_round_under_every_interleaving() {
    assert!(check("2 threads, 2 chunks, 1 round", None, || mppi_loom::rounds(2, 2, 1)) > 1000);
    assert!(check("2 threads, 2 chunks, 2 rounds", Some(3), || mppi_loom::rounds(2, 2, 2)) > 1000);
    assert!(check("3 threads, 3 chunks, 1 round", Some(1), || mppi_loom::rounds(3, 3, 1)) > 1000);
}
