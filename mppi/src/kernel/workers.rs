//! Threads that live as long as the controller and share its work chunk by chunk.
//!
//! Every thread has its own share of the chunks, round after round, so that their memory stays in its core's cache.
//! Who has done its share takes over what another thread leaves lying, so a thread that the system has put aside
//! delays nobody but the chunk it holds. Which thread computes a chunk never changes the chunk's result. Idle threads
//! watch for work for a moment and then sleep: at ten cycles a second they cost nothing between the cycles.

use super::primitives::{
    AtomicBool, AtomicPtr, AtomicU32, Builder, JoinHandle, Ordering, PATIENT_LOOKS, WATCHFUL_LOOKS, park,
    spin_loop, yield_now,
};
use std::ops::Range;
use std::sync::Arc;

/// A job made nameless: how to run one chunk of what `data` points to.
type RunChunk = unsafe fn(data: *const (), chunk: usize);

struct Shared {
    /// Number of the round whose job is published; rounds count from 1.
    round: AtomicU32,
    /// The job's data; valid while chunks of the round are unfinished.
    data: AtomicPtr<()>,
    /// The job's [`RunChunk`].
    run: AtomicPtr<()>,
    slots: Box<[Slot]>,
    /// A chunk panicked on a worker thread.
    panicked: AtomicBool,
    /// No more rounds will come.
    over: AtomicBool,
    /// Threads that have started.
    started: AtomicU32,
}

/// How far a chunk is; a cache line of its own, because another core writes the next one.
#[derive(Default)]
#[repr(align(64))]
struct Slot {
    /// The last round in which it was claimed.
    claimed: AtomicU32,
    /// The last round in which it was finished.
    finished: AtomicU32,
}

impl Slot {
    fn is_unclaimed(&self, round: u32) -> bool {
        self.claimed.load(Ordering::Relaxed) == round.wrapping_sub(1)
    }

    fn claim(&self, round: u32) -> bool {
        let before = round.wrapping_sub(1);
        self.is_unclaimed(round)
            && self.claimed.compare_exchange(before, round, Ordering::AcqRel, Ordering::Relaxed).is_ok()
    }

    /// Watches until somebody claims it; false when nobody does.
    fn is_claimed_soon(&self, round: u32) -> bool {
        (0..PATIENT_LOOKS).any(|_| {
            spin_loop();
            !self.is_unclaimed(round)
        })
    }
}

/// Threads beside the calling one.
pub(crate) struct Workers {
    shared: Arc<Shared>,
    threads: Vec<JoinHandle<()>>,
}

/// Marks a chunk as finished even when it panics.
struct Finish<'a>(&'a Shared, &'a Slot, u32);

impl Drop for Finish<'_> {
    fn drop(&mut self) {
        let Self(shared, slot, round) = *self;
        if std::thread::panicking() {
            shared.panicked.store(true, Ordering::Relaxed);
        }
        slot.finished.store(round, Ordering::Release);
    }
}

/// Keeps a round's job alive until nobody uses it, also when the caller's own chunk panics.
struct Round<'a>(&'a Shared, u32);

impl Drop for Round<'_> {
    fn drop(&mut self) {
        let Self(shared, round) = *self;
        for slot in &shared.slots {
            if slot.claim(round) {
                slot.finished.store(round, Ordering::Release);
            }
        }
        for slot in &shared.slots {
            while slot.finished.load(Ordering::Acquire) != round {
                spin_loop();
            }
        }
    }
}

impl Shared {
    /// Works on a round: the thread's own share first, then what others leave lying.
    fn help(&self, round: u32, share: Range<usize>) {
        let (data, run) = (self.data.load(Ordering::Acquire), self.run.load(Ordering::Acquire));
        share.clone().for_each(|chunk| self.work(round, chunk, (data, run)));
        let mut is_patient = true;
        for chunk in (0..share.start).rev().chain((share.end..self.slots.len()).rev()) {
            // The others go upwards through their shares: a claimed last chunk is a good sign.
            is_patient = is_patient && self.slots[chunk].is_claimed_soon(round);
            self.work(round, chunk, (data, run));
        }
    }

    /// Runs a chunk that nobody has claimed.
    fn work(&self, round: u32, chunk: usize, (data, run): (*mut (), *mut ())) {
        let slot = &self.slots[chunk];
        if slot.claim(round) {
            let _finish = Finish(self, slot, round);
            // SAFETY: a claim of this round can only succeed while the round is open, because `Workers::run` begins
            // no other round before all chunks of this one are finished, and this one is not yet. So `data` and
            // `run` were read whole after being published with this round, `run` is the function that
            // `Workers::run` stored for the type of `data`, and `data` outlives the round.
            unsafe {
                let run = std::mem::transmute::<*mut (), RunChunk>(run);
                run(data, chunk);
            }
        }
    }

    fn serve(&self, share: Range<usize>) {
        self.started.fetch_add(1, Ordering::Release);
        let mut seen = 0;
        loop {
            let mut looks = 0;
            while self.round.load(Ordering::Acquire) == seen {
                if self.over.load(Ordering::Acquire) {
                    return;
                }
                looks += 1;
                if looks < WATCHFUL_LOOKS {
                    spin_loop();
                } else {
                    park();
                }
            }
            seen = self.round.load(Ordering::Acquire);
            self.help(seen, share.clone());
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
            slots: (0..n_chunks).map(|_| Slot::default()).collect(),
            panicked: AtomicBool::new(false),
            over: AtomicBool::new(false),
            started: AtomicU32::new(0),
        });
        let n_threads = n_threads.min(n_chunks);
        let mut workers = Self { shared, threads: Vec::new() };
        for index in 1..n_threads {
            let shared = Arc::clone(&workers.shared);
            let share = index * n_chunks / n_threads..(index + 1) * n_chunks / n_threads;
            let builder = Builder::new().name(format!("mppi-{index}"));
            workers.threads.push(builder.spawn(move || shared.serve(share))?);
        }
        // A thread allocates while it starts; afterwards nothing does.
        while (workers.shared.started.load(Ordering::Acquire) as usize) < workers.threads.len() {
            yield_now();
        }
        Ok(workers)
    }

    /// Runs the job on every item, each on one thread; the caller works too. Allocates nothing.
    pub(crate) fn run<T: Send, J: Fn(usize, &mut T) + Sync>(&mut self, items: &mut [T], job: J) {
        assert_eq!(items.len(), self.shared.slots.len(), "one item for every chunk");
        if self.threads.is_empty() {
            items.iter_mut().enumerate().for_each(|(index, item)| job(index, item));
            return;
        }
        let bound = Bound { items: items.as_mut_ptr(), job: &job };
        let shared = &*self.shared;
        let round = shared.round.load(Ordering::Relaxed).wrapping_add(1);
        shared.data.store((&raw const bound).cast_mut().cast(), Ordering::Release);
        shared.run.store(run_bound::<T, J> as RunChunk as *mut (), Ordering::Release);
        {
            let open = Round(shared, round);
            shared.round.store(round, Ordering::Release);
            self.threads.iter().for_each(|thread| thread.thread().unpark());
            shared.help(round, 0..items.len() / (self.threads.len() + 1));
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_item_is_worked_on_once_a_round_for_any_number_of_threads() {
        for n_threads in [1, 2, 3, 7, 16, 40] {
            let mut workers = Workers::new(n_threads, 16).unwrap();
            let mut items = vec![0usize; 16];
            for round in 1..=200 {
                workers.run(&mut items, |index, item| *item += index + 1);
                assert!(items.iter().enumerate().all(|(index, &item)| item == round * (index + 1)));
            }
        }
    }

    #[test]
    fn sleeping_threads_wake_up_for_work() {
        let mut workers = Workers::new(4, 8).unwrap();
        for _ in 0..3 {
            // Long enough for idle threads to give up spinning.
            (0..5_000_000).for_each(|_| std::hint::spin_loop());
            let mut items = [0u64; 8];
            workers.run(&mut items, |_, item| *item = 1);
            assert_eq!(items, [1; 8]);
        }
    }

    #[test]
    fn a_panic_reaches_the_caller_after_all_work_is_over() {
        for bad in [0, 7] {
            let run = std::panic::catch_unwind(|| {
                let mut workers = Workers::new(3, 8).unwrap();
                workers.run(&mut [0u8; 8], |index, _| assert_ne!(index, bad, "on purpose"));
            });
            assert!(run.is_err());
        }
    }
}
