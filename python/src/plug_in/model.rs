//! A motion model whose steps are written in Python.

use std::f64::consts::TAU;

use bicycle::lanes::{Lanes, Real, SPAN};
use bicycle::{
    Extent, GroundSample, LaneState, ModelError, MotionLimits, MotionModel, MotionState, MotionStepper,
    Odometry, Rates, SensorModel, StepInput, StepOutcome,
};
use mppi::Driven;
use pyo3::prelude::*;

use super::Called;
use super::answer::{numbers, place};
use crate::arrays::{kind, owned};
use crate::failure::{refused, refused_type};
use crate::model::Model;
use crate::planner::N_STATE;

/// A motion model of your own, for trying out: limits and command of a `Model`, steps of a function in Python.
///
/// PythonModel(model, step). model: `Model`, whose limits bound what is sampled; its wheelbase tells how tightly it turns,
/// its effects count for nothing. step(states, commands, traction, step_s) returns the states a step later, float64 (n, 5);
/// states is float64 (n, 5), see `Mppi.state_names`, commands float64 (n, 2), traction float64 (n, 2), linear and angular.
/// A decision calls it once for every step of the horizon with all rollouts, and now and then with one vehicle; it has to
/// treat each by itself. It is tens of times as slow as a model in Rust.
#[pyclass(frozen, module = "surefoot")]
pub struct PythonModel {
    model: bicycle::Model,
    step: Py<PyAny>,
}

#[pymethods]
impl PythonModel {
    #[new]
    #[pyo3(signature = (model, step: "Callable[[_Float64, _Float64, _Float64, float], _Answer]"))]
    fn new(model: &Bound<'_, Model>, step: &Bound<'_, PyAny>) -> PyResult<Self> {
        if !step.is_callable() {
            return Err(refused_type("step", "a function of states, commands, traction, step_s", kind(step)));
        }
        Ok(Self { model: model.get().0.clone(), step: step.clone().unbind() })
    }

    fn __repr__(&self) -> String {
        format!("<surefoot.PythonModel of {} m>", self.model.wheelbase_m)
    }
}

impl PythonModel {
    /// As the controller drives it, and what tells of its faults.
    pub fn motion(&self, py: Python<'_>) -> PythonMotion {
        PythonMotion { model: self.model.clone(), called: Called::new(self.step.clone_ref(py)) }
    }
}

/// The model as the controller has it.
#[derive(Clone, Debug)]
pub struct PythonMotion {
    pub model: bicycle::Model,
    pub called: Called,
}

impl Driven for PythonMotion {}

impl MotionModel for PythonMotion {
    type Command = bicycle::Command;
    type State = bicycle::State;
    type Stepper = PythonStepper;

    fn validate(&self) -> Result<(), ModelError> {
        self.model.validate()
    }

    fn stepper(&self, step_s: f64, unit_m: f64) -> PythonStepper {
        PythonStepper { called: self.called.clone(), step_s, unit_m }
    }

    fn motion_limits(&self) -> MotionLimits {
        self.model.motion_limits()
    }

    fn turning_s_per_rad(&self) -> f64 {
        self.model.turning_s_per_rad()
    }

    fn with_attitude_share(self, share: f64) -> Self {
        Self { model: self.model.with_attitude_share(share), ..self }
    }

    fn sensors(&self) -> SensorModel {
        self.model.sensors()
    }

    fn measured_state(&self, odometry: &Odometry) -> bicycle::State {
        self.model.measured_state(odometry)
    }
}

/// Steps by a call of Python's.
#[derive(Clone, Debug)]
pub struct PythonStepper {
    called: Called,
    step_s: f64,
    unit_m: f64,
}

impl PythonStepper {
    /// The states a step later, not finite where Python gave none.
    fn ask(&self, inputs: &[StepInput]) -> Vec<MotionState> {
        let n = inputs.len();
        let asked = self.called.call(|py, step| {
            let of = |values: &dyn Fn(&StepInput) -> Vec<f64>| inputs.iter().flat_map(values).collect();
            let states = owned::<f64, 2>(py, of(&|input| row(&input.state).to_vec()), [n, N_STATE])?;
            let commands = of(&|input| input.command.map(f64::from).to_vec());
            let traction =
                of(&|StepInput { ground, .. }| vec![ground.linear_traction, ground.angular_traction]);
            let (commands, traction) = (owned(py, commands, [n, 2])?, owned(py, traction, [n, 2])?);
            let returned = step.call1((states, commands, traction, self.step_s))?;
            let shape: [&[usize]; 1] = [&[n, N_STATE]];
            let (stepped, _) = numbers("step", &returned, &shape)?;
            let is_whole = |input: &StepInput| row(&input.state).iter().all(|value| value.is_finite());
            match stepped.iter().position(|value| !value.is_finite()) {
                Some(index) if inputs.iter().all(is_whole) => {
                    Err(refused(&place("step", index, shape[0]), "a finite number", stepped[index]))
                }
                _ => Ok(stepped.as_chunks().0.iter().map(state).collect()),
            }
        });
        asked.unwrap_or_else(|| vec![state(&[f64::NAN; N_STATE]); n])
    }
}

impl MotionStepper for PythonStepper {
    const GOES_TOGETHER: bool = true;

    fn extent(&self) -> Extent {
        Extent::Whole
    }

    fn step_together(&self, inputs: &[StepInput], outcomes: &mut [StepOutcome]) {
        for (outcome, (input, state)) in outcomes.iter_mut().zip(inputs.iter().zip(self.ask(inputs))) {
            let turns = (state.yaw_rad - input.state.yaw_rad) / TAU;
            *outcome = StepOutcome { state, yaw_rate_radps: (turns - turns.round()) * TAU / self.step_s };
        }
    }

    /// The vehicles of a pack alone, positions from where the map begins; rollouts go by
    /// [`MotionStepper::step_together`].
    fn step<L: Lanes>(
        &self,
        state: &mut LaneState<L>,
        command: [Real<L>; 2],
        ground: &GroundSample<Real<L>>,
        _memory: &mut [L::Value],
        _step: usize,
    ) -> Rates<L> {
        let lanes = state.x.0;
        let units = [self.unit_m, self.unit_m, TAU, 1.0, 1.0].map(|unit| lanes.real(unit));
        let before = [state.x, state.y, state.turns, state.speed, state.steering];
        let states = [0, 1, 2, 3, 4].map(|place| read(before[place] * units[place]));
        let (commands, traction) =
            (command.map(read), [ground.linear_traction, ground.angular_traction].map(read));
        let input = |lane: usize| StepInput {
            state: self::state(&states.map(|values| f64::from(values[lane]))),
            command: commands.map(|values| values[lane]),
            ground: GroundSample {
                linear_traction: f64::from(traction[0][lane]),
                angular_traction: f64::from(traction[1][lane]),
                gradient: [0.0; 2],
                class: 0.0,
            },
        };
        let inputs: Vec<StepInput> = (0..L::WIDTH).map(input).collect();
        let mut outcomes = vec![StepOutcome::default(); inputs.len()];
        self.step_together(&inputs, &mut outcomes);
        let pack = |of: &dyn Fn(&StepOutcome) -> f64| {
            let mut span = [0.0; SPAN];
            span.iter_mut().zip(&outcomes).for_each(|(value, outcome)| *value = of(outcome) as f32);
            lanes.real_of_span(&span, 0)
        };
        [state.x, state.y, state.turns, state.speed, state.steering] =
            [0, 1, 2, 3, 4].map(|place| pack(&|outcome| row(&outcome.state)[place]) / units[place]);
        state.turns = state.turns.wrap_turns();
        Rates {
            speed: state.speed,
            side_speed: lanes.real(0.0),
            yaw_rate: pack(&|outcome| outcome.yaw_rate_radps),
        }
    }

    /// Without the way through single precision.
    fn step_one(
        &self,
        state: &MotionState,
        command: [f32; 2],
        ground: &GroundSample,
        _memory: &mut [f64],
        _step: usize,
    ) -> MotionState {
        self.ask(&[StepInput { state: *state, command, ground: *ground }])[0]
    }

    /// What follows at once is the step's own affair.
    fn with_instant_actuators(self) -> Self {
        self
    }

    fn rescale(&mut self, unit_m: f64) {
        self.unit_m = unit_m;
    }
}

/// A state as Python has it: `Mppi.state_names`.
fn row(state: &MotionState) -> [f64; N_STATE] {
    let MotionState { x_m, y_m, yaw_rad, speed_mps, turn } = *state;
    [x_m, y_m, yaw_rad, speed_mps, turn]
}

/// [`row`] backwards.
fn state(row: &[f64; N_STATE]) -> MotionState {
    let [x_m, y_m, yaw_rad, speed_mps, turn] = *row;
    MotionState { x_m, y_m, yaw_rad, speed_mps, turn }
}

/// The numbers of a pack.
fn read<L: Lanes>(pack: Real<L>) -> [f32; SPAN] {
    let mut span = [0.0; SPAN];
    pack.0.to_span(pack.1, &mut span, 0);
    span
}
