//! Costs and models written in Python, for trying things out: called with arrays, slower by far than what is compiled.

mod answer;
mod cost;
mod model;

use std::cell::Cell;
use std::sync::{Arc, Mutex, PoisonError};

use pyo3::prelude::*;

pub use cost::{PythonCost, SampledRollouts};
pub use model::{PythonModel, PythonMotion};

thread_local! {
    /// Whether this thread is within something of Python's that a controller called.
    static IS_WITHIN: Cell<bool> = const { Cell::new(false) };
}

/// Whether this thread is within something of Python's that a controller called, which then waits for it.
pub fn is_within() -> bool {
    IS_WITHIN.with(Cell::get)
}

/// Something of Python's that a controller calls, and what went wrong there first.
#[derive(Clone, Debug)]
pub struct Called {
    callable: Arc<Py<PyAny>>,
    fault: Arc<Mutex<Option<PyErr>>>,
}

impl Called {
    pub fn new(callable: Py<PyAny>) -> Self {
        Self { callable: Arc::new(callable), fault: Arc::default() }
    }

    /// Calls it through `work`. `None` where something went wrong, now or before: who asks by [`Called::fault`] is told.
    fn call<R>(&self, work: impl FnOnce(Python<'_>, &Bound<'_, PyAny>) -> PyResult<R>) -> Option<R> {
        if self.faults().is_some() {
            return None;
        }
        let was_within = IS_WITHIN.with(|within| within.replace(true));
        let result = Python::attach(|py| work(py, self.callable.bind(py)));
        IS_WITHIN.with(|within| within.set(was_within));
        match result {
            Ok(result) => Some(result),
            Err(error) => {
                self.faults().get_or_insert(error);
                None
            }
        }
    }

    /// What went wrong since this was asked last.
    pub fn fault(&self) -> Option<PyErr> {
        self.faults().take()
    }

    fn faults(&self) -> std::sync::MutexGuard<'_, Option<PyErr>> {
        self.fault.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
