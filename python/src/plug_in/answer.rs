//! Arrays that Python's own callables return.

use numpy::ndarray::IxDyn;
use numpy::{PyArrayDyn, PyArrayMethods, PyReadonlyArrayDyn, PyUntypedArray, PyUntypedArrayMethods};
use pyo3::prelude::*;

use crate::arrays::{kind, shape, values};
use crate::failure::{refused, refused_type};

/// What was returned, as numbers row by row, if it is an array of float32 or float64 of one of these shapes.
pub fn numbers(name: &str, found: &Bound<'_, PyAny>, shapes: &[&[usize]]) -> PyResult<(Vec<f64>, usize)> {
    let expected = || {
        let shapes: Vec<String> = shapes.iter().map(|lengths| shape(lengths)).collect();
        format!("an array of float32 or float64 of shape {}", shapes.join(" or "))
    };
    let Ok(array) = found.cast::<PyUntypedArray>() else {
        return Err(refused_type(name, expected(), kind(found)));
    };
    let Some(which) = shapes.iter().position(|lengths| *lengths == array.shape()) else {
        return Err(refused(name, expected(), format!("shape {}", shape(array.shape()))));
    };
    let double = if let Ok(double) = found.cast::<PyArrayDyn<f64>>() {
        row_by_row(name, &double.try_readonly()?)?
    } else if let Ok(single) = found.cast::<PyArrayDyn<f32>>() {
        row_by_row(name, &single.try_readonly()?)?
    } else {
        return Err(refused_type(name, expected(), format!("one of {}", array.dtype())));
    };
    Ok((double, which))
}

/// The values of an array, however it lies in memory.
fn row_by_row<T: numpy::Element + Copy + Into<f64>>(
    name: &str,
    array: &PyReadonlyArrayDyn<'_, T>,
) -> PyResult<Vec<f64>> {
    match values::<T, IxDyn>(name, array) {
        Ok(values) if array.is_c_contiguous() => Ok(values.iter().copied().map(Into::into).collect()),
        _ => Ok(array.as_array().iter().copied().map(Into::into).collect()),
    }
}

/// Where a number of an array stands.
pub fn place(name: &str, index: usize, lengths: &[usize]) -> String {
    let mut rest = index;
    let mut indices: Vec<String> = lengths
        .iter()
        .rev()
        .map(|length| {
            let index = rest % length;
            rest /= length;
            index.to_string()
        })
        .collect();
    indices.reverse();
    format!("{name}[{}]", indices.join(", "))
}
