//! Many drives on few threads.

use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

/// Does `work` for 0 to n, every thread the next one until none is left or one broke; results in their order.
///
/// A broadcast and no parallel iterator: mapping inside a drive is parallel itself, and a thread that waits for its
/// rows of the map would otherwise begin another whole drive meanwhile.
///
/// # Errors
/// The first error in the order of the work.
pub(crate) fn in_turns<T: Send, E: Send>(
    pool: &rayon::ThreadPool,
    n: usize,
    work: impl Fn(usize) -> Result<T, E> + Sync,
) -> Result<Vec<T>, E> {
    let (next, is_broken) = (AtomicUsize::new(0), AtomicBool::new(false));
    let thread = |_: rayon::BroadcastContext<'_>| {
        let mut done = Vec::new();
        while !is_broken.load(Ordering::Relaxed) {
            let index = next.fetch_add(1, Ordering::Relaxed);
            if index >= n {
                break;
            }
            let finished = work(index);
            is_broken.fetch_or(finished.is_err(), Ordering::Relaxed);
            done.push((index, finished));
        }
        done
    };
    let mut done: Vec<_> = pool.broadcast(thread).into_iter().flatten().collect();
    done.sort_by_key(|(index, _)| *index);
    done.into_iter().map(|(_, finished)| finished).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn results_come_in_order_for_any_number_of_threads_and_errors_end_the_work() {
        for n_threads in [1, 3] {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(n_threads).build().unwrap();
            let squares = in_turns(&pool, 20, |index| Ok::<_, usize>(index * index)).unwrap();
            assert_eq!(squares, (0..20).map(|index| index * index).collect::<Vec<_>>());
            let broken = in_turns(&pool, 20, |index| if index < 5 { Ok(index) } else { Err(index) });
            assert_eq!(broken, Err(5));
        }
    }
}
