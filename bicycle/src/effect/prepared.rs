//! The effects of a model, made ready for one step length.

use super::definition::{Commanding, Constants, Driving, Moving, N_CARRIED, Stage};
use super::{Effect, Kind};
use crate::lanes::{Constant, Lanes, Real, Scalar};
use crate::{Asked, Command};

/// How far back, beyond all delays, the commands are gone through for what the effects remember at the start [s].
const PAST_S: f64 = 3.0;

#[derive(Clone, Copy, Debug)]
struct Prepared {
    effect: Effect,
    kind: Kind,
    constants: Constants,
    first_slot: usize,
    n_slots: usize,
    /// What it remembers in its slots is the motion.
    carries_motion: bool,
    held: Option<Held>,
}

/// An acceleration that an effect holds.
#[derive(Clone, Copy, Debug)]
struct Held {
    slot: usize,
    /// See [`Effect::held_follows_per_s`].
    follows_per_s: f64,
}

impl Prepared {
    fn slots(&self) -> std::ops::Range<usize> {
        self.first_slot..self.first_slot + self.n_slots
    }
}

/// The effects of a model, made ready for one step length, by stage.
#[derive(Clone, Debug)]
pub(crate) struct PreparedEffects {
    on_command: Vec<Prepared>,
    on_drive: Vec<Prepared>,
    on_motion: Vec<Prepared>,
    step_s: f64,
    /// Numbers that are carried: what the commands leave, then what is held.
    n_slots: usize,
    /// The first slot of what is held.
    first_held: usize,
    /// Steps gone through before the first.
    n_past: usize,
}

impl PreparedEffects {
    pub(crate) fn new(effects: &[Effect], step_s: f64) -> Self {
        let n_slots =
            |effect: &Effect| effect.n_slots(step_s) + if effect.carries_motion() { N_CARRIED } else { 0 };
        let first_held = effects.iter().map(n_slots).sum();
        let (mut first_slot, mut next_held) = (0, first_held);
        let prepare = |&effect: &Effect| {
            let n_slots = n_slots(&effect);
            let constants = effect.constants(step_s).map(Constant::new);
            let held =
                effect.held_follows_per_s().map(|follows_per_s| Held { slot: next_held, follows_per_s });
            let carries_motion = effect.carries_motion();
            let kind = effect.kind();
            let prepared = Prepared { effect, kind, constants, first_slot, n_slots, carries_motion, held };
            (first_slot, next_held) = (first_slot + n_slots, next_held + usize::from(held.is_some()));
            prepared
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
            n_slots: next_held,
            first_held,
            // No delay has fewer slots than steps.
            n_past: (PAST_S / step_s).ceil() as usize + first_held,
        }
    }

    pub(crate) fn past_s(&self) -> f64 {
        self.n_past as f64 * self.step_s
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

    pub(crate) fn n_held(&self) -> usize {
        self.n_slots - self.first_held
    }

    /// What is held, of all that is carried.
    pub(crate) fn held<'a, T>(&self, memory: &'a mut [T]) -> &'a mut [T] {
        &mut memory[self.first_held..self.n_slots]
    }

    /// Lets what is held follow a speed that was measured and not foretold.
    #[inline(always)]
    pub(crate) fn correct_held<L: Lanes>(&self, memory: &mut [L::Value], faster: Real<L>) {
        let lanes = faster.0;
        for prepared in &self.on_drive {
            if let Some(Held { slot, follows_per_s }) = prepared.held {
                memory[slot] = faster.mul_add(lanes.real(follows_per_s), Real(lanes, memory[slot])).1;
            }
        }
    }

    /// Fills the memory as the commands of the past leave it.
    pub(crate) fn recall(&self, past: &dyn Fn(f64) -> Command, memory: &mut [f64]) {
        let at = |k: usize| {
            let command = past((self.n_past - k) as f64 * self.step_s - 0.5 * self.step_s);
            [f64::from(command.speed_mps), f64::from(command.steering_rad)]
        };
        self.fill_steady_state(at(0), memory);
        for k in 0..self.n_past {
            let asked = Asked::of(at(k).map(|value| Real(Scalar, value)));
            self.pass_command(memory, &mut CommandStep { reached_speed: asked.speed, asked, step: k });
        }
    }

    /// Fills the memory as a command leaves it that was given for long.
    pub(crate) fn fill_steady_state(&self, command: [f64; 2], memory: &mut [f64]) {
        for prepared in self.on_motion.iter().chain(&self.on_command) {
            memory[prepared.slots()].fill(prepared.effect.steady_state(command));
        }
    }

    pub(crate) fn carries_motion(&self) -> bool {
        self.on_motion.iter().any(|prepared| prepared.carries_motion)
    }

    /// Lets bodies begin with a speed to the left [m/s] and a yaw rate [rad/s].
    pub(crate) fn start_motion<V: Copy>(&self, memory: &mut [V], motion: [V; N_CARRIED]) {
        for prepared in self.on_motion.iter().filter(|prepared| prepared.carries_motion) {
            memory[prepared.slots()].copy_from_slice(&motion);
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
                speed: state.asked.speed,
                steering: state.asked.steering,
                acceleration: state.asked.acceleration,
                reached_speed: state.reached_speed,
                memory: &mut memory[prepared.slots()],
                step: state.step,
            };
            prepared.kind.on_command(&prepared.constants, &mut commanding);
            let Commanding { speed, steering, acceleration, .. } = commanding;
            state.asked = Asked { speed, steering, acceleration };
        }
    }

    #[inline(always)]
    pub(crate) fn on_drive<L: Lanes>(&self, memory: &mut [L::Value], driving: &mut Driving<L>) {
        for prepared in &self.on_drive {
            match prepared.held {
                None => prepared.kind.on_drive(&prepared.constants, driving),
                Some(Held { slot, .. }) => {
                    driving.held.1 = memory[slot];
                    prepared.kind.on_drive(&prepared.constants, driving);
                    memory[slot] = driving.held.1;
                }
            }
        }
        for prepared in &self.on_drive {
            if let Some(Held { slot, .. }) = prepared.held {
                driving.held.1 = memory[slot];
                prepared.kind.once_driven(&prepared.constants, driving);
                memory[slot] = driving.held.1;
            }
        }
    }

    #[inline(always)]
    pub(crate) fn on_motion<L: Lanes>(&self, memory: &mut [L::Value], moving: &mut Moving<L>) {
        for prepared in &self.on_motion {
            if prepared.carries_motion {
                let slots = &mut memory[prepared.slots()];
                moving.remembered.iter_mut().zip(&*slots).for_each(|(own, slot)| own.1 = *slot);
                prepared.kind.on_motion(&prepared.constants, moving);
                slots.iter_mut().zip(moving.remembered).for_each(|(slot, own)| *slot = own.1);
            } else {
                prepared.kind.on_motion(&prepared.constants, moving);
            }
        }
    }
}

/// What the effects on the command see and change.
pub(crate) struct CommandStep<L: Lanes> {
    pub(crate) asked: Asked<L>,
    pub(crate) reached_speed: Real<L>,
    pub(crate) step: usize,
}
