//! What a controller believes of its vehicle and of the ground under it.

use crate::effect::{Effect, EffectError};
use crate::lanes::STEERING_DOMAIN_RAD;
use crate::{Command, Limits, MotionLimits, MotionModel, Odometry, SensorModel, State, Stepper, Vehicle};
use serde::{Deserialize, Serialize};

/// What the ground under a pose does to the vehicle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GroundSample<T = f64> {
    /// Achieved over commanded speed, in [0, 1].
    pub linear_traction: T,
    /// Achieved over commanded yaw rate, in [0, 1].
    pub angular_traction: T,
    /// Height change per metre east and north [-].
    pub gradient: [T; 2],
    /// Number of the terrain class.
    pub class: T,
}

impl GroundSample {
    /// Level ground that gives everything that is asked of it.
    pub const FIRM: Self =
        Self { linear_traction: 1.0, angular_traction: 1.0, gradient: [0.0; 2], class: 0.0 };
}

/// What a controller believes of its vehicle.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Model {
    /// Between the axles [m].
    pub wheelbase_m: f64,
    /// What the vehicle can or may do.
    pub limits: Limits,
    /// What the kinematic bicycle leaves out, in order of action.
    #[serde(default)]
    pub effects: Vec<Effect>,
}

/// A model that cannot be.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ModelError {
    /// A length or limit is out of range.
    #[error("{field}: expected {expected}, found {found}")]
    Field {
        /// Dotted path of the field.
        field: &'static str,
        /// The range that would do.
        expected: &'static str,
        /// The value that was given.
        found: f64,
    },
    /// A parameter of an effect is out of range.
    #[error(transparent)]
    Effect(#[from] EffectError),
    /// A parameter of an effect is out of the range that is left at the speeds that the limits allow.
    #[error("{error}, for speeds of up to {speed_mps} m/s")]
    EffectAtSpeed {
        /// What is wrong.
        error: EffectError,
        /// Fastest speed that the vehicle reaches at the limits' fastest command [m/s].
        speed_mps: f64,
    },
}

/// Longest and shortest lengths, fastest speeds and quickest changes of anything on wheels: beyond them, the step's
/// arithmetic in f32 overflows.
const WHEELBASE_M: [f64; 2] = [0.01, 100.0];
pub(crate) const SPEED_MOST_MPS: f64 = 200.0;
pub(crate) const CHANGE_MOST: f64 = 1e6;
/// Share of the tyres' grip that a plan may ask for: beyond it they slide, and what they then do no model foretells well.
const GRIP_SHARE: f64 = 0.75;
const GRAVITY_MPS2: f64 = 9.81;

impl Model {
    /// The vehicle's geometry and limits, no effects.
    pub fn of(vehicle: &Vehicle) -> Self {
        Self { wheelbase_m: vehicle.geometry.wheelbase_m, limits: vehicle.limits, effects: Vec::new() }
    }

    /// Refuses values that no model can have.
    pub fn validate(&self) -> Result<(), ModelError> {
        let limits = &self.limits;
        let positive = [
            ("wheelbase_m", self.wheelbase_m),
            ("limits.speed_max_mps", limits.speed_max_mps),
            ("limits.steering_max_rad", limits.steering_max_rad),
            ("limits.steering_rate_max_radps", limits.steering_rate_max_radps),
            ("limits.acceleration_max_mps2", limits.acceleration_max_mps2),
            ("limits.lateral_acceleration_max_mps2", limits.lateral_acceleration_max_mps2),
            ("limits.roll_max_rad", limits.roll_max_rad),
            ("limits.pitch_max_rad", limits.pitch_max_rad),
        ];
        check(&positive, "a finite number > 0", |value| value > 0.0)?;
        let reverse = [("limits.reverse_speed_max_mps", limits.reverse_speed_max_mps)];
        check(&reverse, "a finite number >= 0", |value| value >= 0.0)?;
        let steering = [("limits.steering_max_rad", limits.steering_max_rad)];
        check(&steering, "an angle of at most 0.8 rad", |value| value <= STEERING_DOMAIN_RAD)?;
        self.validate_sizes()?;
        self.effects.iter().try_for_each(Effect::validate)?;
        let speed_mps = self.speed_reached_mps();
        let at_speed = |error| ModelError::EffectAtSpeed { error, speed_mps };
        self.effects.iter().try_for_each(|effect| effect.validate_at(speed_mps).map_err(at_speed))
    }

    fn validate_sizes(&self) -> Result<(), ModelError> {
        let limits = &self.limits;
        let [shortest_m, longest_m] = WHEELBASE_M;
        check(&[("wheelbase_m", self.wheelbase_m)], "a length from 0.01 to 100 m", |value| {
            (shortest_m..=longest_m).contains(&value)
        })?;
        let speeds = [
            ("limits.speed_max_mps", limits.speed_max_mps),
            ("limits.reverse_speed_max_mps", limits.reverse_speed_max_mps),
        ];
        check(&speeds, "a speed of at most 200 m/s", |value| value <= SPEED_MOST_MPS)?;
        let changes = [
            ("limits.steering_rate_max_radps", limits.steering_rate_max_radps),
            ("limits.acceleration_max_mps2", limits.acceleration_max_mps2),
            ("limits.lateral_acceleration_max_mps2", limits.lateral_acceleration_max_mps2),
        ];
        check(&changes, "a number of at most 1e6", |value| value <= CHANGE_MOST)
    }

    /// The fastest speed that commands within the limits lead to where no force pushes [m/s].
    fn speed_reached_mps(&self) -> f64 {
        let commanded_mps = self.limits.speed_max_mps.max(self.limits.reverse_speed_max_mps);
        let ratio: f64 = self.effects.iter().map(Effect::speed_ratio).product();
        commanded_mps * ratio.max(1.0)
    }
}

impl MotionModel for Model {
    type Command = Command;
    type State = State;
    type Stepper = Stepper;

    fn validate(&self) -> Result<(), ModelError> {
        Self::validate(self)
    }

    fn stepper(&self, step_s: f64, unit_m: f64) -> Stepper {
        Stepper::new(self, step_s, unit_m)
    }

    /// Of lateral acceleration, the limit or what is safe on tyres whose grip the model knows, whichever is less.
    fn motion_limits(&self) -> MotionLimits {
        let limits = &self.limits;
        let safe = |effect: &Effect| match effect {
            Effect::Friction(friction) => GRIP_SHARE * friction.mu * GRAVITY_MPS2,
            Effect::TyreSlide(slide) => GRIP_SHARE * slide.mu * GRAVITY_MPS2,
            _ => f64::INFINITY,
        };
        let lateral_max_mps2 = limits.lateral_acceleration_max_mps2;
        let lateral_acceleration_max_mps2 = self.effects.iter().map(safe).fold(lateral_max_mps2, f64::min);
        MotionLimits { lateral_acceleration_max_mps2, ..limits.into() }
    }

    /// The turning circle of the geometry, `R = L / tan(steering)`, at the speed limit or at that of the largest lateral
    /// acceleration, `sqrt(a R)`.
    fn turning_s_per_rad(&self) -> f64 {
        let limits = self.motion_limits();
        let radius_m = self.wheelbase_m / libm::tan(self.limits.steering_max_rad);
        radius_m / limits.high[0].min((limits.lateral_acceleration_max_mps2 * radius_m).sqrt())
    }

    fn with_attitude_share(mut self, share: f64) -> Self {
        self.limits.roll_max_rad *= share;
        self.limits.pitch_max_rad *= share;
        self
    }

    fn sensors(&self) -> SensorModel {
        SensorModel::of(&self.effects)
    }

    fn measured_state(&self, odometry: &Odometry) -> State {
        odometry.state()
    }
}

impl From<&Limits> for MotionLimits {
    fn from(limits: &Limits) -> Self {
        Self {
            low: [-limits.reverse_speed_max_mps, -limits.steering_max_rad],
            high: [limits.speed_max_mps, limits.steering_max_rad],
            rates: [limits.acceleration_max_mps2, limits.steering_rate_max_radps],
            turn_domain: STEERING_DOMAIN_RAD,
            lateral_acceleration_max_mps2: limits.lateral_acceleration_max_mps2,
            roll_max_rad: limits.roll_max_rad,
            pitch_max_rad: limits.pitch_max_rad,
        }
    }
}

/// Refuses the first field that is not a finite number of the allowed range.
pub(crate) fn check(
    fields: &[(&'static str, f64)],
    expected: &'static str,
    allowed: impl Fn(f64) -> bool,
) -> Result<(), ModelError> {
    match fields.iter().find(|(_, value)| !(value.is_finite() && allowed(*value))) {
        Some(&(field, found)) => Err(ModelError::Field { field, expected, found }),
        None => Ok(()),
    }
}
