//! What a controller asks of a motion model, whatever it is that turns the vehicle.
//!
//! Every model is asked for two things, its channels: a speed, and how to turn in the model's own terms, a steering angle
//! for the [bicycle](crate::Model) and a yaw rate for the [skid-steered vehicle](crate::SkidSteer). Its equations stand
//! once, in [`MotionStepper`], in lanes: the pack of a kernel and the single vehicle that a plan is judged with are two
//! instances of them.

use crate::lanes::{Lanes, Real, Scalar};
use crate::{GroundSample, LaneState, ModelError, Odometry, Rates, SensorModel};
use std::f64::consts::TAU;
use std::fmt::Debug;

/// A command of two channels: speed [m/s], and how to turn in the model's own terms.
pub trait MotionCommand:
    Copy + Debug + Default + PartialEq + From<[f32; 2]> + Into<[f32; 2]> + Send + Sync + 'static
{
    /// What a vehicle is told that shall stand still and was told this before.
    fn at_standstill(self) -> Self;

    /// The first channel [m/s].
    fn speed_mps(self) -> f32 {
        let [speed_mps, _] = self.into();
        speed_mps
    }
}

/// State of a model in the terms that all models share.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct MotionState {
    /// East [m].
    pub x_m: f64,
    /// North [m].
    pub y_m: f64,
    /// Counter-clockwise from east [rad].
    pub yaw_rad: f64,
    /// Speed that the drive has reached, before the ground takes its share [m/s].
    pub speed_mps: f64,
    /// What the turning has reached before the ground takes its share: steering angle [rad] or yaw rate [rad/s].
    pub turn: f64,
}

/// What a vehicle can or may do, by channel where it is about commands: speed [m/s], then steering angle [rad] or yaw
/// rate [rad/s].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MotionLimits {
    /// Least that may be commanded.
    pub low: [f64; 2],
    /// Most that may be commanded.
    pub high: [f64; 2],
    /// Largest change in a second.
    pub rates: [f64; 2],
    /// Largest magnitude of the second channel that a step may start from.
    pub turn_domain: f64,
    /// Largest lateral acceleration that a plan may ask for [m/s2].
    pub lateral_acceleration_max_mps2: f64,
    /// Largest |roll| [rad].
    pub roll_max_rad: f64,
    /// Largest |pitch| [rad].
    pub pitch_max_rad: f64,
}

impl MotionLimits {
    /// With a share of the limits of roll and pitch.
    pub fn with_attitude_share(self, share: f64) -> Self {
        Self { roll_max_rad: share * self.roll_max_rad, pitch_max_rad: share * self.pitch_max_rad, ..self }
    }
}

/// How much of a step there is to compute.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Extent {
    /// The actuators follow at once: [`MotionStepper::step_bare`] is the whole step.
    Bare,
    /// The actuators follow within limits: [`MotionStepper::step_plain`] is the whole step.
    Plain,
    /// [`MotionStepper::step`].
    Whole,
}

/// What a controller believes of its vehicle: a description from which steps are made.
pub trait MotionModel: Clone + Debug + Send + Sync + 'static {
    /// What the vehicle is asked to do.
    type Command: MotionCommand;
    /// Pose and what the actuators have reached.
    type State: Copy + Debug + Default + PartialEq + From<MotionState> + Into<MotionState> + Send + Sync;
    /// The model made ready.
    type Stepper: MotionStepper;

    /// Refuses values that no model can have.
    ///
    /// # Errors
    /// The first field that is out of range.
    fn validate(&self) -> Result<(), ModelError>;

    /// Steps of `step_s`, positions in units of `unit_m`.
    fn stepper(&self, step_s: f64, unit_m: f64) -> Self::Stepper;

    /// What the vehicle can or may do.
    fn motion_limits(&self) -> MotionLimits;

    /// Least time in which it turns by a radian while driving ahead: the tightest turn at the largest speed that the
    /// limits allow there [s/rad].
    fn turning_s_per_rad(&self) -> f64;

    /// With a share of its limits of roll and pitch.
    fn with_attitude_share(self, share: f64) -> Self;

    /// What is believed of the sensors: what they measure is corrected by it.
    fn sensors(&self) -> SensorModel {
        SensorModel::NEUTRAL
    }

    /// The state that a corrected measurement stands for.
    fn measured_state(&self, odometry: &Odometry) -> Self::State;
}

/// What a step of one vehicle starts from.
#[derive(Clone, Copy, Debug)]
pub struct StepInput {
    /// In metres and radians.
    pub state: MotionState,
    /// Speed [m/s], and steering angle [rad] or yaw rate [rad/s].
    pub command: [f32; 2],
    /// The ground where it stands.
    pub ground: GroundSample,
}

/// What a step of one vehicle leads to.
#[derive(Clone, Copy, Debug, Default)]
pub struct StepOutcome {
    /// In metres and radians.
    pub state: MotionState,
    /// Mean yaw rate of the step [rad/s].
    pub yaw_rate_radps: f64,
}

/// A model made ready for one step length and one unit of length.
///
/// Models that remember something of the past override what is said of memory: [`MotionStepper::n_slots`] numbers per
/// vehicle, of which the last [`MotionStepper::n_held`] are accelerations that are held against forces that were met.
pub trait MotionStepper: Clone + Debug + Send + Sync + 'static {
    /// Whether all vehicles are asked for together, by [`MotionStepper::step_together`]: for models that answer a thousand
    /// vehicles about as fast as one.
    const GOES_TOGETHER: bool = false;

    /// How much of a step there is to compute.
    fn extent(&self) -> Extent;

    /// One step whose actuators follow at once and in which nothing else acts; by default the whole step without memory.
    fn step_bare<L: Lanes>(
        &self,
        state: &mut LaneState<L>,
        command: [Real<L>; 2],
        ground: &GroundSample<Real<L>>,
    ) -> Rates<L> {
        self.step(state, command, ground, &mut [], 0)
    }

    /// One step whose actuators follow within their limits and in which nothing else acts; by default as above.
    fn step_plain<L: Lanes>(
        &self,
        state: &mut LaneState<L>,
        command: [Real<L>; 2],
        ground: &GroundSample<Real<L>>,
    ) -> Rates<L> {
        self.step(state, command, ground, &mut [], 0)
    }

    /// One step of the whole model. `memory` holds [`MotionStepper::n_slots`] values or more, `step` counts from the
    /// start.
    fn step<L: Lanes>(
        &self,
        state: &mut LaneState<L>,
        command: [Real<L>; 2],
        ground: &GroundSample<Real<L>>,
        memory: &mut [L::Value],
        step: usize,
    ) -> Rates<L>;

    /// One step of every vehicle into as many outcomes, where [`MotionStepper::GOES_TOGETHER`]; without memory.
    fn step_together(&self, _inputs: &[StepInput], _outcomes: &mut [StepOutcome]) {}

    /// Without the limits on how fast the actuators follow.
    fn with_instant_actuators(self) -> Self;

    /// Changes the unit of length.
    fn rescale(&mut self, unit_m: f64);

    /// Whether the step reads the gradient or the class of the ground.
    fn uses_ground(&self) -> bool {
        false
    }

    /// Numbers per vehicle that are carried from step to step.
    fn n_slots(&self) -> usize {
        0
    }

    /// Accelerations among them that are held against forces that were met.
    fn n_held(&self) -> usize {
        0
    }

    /// How far back [`MotionStepper::recall`] asks for commands [s].
    fn past_s(&self) -> f64 {
        0.0
    }

    /// Fills the memory as the past leaves it: `past` gives the channels of the command that was in force an age [s]
    /// before the start. What is held stays as it was.
    fn recall(&self, _past: &dyn Fn(f64) -> [f32; 2], _memory: &mut [f64]) {}

    /// Corrects what is held once a step was measured to be faster than foretold [m/s].
    fn correct_held(&self, _memory: &mut [f64], _faster_mps: f64) {}

    /// One step of one vehicle in metres and radians: the reference. The stepper's unit must be 1 m.
    fn step_one(
        &self,
        state: &MotionState,
        command: [f32; 2],
        ground: &GroundSample,
        memory: &mut [f64],
        step: usize,
    ) -> MotionState {
        let real = |value: f64| Real(Scalar, value);
        let mut lanes = LaneState {
            x: real(state.x_m),
            y: real(state.y_m),
            turns: real(state.yaw_rad / TAU),
            speed: real(state.speed_mps),
            steering: real(state.turn),
        };
        let ground = GroundSample {
            linear_traction: real(ground.linear_traction),
            angular_traction: real(ground.angular_traction),
            gradient: ground.gradient.map(real),
            class: real(ground.class),
        };
        let command = command.map(|channel| real(f64::from(channel)));
        self.step(&mut lanes, command, &ground, memory, step);
        MotionState {
            x_m: lanes.x.1,
            y_m: lanes.y.1,
            yaw_rad: lanes.turns.1 * TAU,
            speed_mps: lanes.speed.1,
            turn: lanes.steering.1,
        }
    }
}
