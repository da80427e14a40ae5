//! A vehicle that turns by driving its sides at different speeds, taken for a unicycle on ground that takes a share of
//! both of its motions (Cai et al., EVORA, the unicycle with linear and angular traction):
//! x' = l1 v cos(yaw), y' = l1 v sin(yaw), yaw' = l2 w.
//!
//! It turns about a point between its axles, while poses are those of the rear axle's centre, as everywhere: where the
//! point lies ahead of it, a turn takes the rear axle sideways.

use crate::lanes::{Constant, Lanes, Real};
use crate::model::{CHANGE_MOST, SPEED_MOST_MPS, check};
use crate::stepper::{ENDLESS, towards};
use crate::{
    Extent, Geometry, GroundSample, LaneState, ModelError, MotionCommand, MotionLimits, MotionModel,
    MotionState, MotionStepper, Odometry, Rates,
};
use serde::{Deserialize, Serialize};
use std::f64::consts::TAU;

/// Quickest turning of anything on wheels or tracks [rad/s].
const YAW_RATE_MOST_RADPS: f64 = 100.0;
/// Farthest that a vehicle turns about a point ahead of its rear axle, or behind it [m].
const TURNING_POINT_MOST_M: f64 = 100.0;
/// Longest lag of a drive [s].
const LAG_MOST_S: f64 = 10.0;

/// What a skid-steered vehicle is asked to do.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[repr(C)]
pub struct SkidSteerCommand {
    /// Speed along the body's x axis, negative in reverse [m/s].
    pub speed_mps: f32,
    /// Yaw rate, counter-clockwise positive [rad/s].
    pub yaw_rate_radps: f32,
}

impl From<[f32; 2]> for SkidSteerCommand {
    fn from([speed_mps, yaw_rate_radps]: [f32; 2]) -> Self {
        Self { speed_mps, yaw_rate_radps }
    }
}

impl From<SkidSteerCommand> for [f32; 2] {
    fn from(command: SkidSteerCommand) -> Self {
        [command.speed_mps, command.yaw_rate_radps]
    }
}

impl MotionCommand for SkidSteerCommand {
    /// Neither speed nor yaw rate: a turn goes on without any speed.
    fn at_standstill(self) -> Self {
        Self::default()
    }
}

/// State of the skid-steered model: pose of the rear axle's centre and what the drives have reached.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SkidSteerState {
    /// East [m].
    pub x_m: f64,
    /// North [m].
    pub y_m: f64,
    /// Counter-clockwise from east [rad].
    pub yaw_rad: f64,
    /// Speed that the drives have reached, before the ground takes its share [m/s].
    pub speed_mps: f64,
    /// Yaw rate that the drives have reached, before the ground takes its share [rad/s].
    pub yaw_rate_radps: f64,
}

impl From<MotionState> for SkidSteerState {
    fn from(state: MotionState) -> Self {
        let MotionState { x_m, y_m, yaw_rad, speed_mps, turn: yaw_rate_radps } = state;
        Self { x_m, y_m, yaw_rad, speed_mps, yaw_rate_radps }
    }
}

impl From<SkidSteerState> for MotionState {
    fn from(state: SkidSteerState) -> Self {
        let SkidSteerState { x_m, y_m, yaw_rad, speed_mps, yaw_rate_radps } = state;
        Self { x_m, y_m, yaw_rad, speed_mps, turn: yaw_rate_radps }
    }
}

/// What a skid-steered vehicle can or may do.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SkidSteerLimits {
    /// Fastest forward speed that is commanded [m/s].
    pub speed_max_mps: f64,
    /// Fastest speed in reverse, 0 = none [m/s].
    pub reverse_speed_max_mps: f64,
    /// Largest yaw rate that is commanded [rad/s].
    pub yaw_rate_max_radps: f64,
    /// Largest change of speed [m/s2].
    pub acceleration_max_mps2: f64,
    /// Largest change of yaw rate [rad/s2].
    pub yaw_acceleration_max_radps2: f64,
    /// Largest lateral acceleration that a plan may ask for [m/s2].
    pub lateral_acceleration_max_mps2: f64,
    /// Largest |roll| [rad].
    pub roll_max_rad: f64,
    /// Largest |pitch| [rad].
    pub pitch_max_rad: f64,
}

/// What a controller believes of a skid-steered vehicle.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SkidSteer {
    /// What the vehicle can or may do.
    pub limits: SkidSteerLimits,
    /// First-order response time of the speed, 0 = none [s].
    #[serde(default)]
    pub speed_lag_s: f64,
    /// First-order response time of the yaw rate, 0 = none [s].
    #[serde(default)]
    pub yaw_rate_lag_s: f64,
    /// From the rear axle's centre ahead to the point that the vehicle turns about [m].
    #[serde(default)]
    pub turning_point_ahead_m: f64,
}

/// Description of a skid-steered machine, as a planner needs it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SkidSteerVehicle {
    /// Name, for reports.
    pub name: String,
    /// Lengths; the body frame sits at the rear axle's centre.
    pub geometry: Geometry,
    /// How it moves.
    pub model: SkidSteer,
}

impl AsRef<Geometry> for SkidSteerVehicle {
    fn as_ref(&self) -> &Geometry {
        &self.geometry
    }
}

impl MotionModel for SkidSteer {
    type Command = SkidSteerCommand;
    type State = SkidSteerState;
    type Stepper = SkidSteerStepper;

    fn validate(&self) -> Result<(), ModelError> {
        let limits = &self.limits;
        let angles =
            [("limits.roll_max_rad", limits.roll_max_rad), ("limits.pitch_max_rad", limits.pitch_max_rad)];
        check(&angles, "a finite number > 0", |value| value > 0.0)?;
        let forward = [("limits.speed_max_mps", limits.speed_max_mps)];
        check(&forward, "a speed > 0 of at most 200 m/s", |value| value > 0.0 && value <= SPEED_MOST_MPS)?;
        let reverse = [("limits.reverse_speed_max_mps", limits.reverse_speed_max_mps)];
        check(&reverse, "a speed from 0 to 200 m/s", |value| (0.0..=SPEED_MOST_MPS).contains(&value))?;
        let turning = [("limits.yaw_rate_max_radps", limits.yaw_rate_max_radps)];
        check(&turning, "a yaw rate > 0 of at most 100 rad/s", |value| {
            value > 0.0 && value <= YAW_RATE_MOST_RADPS
        })?;
        let changes = [
            ("limits.acceleration_max_mps2", limits.acceleration_max_mps2),
            ("limits.yaw_acceleration_max_radps2", limits.yaw_acceleration_max_radps2),
            ("limits.lateral_acceleration_max_mps2", limits.lateral_acceleration_max_mps2),
        ];
        check(&changes, "a number > 0 of at most 1e6", |value| value > 0.0 && value <= CHANGE_MOST)?;
        let lags = [("speed_lag_s", self.speed_lag_s), ("yaw_rate_lag_s", self.yaw_rate_lag_s)];
        check(&lags, "a time from 0 to 10 s", |value| (0.0..=LAG_MOST_S).contains(&value))?;
        let ahead = [("turning_point_ahead_m", self.turning_point_ahead_m)];
        check(&ahead, "a length from -100 to 100 m", |value| value.abs() <= TURNING_POINT_MOST_M)
    }

    fn stepper(&self, step_s: f64, unit_m: f64) -> SkidSteerStepper {
        let limits = &self.limits;
        let rates = [limits.acceleration_max_mps2, limits.yaw_acceleration_max_radps2];
        let lags_s = [self.speed_lag_s, self.yaw_rate_lag_s];
        let share = |lag_s: f64| if lag_s > 0.0 { -libm::expm1(-step_s / lag_s) } else { 1.0 };
        SkidSteerStepper {
            advance: Constant::new(step_s / unit_m),
            aside: Constant::new(self.turning_point_ahead_m * step_s / unit_m),
            turn: Constant::new(step_s / TAU),
            changes: rates.map(|rate| Constant::new(rate * step_s)),
            shares: lags_s.map(|lag_s| Constant::new(share(lag_s))),
            has_lag: lags_s != [0.0; 2],
            step_s,
            ahead_m: self.turning_point_ahead_m,
        }
    }

    fn motion_limits(&self) -> MotionLimits {
        (&self.limits).into()
    }

    fn turning_s_per_rad(&self) -> f64 {
        1.0 / self.limits.yaw_rate_max_radps
    }

    fn with_attitude_share(mut self, share: f64) -> Self {
        self.limits.roll_max_rad *= share;
        self.limits.pitch_max_rad *= share;
        self
    }

    /// The yaw rate is that of the body: what the drives have reached beyond what the ground lets through is not
    /// measured.
    fn measured_state(&self, odometry: &Odometry) -> SkidSteerState {
        let ([x_m, y_m, _], [_, _, yaw_rad]) = (odometry.position_m, odometry.attitude_rad);
        let (speed_mps, yaw_rate_radps) = (odometry.wheel_speed_mps, odometry.yaw_rate_radps);
        SkidSteerState { x_m, y_m, yaw_rad, speed_mps, yaw_rate_radps }
    }
}

impl From<&SkidSteerLimits> for MotionLimits {
    fn from(limits: &SkidSteerLimits) -> Self {
        Self {
            low: [-limits.reverse_speed_max_mps, -limits.yaw_rate_max_radps],
            high: [limits.speed_max_mps, limits.yaw_rate_max_radps],
            rates: [limits.acceleration_max_mps2, limits.yaw_acceleration_max_radps2],
            turn_domain: f64::INFINITY,
            lateral_acceleration_max_mps2: limits.lateral_acceleration_max_mps2,
            roll_max_rad: limits.roll_max_rad,
            pitch_max_rad: limits.pitch_max_rad,
        }
    }
}

/// A skid-steered model made ready for one step length and one unit of length.
#[derive(Clone, Debug)]
pub struct SkidSteerStepper {
    advance: Constant,
    /// What a yaw rate takes the rear axle to the right in a step [unit s/rad].
    aside: Constant,
    turn: Constant,
    /// Largest changes in a step.
    changes: [Constant; 2],
    /// Share of the distance to what is asked that a lagging drive makes good in a step.
    shares: [Constant; 2],
    has_lag: bool,
    step_s: f64,
    ahead_m: f64,
}

impl SkidSteerStepper {
    /// Moves a vehicle whose drives have acted.
    #[inline(always)]
    fn roll<L: Lanes>(&self, state: &mut LaneState<L>, ground: &GroundSample<Real<L>>) -> Rates<L> {
        let speed = state.speed;
        let advance = speed * ground.linear_traction * Real::constant(state.x.0, self.advance);
        let yaw_rate = state.steering * ground.angular_traction;
        let (sine, cosine) = state.turns.sin_cos_turns();
        let aside = yaw_rate * Real::constant(state.x.0, self.aside);
        state.x = aside.mul_add(sine, state.x);
        state.y = state.y - aside * cosine;
        state.carry_on(advance, yaw_rate, self.turn);
        Rates { speed, side_speed: -(yaw_rate * speed.0.real(self.ahead_m)), yaw_rate }
    }
}

impl MotionStepper for SkidSteerStepper {
    fn extent(&self) -> Extent {
        match (self.has_lag, self.changes[0].value() >= ENDLESS) {
            (true, _) => Extent::Whole,
            (false, true) => Extent::Bare,
            (false, false) => Extent::Plain,
        }
    }

    #[inline(always)]
    fn step_bare<L: Lanes>(
        &self,
        state: &mut LaneState<L>,
        command: [Real<L>; 2],
        ground: &GroundSample<Real<L>>,
    ) -> Rates<L> {
        [state.speed, state.steering] = command;
        self.roll(state, ground)
    }

    #[inline(always)]
    fn step_plain<L: Lanes>(
        &self,
        state: &mut LaneState<L>,
        command: [Real<L>; 2],
        ground: &GroundSample<Real<L>>,
    ) -> Rates<L> {
        state.speed = towards(command[0], state.speed, self.changes[0]);
        state.steering = towards(command[1], state.steering, self.changes[1]);
        self.roll(state, ground)
    }

    #[inline(always)]
    fn step<L: Lanes>(
        &self,
        state: &mut LaneState<L>,
        command: [Real<L>; 2],
        ground: &GroundSample<Real<L>>,
        _memory: &mut [L::Value],
        _step: usize,
    ) -> Rates<L> {
        let lagging = |asked: Real<L>, reached: Real<L>, share: Constant| {
            (asked - reached).mul_add(Real::constant(reached.0, share), reached)
        };
        let asked = [
            lagging(command[0], state.speed, self.shares[0]),
            lagging(command[1], state.steering, self.shares[1]),
        ];
        self.step_plain(state, asked, ground)
    }

    fn with_instant_actuators(mut self) -> Self {
        self.changes = [Constant::new(ENDLESS); 2];
        self
    }

    fn rescale(&mut self, unit_m: f64) {
        self.advance = Constant::new(self.step_s / unit_m);
        self.aside = Constant::new(self.ahead_m * self.step_s / unit_m);
    }
}
