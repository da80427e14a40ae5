//! Threads that live as long as the controller and share its work chunk by chunk.
//!
//! Whoever is free claims the next unclaimed chunk, so a thread that the system has put aside delays nobody but the
//! chunk it holds. Which thread computes a chunk never changes the chunk's result. Idle threads watch for work for a
//! moment and then sleep: at ten cycles a second they cost nothing between the cycles.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicPtr, AtomicU32, AtomicUsize, Ordering};
use std::thread::JoinHandle;

/// Looks at the work flag before a thread goes to sleep: some ten microseconds.
const WATCHFUL_LOOKS: u32 = 4000;

/// A job made nameless: how to run one chunk of what `data` points to.
type RunChunk = unsafe fn(data: *const (), chunk: usize);

struct Shared {
    /// Number of the round whose job is published; rounds count from 1.
    round: AtomicU32,
    /// The job's data; valid while chunks of the round are unfinished.
    data: AtomicPtr<()>,
    /// The job's [`RunChunk`].
    run: AtomicPtr<()>,
    /// For every chunk the last round that was claimed.
    claims: Box<[AtomicU32]>,
    /// Chunks of the round that are finished.
    finished: AtomicUsize,
    /// A chunk panicked on a worker thread.
    panicked: AtomicBool,
    /// No more rounds will come.
    over: AtomicBool,
}

/// Threads beside the calling one.
pub(crate) struct Workers {
    shared: Arc<Shared>,
    threads: Vec<JoinHandle<()>>,
}

/// Counts a chunk as finished even when it panics.
struct Finish<'a>(&'a Shared);

impl Drop for Finish<'_> {
    fn drop(&mut self) {
        if std::thread::panicking() {
            self.0.panicked.store(true, Ordering::Relaxed);
        }
        self.0.finished.fetch_add(1, Ordering::Release);
    }
}

/// Keeps a round's job alive until nobody uses it, also when the caller's own chunk panics.
struct Round<'a>(&'a Shared, u32);

impl Drop for Round<'_> {
    fn drop(&mut self) {
        let Self(shared, round) = *self;
        for claim in &shared.claims {
            if claim_chunk(claim, round) {
                shared.finished.fetch_add(1, Ordering::Release);
            }
        }
        while shared.finished.load(Ordering::Acquire) < shared.claims.len() {
            std::hint::spin_loop();
        }
    }
}

fn claim_chunk(claim: &AtomicU32, round: u32) -> bool {
    let before = round.wrapping_sub(1);
    claim.load(Ordering::Relaxed) == before
        && claim.compare_exchange(before, round, Ordering::AcqRel, Ordering::Relaxed).is_ok()
}

impl Shared {
    /// Works on what is left of a round, starting with this thread's own share.
    fn help(&self, round: u32, first: usize) {
        let (data, run) = (self.data.load(Ordering::Acquire), self.run.load(Ordering::Acquire));
        let n = self.claims.len();
        for chunk in (first..n).chain(0..first) {
            if claim_chunk(&self.claims[chunk], round) {
                let _finish = Finish(self);
                // SAFETY: a claim of this round can only succeed while the round is open, because `Workers::run`
                // begins no other round before all chunks of this one are finished, and this one is not yet. So
                // `data` and `run` were read whole after being published with this round, `run` is the function
                // that `Workers::run` stored for the type of `data`, and `data` outlives the round.
                unsafe {
                    let run = std::mem::transmute::<*mut (), RunChunk>(run);
                    run(data, chunk);
                }
            }
        }
    }

    fn serve(&self, first: usize) {
        let mut seen = 0;
        loop {
            let mut looks = 0;
            while self.round.load(Ordering::Acquire) == seen {
                if self.over.load(Ordering::Acquire) {
                    return;
                }
                looks += 1;
                if looks < WATCHFUL_LOOKS {
                    std::hint::spin_loop();
                } else {
                    std::thread::park();
                }
            }
            seen = self.round.load(Ordering::Acquire);
            self.help(seen, first);
        }
    }
}

impl Workers {
    /// `n_threads` threads, the caller's among them, for jobs of `n_chunks` chunks.
    pub(crate) fn new(n_threads: usize, n_chunks: usize) -> std::io::Result<Self> {
        let shared = Arc::new(Shared {
            round: AtomicU32::new(0),
            data: AtomicPtr::default(),
            run: AtomicPtr::default(),
            claims: (0..n_chunks).map(|_| AtomicU32::new(0)).collect(),
            finished: AtomicUsize::new(0),
            panicked: AtomicBool::new(false),
            over: AtomicBool::new(false),
        });
        let mut workers = Self { shared, threads: Vec::new() };
        for index in 1..n_threads.min(n_chunks) {
            let shared = Arc::clone(&workers.shared);
            let first = index * n_chunks / n_threads.min(n_chunks);
            let builder = std::thread::Builder::new().name(format!("mppi-{index}"));
            workers.threads.push(builder.spawn(move || shared.serve(first))?);
        }
        Ok(workers)
    }

    /// Runs the job on every item, each on one thread; the caller works too. Allocates nothing.
    pub(crate) fn run<T: Send, J: Fn(usize, &mut T) + Sync>(&mut self, items: &mut [T], job: J) {
        assert_eq!(items.len(), self.shared.claims.len(), "one item for every chunk");
        if self.threads.is_empty() {
            items.iter_mut().enumerate().for_each(|(index, item)| job(index, item));
            return;
        }
        let bound = Bound { items: items.as_mut_ptr(), job: &job };
        let shared = &*self.shared;
        let round = shared.round.load(Ordering::Relaxed).wrapping_add(1);
        shared.data.store((&raw const bound).cast_mut().cast(), Ordering::Release);
        shared.run.store(run_bound::<T, J> as RunChunk as *mut (), Ordering::Release);
        shared.finished.store(0, Ordering::Relaxed);
        {
            let open = Round(shared, round);
            shared.round.store(round, Ordering::Release);
            self.threads.iter().for_each(|thread| thread.thread().unpark());
            shared.help(round, 0);
            drop(open);
        }
        assert!(!shared.panicked.load(Ordering::Relaxed), "a worker thread panicked");
    }
}

/// A job and its items.
struct Bound<'a, T, J> {
    items: *mut T,
    job: &'a J,
}

/// # Safety
/// `data` points to a `Bound<T, J>` whose items live and are touched by nobody else, and `chunk` is an index of them
/// that no other thread is given.
unsafe fn run_bound<T: Send, J: Fn(usize, &mut T) + Sync>(data: *const (), chunk: usize) {
    // SAFETY: the caller vouches for `data` and for the sole use of this item; T is Send and J is Sync, so both may
    // be used from this thread.
    unsafe {
        let bound = &*data.cast::<Bound<'_, T, J>>();
        (bound.job)(chunk, &mut *bound.items.add(chunk));
    }
}

impl Drop for Workers {
    fn drop(&mut self) {
        self.shared.over.store(true, Ordering::Release);
        for thread in self.threads.drain(..) {
            thread.thread().unpark();
            // A worker that panicked has been reported by `run`.
            drop(thread.join());
        }
    }
}
