//! Learning on a thread of its own, of the lowest priority, that nobody waits for.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, SyncSender, TryRecvError, TrySendError, sync_channel};

use bicycle::{Limits, Vehicle};
use evidential::{Checkpoint, Unfamiliar};
use navigator::{Assessor, Belief, Config};
use rustix::process::setpriority_process;
use rustix::thread::gettid;
use traversability::CvarLevel;

use super::learner::{Decision, Learner, Round};
use super::notebook::Stretch;
use crate::RuntimeError;

/// Stretches that may wait; of more, the newest is given up.
const WAITING_MAX: usize = 2;
/// Rounds that may wait to be heard of.
const NEWS_MAX: usize = 8;
/// The last to be given time [nice].
const PRIORITY: i32 = 19;

/// What it takes to judge the ground by networks.
#[derive(Clone, Debug)]
pub struct Judge {
    /// The machine.
    pub vehicle: Vehicle,
    /// Limits that plans keep to.
    pub limits: Limits,
    /// Settings of the pipeline.
    pub config: Config,
    /// Share of the worst outcomes to plan for.
    pub level: CvarLevel,
    /// What becomes of ground that is unlike the training data.
    pub unfamiliar: Unfamiliar,
}

impl Judge {
    /// An assessor by these networks.
    pub fn by(&self, checkpoint: &Arc<Checkpoint>) -> Result<Assessor, RuntimeError> {
        let belief = Belief::Learned { checkpoint: Arc::clone(checkpoint), unfamiliar: self.unfamiliar };
        Ok(Assessor::new(&self.vehicle, &self.limits, &self.config, &belief, self.level)?)
    }
}

/// A round that ended, with what is to be used from now on if that has changed.
pub struct News {
    /// The round.
    pub round: Round,
    /// Networks, their hash, and the assessor by them.
    pub change: Option<(Arc<Checkpoint>, u64, Assessor)>,
}

/// The thread that learns.
pub struct Background {
    stretches: SyncSender<Stretch>,
    news: Receiver<Result<News, String>>,
    is_over: Arc<AtomicBool>,
    n_given_up: u64,
    is_lost: bool,
}

impl Background {
    /// Starts the thread. All that learning computes runs on it alone.
    ///
    /// # Errors
    /// The system refuses a thread.
    pub fn start(mut learner: Learner, judge: Judge) -> Result<Self, RuntimeError> {
        let (stretches, waiting) = sync_channel(WAITING_MAX);
        let (teller, news) = sync_channel(NEWS_MAX);
        let is_over = Arc::new(AtomicBool::new(false));
        let ends = Arc::clone(&is_over);
        // A pool of one, so that nothing that learning does in parallel is done by the threads that judge the ground. A
        // panic ends the thread: its channels close, and that is heard of.
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(1)
            .thread_name(|_| "surefoot-learns".to_owned())
            .panic_handler(|_| ())
            .build()?;
        pool.spawn(move || {
            // Where it is not permitted, the scheduler shares the time as it does anyway.
            setpriority_process(Some(gettid()), PRIORITY).ok();
            learn(&mut learner, &judge, &waiting, &teller, &ends);
        });
        Ok(Self { stretches, news, is_over, n_given_up: 0, is_lost: false })
    }

    /// Hands over a stretch, or gives it up when the thread is behind. Never waits.
    pub fn offer(&mut self, stretch: Stretch) {
        // Of a thread that has gone, the news tell.
        if let Err(TrySendError::Full(_)) = self.stretches.try_send(stretch) {
            self.n_given_up += 1;
        }
    }

    /// What has been learned meanwhile, or why learning has ended. Never waits.
    pub fn news(&mut self) -> Option<Result<News, String>> {
        match self.news.try_recv() {
            Ok(news) => Some(news),
            Err(TryRecvError::Empty) => None,
            Err(TryRecvError::Disconnected) if self.is_lost => None,
            Err(TryRecvError::Disconnected) => {
                self.is_lost = true;
                Some(Err("the thread that learns has ended; driving on with what is known".to_owned()))
            }
        }
    }

    /// Stretches that were given up because the thread was behind.
    pub fn n_given_up(&self) -> u64 {
        self.n_given_up
    }
}

impl Drop for Background {
    fn drop(&mut self) {
        self.is_over.store(true, Ordering::Relaxed);
    }
}

fn learn(
    learner: &mut Learner,
    judge: &Judge,
    waiting: &Receiver<Stretch>,
    teller: &SyncSender<Result<News, String>>,
    ends: &AtomicBool,
) {
    let goes_on = || !ends.load(Ordering::Relaxed);
    while let Ok(stretch) = waiting.recv() {
        let news = match learner.take(stretch) {
            Ok(()) if learner.is_ready() => one_round(learner, judge, &goes_on).transpose(),
            Ok(()) => None,
            Err(error) => Some(Err(RuntimeError::from(error))),
        };
        let Some(news) = news else { continue };
        if teller.send(news.map_err(|error| error.to_string())).is_err() {
            return;
        }
    }
}

fn one_round(
    learner: &mut Learner,
    judge: &Judge,
    goes_on: &dyn Fn() -> bool,
) -> Result<Option<News>, RuntimeError> {
    let Some(round) = learner.round(goes_on)? else { return Ok(None) };
    let change = match round.decision {
        Decision::Accepted | Decision::RolledBack => {
            let checkpoint = Arc::clone(learner.in_use());
            let hash = checkpoint.digest()?.short();
            let assessor = judge.by(&checkpoint)?;
            Some((checkpoint, hash, assessor))
        }
        Decision::NotBetter | Decision::Forgets => None,
    };
    Ok(Some(News { round, change }))
}

#[cfg(test)]
mod tests {
    use super::*;
    use terrain::{GridGeometry, GridMap, SurfaceCell};

    fn stretch() -> Stretch {
        let geometry = GridGeometry { resolution_m: 0.5, origin: [0, 0], n_rows: 2, n_cols: 2 };
        let surface = GridMap::filled(geometry, SurfaceCell::UNKNOWN);
        Stretch { rows: Vec::new(), surface, shift: navigator::Jump::NONE }
    }

    #[test]
    fn a_thread_that_does_not_answer_or_is_gone_is_not_waited_for() {
        let (stretches, waiting) = sync_channel(WAITING_MAX);
        let (teller, news) = sync_channel(NEWS_MAX);
        let is_over = Arc::new(AtomicBool::new(false));
        let mut background = Background { stretches, news, is_over, n_given_up: 0, is_lost: false };
        // Paused: nobody takes anything.
        (0..5).for_each(|_| background.offer(stretch()));
        assert_eq!(background.n_given_up(), 3);
        assert!(background.news().is_none());
        // Gone: said once.
        drop((waiting, teller));
        assert!(background.news().is_some_and(|news| news.is_err()));
        assert!(background.news().is_none());
        background.offer(stretch());
        assert_eq!(background.n_given_up(), 3);
    }
}
