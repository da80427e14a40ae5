//! The physical plant with its simulated sensors, driven by commands from Python, alone or many at a time.

mod drive;
mod recording;
mod view;

use std::path::PathBuf;

use numpy::PyUntypedArrayMethods;
use numpy::ndarray::{Ix1, Ix2, Ix3, Ix4};
use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;
use rayon::prelude::*;

use crate::arrays::{array, kind, owned, require_shape, values};
use crate::detached::{BrokenOff, Turns, detached, pool};
use crate::failure::{refused, refused_type};
use crate::ground::Surface;
use crate::settings::dict;
use crate::task::{Task, changed};
use crate::typed::{Array, Fields};
use crate::vehicle::Vehicle;
use drive::{Drive, DriveFault, N_CHANNELS, N_GOAL, N_MEASURED, Settings};
use view::Frame;

/// Names of what is measured beside the ground, in their order.
const STATE_NAMES: [&str; N_MEASURED] = [
    "speed_mps",
    "leftward_speed_mps",
    "yaw_rate_radps",
    "roll_rad",
    "pitch_rad",
    "steering_rad",
    "wheel_speed_mps",
];
/// Names of the layers of the patch of ground, in their order.
const LAYER_NAMES: [&str; N_CHANNELS] = ["relative_height_m", "is_known", "vegetation_height_m", "obstacle"];
/// Sides of a frame [px].
const FRAME_PX: std::ops::RangeInclusive<u32> = 64..=2048;

/// A vehicle in a world: rigid bodies on sprung wheels with brush tyres, a servo that lags, and sensors that lie a little.
///
/// Simulation(vehicle, task, *, seed=1, ground="sensed", settings=None). ground: "sensed", fused into an elevation map from
/// simulated range scans as `surefoot drive` does it, or "true", the world itself, which is cheaper. settings: a dict, TOML
/// text or a path with what differs: control_hz, cycles_per_scan, "rules" (time_limit_s, immobile_m, immobile_s and so on),
/// "odometry", and "patch" (n_rows, n_cols, spacing_m, rear_m: rows ahead, columns to the left). What happens is a function
/// of vehicle, task, seed, settings and commands, bit for bit, for any number of threads. Threads of Python take turns.
/// Raises `ValueError` for a setting out of range and for a start where the vehicle cannot be put.
#[pyclass(frozen, module = "surefoot")]
pub struct Simulation {
    drive: Turns<Drive>,
    settings: Settings,
}

#[pymethods]
impl Simulation {
    /// What the numbers of "state" in an observation are.
    #[classattr]
    const STATE_NAMES: [&'static str; N_MEASURED] = STATE_NAMES;

    /// What the layers of "ground" in an observation are.
    #[classattr]
    const LAYER_NAMES: [&'static str; N_CHANNELS] = LAYER_NAMES;

    #[new]
    #[pyo3(signature = (vehicle, task, *, seed=1, ground="sensed", settings: "_Settings | None" = None))]
    fn new(
        py: Python<'_>,
        vehicle: &Bound<'_, Vehicle>,
        task: &Bound<'_, Task>,
        seed: u64,
        ground: &str,
        settings: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Self> {
        let vehicle = vehicle.get().0.clone();
        let settings = changed(Settings::for_vehicle(&vehicle), settings)?;
        let is_sensed = match ground {
            "sensed" => true,
            "true" => false,
            other => return Err(refused("ground", "\"sensed\" or \"true\"", format!("{other:?}"))),
        };
        let (task, pool) = (task.get().share(), pool()?);
        let made = detached(py, || {
            pool.install(|| {
                let sight = if is_sensed { drive::Sight::Sensed } else { drive::Sight::True };
                Drive::new(vehicle, task, &settings, sight, seed)
            })
        })?;
        Ok(Self { drive: Turns::new(made?), settings })
    }

    /// The settings that a simulation of a vehicle would have, with what differs: a dict.
    #[staticmethod]
    #[pyo3(signature = (vehicle, settings: "_Settings | None" = None))]
    fn settings_for<'py>(
        vehicle: &Bound<'py, Vehicle>,
        settings: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Fields<'py>> {
        let settings = changed(Settings::for_vehicle(&vehicle.get().0), settings)?;
        settings.check_patch()?;
        dict(vehicle.py(), &settings)
    }

    /// How the drive ended, as "goal", "rolled_over", "attitude_limit", "collision", "stuck", "out_of_bounds", "in_water",
    /// "timeout" or "stopped"; None while it goes on.
    #[getter]
    fn outcome(&self, py: Python<'_>) -> PyResult<Option<String>> {
        self.drive.take(py, |drive| drive.outcome())
    }

    /// What is being driven.
    #[getter]
    fn task(&self, py: Python<'_>) -> PyResult<Task> {
        self.drive.take(py, |drive| Task(drive.episode.task().clone()))
    }

    /// Time since the start [s].
    #[getter]
    fn time_s(&self, py: Python<'_>) -> PyResult<f64> {
        self.drive.take(py, |drive| drive.episode.time_s())
    }

    /// Length of a step [s].
    #[getter]
    fn cycle_s(&self, py: Python<'_>) -> PyResult<f64> {
        self.drive.take(py, |drive| drive.episode.cycle_s())
    }

    /// The measured state as `Mppi.decide` takes it: x_m, y_m, yaw_rad, speed_mps, steering_rad.
    #[getter]
    fn state(&self, py: Python<'_>) -> PyResult<(f64, f64, f64, f64, f64)> {
        let state = self.drive.take(py, |drive| drive.episode.observe().odometry.state())?;
        Ok((state.x_m, state.y_m, state.yaw_rad, state.speed_mps, state.steering_rad))
    }

    /// True poses so far, the last one now: float64 (pose, 6), x_m, y_m, z_m, roll_rad, pitch_rad, yaw_rad.
    #[getter]
    fn poses(&self, py: Python<'_>) -> PyResult<Array<f64, Ix2>> {
        let poses = self.drive.take(py, |drive| drive.poses())?;
        let n_poses = poses.len();
        owned(py, poses.into_flattened(), [n_poses, 6])
    }

    /// The ground as it is known now, a copy.
    fn surface(&self, py: Python<'_>) -> PyResult<Surface> {
        self.drive.take(py, |drive| Surface(drive.surveyor.surface().clone()))
    }

    /// The way so far on its ground as a picture: uint8 (row, col, 3), red, green, blue, row 0 in the north. All pictures
    /// of a task have the same size; neither side exceeds side_px, which is from 64 to 2048.
    #[pyo3(signature = (side_px=640))]
    fn frame(&self, py: Python<'_>, side_px: u32) -> PyResult<Array<u8, Ix3>> {
        if !FRAME_PX.contains(&side_px) {
            return Err(refused("side_px", "from 64 to 2048 pixels", side_px));
        }
        let Frame { rgb, shape } = self.drive.take(py, |drive| view::frame(drive, side_px))??;
        owned(py, rgb, shape)
    }

    /// Records from now on into a Foxglove file (.mcap), as `surefoot drive` does: pose, command, decision, drive log, scans,
    /// elevation map, path and goal. A recording under way is finished first. `surefoot.Dataset.from_recording` reads it.
    /// Raises `OSError` where it cannot be written.
    fn record(&self, py: Python<'_>, path: PathBuf) -> PyResult<()> {
        self.drive.take(py, |drive| drive.record(&path))?
    }

    /// Completes the recording; does nothing where there is none.
    fn finish_recording(&self, py: Python<'_>) -> PyResult<()> {
        self.drive.take(py, Drive::finish_recording)?
    }

    /// Its settings as a dict.
    #[getter]
    fn settings<'py>(&self, py: Python<'py>) -> PyResult<Fields<'py>> {
        dict(py, &self.settings)
    }

    fn __repr__(&self, py: Python<'_>) -> PyResult<String> {
        let (time_s, outcome) = self.drive.take(py, |drive| (drive.episode.time_s(), drive.outcome()))?;
        Ok(format!("<surefoot.Simulation at {time_s:.1} s, {}>", outcome.as_deref().unwrap_or("under way")))
    }
}

/// What many simulations measured, one row for each.
#[pyclass(frozen, get_all, module = "surefoot")]
pub struct Observations {
    /// Float32 (simulation, layer, row, col), `Simulation.LAYER_NAMES`: the ground around the vehicle, turned with it; rows go
    /// forward, columns left. Heights are above the mean under the wheels, zero where nothing is known.
    ground: Array<f32, Ix4>,
    /// Float32 (simulation, 7): what is measured of the motion, `Simulation.STATE_NAMES`.
    state: Array<f32, Ix2>,
    /// Float32 (simulation, 2): the goal from the vehicle, forward_m, left_m.
    goal: Array<f32, Ix2>,
    /// Float64 (simulation,): true distance to the goal [m].
    distance_m: Array<f64, Ix1>,
    /// How each drive ended, None while it goes on.
    outcomes: Vec<Option<String>>,
}

/// Steps simulations for one control cycle each, on all cores, and tells what they measure then.
///
/// simulations: a sequence of `Simulation`, of the same patch. commands: float32 (simulation, 2), speed [m/s] and steering
/// angle [rad], each limited by what its vehicle can do; None to look without stepping. A drive that has ended stays as it
/// is. Raises `ValueError` for commands that are not finite; no simulation has moved then.
#[pyfunction(signature = (simulations: "Sequence[Simulation]", commands: "_Float32 | None" = None))]
pub fn step_together(
    py: Python<'_>,
    simulations: &Bound<'_, PyAny>,
    commands: Option<&Bound<'_, PyAny>>,
) -> PyResult<Observations> {
    let simulations = each(simulations)?;
    let commands = commands.map(|commands| read_commands(commands, simulations.len())).transpose()?;
    let shape = simulations[0].get().settings.patch;
    if let Some(other) = simulations.iter().position(|simulation| simulation.get().settings.patch != shape) {
        return Err(refused(&format!("simulations[{other}]"), "the patch of the first", "another"));
    }
    let drives: Vec<&Turns<Drive>> = simulations.iter().map(|simulation| &simulation.get().drive).collect();
    let pool = pool()?;
    let measured = detached(py, || {
        pool.install(|| {
            let step = |(index, drive): (usize, &&Turns<Drive>)| {
                let command = commands.as_ref().map(|commands| commands[index]);
                drive.with(|drive| drive.step(command))
            };
            drives.par_iter().enumerate().map(step).collect::<Result<Vec<_>, BrokenOff>>()
        })
    })??;
    let measured: Vec<drive::Measured> = measured
        .into_iter()
        .enumerate()
        .map(|(index, measured)| measured.map_err(|fault| fault.of(index)))
        .collect::<PyResult<_>>()?;
    Observations::new(py, measured, [shape.n_rows, shape.n_cols])
}

impl Observations {
    fn new(py: Python<'_>, measured: Vec<drive::Measured>, [n_rows, n_cols]: [usize; 2]) -> PyResult<Self> {
        let n = measured.len();
        let mut ground = Vec::with_capacity(n * N_CHANNELS * n_rows * n_cols);
        let (mut state, mut goal) = (Vec::new(), Vec::new());
        let (mut distance_m, mut outcomes) = (Vec::new(), Vec::new());
        for one in measured {
            ground.extend(one.ground);
            state.extend(one.state);
            goal.extend(one.goal_m);
            distance_m.push(one.distance_m);
            outcomes.push(one.outcome);
        }
        Ok(Self {
            ground: owned(py, ground, [n, N_CHANNELS, n_rows, n_cols])?,
            state: owned(py, state, [n, N_MEASURED])?,
            goal: owned(py, goal, [n, N_GOAL])?,
            distance_m: owned(py, distance_m, [n])?,
            outcomes,
        })
    }
}

/// The simulations of a sequence.
fn each<'py>(found: &Bound<'py, PyAny>) -> PyResult<Vec<Bound<'py, Simulation>>> {
    let Ok(items) = found.try_iter() else {
        return Err(refused_type("simulations", "a sequence of Simulation", kind(found)));
    };
    let mut simulations: Vec<Bound<'py, Simulation>> = Vec::new();
    for item in items {
        let item = item?;
        let Ok(simulation) = item.cast::<Simulation>() else {
            let place = format!("simulations[{}]", simulations.len());
            return Err(refused_type(&place, "a Simulation", kind(&item)));
        };
        simulations.push(simulation.clone());
    }
    if simulations.is_empty() {
        return Err(refused("simulations", "at least one", "none"));
    }
    Ok(simulations)
}

fn read_commands(found: &Bound<'_, PyAny>, n: usize) -> PyResult<Vec<[f32; 2]>> {
    let commands = array::<f32, Ix2>("commands", found, "simulation, 2")?;
    require_shape("commands", commands.shape(), &[n, 2])?;
    let commands = values("commands", &commands)?.as_chunks().0.to_vec();
    match commands.iter().flatten().position(|value| !value.is_finite()) {
        Some(index) => {
            let place = format!("commands[{}, {}]", index / 2, index % 2);
            Err(refused(&place, "a finite number", commands.as_flattened()[index]))
        }
        None => Ok(commands),
    }
}

impl DriveFault {
    /// As an exception that tells which simulation it was.
    fn of(&self, index: usize) -> PyErr {
        PyRuntimeError::new_err(format!("simulations[{index}]: {self}"))
    }
}
