//! A simulator of the user's own, which is asked in this process.

use std::cell::RefCell;

use numpy::IntoPyArray;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use sim_to_real::{Knob, Motion, RunMemory, SimulatorDescription, SimulatorRun};

use crate::arrays::kind;
use crate::failure::{refused_type, refused_value};

/// What a motion may tell besides.
const SIDE_SPEED: &str = "side_speed_mps";

/// A callable that makes motions of runs, with what it says of itself.
pub struct OwnSimulator<'py> {
    callable: Bound<'py, PyAny>,
    pub description: SimulatorDescription,
    memory: RefCell<RunMemory>,
}

impl<'py> OwnSimulator<'py> {
    /// A callable; `name`, `stochastic` and `knobs` are its attributes, where it has them.
    ///
    /// # Errors
    /// `TypeError` for anything that cannot be called or says of itself what is none, `ValueError` for knobs that cannot be.
    pub fn new(callable: &Bound<'py, PyAny>) -> PyResult<Self> {
        if !callable.is_callable() {
            return Err(refused_type("simulator", "a callable that takes a run", kind(callable)));
        }
        let attribute = |name: &str| -> PyResult<Option<Bound<'py, PyAny>>> {
            if callable.hasattr(name)? { callable.getattr(name).map(Some) } else { Ok(None) }
        };
        let named = match attribute("name")? {
            Some(name) => Some(name),
            None => attribute("__name__")?,
        };
        let told = |what: &str, found: &Bound<'py, PyAny>, expected: &str| {
            refused_type(&format!("simulator.{what}"), expected, kind(found))
        };
        let name = match named {
            Some(name) => name.extract().map_err(|_| told("name", &name, "a word"))?,
            None => callable.get_type().name()?.to_string(),
        };
        let stochastic = match attribute("stochastic")? {
            Some(found) => found.extract().map_err(|_| told("stochastic", &found, "a bool"))?,
            None => false,
        };
        let knobs = match attribute("knobs")? {
            Some(found) => knobs(&found)?,
            None => Vec::new(),
        };
        let description = SimulatorDescription { name, stochastic, knobs };
        description.validate().map_err(|error| refused_value(format!("simulator: {error}")))?;
        Ok(Self { callable: callable.clone(), description, memory: RefCell::default() })
    }

    /// The motion of every run in their order; no run is made twice.
    ///
    /// # Errors
    /// What the callable raises; what it returns is no motion; a signal whose handler raised.
    pub fn run(&self, runs: &[SimulatorRun]) -> PyResult<Vec<Motion>> {
        self.memory.borrow_mut().recall(runs, |missing| missing.iter().map(|run| self.motion(run)).collect())
    }

    fn motion(&self, run: &SimulatorRun) -> PyResult<Motion> {
        self.callable.py().check_signals()?;
        let answer = self.callable.call1((asked(self.callable.py(), run)?,))?;
        let column = |name: &str| -> PyResult<Vec<f64>> {
            let place = format!("simulator: motion['{name}']");
            let values = answer
                .get_item(name)
                .map_err(|_| refused_type("simulator", format!("a dict with '{name}'"), kind(&answer)))?;
            let values = self.callable.py().import("numpy")?.call_method1("asarray", (values, "float64"));
            let extracted = values.and_then(|values| values.extract());
            extracted.map_err(|error| refused_type(&place, "numbers", error))
        };
        let motion = Motion {
            x_m: column("x_m")?,
            y_m: column("y_m")?,
            yaw_rad: column("yaw_rad")?,
            speed_mps: column("speed_mps")?,
            yaw_rate_radps: column("yaw_rate_radps")?,
            side_speed_mps: answer.contains(SIDE_SPEED)?.then(|| column(SIDE_SPEED)).transpose()?,
        };
        motion.checked(run.n_rows()).map_err(|told| refused_value(format!("simulator: motion: {told}")))
    }
}

fn knobs(found: &Bound<'_, PyAny>) -> PyResult<Vec<Knob>> {
    let told = || {
        refused_type("simulator.knobs", "a list of dicts with name, unit, low, high and default", kind(found))
    };
    let knob = |knob: Bound<'_, PyAny>| -> PyResult<Knob> {
        let of = |name: &str| knob.get_item(name).map_err(|_| told());
        Ok(Knob {
            name: of("name")?.extract().map_err(|_| told())?,
            unit: of("unit")?.extract().map_err(|_| told())?,
            low: of("low")?.extract().map_err(|_| told())?,
            high: of("high")?.extract().map_err(|_| told())?,
            default: of("default")?.extract().map_err(|_| told())?,
        })
    };
    found.try_iter().map_err(|_| told())?.map(|own| knob(own?)).collect()
}

/// A run as the protocol tells it, with arrays for lists.
fn asked<'py>(py: Python<'py>, run: &SimulatorRun) -> PyResult<Bound<'py, PyDict>> {
    let SimulatorRun {
        start,
        step_s,
        command_speed_mps,
        command_steering_rad,
        slope_ahead,
        slope_left,
        terrain_class,
        seed,
        knobs,
    } = run;
    let dict = PyDict::new(py);
    let began = PyDict::new(py);
    let values = [
        ("x_m", start.x_m),
        ("y_m", start.y_m),
        ("yaw_rad", start.yaw_rad),
        ("speed_mps", start.speed_mps),
        ("yaw_rate_radps", start.yaw_rate_radps),
    ];
    values.iter().try_for_each(|(name, value)| began.set_item(name, value))?;
    dict.set_item("start", began)?;
    dict.set_item("step_s", step_s)?;
    let lists = [
        ("command_speed_mps", command_speed_mps),
        ("command_steering_rad", command_steering_rad),
        ("slope_ahead", slope_ahead),
        ("slope_left", slope_left),
    ];
    lists.iter().try_for_each(|(name, values)| dict.set_item(name, (*values).clone().into_pyarray(py)))?;
    dict.set_item("terrain_class", terrain_class.clone().into_pyarray(py))?;
    dict.set_item("seed", seed)?;
    dict.set_item("knobs", knobs.clone())?;
    Ok(dict)
}
