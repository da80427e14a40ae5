//! Tables on their way to Python: data frames where pandas is installed, else dicts of arrays.

use formats::{RecordedColumn, RecordedTable};
use numpy::IntoPyArray;
use pyo3::exceptions::PyModuleNotFoundError;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList};

/// A table as a data frame; without pandas as a dict of arrays.
///
/// # Errors
/// Those of pandas.
pub fn frame<'py>(py: Python<'py>, columns: Vec<(String, Bound<'py, PyAny>)>) -> PyResult<Bound<'py, PyAny>> {
    let dict = PyDict::new(py);
    for (name, values) in columns {
        dict.set_item(name, values)?;
    }
    match py.import("pandas") {
        Ok(pandas) => pandas.getattr("DataFrame")?.call1((dict,)),
        Err(error) if error.is_instance_of::<PyModuleNotFoundError>(py) => Ok(dict.into_any()),
        Err(error) => Err(error),
    }
}

/// The columns of a table that was recorded, after the times of its rows.
pub fn recorded<'py>(py: Python<'py>, table: RecordedTable) -> PyResult<Vec<(String, Bound<'py, PyAny>)>> {
    let mut columns = vec![("time_ns".to_owned(), table.time_ns.into_pyarray(py).into_any())];
    for (name, column) in table.columns {
        columns.push((name, of_column(py, column)?));
    }
    Ok(columns)
}

fn of_column(py: Python<'_>, column: RecordedColumn) -> PyResult<Bound<'_, PyAny>> {
    match column {
        RecordedColumn::Numbers(values) => Ok(values.into_pyarray(py).into_any()),
        RecordedColumn::Counts(values) => Ok(values.into_pyarray(py).into_any()),
        RecordedColumn::Text(values) => words(py, values),
    }
}

/// Words as an array of them.
pub fn words(py: Python<'_>, values: Vec<String>) -> PyResult<Bound<'_, PyAny>> {
    py.import("numpy")?.call_method1("array", (PyList::new(py, values)?, "O"))
}

/// A page that stands by itself, as a cell of a notebook shows it.
pub fn in_notebook(page: &str) -> String {
    let page = page.replace('&', "&amp;").replace('"', "&quot;");
    format!("<iframe srcdoc=\"{page}\" style=\"width:100%;height:900px;border:1px solid #d9dee5\"></iframe>")
}
