//! Descriptions of vehicles.

use bicycle::Geometry;
use formats::{
    parse_skid_steer_vehicle, parse_vehicle, read_skid_steer_vehicle, read_vehicle, shipped_vehicle_names,
};
use navigator::Config;
use pyo3::inspect::PyStaticExpr;
use pyo3::prelude::*;
use pyo3::{PyTypeInfo, type_hint_union};

use crate::arrays::kind;
use crate::failure::{refused_config, refused_type};
use crate::model::{Model, SkidSteerModel};
use crate::settings::{Source, dict};
use crate::typed::Fields;

/// A vehicle with four wheels that steers the front ones, as a file `vehicle.toml` describes it.
///
/// Vehicle(source): the name of one that ships with surefoot (`Vehicle.SHIPPED`) or the path of a TOML file, as a string
/// on the command line. See also `from_toml` and `from_dict`. Lengths in metres, angles in radians, masses in kilograms.
/// Raises `FileNotFoundError`, and `ValueError` with file, line and field for what no vehicle can have.
#[pyclass(frozen, module = "surefoot")]
pub struct Vehicle(pub bicycle::Vehicle);

#[pymethods]
impl Vehicle {
    /// Names of the vehicles that ship with surefoot.
    #[classattr]
    #[pyo3(name = "SHIPPED")]
    fn shipped() -> Vec<&'static str> {
        shipped_vehicle_names().collect()
    }

    #[new]
    fn new(name_or_path: &str) -> PyResult<Self> {
        read_vehicle(name_or_path).map(Self).map_err(refused_config)
    }

    /// From TOML text; `name` stands where errors name the file.
    #[staticmethod]
    #[pyo3(signature = (text, name="vehicle.toml"))]
    fn from_toml(text: &str, name: &str) -> PyResult<Self> {
        Source::of_text(name, text).parse(parse_vehicle).map(Self)
    }

    /// From a dict of what stands in the file, or a dataclass with such fields, of which those that are None count as absent.
    #[staticmethod]
    #[pyo3(signature = (description: "_Description"))]
    fn from_dict(description: &Bound<'_, PyAny>) -> PyResult<Self> {
        Source::of_description("vehicle", description)?.parse(parse_vehicle).map(Self)
    }

    /// A dict of what stands in the file.
    fn to_dict<'py>(&self, py: Python<'py>) -> PyResult<Fields<'py>> {
        dict(py, &self.0)
    }

    /// What it is called, for reports.
    #[getter]
    fn name(&self) -> &str {
        &self.0.name
    }

    /// What a controller believes of it unless told otherwise: wheelbase and limits, no effects.
    fn model(&self) -> Model {
        Model(bicycle::Model::of(&self.0))
    }

    fn __repr__(&self) -> String {
        format!("<surefoot.Vehicle {}>", self.0.name)
    }

    fn __eq__(&self, other: &Self) -> bool {
        self.0 == other.0
    }

    fn __reduce__<'py>(&self, py: Python<'py>) -> PyResult<(Bound<'py, PyAny>, (Fields<'py>,))> {
        Ok((py.get_type::<Self>().getattr("from_dict")?, (self.to_dict(py)?,)))
    }
}

/// A skid-steered vehicle: `name`, `[geometry]`, and in `[model]` what its drives can do.
///
/// SkidSteerVehicle(source): "warthog" or the path of a TOML file. Otherwise as `Vehicle`.
#[pyclass(frozen, module = "surefoot")]
pub struct SkidSteerVehicle(pub bicycle::SkidSteerVehicle);

#[pymethods]
impl SkidSteerVehicle {
    #[new]
    fn new(name_or_path: &str) -> PyResult<Self> {
        read_skid_steer_vehicle(name_or_path).map(Self).map_err(refused_config)
    }

    /// From TOML text; `name` stands where errors name the file.
    #[staticmethod]
    #[pyo3(signature = (text, name="vehicle.toml"))]
    fn from_toml(text: &str, name: &str) -> PyResult<Self> {
        Source::of_text(name, text).parse(parse_skid_steer_vehicle).map(Self)
    }

    /// From a dict of what stands in the file, or a dataclass with such fields, of which those that are None count as absent.
    #[staticmethod]
    #[pyo3(signature = (description: "_Description"))]
    fn from_dict(description: &Bound<'_, PyAny>) -> PyResult<Self> {
        Source::of_description("vehicle", description)?.parse(parse_skid_steer_vehicle).map(Self)
    }

    /// A dict of what stands in the file.
    fn to_dict<'py>(&self, py: Python<'py>) -> PyResult<Fields<'py>> {
        dict(py, &self.0)
    }

    /// What it is called, for reports.
    #[getter]
    fn name(&self) -> &str {
        &self.0.name
    }

    /// What a controller believes of it.
    fn model(&self) -> SkidSteerModel {
        SkidSteerModel(self.0.model.clone())
    }

    fn __repr__(&self) -> String {
        format!("<surefoot.SkidSteerVehicle {}>", self.0.name)
    }

    fn __eq__(&self, other: &Self) -> bool {
        self.0 == other.0
    }

    fn __reduce__<'py>(&self, py: Python<'py>) -> PyResult<(Bound<'py, PyAny>, (Fields<'py>,))> {
        Ok((py.get_type::<Self>().getattr("from_dict")?, (self.to_dict(py)?,)))
    }
}

/// A vehicle, however it is steered.
pub enum AnyVehicle<'py> {
    /// By its front wheels.
    Steered(Bound<'py, Vehicle>),
    /// By its sides.
    SkidSteered(Bound<'py, SkidSteerVehicle>),
}

impl<'py> FromPyObject<'_, 'py> for AnyVehicle<'py> {
    type Error = PyErr;

    const INPUT_TYPE: PyStaticExpr = type_hint_union!(Vehicle::TYPE_HINT, SkidSteerVehicle::TYPE_HINT);

    fn extract(found: Borrowed<'_, 'py, PyAny>) -> PyResult<Self> {
        if let Ok(vehicle) = found.cast::<Vehicle>() {
            return Ok(Self::Steered(vehicle.to_owned()));
        }
        let vehicle = found.cast::<SkidSteerVehicle>();
        let vehicle =
            vehicle.map_err(|_| refused_type("vehicle", "a Vehicle or a SkidSteerVehicle", kind(&found)))?;
        Ok(Self::SkidSteered(vehicle.to_owned()))
    }
}

impl AnyVehicle<'_> {
    /// Its lengths.
    pub fn geometry(&self) -> &Geometry {
        match self {
            Self::Steered(vehicle) => &vehicle.get().0.geometry,
            Self::SkidSteered(vehicle) => &vehicle.get().0.geometry,
        }
    }

    /// Settings that fit it.
    pub fn config(&self) -> Config {
        match self {
            Self::Steered(vehicle) => Config::for_vehicle(&vehicle.get().0),
            Self::SkidSteered(vehicle) => {
                let vehicle = &vehicle.get().0;
                Config::for_geometry(&vehicle.geometry, vehicle.model.limits.speed_max_mps)
            }
        }
    }
}
