//! Learning from drives: footprints with what was measured on them, and networks that are fitted to them.

use std::ops::ControlFlow;
use std::path::PathBuf;

use bench::collection::{CollectionError, Place, Recorded, Request, collect, collect_recorded};
use evidential::{Epoch, Method, Settings, TrainError, TrainingEnd};
use formats::{DriveFileError, DriveLogFileError, McapReadError, read_drive};
use numpy::ndarray::{Ix1, Ix2};
use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict};
use scenarios::{RockFieldConfig, Split, WorldLayers};

use crate::arrays::{kind, owned};
use crate::detached::{detached, pool};
use crate::failure::{refused, refused_by_system, refused_type, refused_value};
use crate::settings::dict;
use crate::task::{Task, changed, layers};
use crate::typed::Array;
use crate::vehicle::Vehicle;

/// Footprints of a vehicle's drives, with what was measured on them: what networks learn from.
///
/// Made by `Dataset.from_recording`, `Dataset.collect`, and `Dataset.from_bytes` of a file that `surefoot collect` wrote.
#[pyclass(frozen, module = "surefoot")]
pub struct Dataset(evidential::Dataset);

#[pymethods]
impl Dataset {
    /// Of a drive that was recorded.
    ///
    /// log: the path of a drive log, a recording (.mcap) or CSV, whose poses lie in the frame of the ground. ground: the `Task`
    /// that was driven, a `Surface`, or the path of an elevation file. Raises `ValueError` where ground is known under less
    /// than half of the drive, or nothing can be labelled; `OSError` for a file that cannot be read.
    #[staticmethod]
    #[pyo3(signature = (vehicle, log, ground: "Task | Surface | _Path"))]
    fn from_recording(
        py: Python<'_>,
        vehicle: &Bound<'_, Vehicle>,
        log: PathBuf,
        ground: &Bound<'_, PyAny>,
    ) -> PyResult<Self> {
        let (name, layers) = match ground.cast::<Task>() {
            Ok(task) => {
                let world = &task.get().0.world;
                (world.name.clone(), WorldLayers::bare(world.heights.clone()))
            }
            Err(_) => layers(ground)?,
        };
        let source = Recorded { log: log.display().to_string(), ground: name };
        let vehicle = &vehicle.get().0;
        let drive = detached(py, || read_drive(&log))?.map_err(refused_drive)?.log;
        let pool = pool()?;
        let gathered = detached(py, || pool.install(|| collect_recorded(vehicle, drive, &layers, &source)))?;
        Ok(Self(gathered.map_err(refused_collection)?.dataset))
    }

    /// Of simulated drives over generated ground, with steering that swings from side to side, until the vehicle rolls over,
    /// is stuck or leaves the map, as `surefoot collect` does it.
    ///
    /// world: "testbed" or "rocks", rock fields, "arena", or "floor", which is level. split: "train", "validation" or "test".
    /// On all cores; the result does not depend on how many.
    #[staticmethod]
    #[pyo3(signature = (vehicle, world="testbed", split="train", *, n_maps=10, n_trials=20, time_limit_s=40.0, seed=1))]
    #[expect(clippy::too_many_arguments, reason = "keywords in Python")]
    fn collect(
        py: Python<'_>,
        vehicle: &Bound<'_, Vehicle>,
        world: &str,
        split: &str,
        n_maps: u32,
        n_trials: u32,
        time_limit_s: f64,
        seed: u64,
    ) -> PyResult<Self> {
        let place = place(world, split)?;
        let n_threads = pool()?.current_num_threads();
        let usual = Request::new(vehicle.get().0.clone(), place, seed);
        let request = Request { n_maps, n_trials, time_limit_s, n_threads, ..usual };
        let collected = detached(py, || collect(&request, || ()))?;
        Ok(Self(collected.map_err(refused_collection)?.dataset))
    }

    /// From a file's bytes.
    #[staticmethod]
    fn from_bytes(bytes: &[u8]) -> PyResult<Self> {
        evidential::Dataset::from_bytes(bytes).map(Self).map_err(refused_value)
    }

    /// The bytes of a file, which `surefoot train` reads too.
    fn to_bytes<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyBytes>> {
        self.0.to_bytes().map(|bytes| PyBytes::new(py, &bytes)).map_err(refused_value)
    }

    fn __reduce__<'py>(&self, py: Python<'py>) -> PyResult<(Bound<'py, PyAny>, (Bound<'py, PyBytes>,))> {
        Ok((py.get_type::<Self>().getattr("from_bytes")?, (self.to_bytes(py)?,)))
    }

    /// The examples of both. Raises `ValueError` for another vehicle.
    fn joined(&self, other: &Self) -> PyResult<Self> {
        self.0.clone().joined(other.0.clone()).map(Self).map_err(refused_value)
    }

    /// The examples on ground up to an unevenness [m]: what is to count as familiar.
    fn even(&self, unevenness_max_m: f32) -> PyResult<Self> {
        let mut dataset = self.0.clone();
        dataset.examples.retain(|example| example.unevenness_m <= unevenness_max_m);
        dataset.validate().map_err(refused_value)?;
        Ok(Self(dataset))
    }

    /// What was measured: float32 (example, 4), linear and angular traction, |roll|, |pitch| [rad]; NaN where it means
    /// nothing.
    #[getter]
    fn measured(&self, py: Python<'_>) -> PyResult<Array<f32, Ix2>> {
        let values = self.0.examples.iter().flat_map(|example| example.measured).collect();
        owned(py, values, [self.0.examples.len(), 4])
    }

    /// Where: float64 (example, 3), x_m, y_m, yaw_rad.
    #[getter]
    fn poses(&self, py: Python<'_>) -> PyResult<Array<f64, Ix2>> {
        let values = self.0.examples.iter().flat_map(|example| example.pose).collect();
        owned(py, values, [self.0.examples.len(), 3])
    }

    /// How uneven the ground is [m]: float32 (example,), standard deviation of its height.
    #[getter]
    fn unevenness_m(&self, py: Python<'_>) -> PyResult<Array<f32, Ix1>> {
        let values = self.0.examples.iter().map(|example| example.unevenness_m).collect();
        owned(py, values, [self.0.examples.len()])
    }

    fn __len__(&self) -> usize {
        self.0.examples.len()
    }

    fn __repr__(&self) -> String {
        let (n, drives) = (self.0.examples.len(), self.0.origin.drives.len());
        format!("<surefoot.Dataset of {n} examples of {drives} drives, {}>", self.0.origin.vehicle)
    }
}

/// What a training came to.
#[pyclass(frozen, get_all, module = "surefoot")]
pub struct Training {
    /// The networks, for `Evidential.from_bytes`; as weights.safetensors of `surefoot train`.
    weights: Py<PyBytes>,
    /// What belongs to them; as weights.json.
    sidecar: Py<PyBytes>,
    /// One dict for each pass over the data: phase, epoch, training_loss, validation_error, is_best.
    curves: Vec<Py<PyDict>>,
    /// EMD2 on the validation data of linear and angular traction, |roll| and |pitch|.
    validation_emd2: [f64; 4],
}

/// Fits networks to a dataset; the same data and settings give the same networks, bit for bit.
///
/// dataset, validation: `Dataset`, of drives of their own. method: "pietra", "evora", "physics-informed" or "vanilla". settings:
/// a dict, TOML text or a path with what differs: seed, epochs_max, patience, batch, learning_rate, encoder_hidden and so
/// on. progress: a function that is called with the dict of every pass; what it raises ends the training and comes out.
/// Works on one thread. Raises `ValueError` for data that nothing can be learned from and for settings out of range.
#[pyfunction(signature = (dataset, validation, method="pietra", settings: "_Settings | None" = None, *, progress: "Callable[[dict[str, Any]], object] | None" = None))]
pub fn train(
    py: Python<'_>,
    dataset: &Bound<'_, Dataset>,
    validation: &Bound<'_, Dataset>,
    method: &str,
    settings: Option<&Bound<'_, PyAny>>,
    progress: Option<&Bound<'_, PyAny>>,
) -> PyResult<Training> {
    let settings: Settings = changed(Settings::new(method_of(method)?, 1), settings)?;
    if let Some(progress) = progress.filter(|progress| !progress.is_callable()) {
        return Err(refused_type("progress", "a function of a dict", kind(progress)));
    }
    let progress = progress.map(|progress| progress.clone().unbind());
    let (training, validation) = (&dataset.get().0, &validation.get().0);
    let mut fault = None;
    let trained = detached(py, || {
        evidential::train(training, validation, &settings, env!("CARGO_PKG_VERSION"), &mut |epoch| {
            match Python::attach(|py| told(py, progress.as_ref(), epoch)) {
                Ok(()) => ControlFlow::Continue(()),
                Err(error) => {
                    fault = Some(error);
                    ControlFlow::Break(())
                }
            }
        })
    })?;
    match fault {
        Some(fault) => Err(fault),
        None => Training::new(py, trained.map_err(refused_training)?),
    }
}

impl Training {
    fn new(py: Python<'_>, outcome: evidential::Outcome) -> PyResult<Self> {
        if outcome.end == TrainingEnd::Interrupted {
            return Err(PyRuntimeError::new_err("train: expected to come to an end, was broken off"));
        }
        let weights = outcome.checkpoint.weights_bytes().map_err(refused_value)?;
        let sidecar = outcome.checkpoint.sidecar_bytes().map_err(refused_value)?;
        let curves: PyResult<Vec<_>> =
            outcome.curves.iter().map(|epoch| dict(py, epoch).map(|fields| fields.0.unbind())).collect();
        Ok(Self {
            weights: PyBytes::new(py, &weights).unbind(),
            sidecar: PyBytes::new(py, &sidecar).unbind(),
            curves: curves?,
            validation_emd2: outcome.validation_emd2,
        })
    }
}

/// Tells of a pass, and lets a key that was pressed meanwhile interrupt.
fn told(py: Python<'_>, progress: Option<&Py<PyAny>>, epoch: &Epoch) -> PyResult<()> {
    py.check_signals()?;
    match progress {
        Some(progress) => progress.call1(py, (dict(py, epoch)?,)).map(|_| ()),
        None => Ok(()),
    }
}

fn method_of(name: &str) -> PyResult<Method> {
    let names = Method::ALL.map(Method::name).join(", ");
    let found = Method::ALL.into_iter().find(|known| known.name() == name);
    found.ok_or_else(|| refused("method", format!("one of {names}"), format!("{name:?}")))
}

fn place(world: &str, split: &str) -> PyResult<Place> {
    let split = match split {
        "train" => Split::Train,
        "validation" => Split::Validation,
        "test" => Split::Test,
        other => {
            return Err(refused("split", "\"train\", \"validation\" or \"test\"", format!("{other:?}")));
        }
    };
    match world {
        "testbed" => Ok(Place::Rocks { field: RockFieldConfig::testbed(), split }),
        "rocks" => Ok(Place::Rocks { field: RockFieldConfig::default(), split }),
        "arena" => Ok(Place::Arena { split }),
        "floor" => Ok(Place::Floor { split }),
        other => {
            Err(refused("world", "\"testbed\", \"rocks\", \"arena\" or \"floor\"", format!("{other:?}")))
        }
    }
}

/// What the file system said is an `OSError`, all else a `ValueError`.
fn refused_drive(error: DriveFileError) -> PyErr {
    let text = error.to_string();
    match error {
        DriveFileError::Csv(DriveLogFileError::Unreadable { source, .. })
        | DriveFileError::Mcap(McapReadError::Unreadable { source, .. }) => {
            refused_by_system(source.kind(), text)
        }
        _ => refused_value(text),
    }
}

/// What the plant or the system did is no choice of the caller's.
fn refused_collection(error: CollectionError) -> PyErr {
    match error {
        CollectionError::Episode { .. } | CollectionError::Threads(_) => {
            PyRuntimeError::new_err(error.to_string())
        }
        other => refused_value(other),
    }
}

/// Data and settings are the caller's choice, all else is not.
fn refused_training(error: TrainError) -> PyErr {
    match error {
        TrainError::Settings(_)
        | TrainError::Data { .. }
        | TrainError::OneClass { .. }
        | TrainError::Mismatch { .. } => refused_value(error),
        other => PyRuntimeError::new_err(other.to_string()),
    }
}
