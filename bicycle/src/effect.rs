//! The catalogue of effects: what a real machine does and the kinematic bicycle does not.
//!
//! An effect is its id, what it is, its parameters with bounds and units, and how it changes a step. Effects of one shape
//! are a family in one file, which says once how they act; the others have a file each.
//! It acts at one or more stages of a step: on the command before the actuators follow it, on the
//! acceleration, on the motion before the ground takes its share, or on what the sensors say. Effects of a model
//! act in the order in which the model lists them, and the same effect may stand there more than once: two
//! lags in series are two lags. To add one, write it and name it in [`catalogue!`] below.

mod actuator;
mod command;
mod definition;
mod drag;
mod drive_lag;
mod feed_forward;
mod felt_slope;
mod friction;
mod gravity;
mod limit;
mod mass;
mod prepared;
mod rear_slip;
mod sensors;
mod speed_integral;
mod speed_loop;
mod speed_ramp;
mod steer_linkage;
mod steer_servo;
mod steer_swing;
mod tyre_slide;
mod tyre_slip;
mod wheel_slip;
mod wind;
mod yaw_gain;
mod yaw_load;

pub use definition::{Description, Parameter, Role};
pub(crate) use definition::{Driving, Moving};
pub(crate) use prepared::{CommandStep, PreparedEffects};
pub use sensors::SensorModel;

use crate::lanes::Lanes;
use definition::{Commanding, Constants, Definition, Stage, Values};

/// Standard gravity [m/s2].
pub(crate) const STANDARD_GRAVITY_MPS2: f64 = 9.80665;

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

        /// Every effect there is.
        pub const CATALOGUE: &[Description] = &[$(Description {
            id: $name::ID,
            meaning: $name::MEANING,
            role: $name::ROLE,
            cause: $name::CAUSE,
            parameters: $name::PARAMETERS,
        },)*];

        impl Effect {
            /// What the catalogue says of it.
            pub fn description(&self) -> Description {
                CATALOGUE[self.kind() as usize]
            }

            /// The effect with this id and these values of its parameters; `None` for an unknown id.
            pub fn from_values(id: &str, values: [f64; 4]) -> Option<Self> {
                $(if id == $name::ID {
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

            fn carries_motion(&self) -> bool {
                match self { $(Self::$name(_) => $name::CARRIES_MOTION,)* }
            }

            fn stages(&self) -> &'static [Stage] {
                match self { $(Self::$name(_) => $name::STAGES,)* }
            }

            fn kind(&self) -> Kind {
                match self { $(Self::$name(_) => Kind::$name,)* }
            }

            fn least_at(&self, speed_mps: f64) -> f64 {
                match self { $(Self::$name(_) => $name::least_at(speed_mps),)* }
            }

            fn constants(&self, step_s: f64) -> [f64; 4] {
                match self { $(Self::$name(effect) => effect.constants(step_s),)* }
            }

            fn n_slots(&self, step_s: f64) -> usize {
                match self { $(Self::$name(effect) => effect.n_slots(step_s),)* }
            }

            fn held_follows_per_s(&self) -> Option<f64> {
                match self { $(Self::$name(effect) => effect.held_follows_per_s(),)* }
            }

            fn steady_state(&self, command: [f64; 2]) -> f64 {
                match self { $(Self::$name(effect) => effect.steady_state(command),)* }
            }

            fn on_sensors(&self, sensors: &mut SensorModel) {
                match self { $(Self::$name(effect) => effect.on_sensors(sensors),)* }
            }
        }

        impl Kind {
            #[inline(always)]
            fn on_command<L: Lanes>(self, constants: &Constants, state: &mut Commanding<'_, L>) {
                match self { $(Self::$name => $name::on_command(constants, state),)* }
            }

            #[inline(always)]
            fn on_drive<L: Lanes>(self, constants: &Constants, state: &mut Driving<L>) {
                match self { $(Self::$name => $name::on_drive(constants, state),)* }
            }

            #[inline(always)]
            fn once_driven<L: Lanes>(self, constants: &Constants, state: &mut Driving<L>) {
                match self { $(Self::$name => $name::once_driven(constants, state),)* }
            }

            #[inline(always)]
            fn on_motion<L: Lanes>(self, constants: &Constants, state: &mut Moving<L>) {
                match self { $(Self::$name => $name::on_motion(constants, state),)* }
            }
        }
    };
}

catalogue! {
    actuator::SteerDelay,
    actuator::SpeedDelay,
    command::MotorDeadband,
    command::SpeedScale,
    command::SteerGain,
    command::SteerBias,
    actuator::Backlash,
    actuator::SteerRate,
    actuator::SteerLag,
    steer_servo::SteerServo,
    steer_servo::LimitedServo,
    steer_swing::SteerSwing,
    actuator::SpeedLag,
    actuator::SpeedLagChain,
    actuator::AccelLimit,
    speed_ramp::SpeedRamp,
    wheel_slip::WheelSlip,
    speed_loop::SpeedLoop,
    feed_forward::FeedForward,
    speed_integral::SpeedIntegral,
    gravity::HillCompensation,
    felt_slope::FeltSlope,
    gravity::CompensationLoss,
    limit::DriveLimit,
    limit::DrivePower,
    limit::DriveForceLimit,
    drive_lag::DriveLag,
    mass::Mass,
    drag::RollingDrag,
    drag::QuadDrag,
    drag::VegDrag,
    drag::LooseDrag,
    drag::CorneringDrag,
    gravity::SlopeGravity,
    gravity::CrossSlope,
    wind::Wind,
    steer_linkage::SteerLinkage,
    yaw_gain::Understeer,
    yaw_gain::SteerYield,
    yaw_load::YawLoad,
    rear_slip::RearSlip,
    rear_slip::RearSteer,
    friction::Friction,
    tyre_slip::TyreSlip,
    tyre_slide::TyreSlide,
    sensors::PoseLatency,
    sensors::OdomScale,
    sensors::GyroBias,
    sensors::YawMisalign,
}

impl Effect {
    /// Whether it changes the command before the actuators follow it.
    pub fn acts_on_command(&self) -> bool {
        self.stages().contains(&Stage::Command)
    }

    /// Whether it changes what the sensors say.
    pub fn acts_on_sensors(&self) -> bool {
        self.stages().contains(&Stage::Sensors)
    }

    /// Whether it changes how the body moves, whatever the actuators reach and the sensors say.
    pub fn acts_on_body(&self) -> bool {
        self.stages().iter().any(|stage| matches!(stage, Stage::Drive | Stage::Motion))
    }

    /// The factor by which the speed that is reached exceeds the one that is commanded.
    pub(crate) fn speed_ratio(&self) -> f64 {
        match self {
            Self::SpeedScale(scale) => scale.ratio,
            _ => 1.0,
        }
    }

    /// Refuses parameters within their bounds with which a step is not finite at every speed of up to `speed_mps`.
    pub fn validate_at(&self, speed_mps: f64) -> Result<(), EffectError> {
        self.validate()?;
        let least = self.least_at(speed_mps);
        let Description { id, parameters, .. } = self.description();
        match (parameters.first(), self.values()[0]) {
            (Some(&Parameter { name, unit, high, .. }), found) if found < least => {
                Err(EffectError { id, parameter: name, low: least, high, unit, found })
            }
            _ => Ok(()),
        }
    }

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

/// Adds an effect to others where the order of the catalogue, the order of a machine from command to sensor, has its
/// place: after all that come before it there and after those of its own kind.
pub fn add_in_order(effects: &mut Vec<Effect>, effect: Effect) {
    let place = effects.iter().position(|other| other.kind() as usize > effect.kind() as usize);
    effects.insert(place.unwrap_or(effects.len()), effect);
}
