//! The catalogue of effects: what a real machine does and the kinematic bicycle does not.
//!
//! An effect is one file: its id, what it is, its parameters with bounds and units, and how it changes a step.
//! It acts either on the command before the actuators follow it, or on the motion before the ground takes its
//! share. To add one, write the file and name it in [`catalogue!`] below; order in the list is order of action.

mod delay_line;
mod speed_delay;
mod speed_lag;
mod speed_scale;
mod steer_bias;
mod steer_delay;
mod steer_gain;
mod steer_lag;
mod understeer;

use crate::lanes::{Constant, Lanes, Real};
use crate::{Command, GroundSample};

/// A parameter of an effect.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Parameter {
    /// Key in files.
    pub name: &'static str,
    /// Unit, `-` for a ratio.
    pub unit: &'static str,
    /// Smallest allowed value.
    pub low: f64,
    /// Largest allowed value.
    pub high: f64,
    /// The value at which the effect changes nothing.
    pub neutral: f64,
}

/// What the catalogue says of an effect.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Description {
    /// Fixed name, shared with the diagnosis.
    pub id: &'static str,
    /// What it is, with its equation.
    pub meaning: &'static str,
    /// Its parameters.
    pub parameters: &'static [Parameter],
}

/// Constants of an effect for one step length.
pub type Constants = [Constant; 4];

/// A step of the actuators: what is commanded and what they had reached before.
pub struct Commanding<'a, L: Lanes> {
    /// Speed that the drive is asked for; effects change it [m/s].
    pub speed: Real<L>,
    /// Angle that the steering is asked for; effects change it [rad].
    pub steering: Real<L>,
    /// Speed reached before this step [m/s].
    pub reached_speed: Real<L>,
    /// Angle reached before this step [rad].
    pub reached_steering: Real<L>,
    /// What the effect carries from step to step.
    pub memory: &'a mut [L::Value],
    /// Steps since the start.
    pub step: usize,
}

/// A step of the body: how it moves in its own frame before the ground takes its share.
pub struct Moving<'a, L: Lanes> {
    /// Speed along the body's x axis; effects change it [m/s].
    pub forward: Real<L>,
    /// Speed along the body's y axis; effects change it [m/s].
    pub lateral: Real<L>,
    /// Yaw rate; effects change it [rad/s].
    pub yaw_rate: Real<L>,
    /// Steering angle reached [rad].
    pub steering: Real<L>,
    /// Sine and cosine of the yaw.
    pub heading: [Real<L>; 2],
    /// Ground under the vehicle.
    pub ground: GroundSample<Real<L>>,
    /// What the effect carries from step to step.
    pub memory: &'a mut [L::Value],
}

/// Where in a step an effect acts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Acts {
    /// On the command, before the actuators follow it.
    OnCommand,
    /// On the motion, before the ground takes its share.
    OnMotion,
}

/// How an effect is written; implemented once per file.
pub(crate) trait Definition {
    const DESCRIPTION: Description;
    const ACTS: Acts;
    /// Whether it reads the gradient or the class of the ground.
    const USES_GROUND: bool = false;

    /// From values in the order of the description's parameters.
    fn from_values(values: [f64; 4]) -> Self;
    /// Values in the order of the description's parameters.
    fn values(&self) -> [f64; 4];
    /// What a step of `step_s` needs of the parameters.
    fn constants(&self, step_s: f64) -> [f64; 4];
    /// Numbers to be carried from step to step.
    fn n_slots(&self, _step_s: f64) -> usize {
        0
    }
    /// What slot `slot` holds at the start, from the command that was sent `age_s` before.
    fn recall(&self, _slot: usize, _step_s: f64, _past: &dyn Fn(f64) -> Command) -> f64 {
        0.0
    }
    #[inline(always)]
    fn on_command<L: Lanes>(_constants: &Constants, _state: &mut Commanding<'_, L>) {}
    #[inline(always)]
    fn on_motion<L: Lanes>(_constants: &Constants, _state: &mut Moving<'_, L>) {}
}

/// An effect whose parameters cannot be.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("effect {id}: {parameter}: expected {low} to {high} {unit}, found {found}")]
pub struct EffectError {
    /// Which effect.
    pub id: &'static str,
    /// Which parameter.
    pub parameter: &'static str,
    /// Smallest allowed value.
    pub low: f64,
    /// Largest allowed value.
    pub high: f64,
    /// Its unit.
    pub unit: &'static str,
    /// What was given.
    pub found: f64,
}

macro_rules! catalogue {
    ($($module:ident::$name:ident),* $(,)?) => {
        $(pub use $module::$name;)*

        /// One effect with its parameters; in files a table with the key `id`.
        #[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
        #[serde(tag = "id", rename_all = "snake_case")]
        pub enum Effect {
            $(#[doc = concat!("See [`", stringify!($name), "`].")] $name($name),)*
        }

        #[derive(Clone, Copy, Debug, PartialEq)]
        enum Kind { $($name,)* }

        /// Every effect there is, in order of action.
        pub const CATALOGUE: &[Description] = &[$($name::DESCRIPTION,)*];

        impl Effect {
            /// What the catalogue says of it.
            pub fn description(&self) -> Description {
                match self { $(Self::$name(_) => $name::DESCRIPTION,)* }
            }

            /// The effect with this id and these values of its parameters; `None` for an unknown id.
            pub fn from_values(id: &str, values: [f64; 4]) -> Option<Self> {
                $(if id == $name::DESCRIPTION.id {
                    return Some(Self::$name($name::from_values(values)));
                })*
                None
            }

            /// Its parameters' values in the order of the description; unused places hold 0.
            pub fn values(&self) -> [f64; 4] {
                match self { $(Self::$name(effect) => effect.values(),)* }
            }

            /// Whether it reads the gradient or the class of the ground.
            pub fn uses_ground(&self) -> bool {
                match self { $(Self::$name(_) => $name::USES_GROUND,)* }
            }

            fn acts(&self) -> Acts {
                match self { $(Self::$name(_) => $name::ACTS,)* }
            }

            fn kind(&self) -> Kind {
                match self { $(Self::$name(_) => Kind::$name,)* }
            }

            fn constants(&self, step_s: f64) -> [f64; 4] {
                match self { $(Self::$name(effect) => effect.constants(step_s),)* }
            }

            fn n_slots(&self, step_s: f64) -> usize {
                match self { $(Self::$name(effect) => effect.n_slots(step_s),)* }
            }

            fn recall(&self, slot: usize, step_s: f64, past: &dyn Fn(f64) -> Command) -> f64 {
                match self { $(Self::$name(effect) => effect.recall(slot, step_s, past),)* }
            }
        }

        impl Kind {
            #[inline(always)]
            fn on_command<L: Lanes>(self, constants: &Constants, state: &mut Commanding<'_, L>) {
                match self { $(Self::$name => $name::on_command(constants, state),)* }
            }

            #[inline(always)]
            fn on_motion<L: Lanes>(self, constants: &Constants, state: &mut Moving<'_, L>) {
                match self { $(Self::$name => $name::on_motion(constants, state),)* }
            }
        }
    };
}

catalogue! {
    steer_delay::SteerDelay,
    speed_delay::SpeedDelay,
    steer_gain::SteerGain,
    steer_bias::SteerBias,
    steer_lag::SteerLag,
    speed_lag::SpeedLag,
    speed_scale::SpeedScale,
    understeer::Understeer,
}

impl Effect {
    /// Refuses parameters outside their bounds.
    pub fn validate(&self) -> Result<(), EffectError> {
        let Description { id, parameters, .. } = self.description();
        let outside = parameters
            .iter()
            .zip(self.values())
            .find(|(parameter, value)| !(parameter.low..=parameter.high).contains(value));
        match outside {
            Some((&Parameter { name, unit, low, high, .. }, found)) => {
                Err(EffectError { id, parameter: name, low, high, unit, found })
            }
            None => Ok(()),
        }
    }
}

/// An effect made ready for one step length.
#[derive(Clone, Copy, Debug)]
struct Prepared {
    effect: Effect,
    kind: Kind,
    constants: Constants,
    first_slot: usize,
    n_slots: usize,
}

/// The effects of a model, made ready for one step length, in order of action.
#[derive(Clone, Debug)]
pub(crate) struct PreparedEffects {
    on_command: Vec<Prepared>,
    on_motion: Vec<Prepared>,
    step_s: f64,
    n_slots: usize,
}

impl PreparedEffects {
    pub(crate) fn new(effects: &[Effect], step_s: f64) -> Self {
        let mut ordered = effects.to_vec();
        ordered.sort_by_key(|effect| effect.kind() as usize);
        let mut n_slots = 0;
        let prepare = |effect: Effect| {
            let first_slot = n_slots;
            n_slots += effect.n_slots(step_s);
            let constants = effect.constants(step_s).map(Constant::new);
            Prepared { effect, kind: effect.kind(), constants, first_slot, n_slots: n_slots - first_slot }
        };
        let prepared: Vec<Prepared> = ordered.into_iter().map(prepare).collect();
        let (on_command, on_motion) =
            prepared.into_iter().partition(|prepared| prepared.effect.acts() == Acts::OnCommand);
        Self { on_command, on_motion, step_s, n_slots }
    }

    pub(crate) fn is_empty(&self) -> bool {
        self.on_command.is_empty() && self.on_motion.is_empty()
    }

    pub(crate) fn use_ground(&self) -> bool {
        self.on_command.iter().chain(&self.on_motion).any(|prepared| prepared.effect.uses_ground())
    }

    pub(crate) fn n_slots(&self) -> usize {
        self.n_slots
    }

    pub(crate) fn recall(&self, past: &dyn Fn(f64) -> Command, mut hold: impl FnMut(usize, f64)) {
        for prepared in self.on_command.iter().chain(&self.on_motion) {
            for slot in 0..prepared.n_slots {
                hold(prepared.first_slot + slot, prepared.effect.recall(slot, self.step_s, past));
            }
        }
    }

    #[inline(always)]
    pub(crate) fn on_command<L: Lanes>(&self, memory: &mut [L::Value], state: &mut CommandStep<L>) {
        for prepared in &self.on_command {
            let mut commanding = Commanding {
                speed: state.speed,
                steering: state.steering,
                reached_speed: state.reached_speed,
                reached_steering: state.reached_steering,
                memory: &mut memory[prepared.first_slot..prepared.first_slot + prepared.n_slots],
                step: state.step,
            };
            prepared.kind.on_command(&prepared.constants, &mut commanding);
            (state.speed, state.steering) = (commanding.speed, commanding.steering);
        }
    }

    #[inline(always)]
    pub(crate) fn on_motion<L: Lanes>(&self, memory: &mut [L::Value], state: &mut MotionStep<L>) {
        for prepared in &self.on_motion {
            let mut moving = Moving {
                forward: state.rates[0],
                lateral: state.rates[1],
                yaw_rate: state.rates[2],
                steering: state.steering,
                heading: state.heading,
                ground: state.ground,
                memory: &mut memory[prepared.first_slot..prepared.first_slot + prepared.n_slots],
            };
            prepared.kind.on_motion(&prepared.constants, &mut moving);
            state.rates = [moving.forward, moving.lateral, moving.yaw_rate];
        }
    }
}

/// What the effects on the command see and change.
pub(crate) struct CommandStep<L: Lanes> {
    pub(crate) speed: Real<L>,
    pub(crate) steering: Real<L>,
    pub(crate) reached_speed: Real<L>,
    pub(crate) reached_steering: Real<L>,
    pub(crate) step: usize,
}

/// What the effects on the motion see and change; rates are forward, lateral, yaw.
pub(crate) struct MotionStep<L: Lanes> {
    pub(crate) rates: [Real<L>; 3],
    pub(crate) steering: Real<L>,
    pub(crate) heading: [Real<L>; 2],
    pub(crate) ground: GroundSample<Real<L>>,
}
