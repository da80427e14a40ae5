//! The controller of whatever model, in numbers that all models share.

use bicycle::{Decision, MotionState};
use mppi::{Controller, Diagnostics, Driven, Input, Objective, RolloutCost, StepCost};
use traversability::RiskMapView;

/// Numbers of a state: x [m], y [m], yaw [rad], speed [m/s], and the steering angle [rad] or the yaw rate [rad/s].
pub const N_STATE: usize = 5;

/// What a cycle is about.
pub struct Cycle<'a> {
    pub state: [f64; N_STATE],
    pub elapsed_s: f64,
    pub map: RiskMapView<'a>,
    pub objective: Objective<'a>,
    pub cycle: u64,
}

/// What a cycle came to.
pub struct Outcome {
    /// Drive, or the reason to hold or to stop.
    pub decision: Decision<[f32; 2]>,
    /// Whether futures were sampled, so that there are rollouts to look at.
    pub sampled: bool,
}

/// Sampled futures, one after the other.
pub struct Futures {
    pub states: Vec<f64>,
    pub costs_s: Vec<f32>,
    pub weights: Vec<f32>,
}

/// A controller without the types of its model.
pub trait Planner: Send {
    fn decide(&mut self, cycle: &Cycle<'_>) -> Outcome;
    fn reset(&mut self);
    fn note_sent(&mut self, command: [f32; 2], after_s: f64);
    fn diagnostics(&self) -> Diagnostics;
    /// The commands of the plan, one after the other.
    fn plan(&self) -> Vec<f32>;
    /// Where the plan leads over a map, the predicted start first.
    fn trajectory(&self, map: RiskMapView<'_>) -> Vec<f64>;
    /// The `n` cheapest futures of the last cycle over a map.
    fn futures(&self, n: usize, map: RiskMapView<'_>) -> Futures;
}

impl<M: Driven, S: StepCost, R: RolloutCost> Planner for Controller<M, S, R> {
    fn decide(&mut self, cycle: &Cycle<'_>) -> Outcome {
        let &Cycle { state: [x_m, y_m, yaw_rad, speed_mps, turn], elapsed_s, map, objective, cycle } = cycle;
        let state = MotionState { x_m, y_m, yaw_rad, speed_mps, turn }.into();
        let mut sampled = false;
        let input = Input { state, elapsed_s, map, objective, cycle };
        let decision = match self.decide_observed(&input, |_| sampled = true) {
            Decision::Drive(command) => Decision::Drive(command.into()),
            Decision::Hold(reason) => Decision::Hold(reason),
            Decision::Stop(reason) => Decision::Stop(reason),
        };
        Outcome { decision, sampled }
    }

    fn reset(&mut self) {
        Controller::reset(self);
    }

    fn note_sent(&mut self, command: [f32; 2], after_s: f64) {
        Controller::note_sent(self, command.into(), after_s);
    }

    fn diagnostics(&self) -> Diagnostics {
        *Controller::diagnostics(self)
    }

    fn plan(&self) -> Vec<f32> {
        Controller::plan(self).flat_map(Into::into).collect()
    }

    fn trajectory(&self, map: RiskMapView<'_>) -> Vec<f64> {
        self.nominal_trajectory(map).into_iter().flat_map(numbers).collect()
    }

    fn futures(&self, n: usize, map: RiskMapView<'_>) -> Futures {
        let rollouts = self.best_rollouts(n, map);
        Futures {
            costs_s: rollouts.iter().map(|rollout| rollout.cost_s).collect(),
            weights: rollouts.iter().map(|rollout| rollout.weight).collect(),
            states: rollouts.into_iter().flat_map(|rollout| rollout.states).flat_map(numbers).collect(),
        }
    }
}

fn numbers(state: impl Into<MotionState>) -> [f64; N_STATE] {
    let MotionState { x_m, y_m, yaw_rad, speed_mps, turn } = state.into();
    [x_m, y_m, yaw_rad, speed_mps, turn]
}
