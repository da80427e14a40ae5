//! What a controller believes of its vehicle.

use std::path::PathBuf;

use bicycle::{MotionModel, SkidSteer};
use formats::{ConfigText, parse_model, read_model};
use pyo3::prelude::*;

use crate::failure::{refused_config, refused_value};
use crate::settings::{Source, dict};
use crate::typed::Fields;

/// The kinematic bicycle with its effects: `wheelbase_m`, `[limits]`, and one `[[effects]]` per effect.
///
/// Model(path): a TOML file. See also `Vehicle.model`, `from_toml` and `from_dict`. A command is a speed [m/s] and a steering
/// angle [rad]; a state is (x_m, y_m, yaw_rad, speed_mps, steering_rad) of the rear axle's centre.
#[pyclass(frozen, module = "surefoot")]
#[derive(Clone)]
pub struct Model(pub bicycle::Model);

#[pymethods]
impl Model {
    #[new]
    fn new(path: PathBuf) -> PyResult<Self> {
        read_model(&path).map(Self).map_err(refused_config)
    }

    /// From TOML text; `name` stands where errors name the file.
    #[staticmethod]
    #[pyo3(signature = (text, name="model.toml"))]
    fn from_toml(text: &str, name: &str) -> PyResult<Self> {
        Source::of_text(name, text).parse(parse_model).map(Self)
    }

    /// From a dict of what stands in the file, or a dataclass with such fields, of which those that are None count as absent.
    #[staticmethod]
    #[pyo3(signature = (description: "_Description"))]
    fn from_dict(description: &Bound<'_, PyAny>) -> PyResult<Self> {
        Source::of_description("model", description)?.parse(parse_model).map(Self)
    }

    /// A dict of what stands in the file.
    fn to_dict<'py>(&self, py: Python<'py>) -> PyResult<Fields<'py>> {
        dict(py, &self.0)
    }

    fn __repr__(&self) -> String {
        let effects = self.0.effects.iter().map(|effect| effect.description().id);
        format!(
            "<surefoot.Model of {} m, effects [{}]>",
            self.0.wheelbase_m,
            effects.collect::<Vec<_>>().join(", ")
        )
    }

    fn __eq__(&self, other: &Self) -> bool {
        self.0 == other.0
    }

    fn __reduce__<'py>(&self, py: Python<'py>) -> PyResult<(Bound<'py, PyAny>, (Fields<'py>,))> {
        Ok((py.get_type::<Self>().getattr("from_dict")?, (self.to_dict(py)?,)))
    }
}

/// The skid-steered unicycle: `[limits]`, `speed_lag_s`, `yaw_rate_lag_s` and `turning_point_ahead_m`.
///
/// Made by `SkidSteerVehicle.model`, `from_toml` and `from_dict`. A command is a speed [m/s] and a yaw rate [rad/s]; a
/// state is (x_m, y_m, yaw_rad, speed_mps, yaw_rate_radps) of the rear axle's centre.
#[pyclass(frozen, module = "surefoot")]
#[derive(Clone)]
pub struct SkidSteerModel(pub SkidSteer);

#[pymethods]
impl SkidSteerModel {
    /// From TOML text; `name` stands where errors name the file.
    #[staticmethod]
    #[pyo3(signature = (text, name="model.toml"))]
    fn from_toml(text: &str, name: &str) -> PyResult<Self> {
        Self::checked(Source::of_text(name, text).parse(ConfigText::parse)?)
    }

    /// From a dict of what stands in the file, or a dataclass with such fields, of which those that are None count as absent.
    #[staticmethod]
    #[pyo3(signature = (description: "_Description"))]
    fn from_dict(description: &Bound<'_, PyAny>) -> PyResult<Self> {
        Self::checked(Source::of_description("model", description)?.parse(ConfigText::parse)?)
    }

    /// A dict of what stands in the file.
    fn to_dict<'py>(&self, py: Python<'py>) -> PyResult<Fields<'py>> {
        dict(py, &self.0)
    }

    fn __repr__(&self) -> String {
        let limits = &self.0.limits;
        format!(
            "<surefoot.SkidSteerModel of {} m/s, {} rad/s>",
            limits.speed_max_mps, limits.yaw_rate_max_radps
        )
    }

    fn __eq__(&self, other: &Self) -> bool {
        self.0 == other.0
    }

    fn __reduce__<'py>(&self, py: Python<'py>) -> PyResult<(Bound<'py, PyAny>, (Fields<'py>,))> {
        Ok((py.get_type::<Self>().getattr("from_dict")?, (self.to_dict(py)?,)))
    }
}

impl SkidSteerModel {
    fn checked(model: SkidSteer) -> PyResult<Self> {
        model.validate().map_err(|error| refused_value(format!("model: {error}")))?;
        Ok(Self(model))
    }
}
