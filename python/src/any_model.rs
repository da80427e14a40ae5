//! A model of whatever kind, and the controller that drives it.

use bicycle::{MotionCommand, MotionLimits, MotionModel, SkidSteerCommand};
use mppi::{Config, Controller, Driven};
use pyo3::inspect::PyStaticExpr;
use pyo3::prelude::*;
use pyo3::{PyTypeInfo, type_hint_union};

use crate::arrays::kind;
use crate::failure::refused_type;
use crate::model::{Model, SkidSteerModel};
use crate::planner::Planner;
use crate::plug_in::{Called, PythonCost, PythonModel, PythonMotion};

/// A model, however its vehicle is steered.
pub enum AnyModel {
    /// By its front wheels.
    Steered(Model),
    /// By its sides.
    SkidSteered(SkidSteerModel),
    /// By its front wheels, as a function of Python's says.
    Python(PythonMotion),
}

impl<'py> FromPyObject<'_, 'py> for AnyModel {
    type Error = PyErr;

    const INPUT_TYPE: PyStaticExpr =
        type_hint_union!(Model::TYPE_HINT, SkidSteerModel::TYPE_HINT, PythonModel::TYPE_HINT);

    fn extract(found: Borrowed<'_, 'py, PyAny>) -> PyResult<Self> {
        if let Ok(model) = found.cast::<Model>() {
            return Ok(Self::Steered(model.get().clone()));
        }
        if let Ok(model) = found.cast::<PythonModel>() {
            return Ok(Self::Python(model.get().motion(found.py())));
        }
        let model = found.cast::<SkidSteerModel>();
        let expected = "a Model, a SkidSteerModel or a PythonModel";
        let model = model.map_err(|_| refused_type("model", expected, kind(&found)))?;
        Ok(Self::SkidSteered(model.get().clone()))
    }
}

impl AnyModel {
    /// What its vehicle can or may do.
    pub fn limits(&self) -> MotionLimits {
        match self {
            Self::Steered(model) => model.0.motion_limits(),
            Self::SkidSteered(model) => model.0.motion_limits(),
            Self::Python(model) => model.model.motion_limits(),
        }
    }

    pub fn planner(
        self,
        config: Config,
        cost: Option<Called>,
        seed: u64,
    ) -> Result<Box<dyn Planner>, mppi::ConfigError> {
        match self {
            Self::Steered(model) => planner_of(config, model.0, cost, seed),
            Self::SkidSteered(model) => planner_of(config, model.0, cost, seed),
            Self::Python(model) => planner_of(config, model, cost, seed),
        }
    }

    /// What of it is Python's.
    pub fn called(&self) -> Option<Called> {
        match self {
            Self::Python(model) => Some(model.called.clone()),
            Self::Steered(_) | Self::SkidSteered(_) => None,
        }
    }

    pub fn turn_name(&self) -> &'static str {
        match self {
            Self::Steered(_) | Self::Python(_) => "steering_rad",
            Self::SkidSteered(_) => "yaw_rate_radps",
        }
    }

    /// What is told to stand still who was told `last` before.
    pub fn at_standstill(&self) -> fn([f32; 2]) -> [f32; 2] {
        match self {
            Self::Steered(_) | Self::Python(_) => |last| bicycle::Command::from(last).at_standstill().into(),
            Self::SkidSteered(_) => |last| SkidSteerCommand::from(last).at_standstill().into(),
        }
    }
}

/// The controller of a model, with a cost of Python's or without.
fn planner_of<M: Driven>(
    config: Config,
    model: M,
    cost: Option<Called>,
    seed: u64,
) -> Result<Box<dyn Planner>, mppi::ConfigError> {
    Ok(match cost {
        None => Box::new(Controller::new(config, model, seed)?),
        Some(cost) => Box::new(Controller::with_costs(config, model, ((), PythonCost(cost)), seed)?),
    })
}
