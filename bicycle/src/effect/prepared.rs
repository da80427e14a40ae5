//! The effects of a model, made ready for one step length.

use super::definition::{Commanding, Constants, Driving, Moving, Stage};
use super::{Effect, Kind};
use crate::Command;
use crate::lanes::{Constant, Lanes, Real, Scalar};

/// How far back the commands are gone through for what the effects remember at the start [s].
const PAST_S: f64 = 3.0;

#[derive(Clone, Copy, Debug)]
struct Prepared {
    effect: Effect,
    kind: Kind,
    constants: Constants,
    first_slot: usize,
    n_slots: usize,
}

/// The effects of a model, made ready for one step length, by stage.
#[derive(Clone, Debug)]
pub(crate) struct PreparedEffects {
    on_command: Vec<Prepared>,
    on_drive: Vec<Prepared>,
    on_motion: Vec<Prepared>,
    step_s: f64,
    n_slots: usize,
    /// Steps gone through before the first.
    n_past: usize,
}

impl PreparedEffects {
    pub(crate) fn new(effects: &[Effect], step_s: f64) -> Self {
        let mut n_slots = 0;
        let prepare = |&effect: &Effect| {
            let first_slot = n_slots;
            n_slots += effect.n_slots(step_s);
            let constants = effect.constants(step_s).map(Constant::new);
            Prepared { effect, kind: effect.kind(), constants, first_slot, n_slots: n_slots - first_slot }
        };
        let prepared: Vec<Prepared> = effects.iter().map(prepare).collect();
        let at = |stage: Stage| {
            let acts = |prepared: &&Prepared| prepared.effect.stages().contains(&stage);
            prepared.iter().filter(acts).copied().collect()
        };
        Self {
            on_command: at(Stage::Command),
            on_drive: at(Stage::Drive),
            on_motion: at(Stage::Motion),
            step_s,
            n_slots,
            n_past: (PAST_S / step_s).ceil() as usize,
        }
    }

    pub(crate) fn is_empty(&self) -> bool {
        self.on_command.is_empty() && self.on_drive.is_empty() && self.on_motion.is_empty()
    }

    pub(crate) fn drive(&self) -> bool {
        !self.on_drive.is_empty()
    }

    pub(crate) fn use_ground(&self) -> bool {
        self.on_drive.iter().chain(&self.on_motion).any(|prepared| prepared.effect.uses_ground())
    }

    pub(crate) fn n_slots(&self) -> usize {
        self.n_slots
    }

    /// Fills the memory as the commands of the past leave it.
    pub(crate) fn recall(&self, past: &dyn Fn(f64) -> Command, memory: &mut [f64]) {
        let at = |k: usize| {
            let command = past((self.n_past - k) as f64 * self.step_s - 0.5 * self.step_s);
            [f64::from(command.speed_mps), f64::from(command.steering_rad)]
        };
        self.settle(at(0), memory);
        for k in 0..self.n_past {
            let [speed, steering] = at(k).map(|value| Real(Scalar, value));
            let reached_speed = speed;
            self.pass_command(memory, &mut CommandStep { speed, steering, reached_speed, step: k });
        }
    }

    /// Fills the memory as a command leaves it that was given for long.
    pub(crate) fn settle(&self, command: [f64; 2], memory: &mut [f64]) {
        for prepared in &self.on_command {
            let slots = prepared.first_slot..prepared.first_slot + prepared.n_slots;
            memory[slots].fill(prepared.effect.settled(command));
        }
    }

    /// Steps count from the start; what [`PreparedEffects::recall`] went through lies before.
    #[inline(always)]
    pub(crate) fn on_command<L: Lanes>(&self, memory: &mut [L::Value], state: &mut CommandStep<L>) {
        state.step += self.n_past;
        self.pass_command(memory, state);
    }

    #[inline(always)]
    fn pass_command<L: Lanes>(&self, memory: &mut [L::Value], state: &mut CommandStep<L>) {
        for prepared in &self.on_command {
            let mut commanding = Commanding {
                speed: state.speed,
                steering: state.steering,
                reached_speed: state.reached_speed,
                memory: &mut memory[prepared.first_slot..prepared.first_slot + prepared.n_slots],
                step: state.step,
            };
            prepared.kind.on_command(&prepared.constants, &mut commanding);
            (state.speed, state.steering) = (commanding.speed, commanding.steering);
        }
    }

    #[inline(always)]
    pub(crate) fn on_drive<L: Lanes>(&self, driving: &mut Driving<L>) {
        for prepared in &self.on_drive {
            prepared.kind.on_drive(&prepared.constants, driving);
        }
    }

    #[inline(always)]
    pub(crate) fn on_motion<L: Lanes>(&self, moving: &mut Moving<L>) {
        for prepared in &self.on_motion {
            prepared.kind.on_motion(&prepared.constants, moving);
        }
    }
}

/// What the effects on the command see and change.
pub(crate) struct CommandStep<L: Lanes> {
    pub(crate) speed: Real<L>,
    pub(crate) steering: Real<L>,
    pub(crate) reached_speed: Real<L>,
    pub(crate) step: usize,
}
