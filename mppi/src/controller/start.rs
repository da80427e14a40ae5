//! What a cycle starts from: the measured state, the commands on their way, and what the effects hold.

use super::{Controller, LONGEST_STEPS};
use crate::cost::{RolloutCost, StepCost};
use crate::driven::Driven;
use crate::objective::Input;
use crate::rollout::MAX_SLOTS;
use crate::sampling::Control;
use bicycle::{MotionState, MotionStepper};
use std::f64::consts::TAU;
use std::ops::Range;

impl<M: Driven, S: StepCost, R: RolloutCost> Controller<M, S, R> {
    /// The measured state, carried over the known delay by the commands that are already on their way.
    pub(super) fn predict_start(&mut self, input: &Input<'_, MotionState>) -> MotionState {
        let mut state = input.state;
        let n_steps = (self.config.delay_s / self.config.step_s).ceil() as usize;
        if n_steps == 0 {
            return state;
        }
        self.recall_slots(state, self.config.delay_s);
        let step_s = self.config.delay_s / n_steps as f64;
        let judge = self.judge_over(input.map);
        let mut memory = self.slots.map(f64::from);
        for k in 0..n_steps {
            // In force during this step: the command that was sent a delay ago.
            let age_s = self.config.delay_s - (k as f64 + 0.5) * step_s;
            let sent = self.ledger.at(age_s).map_or(as_control(&state), Into::into);
            let next = judge.step(&state, sent, &mut memory, k);
            let share = step_s / self.config.step_s;
            state = between(&state, &next, share);
        }
        state
    }

    /// Lets what the effects hold follow the step that was driven since the last cycle.
    pub(super) fn follow_held(&mut self, input: &Input<'_, MotionState>) {
        let Some(before) = self.before else { return };
        let is_step = input.elapsed_s > 0.0 && input.elapsed_s < LONGEST_STEPS * self.config.step_s;
        if self.held_mps2.is_empty() || !is_step {
            return;
        }
        let age_s = self.config.delay_s + input.elapsed_s;
        self.recall_slots(before, age_s);
        let mut memory = self.slots.map(f64::from);
        let sent = self.ledger.at(age_s - 0.5 * input.elapsed_s).map_or(as_control(&before), Into::into);
        let expected = self.judge_over(input.map).step(&before, sent, &mut memory, 0);
        let share = input.elapsed_s / self.config.step_s;
        let gained_mps = input.state.speed_mps - before.speed_mps;
        let faster_mps = gained_mps / share - (expected.speed_mps - before.speed_mps);
        self.stepper.correct_held(&mut memory, faster_mps * share);
        let held = self.held_slots();
        self.held_mps2.copy_from_slice(&memory[held]);
    }

    /// Forgets what was held: the vehicle stands, or the step was not driven.
    pub(super) fn let_go(&mut self) {
        self.before = None;
        self.held_mps2.fill(0.0);
    }

    /// What the effects remember at `state`, whose actuators follow the commands `delay_s` late.
    pub(super) fn recall_slots(&mut self, state: MotionState, delay_s: f64) {
        let ledger = &self.ledger;
        let past = |age_s: f64| ledger.at(age_s + delay_s).map_or(as_control(&state), Into::into);
        let mut memory = [0.0; MAX_SLOTS];
        memory[self.held_slots()].copy_from_slice(&self.held_mps2);
        self.stepper.recall(&past, &mut memory[..self.stepper.n_slots()]);
        self.slots = memory.map(|value| value as f32);
    }

    /// Where the memory of the effects holds accelerations.
    fn held_slots(&self) -> Range<usize> {
        self.stepper.n_slots() - self.stepper.n_held()..self.stepper.n_slots()
    }
}

/// The state a share of the way from one to the other; yaw the short way round.
fn between(from: &MotionState, to: &MotionState, share: f64) -> MotionState {
    let blend = |from: f64, to: f64| from + share * (to - from);
    let turn_rad = (to.yaw_rad - from.yaw_rad + TAU / 2.0).rem_euclid(TAU) - TAU / 2.0;
    MotionState {
        x_m: blend(from.x_m, to.x_m),
        y_m: blend(from.y_m, to.y_m),
        yaw_rad: from.yaw_rad + share * turn_rad,
        speed_mps: blend(from.speed_mps, to.speed_mps),
        turn: blend(from.turn, to.turn),
    }
}

/// The command that keeps a state's actuators where they are.
pub(super) fn as_control(state: &MotionState) -> Control {
    [state.speed_mps as f32, state.turn as f32]
}
