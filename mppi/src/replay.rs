//! Trajectories of the last decision, computed only when somebody asks.

use crate::controller::Controller;
use crate::cost::{RolloutCost, StepCost};
use crate::driven::Driven;
use crate::kernel::CHUNK;
use crate::sampling::Control;
use bicycle::{MotionState, State};
use traversability::RiskMapView;

/// One sampled future.
#[derive(Clone, Debug, PartialEq)]
pub struct Rollout<S = State> {
    /// Its cost [s].
    pub cost_s: f32,
    /// Its share in the average of all rollouts of the cycle; the shares of all sum to one.
    pub weight: f32,
    /// Its states, the start first.
    pub states: Vec<S>,
}

impl<M: Driven, S: StepCost, R: RolloutCost> Controller<M, S, R> {
    /// The commands of the plan, one per step, the one just decided first.
    pub fn plan(&self) -> impl ExactSizeIterator<Item = M::Command> + '_ {
        self.plan.nominal.iter().copied().map(M::Command::from)
    }

    /// Where the plan leads over `map`, the predicted start first.
    pub fn nominal_trajectory(&self, map: RiskMapView<'_>) -> Vec<M::State> {
        self.nominal_states(map).collect()
    }

    /// The same, state by state as they are asked for. Allocates nothing.
    pub fn nominal_states<'a>(&'a self, map: RiskMapView<'a>) -> impl Iterator<Item = M::State> + 'a {
        self.states(map, self.plan.nominal.iter().copied())
    }

    /// What a rollout of the last cycle costs [s], and where it leads over `map`, the predicted start first; `None` where
    /// none has this number. Allocates nothing.
    pub fn sampled_states<'a>(
        &'a self,
        rollout: usize,
        map: RiskMapView<'a>,
    ) -> Option<(f32, impl Iterator<Item = M::State> + 'a)> {
        let chunk = self.chunks[..self.n_used].get(rollout / CHUNK)?;
        let lane = rollout % CHUNK;
        Some((chunk.costs.0[lane], self.states(map, chunk.controls_of(lane))))
    }

    /// The `n` cheapest rollouts of the last cycle over `map`, the cheapest first.
    pub fn best_rollouts(&self, n: usize, map: RiskMapView<'_>) -> Vec<Rollout<M::State>> {
        let mut order: Vec<(f32, usize, usize)> = Vec::new();
        for (index, chunk) in self.chunks[..self.n_used].iter().enumerate() {
            order.extend(chunk.costs.0.iter().enumerate().map(|(lane, &cost_s)| (cost_s, index, lane)));
        }
        order.sort_by(|a, b| a.0.total_cmp(&b.0));
        let rollout = |&(cost_s, index, lane): &(f32, usize, usize)| {
            let chunk = &self.chunks[index];
            let weight = chunk.weights.0[lane] / self.diagnostics().normalizer;
            Rollout { cost_s, weight, states: self.states(map, chunk.controls_of(lane)).collect() }
        };
        order.iter().take(n).map(rollout).collect()
    }

    fn states<'a>(
        &'a self,
        map: RiskMapView<'a>,
        controls: impl Iterator<Item = Control> + 'a,
    ) -> impl Iterator<Item = M::State> + 'a {
        let judge = self.judge_over(map);
        let mut memory = self.slots.map(f64::from);
        let walk = move |state: &mut MotionState, (t, control)| {
            *state = judge.step(state, control, &mut memory, t);
            Some(M::State::from(*state))
        };
        let led_to = controls.enumerate().scan(self.start, walk);
        std::iter::once(self.start.into()).chain(led_to)
    }
}
