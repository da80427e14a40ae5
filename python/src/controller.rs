//! The controller.

use bicycle::Decision as Decided;
use mppi::{Config, Objective, ReferencePath, Terminal};
use numpy::PyUntypedArrayMethods;
use numpy::ndarray::{Ix1, Ix2, Ix3};
use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;
use toml::Value;

use crate::any_model::AnyModel;
use crate::arrays::{array, kind, numbers, owned, require_shape, values};
use crate::cost_to_go::CostToGo;
use crate::detached::{BrokenOff, Turns, detached, forked, n_forks};
use crate::failure::{refused, refused_controller, refused_type};
use crate::planner::{Cycle, N_STATE, Outcome, Planner};
use crate::plug_in::{Called, is_within};
use crate::risk_map::RiskMap;
use crate::settings::{Source, dict};
use crate::typed::{Array, Fields};

/// Model predictive path integral control over a risk map (Williams et al. 2017).
///
/// Mppi(model, settings=None, *, seed=1, cost=None). model: `Model`, `SkidSteerModel` or `PythonModel`. settings: a dict, TOML
/// text or a path with what differs from the defaults, as the part "controller" of `settings_for(vehicle)`. A decision is a
/// function of the calls before it, settings and seed, bit for bit, for any number of threads. Threads of Python take turns.
/// Raises `ValueError` for a setting out of range, with its name, range and value.
///
/// cost: a function of your own, for trying out, called once per update with all `SampledRollouts`; it returns what they cost
/// more [s], float32 or float64 (rollout, step), of which the steps before the goal count, or (rollout,). Infinity is for
/// what may not be; NaN, another shape and what the function raises come out of `decide`, whose plan then goes without.
/// It must not call a controller.
#[pyclass(frozen, module = "surefoot")]
pub struct Mppi {
    run: Turns<Run>,
    config: Config,
    state_names: [&'static str; N_STATE],
    /// What of Python's it calls.
    called: Vec<Called>,
    born: u64,
}

/// A controller and what it needs to be told from one cycle to the next.
struct Run {
    /// Nothing once its threads are gone, which nobody could wait for.
    planner: Option<Box<dyn Planner>>,
    at_standstill: fn([f32; 2]) -> [f32; 2],
    told: [f32; 2],
    cycle: u64,
    has_sampled: bool,
}

#[pymethods]
impl Mppi {
    #[new]
    #[pyo3(signature = (
        model,
        settings: "_Settings | None" = None,
        *,
        seed=1,
        cost: "Callable[[SampledRollouts], _Answer] | None" = None,
    ))]
    fn new(
        py: Python<'_>,
        model: AnyModel,
        settings: Option<&Bound<'_, PyAny>>,
        seed: u64,
        cost: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Self> {
        if let Some(cost) = cost.filter(|cost| !cost.is_callable()) {
            return Err(refused_type("cost", "a function of rollouts", kind(cost)));
        }
        let cost = cost.map(|cost| Called::new(cost.clone().unbind()));
        let called: Vec<Called> = cost.iter().cloned().chain(model.called()).collect();
        let config: Config = match settings {
            Some(settings) => Source::new("settings", settings)?.parse(formats::ConfigText::parse)?,
            None => Config::default(),
        };
        let state_names = ["x_m", "y_m", "yaw_rad", "speed_mps", model.turn_name()];
        let at_standstill = model.at_standstill();
        let planner =
            detached(py, || model.planner(config.clone(), cost, seed))?.map_err(refused_controller)?;
        require_no_fault(&called)?;
        let run = Run { planner: Some(planner), at_standstill, told: [0.0; 2], cycle: 0, has_sampled: false };
        Ok(Self { run: Turns::new(run), config, state_names, called, born: n_forks() })
    }

    /// Decides what to do now to reach a point.
    ///
    /// state: five numbers, see `state_names`, of the rear axle's centre in the map frame. risk_map: `RiskMap` around the
    /// vehicle. goal_m: two numbers, x_m, y_m. tolerance_m: distance at which the goal counts as reached. cost_to_go:
    /// `CostToGo` to this goal, in place of the straight line from the end of the horizon. elapsed_s: time since the last
    /// decision; None stands for nothing on the first and for a step of the horizon on all others. Numbers that are not
    /// finite, a map without the vehicle, no feasible future: such a cycle gives a decision to stop with its reason and
    /// raises nothing.
    #[pyo3(signature = (
        state: "_Floats",
        risk_map,
        goal_m: "_Floats",
        *,
        tolerance_m=0.5,
        cost_to_go=None,
        elapsed_s=None,
    ))]
    #[expect(clippy::too_many_arguments, reason = "keywords in Python")]
    fn decide(
        &self,
        py: Python<'_>,
        state: &Bound<'_, PyAny>,
        risk_map: &Bound<'_, RiskMap>,
        goal_m: &Bound<'_, PyAny>,
        tolerance_m: f64,
        cost_to_go: Option<&Bound<'_, CostToGo>>,
        elapsed_s: Option<f64>,
    ) -> PyResult<Decision> {
        let state = numbers("state", state, self.state_names)?;
        let goal_m = numbers("goal_m", goal_m, ["x_m", "y_m"])?;
        let field = cost_to_go.map(|field| &field.get().field);
        self.cycle(py, state, risk_map.get(), elapsed_s, |decide| match field {
            Some(field) => field.with(|field| {
                let terminal = Terminal::CostToGo(field.view());
                decide(Objective::Goal { goal_m, tolerance_m, terminal })
            }),
            None => Ok(decide(Objective::Goal { goal_m, tolerance_m, terminal: Terminal::StraightLine })),
        })
    }

    /// Decides what to do now to follow a line at a speed.
    ///
    /// points_m: float64 (point, 2), x_m, y_m of at least two corners. tolerance_m: distance from the last of them at which the
    /// end counts as reached. All else as `decide`.
    #[pyo3(signature = (
        state: "_Floats",
        risk_map,
        points_m: "_Float64",
        speed_mps,
        *,
        tolerance_m=0.5,
        elapsed_s=None,
    ))]
    #[expect(clippy::too_many_arguments, reason = "keywords in Python")]
    fn follow(
        &self,
        py: Python<'_>,
        state: &Bound<'_, PyAny>,
        risk_map: &Bound<'_, RiskMap>,
        points_m: &Bound<'_, PyAny>,
        speed_mps: f64,
        tolerance_m: f64,
        elapsed_s: Option<f64>,
    ) -> PyResult<Decision> {
        let state = numbers("state", state, self.state_names)?;
        let points = array::<f64, Ix2>("points_m", points_m, "point, 2")?;
        let n_points = points.shape()[0];
        require_shape("points_m", points.shape(), &[n_points, 2])?;
        let points_m: &[[f64; 2]] = values("points_m", &points)?.as_chunks().0;
        let path = ReferencePath { points_m, speed_mps, tolerance_m };
        self.cycle(py, state, risk_map.get(), elapsed_s, |decide| Ok(decide(Objective::Path(path))))
    }

    /// The cheapest futures that the last decision sampled, cheapest first.
    ///
    /// n: how many, all without it. They are computed again over the map, so that only who asks pays for them. Raises
    /// `RuntimeError` before the first decision that sampled.
    #[pyo3(signature = (risk_map, n=None))]
    fn rollouts(
        &self,
        py: Python<'_>,
        risk_map: &Bound<'_, RiskMap>,
        n: Option<usize>,
    ) -> PyResult<Rollouts> {
        let n = n.map_or(self.config.n_rollouts, |n| n.min(self.config.n_rollouts));
        let futures = self.sampled(py, risk_map.get(), |planner, map| planner.futures(n, map))?;
        let n = futures.costs_s.len();
        Ok(Rollouts {
            states: owned(py, futures.states, [n, self.config.n_steps + 1, N_STATE])?,
            costs_s: owned(py, futures.costs_s, [n])?,
            weights: owned(py, futures.weights, [n])?,
        })
    }

    /// Where the plan leads over the map: float64 (step + 1, 5), the predicted start first.
    fn trajectory<'py>(&self, py: Python<'py>, risk_map: &Bound<'py, RiskMap>) -> PyResult<Array<f64, Ix2>> {
        let states = self.sampled(py, risk_map.get(), |planner, map| planner.trajectory(map))?;
        owned(py, states, [self.config.n_steps + 1, N_STATE])
    }

    /// The commands of the plan: float32 (step, 2), the one just decided first.
    #[getter]
    fn plan(&self, py: Python<'_>) -> PyResult<Array<f32, Ix2>> {
        owned(py, self.take(py, |planner, _| planner.plan())?, [self.config.n_steps, 2])
    }

    /// What the last decision that sampled tells about itself, as a dict: costs of the cheapest rollout and their means by
    /// term [s], temperature [s], effective sample size, free energy [s], feasible rollouts and so on.
    #[getter]
    fn diagnostics<'py>(&self, py: Python<'py>) -> PyResult<Fields<'py>> {
        dict(py, &self.take(py, |planner, _| planner.diagnostics())?)
    }

    /// Forgets plan, history and progress, and counts its decisions from zero.
    fn reset(&self, py: Python<'_>) -> PyResult<()> {
        self.take(py, |planner, rest| {
            planner.reset();
            (*rest.cycle, *rest.has_sampled, *rest.told) = (0, false, [0.0; 2]);
        })
    }

    /// What the vehicle was really told, two numbers as `Decision.command`, from `after_s` after the last decision on,
    /// where that is something else. Numbers that are not finite are no command and change nothing.
    #[pyo3(signature = (command: "_Floats", after_s=0.0))]
    fn note_sent(&self, py: Python<'_>, command: &Bound<'_, PyAny>, after_s: f64) -> PyResult<()> {
        let told =
            numbers("command", command, [self.state_names[3], self.state_names[4]])?.map(|part| part as f32);
        self.take(py, |planner, rest| {
            planner.note_sent(told, after_s);
            if told.iter().all(|part| part.is_finite()) {
                *rest.told = told;
            }
        })
    }

    /// What the numbers of a state are; the last two name those of a command.
    #[getter]
    fn state_names(&self) -> (&str, &str, &str, &str, &str) {
        self.state_names.into()
    }

    /// Its settings as a dict.
    #[getter]
    fn settings<'py>(&self, py: Python<'py>) -> PyResult<Fields<'py>> {
        dict(py, &self.config)
    }

    fn __repr__(&self) -> String {
        let Config { n_rollouts, n_steps, step_s, .. } = self.config;
        format!("<surefoot.Mppi of {n_rollouts} rollouts of {n_steps} steps of {step_s} s>")
    }
}

/// What stays from one cycle to the next beside the controller.
struct Rest<'a> {
    at_standstill: fn([f32; 2]) -> [f32; 2],
    told: &'a mut [f32; 2],
    cycle: &'a mut u64,
    has_sampled: &'a mut bool,
}

impl Mppi {
    /// Has the controller to itself without Python's lock.
    fn take<R: Send>(
        &self,
        py: Python<'_>,
        work: impl FnOnce(&mut dyn Planner, Rest<'_>) -> R + Send,
    ) -> PyResult<R> {
        if self.has_lost_threads() {
            return Err(forked("Mppi"));
        }
        if is_within() {
            return Err(PyRuntimeError::new_err(
                "Mppi: expected a cost and a model that call no controller, found one that does",
            ));
        }
        let result = self.run.take(py, |run| {
            let Run { planner, at_standstill, told, cycle, has_sampled } = run;
            let rest = Rest { at_standstill: *at_standstill, told, cycle, has_sampled };
            planner.as_mut().map(|planner| work(&mut **planner, rest))
        })?;
        require_no_fault(&self.called)?;
        result.ok_or_else(|| forked("Mppi"))
    }

    /// Has what the last decision sampled, over a map.
    fn sampled<R: Send>(
        &self,
        py: Python<'_>,
        risk_map: &RiskMap,
        work: impl FnOnce(&dyn Planner, traversability::RiskMapView<'_>) -> R + Send,
    ) -> PyResult<R> {
        let result = risk_map.with_view(py, |map| {
            self.take(py, |planner, rest| rest.has_sampled.then(|| work(planner, map)))
        })??;
        result.ok_or_else(|| {
            PyRuntimeError::new_err("rollouts: expected a decision that sampled before, found none")
        })
    }

    /// One cycle, in which `order` says what is to be done.
    fn cycle<F>(
        &self,
        py: Python<'_>,
        state: [f64; N_STATE],
        risk_map: &RiskMap,
        elapsed_s: Option<f64>,
        order: F,
    ) -> PyResult<Decision>
    where
        F: FnOnce(&mut dyn FnMut(Objective<'_>) -> Outcome) -> Result<Outcome, BrokenOff> + Send,
    {
        let step_s = self.config.step_s;
        let outcome = risk_map.with_view(py, |map| {
            self.take(py, |planner, rest| {
                let elapsed_s = elapsed_s.unwrap_or(if *rest.cycle == 0 { 0.0 } else { step_s });
                let cycle = *rest.cycle;
                let outcome = order(&mut |objective| {
                    planner.decide(&Cycle { state, elapsed_s, map, objective, cycle })
                })?;
                *rest.cycle += 1;
                *rest.has_sampled |= outcome.sampled;
                *rest.told = match outcome.decision {
                    Decided::Drive(command) => command,
                    Decided::Hold(_) | Decided::Stop(_) => (rest.at_standstill)(*rest.told),
                };
                Ok::<_, BrokenOff>((outcome.decision, *rest.told))
            })
        })???;
        Decision::new(outcome)
    }

    fn has_lost_threads(&self) -> bool {
        self.config.n_threads > 1 && self.born != n_forks()
    }
}

impl Drop for Mppi {
    fn drop(&mut self) {
        let is_lost = self.has_lost_threads();
        let planner = self.run.get_mut().planner.take();
        if is_lost {
            std::mem::forget(planner);
        }
    }
}

/// Raises what went wrong in Python first.
fn require_no_fault(called: &[Called]) -> PyResult<()> {
    // All are asked, so that none keeps a fault for later.
    let faults: Vec<PyErr> = called.iter().filter_map(Called::fault).collect();
    faults.into_iter().next().map_or(Ok(()), Err)
}

/// What came out of a cycle.
#[pyclass(frozen, get_all, module = "surefoot")]
pub struct Decision {
    /// "drive": follow the command; "hold": stand still for now; "stop": come to a controlled stop.
    kind: &'static str,
    /// Why to hold or to stop, as "at_goal" or "no_feasible_rollout"; None to drive.
    reason: Option<String>,
    /// What the vehicle is to be told: speed [m/s] and steering angle [rad], or yaw rate [rad/s].
    command: (f32, f32),
}

#[pymethods]
impl Decision {
    fn __repr__(&self) -> String {
        let (speed_mps, turn) = self.command;
        match &self.reason {
            Some(reason) => format!("<surefoot.Decision {}: {reason}>", self.kind),
            None => format!("<surefoot.Decision drive: {speed_mps:.3}, {turn:.3}>"),
        }
    }
}

impl Decision {
    fn new((decided, told): (Decided<[f32; 2]>, [f32; 2])) -> PyResult<Self> {
        let named = |reason: Result<Value, toml::ser::Error>| match reason {
            Ok(Value::String(name)) => Ok(Some(name)),
            other => Err(refused("reason", "a name", format!("{other:?}"))),
        };
        let (kind, reason) = match decided {
            Decided::Drive(_) => ("drive", None),
            Decided::Hold(reason) => ("hold", named(Value::try_from(reason))?),
            Decided::Stop(reason) => ("stop", named(Value::try_from(reason))?),
        };
        Ok(Self { kind, reason, command: told.into() })
    }
}

/// Sampled futures, the cheapest first.
#[pyclass(frozen, get_all, module = "surefoot")]
pub struct Rollouts {
    /// Float64 (rollout, step + 1, 5), the start first; see `Mppi.state_names`.
    states: Array<f64, Ix3>,
    /// Float32 (rollout,): what each costs [s].
    costs_s: Array<f32, Ix1>,
    /// Float32 (rollout,): the share of each in the average; those of all rollouts sum to one.
    weights: Array<f32, Ix1>,
}
