//! Many drives on few threads, and why one of them could not be driven.

use std::fmt::Display;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

use scenarios::{ArenaError, PlantError, RockFieldError, WorldError};

use crate::closed_loop::DriveError;
use crate::navigation::ExternalError;

/// Why there is no table.
#[derive(Debug, thiserror::Error)]
pub enum SweepError {
    /// Nothing to drive.
    #[error("expected {expected}, found none")]
    NoDrives {
        /// What there has to be at least one of.
        expected: &'static str,
    },
    /// The vehicle cannot be read, or settings are none.
    #[error(transparent)]
    Config(#[from] formats::ConfigError),
    /// The configuration has no form in JSON, hence no hash.
    #[error("config_hash: {reason}")]
    Hash {
        /// What stands against it.
        reason: String,
    },
    /// There is no such rock field.
    #[error(transparent)]
    Field(#[from] RockFieldError),
    /// This build has no such plant.
    #[error(transparent)]
    Plant(#[from] PlantError),
    /// The machine lacks the instructions that were asked for.
    #[error(transparent)]
    Isa(#[from] bicycle::lanes::IsaAbsent),
    /// What came of a drive could not be kept.
    #[error(transparent)]
    Kept(#[from] formats::OutputError),
    /// The system refused the threads.
    #[error("threads: {0}")]
    Threads(#[from] rayon::ThreadPoolBuildError),
    /// A drive could not begin or go on; one that ends badly is a result and no error.
    #[error("{drive}: {source}")]
    Drive {
        /// Which one.
        drive: String,
        /// Why.
        source: Box<BrokenDrive>,
    },
}

/// Why a drive could not begin or go on.
#[derive(Debug, thiserror::Error)]
pub enum BrokenDrive {
    /// There is no such rock field.
    #[error(transparent)]
    Field(#[from] RockFieldError),
    /// There is no such hall.
    #[error(transparent)]
    Arena(#[from] ArenaError),
    /// There is no such world.
    #[error(transparent)]
    World(#[from] WorldError),
    /// The plant or the planner gave up.
    #[error(transparent)]
    Loop(#[from] DriveError),
    /// A planner of other people's gave up, or what it answered cannot be.
    #[error("{0}")]
    External(ExternalError),
}

/// Drives all that is to be driven; `after` sees what comes of each as it ends, in any order and on any thread, and ends
/// the work with an error of its own.
pub(crate) fn sweep<J: Display + Sync, T: Send>(
    jobs: &[J],
    n_threads: usize,
    drive: impl Fn(&J) -> Result<T, BrokenDrive> + Sync,
    after: impl Fn(&T) -> Result<(), SweepError> + Sync,
) -> Result<Vec<T>, SweepError> {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(n_threads).build()?;
    in_turns(&pool, jobs.len(), |index| {
        let job = &jobs[index];
        let told = |source| SweepError::Drive { drive: job.to_string(), source: Box::new(source) };
        let driven = drive(job).map_err(told)?;
        after(&driven)?;
        Ok(driven)
    })
}

/// [`formats::config_hash`].
pub(crate) fn hash_of(config: &navigator::Config) -> Result<String, SweepError> {
    formats::config_hash(config).map_err(|error| SweepError::Hash { reason: error.to_string() })
}

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
