//! Surefoot in Python: the module behind the wheel `surefoot`, maps, beliefs and the controller over NumPy arrays, worlds to
//! drive in, and learning. A part of [Surefoot](../cli/index.html).
//!
//! Nothing is computed here. Each class holds an object of the crates below, checks what comes from Python before it
//! reaches them, and hands their results on as arrays; `docs/python.md` is its manual, `python/examples` are its examples.
//!
//! - `arrays`: what may come in as an array and what is said where it may not, and how results become arrays.
//! - `typed`: what type results have in Python, for the stubs, which are generated.
//! - `settings`: TOML text, files and dicts are one thing to the crates, the text that a configuration file holds.
//! - `detached`: work without Python's lock, in threads that survive a fork, whose panics become an exception.
//! - `frames`, `recording`: recordings as tables, maps and clouds.
//! - `drives`, `gap`, `own_simulator`: the diagnosis over drives of Python's; `ground_gap`: of beliefs about the ground.
//! - `command_line`: the command `surefoot` of the wheel.
//! - `running`, `driver`, `pilot`, `keeper`: processes of a run, listened to, directed, given a vehicle and given a planner.
//! - `task`, `simulation`: worlds of `scenarios`, stepped many at a time; `surefoot/environments.py` makes environments of them.
//! - `plug_in`: costs and models that are functions of Python's, behind the traits of `mppi` and `bicycle`.
//! - `failure`: errors as Python's exceptions, with the text that the command line prints.

mod any_model;
mod arrays;
mod belief;
mod command_line;
mod controller;
mod cost_to_go;
mod detached;
mod driver;
mod drives;
mod elevation;
mod failure;
mod frames;
mod gap;
mod ground;
mod ground_gap;
mod keeper;
mod model;
mod own_simulator;
mod pilot;
mod planner;
mod plug_in;
mod recording;
mod risk_map;
mod running;
mod settings;
mod simulation;
mod task;
mod training;
mod typed;
mod vehicle;

/// The module that Python loads; the package `surefoot` gives its names to users.
#[pyo3::pymodule]
mod _native {
    #[pymodule_export]
    use crate::belief::{Evidential, PhysicsPrior};
    #[pymodule_export]
    use crate::command_line::run_command_line;
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
    use crate::driver::Driver;
    #[pymodule_export]
    use crate::elevation::{ElevationMap, FuseReport};
    #[pymodule_export]
    use crate::failure::Defect;
    #[pymodule_export]
    use crate::gap::{GapReport, apply, diagnose, manoeuvre};
    #[pymodule_export]
    use crate::ground::Surface;
    #[pymodule_export]
    use crate::ground_gap::{GroundReport, ground};
    #[pymodule_export]
    use crate::model::{Model, SkidSteerModel};
    #[pymodule_export]
    use crate::pilot::{Cycle, Pilot};
    #[pymodule_export]
    use crate::plug_in::{PythonModel, SampledRollouts};
    #[pymodule_export]
    use crate::recording::{RecordedMessages, Recording, open_python};
    #[pymodule_export]
    use crate::risk_map::RiskMap;
    #[pymodule_export]
    use crate::running::{Run, attach};
    #[pymodule_export]
    use crate::settings::settings_for;
    #[pymodule_export]
    use crate::simulation::{Observations, Simulation, step_together};
    #[pymodule_export]
    use crate::task::Task;
    #[pymodule_export]
    use crate::training::{Dataset, Training, train};
    #[pymodule_export]
    use crate::vehicle::{SkidSteerVehicle, Vehicle};
}
