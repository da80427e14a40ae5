//! Commands that arrive as others than they were: scaled, shifted or not at all.

use super::definition::{Commanding, as_they_are, effects, parameters};

effects! {
    Command on_command(Commanding<'_, L>, speed) by as_they_are;

    /// Speed commands too small to move the motor.
    MotorDeadband "motor_deadband": "motor deadband: speed command = 0 where |command| < D"
    {
        /// Smallest command D that moves it [m/s].
        speed_mps in "m/s": 0.0 to 5.0, neutral 0.0, tried [0.3, 0.6, 1.0, 1.8, 3.0];
    } |least; state| {
        let still = state.speed.abs().less(least);
        state.speed = state.speed.0.real(0.0).or_else(still, state.speed);
    };

    /// Speed out of proportion with the command.
    SpeedScale "speed_scale": "speed scale: x = S command (wheel radius, linear drag)"
    {
        /// Achieved over commanded speed S [-].
        ratio in "-": 0.2 to 2.0, neutral 1.0, tried [0.8, 0.92, 1.08, 1.2];
    } |ratio; state| state.speed = state.speed * ratio;

    /// Steering angle out of proportion with the command.
    SteerGain "steer_gain": "steering gain: x = G command (steering ratio, wheelbase)"
    {
        /// Achieved over commanded angle G [-].
        ratio in "-": 0.2 to 2.0, neutral 1.0, tried [0.75, 0.9, 1.1, 1.25];
    } |ratio; state| state.steering = state.steering * ratio;

    /// Steering that is not straight when it is told to be.
    SteerBias "steer_bias": "steering bias: x = command + B (trim)"
    {
        /// Angle B at a command of zero [rad].
        angle_rad in "rad": -0.3 to 0.3, neutral 0.0, tried [-0.06, -0.02, 0.02, 0.06];
    } |angle; state| state.steering = state.steering + angle;
}
