//! Errors as Python's exceptions.

use std::fmt::Display;
use std::io::ErrorKind;

use formats::ConfigError;
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
        ConfigError::Unreadable { source, .. } => match source.kind() {
            ErrorKind::NotFound => PyFileNotFoundError::new_err(text),
            ErrorKind::PermissionDenied => PyPermissionError::new_err(text),
            ErrorKind::InvalidData => PyValueError::new_err(text),
            _ => PyOSError::new_err(text),
        },
        _ => PyValueError::new_err(text),
    }
}

/// A controller that cannot be made: where the system refused a thread an `OSError`, else a `ValueError`.
pub fn refused_controller(error: mppi::ConfigError) -> PyErr {
    match error {
        mppi::ConfigError::Threads(_) => PyOSError::new_err(error.to_string()),
        other => refused_value(other),
    }
}
