//! A cost of whole rollouts that is written in Python.

use mppi::{Future, RolloutCost, Trace};
use numpy::ndarray::{Ix2, Ix3};
use pyo3::prelude::*;

use super::Called;
use super::answer::{numbers, place};
use crate::arrays::owned;
use crate::failure::refused;
use crate::planner::N_STATE;
use crate::typed::Array;

/// What a cost written in Python is called with: every step of all rollouts that were sampled.
#[pyclass(frozen, get_all, module = "surefoot")]
pub struct SampledRollouts {
    /// Float64 (rollout, step + 1, 5), the start first; see `Mppi.state_names`. Single precision within the map.
    states: Array<f64, Ix3>,
    /// Float32 (rollout, step, 2): what is asked for, see `Decision.command`.
    commands: Array<f32, Ix3>,
    /// Float32 (rollout, step, 2): speed before the ground takes its share [m/s], yaw rate after [rad/s].
    rates: Array<f32, Ix3>,
    /// Float32 (rollout, step, 4): the risk where the step begins, as `RiskMap.risks`.
    risks: Array<f32, Ix3>,
    /// Bool (rollout, step): whether the goal was not reached before the step.
    is_under_way: Array<bool, Ix2>,
}

/// Every step of all rollouts, one after the other.
#[derive(Default)]
struct Steps {
    states: Vec<f64>,
    commands: Vec<f32>,
    rates: Vec<f32>,
    risks: Vec<f32>,
    is_under_way: Vec<bool>,
}

impl Steps {
    fn of(trace: &Trace<'_>) -> Self {
        let mut steps = Self::default();
        let start = trace.start();
        let start = [start.x_m, start.y_m, start.yaw_rad, start.speed_mps, start.turn];
        for rollout in 0..trace.n_rollouts() {
            steps.states.extend(start);
            for step in (0..trace.n_steps()).filter_map(|t| trace.step(rollout, t)) {
                let state = step.state;
                steps.states.extend([state.x_m, state.y_m, state.yaw_rad, state.speed_mps, state.turn]);
                steps.commands.extend(step.command);
                steps.rates.extend([step.speed_mps, step.yaw_rate_radps]);
                steps.risks.extend(step.risk);
                steps.is_under_way.push(step.is_under_way);
            }
        }
        steps
    }

    fn into_python(self, py: Python<'_>, [n, n_steps]: [usize; 2]) -> PyResult<SampledRollouts> {
        Ok(SampledRollouts {
            states: owned(py, self.states, [n, n_steps + 1, N_STATE])?,
            commands: owned(py, self.commands, [n, n_steps, 2])?,
            rates: owned(py, self.rates, [n, n_steps, 2])?,
            risks: owned(py, self.risks, [n, n_steps, 4])?,
            is_under_way: owned(py, self.is_under_way, [n, n_steps])?,
        })
    }
}

/// A callable of Python's that prices rollouts.
pub struct PythonCost(pub Called);

impl RolloutCost for PythonCost {
    const KEEPS_STEPS: bool = true;

    fn add(&self, _futures: &[Future], _added_s: &mut [f32]) {}

    fn add_traced(&self, trace: &Trace<'_>, added_s: &mut [f32]) {
        let shape = [trace.n_rollouts(), trace.n_steps()];
        let steps = Steps::of(trace);
        let counts = steps.is_under_way.clone();
        let costs_s = self.0.call(|py, callable| {
            let rollouts = steps.into_python(py, shape)?;
            priced(&callable.call1((rollouts,))?, shape, &counts)
        });
        for (added_s, cost_s) in added_s.iter_mut().zip(costs_s.unwrap_or_default()) {
            *added_s += cost_s as f32;
        }
    }
}

/// What each rollout costs: as it was returned, or the sum of its steps that count [s].
fn priced(returned: &Bound<'_, PyAny>, [n, n_steps]: [usize; 2], counts: &[bool]) -> PyResult<Vec<f64>> {
    let shapes: [&[usize]; 2] = [&[n, n_steps], &[n]];
    let (costs_s, which) = numbers("cost", returned, &shapes)?;
    if let Some(index) = costs_s.iter().position(|cost_s| cost_s.is_nan() || *cost_s == f64::NEG_INFINITY) {
        let expected = "a number, or infinity for what may not be";
        return Err(refused(&place("cost", index, shapes[which]), expected, costs_s[index]));
    }
    if which == 1 {
        return Ok(costs_s);
    }
    let sum = |(costs_s, counts): (&[f64], &[bool])| {
        costs_s.iter().zip(counts).filter(|(_, counts)| **counts).map(|(cost_s, _)| cost_s).sum()
    };
    Ok(costs_s.chunks_exact(n_steps).zip(counts.chunks_exact(n_steps)).map(sum).collect())
}
