//! How an effect is written.

use super::SensorModel;
use crate::GroundSample;
use crate::lanes::{Constant, Lanes, Real};

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
    /// Values that a fit tries first, from small effects to large ones.
    pub tried: &'static [f64],
}

/// What an effect is to a diagnosis.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Role {
    /// May be the cause of a gap.
    Cause,
    /// Ordinary physics of a machine that the kinematic bicycle leaves out: calibrated on nominal drives.
    Calibration,
}

/// What the catalogue says of an effect.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Description {
    /// Fixed name, shared with the diagnosis.
    pub id: &'static str,
    /// What it is, with its equation.
    pub meaning: &'static str,
    /// What it is to a diagnosis.
    pub role: Role,
    /// Name of the cause that it is a form of: its own, where it is the only form.
    pub cause: &'static str,
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
    /// Acceleration that the drive is asked for beside the speed; effects change it [m/s2].
    pub acceleration: Real<L>,
    /// Speed reached before this step [m/s].
    pub reached_speed: Real<L>,
    /// What the effect carries from step to step.
    pub memory: &'a mut [L::Value],
    /// Steps since the start.
    pub step: usize,
}

/// A step of the drive: how fast the speed changes.
pub struct Driving<L: Lanes> {
    /// Acceleration along the body's x axis; effects change it [m/s2].
    pub acceleration: Real<L>,
    /// Acceleration that a force from outside gives the body along its y axis; effects change it [m/s2].
    pub side_acceleration: Real<L>,
    /// Most that the actuators' own limit allows [m/s2].
    pub acceleration_limit: Real<L>,
    /// Speed that the drive is asked for [m/s].
    pub asked_speed: Real<L>,
    /// Acceleration that it is asked for beside it [m/s2].
    pub asked_acceleration: Real<L>,
    /// Speed reached before this step [m/s].
    pub speed: Real<L>,
    /// Tangent of the steering angle reached.
    pub steering_tangent: Real<L>,
    /// Yaw rate of the kinematic bicycle at that speed and angle [rad/s].
    pub yaw_rate: Real<L>,
    /// Sine and cosine of the yaw.
    pub heading: [Real<L>; 2],
    /// Ground under the vehicle.
    pub ground: GroundSample<Real<L>>,
    /// What an effect that holds an acceleration holds; it changes it [m/s2].
    pub held: Real<L>,
    /// What was wanted of the drive beyond what its limits let it give [m/s2].
    pub withheld: Real<L>,
    /// What forces took from what the drive gave [m/s2].
    pub resisted: Real<L>,
}

impl<L: Lanes> Driving<L> {
    /// Rise of the ground per metre ahead and per metre to the left [-].
    #[inline(always)]
    pub fn slope(&self) -> [Real<L>; 2] {
        let ([east, north], [sine, cosine]) = (self.ground.gradient, self.heading);
        [east.mul_add(cosine, north * sine), north.mul_add(cosine, -(east * sine))]
    }

    /// Lets the drive accelerate by so much more [m/s2], as far as the actuators can.
    #[inline(always)]
    pub fn drive_by(&mut self, more: Real<L>) {
        let limit = self.acceleration_limit;
        self.acceleration = (self.acceleration + more).clamp(-limit, limit);
    }

    /// Lets the drive give so much of what is wanted of it [m/s2].
    #[inline(always)]
    pub fn give(&mut self, given: Real<L>) {
        self.withheld = self.withheld + (self.acceleration - given);
        self.acceleration = given;
    }

    /// Takes so much from the acceleration [m/s2].
    #[inline(always)]
    pub fn resist(&mut self, less: Real<L>) {
        self.acceleration = self.acceleration - less;
        self.resisted = self.resisted + less;
    }

    /// 1 on ground of this class, 0 on other ground, in between on the border.
    #[inline(always)]
    pub fn on_class(&self, class: Constant) -> Real<L> {
        let lanes = self.speed.0;
        let distance = (self.ground.class - Real::constant(lanes, class)).abs();
        (lanes.real(1.0) - distance).max(lanes.real(0.0))
    }

    /// -1, 0 or 1 with the direction of motion, growing linearly between walking-pace tenths of a metre per second.
    #[inline(always)]
    pub fn direction(&self) -> Real<L> {
        let lanes = self.speed.0;
        (self.speed * lanes.real(10.0)).clamp(lanes.real(-1.0), lanes.real(1.0))
    }
}

/// A step of the body: how it moves in its own frame before the ground takes its share.
pub struct Moving<L: Lanes> {
    /// Speed along the body's x axis; effects change it [m/s].
    pub forward: Real<L>,
    /// Speed along the body's y axis; effects change it [m/s].
    pub lateral: Real<L>,
    /// Yaw rate; effects change it [rad/s].
    pub yaw_rate: Real<L>,
    /// Acceleration that a force from outside gives the body along its y axis [m/s2].
    pub side_acceleration: Real<L>,
    /// Acceleration along the body's x axis in this step [m/s2].
    pub acceleration: Real<L>,
    /// Tangent of the angle that the steering reached; 0 for a skid-steered vehicle.
    pub steering_tangent: Real<L>,
    /// Distance between the axles [m].
    pub wheelbase: Real<L>,
    /// Speed along the body's x axis that the drive has gained once the step is done [m/s].
    pub gained: Real<L>,
    /// What an effect that carries the motion remembers of it; see [`Moving::carried`].
    pub(crate) remembered: [Real<L>; N_CARRIED],
}

/// What an effect that carries the motion remembers: speed to the left [m/s], yaw rate [rad/s], and whether the motion
/// has begun, 0 or 1.
pub(crate) const N_CARRIED: usize = 3;

impl<L: Lanes> Moving<L> {
    /// Speed to the left [m/s] and yaw rate [rad/s] before this step; those of the model where none were carried yet.
    #[inline(always)]
    pub fn carried(&self) -> [Real<L>; 2] {
        let [lateral, yaw_rate, begun] = self.remembered;
        let or_model = |carried: Real<L>, model: Real<L>| begun.mul_add(carried - model, model);
        [or_model(lateral, self.lateral), or_model(yaw_rate, self.yaw_rate)]
    }

    /// Moves so in this step, and carries it to the next.
    #[inline(always)]
    pub fn carry(&mut self, lateral: Real<L>, yaw_rate: Real<L>) {
        (self.lateral, self.yaw_rate) = (lateral, yaw_rate);
        self.remembered = [lateral, yaw_rate, self.forward.0.real(1.0)];
    }

    /// Lateral acceleration that the tyres have to supply [m/s2].
    #[inline(always)]
    pub fn tyre_acceleration(&self) -> Real<L> {
        self.forward.mul_add(self.yaw_rate, -self.side_acceleration)
    }
}

/// Where in a step an effect acts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Stage {
    /// On the command, before the actuators follow it.
    Command,
    /// On the acceleration.
    Drive,
    /// On the motion, before the ground takes its share.
    Motion,
    /// On what the sensors say of the motion.
    Sensors,
}

/// The parameters of an effect as numbers; implemented by [`parameters!`].
pub(crate) trait Values {
    const PARAMETERS: &'static [Parameter];
    /// From values in the order of the parameters.
    fn from_values(values: [f64; 4]) -> Self;
    /// Values in the order of the parameters.
    fn values(&self) -> [f64; 4];
}

/// How an effect is written.
pub(crate) trait Definition: Values {
    const ID: &'static str;
    const MEANING: &'static str;
    const ROLE: Role = Role::Cause;
    const CAUSE: &'static str = Self::ID;
    const STAGES: &'static [Stage];
    /// Whether it reads the gradient or the class of the ground.
    const USES_GROUND: bool = false;
    /// Whether it carries how the body moves sideways and turns from step to step.
    const CARRIES_MOTION: bool = false;

    /// Smallest value of the first parameter with which a step is finite at speeds of up to `speed_mps`, where that is
    /// not what the parameter's bounds say.
    fn least_at(_speed_mps: f64) -> f64 {
        f64::NEG_INFINITY
    }
    /// What a step of `step_s` needs of the parameters.
    fn constants(&self, _step_s: f64) -> [f64; 4] {
        self.values()
    }
    /// Numbers to be carried from step to step.
    fn n_slots(&self, _step_s: f64) -> usize {
        0
    }
    /// For an effect that holds an acceleration from step to step, which is what a controller has built up against the
    /// forces it met: by how much that follows a speed that was measured and not foretold [1/s].
    fn held_follows_per_s(&self) -> Option<f64> {
        None
    }
    /// What the slots hold after `[speed, steering]` were commanded for long.
    fn steady_state(&self, _command: [f64; 2]) -> f64 {
        0.0
    }
    #[inline(always)]
    fn on_command<L: Lanes>(_constants: &Constants, _state: &mut Commanding<'_, L>) {}
    #[inline(always)]
    fn on_drive<L: Lanes>(_constants: &Constants, _state: &mut Driving<L>) {}
    /// For an effect that holds an acceleration, once all effects on the drive have acted.
    #[inline(always)]
    fn once_driven<L: Lanes>(_constants: &Constants, _state: &mut Driving<L>) {}
    #[inline(always)]
    fn on_motion<L: Lanes>(_constants: &Constants, _state: &mut Moving<L>) {}
    /// Adds what it does to the sensors.
    fn on_sensors(&self, _sensors: &mut SensorModel) {}
}

/// The parameters of an effect: a struct of f64, the bounds and units of each, and the way from and to numbers.
macro_rules! parameters {
    (
        $(#[$doc:meta])*
        $name:ident {
            $($(#[$field_doc:meta])* $field:ident in $unit:literal: $low:literal to $high:literal,
            neutral $neutral:literal, tried $tried:expr;)*
        }
    ) => {
        $(#[$doc])*
        #[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
        #[serde(deny_unknown_fields)]
        pub struct $name {
            $($(#[$field_doc])* pub $field: f64,)*
        }

        impl $crate::effect::definition::Values for $name {
            const PARAMETERS: &'static [$crate::effect::definition::Parameter] =
                &[$($crate::effect::definition::Parameter {
                    name: stringify!($field),
                    unit: $unit,
                    low: $low,
                    high: $high,
                    neutral: $neutral,
                    tried: &$tried,
                },)*];

            fn from_values(values: [f64; 4]) -> Self {
                let mut values = values.into_iter();
                Self { $($field: values.next().unwrap_or($neutral),)* }
            }

            fn values(&self) -> [f64; 4] {
                let mut values = [$(self.$field,)*].into_iter();
                std::array::from_fn(|_| values.next().unwrap_or(0.0))
            }
        }
    };
}
pub(crate) use parameters;

/// Constants that are the parameters themselves.
pub(crate) fn as_they_are(values: [f64; 4], _step_s: f64) -> [f64; 4] {
    values
}

/// Effects of one stage that remember nothing: of each what it is, its parameters, and what it does with their constants.
/// `by` names the function from parameters and step length to constants.
macro_rules! effects {
    (@cause $cause:literal) => { const CAUSE: &'static str = $cause; };
    (@role $role:ident) => {
        const ROLE: $crate::effect::definition::Role = $crate::effect::definition::Role::$role;
    };
    (@ground read) => { const USES_GROUND: bool = true; };
    ($stage:ident $method:ident($State:ty, $lanes:ident) by $constants:ident; $(
        $(#[$doc:meta])* $name:ident $id:literal: $meaning:literal $($key:ident $value:tt)* {$($parameters:tt)*}
        |$($constant:ident),+; $state:ident| $act:expr;
    )*) => {$(
        parameters! { $(#[$doc])* $name {$($parameters)*} }

        impl $crate::effect::definition::Definition for $name {
            const ID: &'static str = $id;
            const MEANING: &'static str = $meaning;
            const STAGES: &'static [$crate::effect::definition::Stage] =
                &[$crate::effect::definition::Stage::$stage];
            $($crate::effect::definition::effects!(@$key $value);)*

            fn constants(&self, step_s: f64) -> [f64; 4] {
                $constants($crate::effect::definition::Values::values(self), step_s)
            }

            #[inline(always)]
            fn $method<L: $crate::lanes::Lanes>(
                constants: &$crate::effect::definition::Constants,
                $state: &mut $State,
            ) {
                let lanes = $state.$lanes.0;
                let [$($constant,)+ ..] = constants.map(|value| $crate::lanes::Real::constant(lanes, value));
                $act;
            }
        }
    )*};
}
pub(crate) use effects;
