//! Surefoot in Python: the module behind the wheel `surefoot`, maps, beliefs and the controller over NumPy arrays. A part
//! of [Surefoot](../cli/index.html).
//!
//! Nothing is computed here. Each class holds an object of the crates below, checks what comes from Python before it
//! reaches them, and hands their results on as arrays; `docs/python.md` is its manual, `python/examples` are its examples.
//!
//! - `arrays`: what may come in as an array and what is said where it may not, and how results become arrays.
//! - `settings`: TOML text, files and dicts are one thing to the crates, the text that a configuration file holds.
//! - `detached`: work without Python's lock, in threads that survive a fork, whose panics become an exception.
//! - `failure`: errors as Python's exceptions, with the text that the command line prints.

mod arrays;
mod belief;
mod controller;
mod cost_to_go;
mod detached;
mod elevation;
mod failure;
mod ground;
mod model;
mod planner;
mod risk_map;
mod settings;
mod vehicle;

/// The module that Python loads; the package `surefoot` gives its names to users.
#[pyo3::pymodule]
mod _native {
    #[pymodule_export]
    use crate::belief::{Evidential, PhysicsPrior};
    #[pymodule_export]
    use crate::controller::{Decision, Mppi, Rollouts};
    #[pymodule_export]
    use crate::cost_to_go::CostToGo;
    #[pymodule_export]
    use crate::detached::note_fork;
    #[cfg(debug_assertions)]
    #[pymodule_export]
    use crate::detached::provoke_defect;
    #[pymodule_export]
    use crate::elevation::{ElevationMap, FuseReport};
    #[pymodule_export]
    use crate::failure::Defect;
    #[pymodule_export]
    use crate::ground::Surface;
    #[pymodule_export]
    use crate::model::{Model, SkidSteerModel};
    #[pymodule_export]
    use crate::risk_map::RiskMap;
    #[pymodule_export]
    use crate::settings::settings_for;
    #[pymodule_export]
    use crate::vehicle::{SkidSteerVehicle, Vehicle};
}
