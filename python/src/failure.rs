//! Errors as Python's exceptions.

use std::fmt::Display;
use std::io::{self, ErrorKind};
use std::path::Path;

use formats::{ConfigError, ElevationError};
use pyo3::PyErr;
use pyo3::exceptions::{
    PyFileNotFoundError, PyOSError, PyPermissionError, PyRuntimeError, PyTypeError, PyValueError,
};

pyo3::create_exception!(
    surefoot,
    Defect,
    PyRuntimeError,
    "Surefoot broke off where it never should: a defect of its own, whatever it was given."
);

/// A value that cannot be, in the words of the crate that refused it.
pub fn refused_value(error: impl Display) -> PyErr {
    PyValueError::new_err(error.to_string())
}

/// A value that cannot be, with the argument that it came in.
pub fn refused(argument: &str, expected: impl Display, found: impl Display) -> PyErr {
    PyValueError::new_err(format!("{argument}: expected {expected}, found {found}"))
}

/// Something of another type.
pub fn refused_type(argument: &str, expected: impl Display, found: impl Display) -> PyErr {
    PyTypeError::new_err(format!("{argument}: expected {expected}, found {found}"))
}

/// A configuration that cannot be used: what the file system said is an `OSError`, all else a `ValueError`.
pub fn refused_config(error: ConfigError) -> PyErr {
    let text = error.to_string();
    match error {
        ConfigError::Unreadable { source, .. } => refused_by_system(source.kind(), text),
        _ => PyValueError::new_err(text),
    }
}

/// An elevation file that cannot be used: what the file system said is an `OSError`, all else a `ValueError`.
pub fn refused_elevation(error: ElevationError) -> PyErr {
    let text = error.to_string();
    let said = std::error::Error::source(&error).and_then(|source| source.downcast_ref::<std::io::Error>());
    match said.map(std::io::Error::kind) {
        Some(kind) => refused_by_system(kind, text),
        None => PyValueError::new_err(text),
    }
}

/// A file that the system does not give.
pub fn refused_file(path: &Path, error: &io::Error) -> PyErr {
    let text = format!("{}: expected a readable file, found: {error}", path.display());
    refused_by_system(error.kind(), text)
}

/// What the file system said.
pub fn refused_by_system(kind: ErrorKind, text: String) -> PyErr {
    match kind {
        ErrorKind::NotFound => PyFileNotFoundError::new_err(text),
        ErrorKind::PermissionDenied => PyPermissionError::new_err(text),
        ErrorKind::InvalidData => PyValueError::new_err(text),
        _ => PyOSError::new_err(text),
    }
}

/// A controller that cannot be made: where the system refused a thread an `OSError`, else a `ValueError`.
pub fn refused_controller(error: mppi::ConfigError) -> PyErr {
    match error {
        mppi::ConfigError::Threads(_) => PyOSError::new_err(error.to_string()),
        other => refused_value(other),
    }
}
