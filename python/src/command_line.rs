//! The command line, as the wheel installs it.

use std::ffi::OsString;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::PathBuf;

use cli::Program;
use pyo3::prelude::*;

/// What a program of Rust's ends with when it breaks off.
const BROKEN_OFF: u8 = 101;

/// Runs the command line; returns the exit code.
///
/// start: what starts it again for its own processes, the interpreter and the words before the command's own. words: the
/// command's own. file: which file holds it.
#[pyfunction]
#[pyo3(signature = (start: "Sequence[str]", words: "Sequence[str]", file))]
pub fn run_command_line(py: Python<'_>, start: Vec<OsString>, words: Vec<OsString>, file: PathBuf) -> u8 {
    py.detach(|| {
        let run = AssertUnwindSafe(|| cli::run_as(Program { file, start, words }));
        catch_unwind(run).unwrap_or(BROKEN_OFF)
    })
}
