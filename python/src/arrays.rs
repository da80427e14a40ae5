//! Arrays and numbers from Python, checked; results as arrays.

use numpy::ndarray::{Dim, Dimension, IntoDimension};
use numpy::{
    Element, IntoPyArray, PyArray1, PyArrayDescrMethods, PyArrayMethods, PyReadonlyArray, PyUntypedArray,
    PyUntypedArrayMethods, dtype,
};
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use pyo3::types::PyBool;

use crate::failure::{refused, refused_type};
use crate::typed::{Array, Scalar};

/// An array whose elements lie row by row without gaps: the caller's own memory where it is like that, else a copy.
///
/// # Errors
/// `TypeError` for anything but an array of this type of number, `ValueError` for one of another number of axes; `axes` says
/// what they stand for, `row, col`.
pub fn array<'py, T: Element, D: Dimension>(
    argument: &str,
    found: &Bound<'py, PyAny>,
    axes: &str,
) -> PyResult<PyReadonlyArray<'py, T, D>> {
    let py = found.py();
    let expected = || format!("an array of {} with axes ({axes})", dtype::<T>(py));
    let Ok(untyped) = found.cast::<PyUntypedArray>() else {
        return Err(refused_type(argument, expected(), kind(found)));
    };
    if !untyped.dtype().is_equiv_to(&dtype::<T>(py)) {
        return Err(refused_type(argument, expected(), format!("one of {}", untyped.dtype())));
    }
    if D::NDIM != Some(untyped.ndim()) {
        return Err(refused(argument, expected(), format!("shape {}", shape(untyped.shape()))));
    }
    let rows = if untyped.is_c_contiguous() && untyped.is_aligned() {
        untyped.clone().into_any()
    } else {
        py.import("numpy")?.call_method1("require", (untyped, dtype::<T>(py), ["C", "A"]))?
    };
    rows.extract()
}

/// [`array`], where `None` stands for none.
pub fn optional<'py, T: Element, D: Dimension>(
    argument: &str,
    found: Option<&Bound<'py, PyAny>>,
    axes: &str,
) -> PyResult<Option<PyReadonlyArray<'py, T, D>>> {
    found.map(|found| array(argument, found, axes)).transpose()
}

/// The elements of an array that [`array`] let in.
pub fn values<'a, T: Element, D: Dimension>(
    argument: &str,
    array: &'a PyReadonlyArray<'_, T, D>,
) -> PyResult<&'a [T]> {
    array.as_slice().map_err(|error| refused(argument, "rows without gaps", error))
}

/// Refuses an array of another shape.
pub fn require_shape(argument: &str, found: &[usize], expected: &[usize]) -> PyResult<()> {
    if found == expected {
        Ok(())
    } else {
        Err(refused(argument, format!("shape {}", shape(expected)), format!("shape {}", shape(found))))
    }
}

/// A shape as Python writes it.
pub fn shape(lengths: &[usize]) -> String {
    let lengths: Vec<String> = lengths.iter().map(usize::to_string).collect();
    if let [length] = lengths.as_slice() {
        format!("({length},)")
    } else {
        format!("({})", lengths.join(", "))
    }
}

/// So many real numbers, from an array or any sequence. Of complex ones NumPy would leave a part out.
pub struct Reals<T, const N: usize>(pub [T; N]);

impl<'a, 'py, T, const N: usize> FromPyObject<'a, 'py> for Reals<T, N>
where
    [T; N]: FromPyObject<'a, 'py, Error = PyErr>,
{
    type Error = PyErr;

    fn extract(found: Borrowed<'a, 'py, PyAny>) -> PyResult<Self> {
        if is_complex(&found) {
            return Err(PyTypeError::new_err(format!("expected {N} real numbers, found complex ones")));
        }
        found.extract().map(Self)
    }
}

fn is_complex(found: &Bound<'_, PyAny>) -> bool {
    found.cast::<PyUntypedArray>().is_ok_and(|array| array.dtype().kind() == b'c')
}

/// As many numbers as there are names for them, from an array or any sequence.
pub fn numbers<const N: usize>(
    argument: &str,
    found: &Bound<'_, PyAny>,
    names: [&str; N],
) -> PyResult<[f64; N]> {
    if let Ok(Reals(numbers)) = found.extract::<Reals<f64, N>>() {
        return Ok(numbers);
    }
    let expected = format!("{N} numbers ({})", names.join(", "));
    match found.len() {
        Ok(length) if length != N => Err(refused(argument, expected, format!("{length}"))),
        _ => Err(refused_type(argument, expected, kind(found))),
    }
}

/// What something is, for an error.
pub fn kind(found: &Bound<'_, PyAny>) -> String {
    if found.is_none() {
        return "None".to_owned();
    }
    if found.is_instance_of::<PyBool>() {
        return "a bool".to_owned();
    }
    found.get_type().name().map_or_else(|_| "something else".to_owned(), |name| name.to_string())
}

/// Values as an array of Python's that takes over their memory.
pub fn owned<T: Scalar, const N: usize>(
    py: Python<'_>,
    values: Vec<T>,
    shape: [usize; N],
) -> PyResult<Array<T, Dim<[usize; N]>>>
where
    Dim<[usize; N]>: Dimension,
    [usize; N]: IntoDimension<Dim = Dim<[usize; N]>>,
{
    let array: Bound<'_, PyArray1<T>> = values.into_pyarray(py);
    Ok(Array(array.reshape(shape)?.unbind()))
}
