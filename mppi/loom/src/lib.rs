//! The controller's worker threads, word for word, over the primitives of the model checker loom in place of the standard
//! library's. Run with `cargo test --manifest-path mppi/loom/Cargo.toml`.

mod primitives {
    pub(super) use loom::hint::spin_loop;
    pub(super) use loom::sync::atomic::{AtomicBool, AtomicPtr, AtomicU32, Ordering};
    pub(super) use loom::thread::{Builder, JoinHandle, park, yield_now};

    /// Every look more is another place where a thread may be put aside, and finds nothing that one does not.
    pub(super) const WATCHFUL_LOOKS: u32 = 1;
    pub(super) const PATIENT_LOOKS: u32 = 1;
}

#[path = "../../src/kernel/workers.rs"]
mod workers;

use loom::cell::Cell;
use workers::Workers;

/// Lets `n_threads` threads work on `n_chunks` chunks for `n_rounds` rounds, whose jobs differ. Every chunk is a cell that
/// the model checker watches: two threads that touch one without an order between them fail the run, and so does a chunk
/// that was worked on never or twice in a round, by the job of another round, or that the caller finds unfinished.
pub fn rounds(n_threads: usize, n_chunks: usize, n_rounds: usize) {
    let mut workers = Workers::new(n_threads, n_chunks).expect("the model checker refuses no thread");
    let mut chunks: Vec<Cell<usize>> = (0..n_chunks).map(|_| Cell::new(0)).collect();
    let mut expected = 0;
    for round in 0..n_rounds {
        if round % 2 == 0 {
            workers.run(&mut chunks, |_, chunk| chunk.set(chunk.get() + 1));
            expected += 1;
        } else {
            workers.run(&mut chunks, |_, chunk| chunk.set(chunk.get() + 10));
            expected += 10;
        }
        assert!(chunks.iter().all(|chunk| chunk.get() == expected), "every chunk once a round");
    }
}
