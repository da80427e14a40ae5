//! Many like jobs on a few threads, and the bar that counts them.

use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Duration;

use indicatif::ProgressBar;

use crate::{WorkFailed, progress};

/// Counts on standard error; draws nothing where that is not a terminal.
pub(super) struct Bar(ProgressBar);

impl Bar {
    pub(super) fn new(n: usize, what: &str) -> Self {
        let bar = progress::bar(n as u64, &format!("{{pos}}/{{len}} {what}, {{eta}} left   {{msg}}"));
        bar.enable_steady_tick(Duration::from_millis(200));
        Self(bar)
    }

    /// One more is done.
    pub(super) fn step(&self, message: &str) {
        self.0.set_message(message.to_owned());
        self.0.inc(1);
    }

    /// Takes the bar away.
    pub(super) fn finish(self) {
        self.0.finish_and_clear();
    }
}

/// Does jobs 0 to `n`; every thread takes the next one until none is left or one failed.
///
/// Errors: that of the first job, by number, that failed.
pub(super) fn work<T: Send>(
    n: usize,
    n_threads: usize,
    job: impl Fn(usize) -> anyhow::Result<T> + Sync,
) -> anyhow::Result<Vec<T>> {
    let next = AtomicUsize::new(0);
    let done = Mutex::new(Vec::with_capacity(n));
    let take = || loop {
        let index = next.fetch_add(1, Ordering::Relaxed);
        if index >= n {
            return;
        }
        let result = job(index);
        if result.is_err() {
            next.store(n, Ordering::Relaxed);
        }
        if let Ok(mut done) = done.lock() {
            done.push((index, result));
        }
    };
    std::thread::scope(|scope| {
        for _ in 1..n_threads.min(n) {
            scope.spawn(take);
        }
        take();
    });
    let mut done = done.into_inner().map_err(|_| WorkFailed("a thread has failed".to_owned()))?;
    done.sort_by_key(|(index, _)| *index);
    done.into_iter().map(|(_, result)| result).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn results_stand_in_order_for_any_number_of_threads() {
        for n_threads in [1, 3, 50] {
            let squares = work(20, n_threads, |index| Ok(index * index)).unwrap();
            assert_eq!(squares, (0..20).map(|index| index * index).collect::<Vec<_>>());
        }
        assert!(work(0, 2, |_| Ok(())).unwrap().is_empty());
    }

    #[test]
    fn the_first_failure_ends_the_work_and_is_told() {
        let n_begun = AtomicUsize::new(0);
        let failed = work(1000, 2, |index| {
            n_begun.fetch_add(1, Ordering::Relaxed);
            if index == 3 { Err(WorkFailed(format!("job {index}")).into()) } else { Ok(()) }
        });
        assert_eq!(failed.unwrap_err().to_string(), "job 3");
        assert!(n_begun.into_inner() < 1000);
    }
}
