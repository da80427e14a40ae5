//! Work without Python's lock.

use std::any::Any;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::Builder;
use std::time::Duration;

use pyo3::exceptions::{PyOSError, PyRuntimeError};
use pyo3::{PyErr, PyResult, Python, pyfunction};
use rayon::{ThreadPool, ThreadPoolBuilder};

use crate::failure::Defect;

/// How often this process was forked: threads that were started before belong to its parent.
static N_FORKS: AtomicU64 = AtomicU64::new(0);
/// Messages of a recording between two looks for a signal: some milliseconds.
const LOOKS_BETWEEN: u32 = 256;
/// The threads that maps are made by, and the number of forks before them.
static POOL: Mutex<Option<(u64, Arc<ThreadPool>)>> = Mutex::new(None);

/// What threads of Python take turns with: whoever comes second waits, without Python's lock.
pub struct Turns<T>(Mutex<T>);

impl<T: Send> Turns<T> {
    pub fn new(value: T) -> Self {
        Self(Mutex::new(value))
    }

    /// Lets `work` have the value to itself, without Python's lock.
    ///
    /// # Errors
    /// A panic, as [`Defect`]: of this call, or of one before, after which nobody knows what the value holds.
    pub fn take<R: Send>(&self, py: Python<'_>, work: impl FnOnce(&mut T) -> R + Send) -> PyResult<R> {
        Ok(detached(py, || self.with(work))??)
    }

    /// [`Turns::take`] for who has let go of Python's lock already.
    ///
    /// # Errors
    /// A call before panicked.
    pub fn with<R>(&self, work: impl FnOnce(&mut T) -> R) -> Result<R, BrokenOff> {
        self.0.lock().map(|mut value| work(&mut value)).map_err(|_| BrokenOff)
    }

    /// The value, whose owner is going away.
    pub fn get_mut(&mut self) -> &mut T {
        self.0.get_mut().unwrap_or_else(PoisonError::into_inner)
    }
}

/// A call before panicked, so that nobody knows what the object holds.
#[derive(Debug)]
pub struct BrokenOff;

impl From<BrokenOff> for PyErr {
    fn from(_: BrokenOff) -> Self {
        defect("an earlier call on this object broke off; make a new one")
    }
}

/// Does `work` without Python's lock.
///
/// # Errors
/// A panic, as [`Defect`].
pub fn detached<R: Send>(py: Python<'_>, work: impl FnOnce() -> R + Send) -> PyResult<R> {
    py.detach(|| catch_unwind(AssertUnwindSafe(work))).map_err(|panic| defect(said(&*panic)))
}

/// Looks, now and then, whether Python has a signal to handle, in work that has let go of its lock.
#[derive(Default)]
pub struct Interrupts {
    n_looks: u32,
    raised: Option<PyErr>,
}

impl Interrupts {
    /// Looks every so many calls between which not even a person notices time to pass.
    ///
    /// # Errors
    /// A signal whose handler raised, Ctrl-C above all: the work is to end.
    pub fn look(&mut self) -> Result<(), String> {
        self.n_looks = self.n_looks.wrapping_add(1);
        if self.n_looks.is_multiple_of(LOOKS_BETWEEN) { self.look_now() } else { Ok(()) }
    }

    /// The same at once.
    ///
    /// # Errors
    /// Those of [`Interrupts::look`].
    pub fn look_now(&mut self) -> Result<(), String> {
        match Python::attach(|py| py.check_signals()) {
            Ok(()) => Ok(()),
            Err(error) => {
                self.raised = Some(error);
                Err("interrupted".to_owned())
            }
        }
    }

    /// Raises what a handler raised.
    ///
    /// # Errors
    /// That.
    pub fn raise(self) -> PyResult<()> {
        self.raised.map_or(Ok(()), Err)
    }
}

/// What a thread found, or how it panicked.
pub type Outcome<R> = Result<R, Box<dyn Any + Send>>;

/// Time between two looks for a signal while a thread works.
const PATIENCE: Duration = Duration::from_millis(50);

/// Does long `work` in a thread of its own, so that Ctrl-C is heard meanwhile: work that nobody waits for any more ends by
/// itself, and what it found is lost.
///
/// # Errors
/// What a handler of a signal raised; a panic, as [`Defect`]; an `OSError` where the system refuses a thread.
pub fn interruptible<R: Send + 'static>(
    py: Python<'_>,
    work: impl FnOnce() -> R + Send + 'static,
) -> PyResult<R> {
    let (sender, receiver) = channel();
    let spawned = Builder::new().spawn(move || drop(sender.send(catch_unwind(AssertUnwindSafe(work)))));
    spawned.map_err(|error| PyOSError::new_err(error.to_string()))?;
    interruptible_answer(py, receiver)
}

/// Waits for what a thread finds, or how it panicked, and hears Ctrl-C meanwhile.
///
/// # Errors
/// What a handler of a signal raised; a panic, as [`Defect`].
pub fn interruptible_answer<R: Send>(py: Python<'_>, mut answer: Receiver<Outcome<R>>) -> PyResult<R> {
    loop {
        let (waiting, heard) = py.detach(move || {
            let heard = answer.recv_timeout(PATIENCE);
            (answer, heard)
        });
        answer = waiting;
        match heard {
            Ok(found) => return found.map_err(|panic| defect(said(&*panic))),
            Err(RecvTimeoutError::Timeout) => py.check_signals()?,
            Err(RecvTimeoutError::Disconnected) => return Err(defect("a thread that ended without a word")),
        }
    }
}

/// The threads of this process, in which all parallel work is to be installed.
///
/// # Errors
/// An `OSError` where the system refuses threads.
pub fn pool() -> PyResult<Arc<ThreadPool>> {
    let mut pool = POOL.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some((_, threads)) = pool.as_ref().filter(|(born, _)| *born == n_forks()) {
        return Ok(Arc::clone(threads));
    }
    let threads = ThreadPoolBuilder::new().build();
    let threads = Arc::new(threads.map_err(|error| PyOSError::new_err(error.to_string()))?);
    // The threads of the process that this one was forked from are not here, so nobody can wait for their end.
    std::mem::forget(pool.replace((n_forks(), Arc::clone(&threads))));
    Ok(threads)
}

/// How often this process was forked.
pub fn n_forks() -> u64 {
    N_FORKS.load(Ordering::Relaxed)
}

/// Refuses an object whose threads were started before a fork.
pub fn forked(what: &str) -> PyErr {
    PyRuntimeError::new_err(format!(
        "{what}: expected to be used in the process that made it, found a process that was forked from there, without \
         its threads; make it after the fork, or start processes by multiprocessing's method \"spawn\""
    ))
}

/// Says that this process was just forked from another; Python calls it.
#[pyfunction]
pub fn note_fork() {
    N_FORKS.fetch_add(1, Ordering::Relaxed);
}

/// Panics, so that tests see what becomes of it; only builds with debug assertions have it.
#[cfg(debug_assertions)]
#[pyfunction]
pub fn provoke_defect(py: Python<'_>) -> PyResult<()> {
    detached(py, || panic!("provoked"))
}

fn defect(said: &str) -> PyErr {
    Defect::new_err(format!("this is a defect of surefoot, please report it: {said}"))
}

/// The words of a panic.
fn said(panic: &(dyn Any + Send)) -> &str {
    let text = panic.downcast_ref::<&str>().copied();
    text.or_else(|| panic.downcast_ref::<String>().map(String::as_str)).unwrap_or("a panic without words")
}
