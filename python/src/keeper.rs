//! What must stay in the thread that made it, in a thread of its own.

use std::sync::mpsc::{Sender, channel};
use std::thread::Builder;

use pyo3::exceptions::PyOSError;
use pyo3::{PyResult, Python};

use crate::detached::{forked, interruptible_answer, n_forks};

type Work<T> = Box<dyn FnOnce(&mut T) + Send>;

/// A value in a thread of its own, which ends with this.
pub struct Keeper<T> {
    what: &'static str,
    requests: Sender<Work<T>>,
    born: u64,
}

impl<T: 'static> Keeper<T> {
    /// Has `make` make the value in its thread.
    ///
    /// # Errors
    /// Those of `make`, by way of `refused`; an `OSError` where the system refuses a thread.
    pub fn start<E: Send + 'static>(
        py: Python<'_>,
        what: &'static str,
        make: impl FnOnce() -> Result<T, E> + Send + 'static,
        refused: impl FnOnce(E) -> pyo3::PyErr,
    ) -> PyResult<Self> {
        let (requests, asked) = channel::<Work<T>>();
        let (answer, made) = channel();
        let thread = Builder::new().name(what.to_owned()).spawn(move || match make() {
            Ok(mut value) => {
                drop(answer.send(Ok(Ok(()))));
                asked.iter().for_each(|work| work(&mut value));
            }
            Err(error) => drop(answer.send(Ok(Err(error)))),
        });
        thread.map_err(|error| PyOSError::new_err(error.to_string()))?;
        interruptible_answer(py, made)?.map_err(refused)?;
        Ok(Self { what, requests, born: n_forks() })
    }

    /// Lets `work` have the value, and waits for what it finds.
    ///
    /// # Errors
    /// A panic, as `Defect`; a process that was forked from the one that made this.
    pub fn ask<R: Send + 'static>(
        &self,
        py: Python<'_>,
        work: impl FnOnce(&mut T) -> R + Send + 'static,
    ) -> PyResult<R> {
        if self.born != n_forks() {
            return Err(forked(self.what));
        }
        let (answer, found) = channel();
        let request: Work<T> = Box::new(move |value| {
            let work = std::panic::AssertUnwindSafe(|| work(value));
            drop(answer.send(std::panic::catch_unwind(work)));
        });
        // Where the thread has ended, nobody answers, and that is told below.
        drop(self.requests.send(request));
        interruptible_answer(py, found)
    }
}
