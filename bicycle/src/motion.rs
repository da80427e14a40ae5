//! States, commands and what the vehicle measures of its own motion.

use crate::{MotionCommand, MotionState};

/// What a vehicle is asked to do that steers its front wheels.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
#[repr(C)]
pub struct Command {
    /// Speed along the body's x axis, negative in reverse [m/s].
    pub speed_mps: f32,
    /// Angle of the front wheels, left positive [rad].
    pub steering_rad: f32,
}

impl From<[f32; 2]> for Command {
    fn from([speed_mps, steering_rad]: [f32; 2]) -> Self {
        Self { speed_mps, steering_rad }
    }
}

impl From<Command> for [f32; 2] {
    fn from(command: Command) -> Self {
        [command.speed_mps, command.steering_rad]
    }
}

impl MotionCommand for Command {
    /// No speed, and the wheels as they were told to stand.
    fn at_standstill(self) -> Self {
        Self { speed_mps: 0.0, ..self }
    }
}

/// State of the bicycle model: pose of the rear axle's centre and what the actuators have reached.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct State {
    /// East [m].
    pub x_m: f64,
    /// North [m].
    pub y_m: f64,
    /// Counter-clockwise from east [rad].
    pub yaw_rad: f64,
    /// Speed that the drive has reached, before the ground takes its share [m/s].
    pub speed_mps: f64,
    /// Angle that the front wheels have reached [rad].
    pub steering_rad: f64,
}

impl From<MotionState> for State {
    fn from(state: MotionState) -> Self {
        let MotionState { x_m, y_m, yaw_rad, speed_mps, turn: steering_rad } = state;
        Self { x_m, y_m, yaw_rad, speed_mps, steering_rad }
    }
}

impl From<State> for MotionState {
    fn from(state: State) -> Self {
        let State { x_m, y_m, yaw_rad, speed_mps, steering_rad } = state;
        Self { x_m, y_m, yaw_rad, speed_mps, turn: steering_rad }
    }
}

/// What a vehicle knows of its own motion at one instant.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Odometry {
    /// When it was measured, monotonic [ns].
    pub valid_at_ns: u64,
    /// Position of the rear axle's centre in the map frame [m].
    pub position_m: [f64; 3],
    /// Roll, pitch, yaw [rad]; roll > 0 lifts the left side, pitch > 0 lowers the nose.
    pub attitude_rad: [f64; 3],
    /// Forward and leftward velocity of the rear axle's centre in the body frame [m/s].
    pub velocity_mps: [f64; 2],
    /// Yaw rate [rad/s].
    pub yaw_rate_radps: f64,
    /// Mean circumferential speed of the driven wheels [m/s].
    pub wheel_speed_mps: f64,
    /// Measured angle of the front wheels [rad].
    pub steering_rad: f64,
}

impl Odometry {
    /// Whether every value is a finite number.
    pub fn is_finite(&self) -> bool {
        self.position_m
            .iter()
            .chain(&self.attitude_rad)
            .chain(&self.velocity_mps)
            .chain(&[self.yaw_rate_radps, self.wheel_speed_mps, self.steering_rad])
            .all(|value| value.is_finite())
    }

    /// The model state that this measurement stands for.
    pub fn state(&self) -> State {
        State {
            x_m: self.position_m[0],
            y_m: self.position_m[1],
            yaw_rad: self.attitude_rad[2],
            speed_mps: self.wheel_speed_mps,
            steering_rad: self.steering_rad,
        }
    }
}

/// One sample of an inertial measurement unit in the body frame.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ImuSample {
    /// When it was measured, monotonic [ns].
    pub valid_at_ns: u64,
    /// Specific force [m/s2]; (0, 0, +9.81) at rest on level ground.
    pub acceleration_mps2: [f32; 3],
    /// Angular rate [rad/s].
    pub angular_rate_radps: [f32; 3],
}
