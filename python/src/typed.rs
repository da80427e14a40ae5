//! Results that know what type they have in Python, which the stubs tell.

use std::convert::Infallible;

use numpy::ndarray::Dimension;
use numpy::{Element, PyArray};
use pyo3::inspect::PyStaticExpr;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use pyo3::{PyTypeInfo, type_hint_identifier, type_hint_subscript};

/// A number that arrays hold.
pub trait Scalar: Element {
    /// Its type in NumPy.
    const TYPE: PyStaticExpr;
}

impl Scalar for f32 {
    const TYPE: PyStaticExpr = type_hint_identifier!("numpy", "float32");
}

impl Scalar for f64 {
    const TYPE: PyStaticExpr = type_hint_identifier!("numpy", "float64");
}

impl Scalar for u8 {
    const TYPE: PyStaticExpr = type_hint_identifier!("numpy", "uint8");
}

impl Scalar for bool {
    const TYPE: PyStaticExpr = type_hint_identifier!("numpy", "bool_");
}

/// An array of NumPy's.
pub struct Array<T, D>(pub Py<PyArray<T, D>>);

impl<'py, T: Scalar, D: Dimension> IntoPyObject<'py> for Array<T, D> {
    type Target = PyArray<T, D>;
    type Output = Bound<'py, Self::Target>;
    type Error = Infallible;

    const OUTPUT_TYPE: PyStaticExpr =
        type_hint_subscript!(type_hint_identifier!("numpy.typing", "NDArray"), T::TYPE);

    fn into_pyobject(self, py: Python<'py>) -> Result<Self::Output, Infallible> {
        Ok(self.0.into_bound(py))
    }
}

impl<'py, T: Scalar, D: Dimension> IntoPyObject<'py> for &Array<T, D> {
    type Target = PyArray<T, D>;
    type Output = Bound<'py, Self::Target>;
    type Error = Infallible;

    const OUTPUT_TYPE: PyStaticExpr = <Array<T, D> as IntoPyObject<'py>>::OUTPUT_TYPE;

    fn into_pyobject(self, py: Python<'py>) -> Result<Self::Output, Infallible> {
        Ok(self.0.bind(py).clone())
    }
}

/// Anything by its name.
pub struct Fields<'py>(pub Bound<'py, PyDict>);

impl<'py> IntoPyObject<'py> for Fields<'py> {
    type Target = PyDict;
    type Output = Bound<'py, PyDict>;
    type Error = Infallible;

    const OUTPUT_TYPE: PyStaticExpr = type_hint_subscript!(
        PyDict::TYPE_HINT,
        <String as IntoPyObject<'py>>::OUTPUT_TYPE,
        type_hint_identifier!("typing", "Any")
    );

    fn into_pyobject(self, _py: Python<'py>) -> Result<Self::Output, Infallible> {
        Ok(self.0)
    }
}

/// Parameters of effects, {effect: {parameter: (value, low, high)}}.
pub struct Intervals<'py>(pub Bound<'py, PyDict>);

impl<'py> IntoPyObject<'py> for Intervals<'py> {
    type Target = PyDict;
    type Output = Bound<'py, PyDict>;
    type Error = Infallible;

    const OUTPUT_TYPE: PyStaticExpr = type_hint_subscript!(
        PyDict::TYPE_HINT,
        <String as IntoPyObject<'py>>::OUTPUT_TYPE,
        type_hint_subscript!(
            PyDict::TYPE_HINT,
            <String as IntoPyObject<'py>>::OUTPUT_TYPE,
            <(f64, f64, f64) as IntoPyObject<'py>>::OUTPUT_TYPE
        )
    );

    fn into_pyobject(self, _py: Python<'py>) -> Result<Self::Output, Infallible> {
        Ok(self.0)
    }
}
