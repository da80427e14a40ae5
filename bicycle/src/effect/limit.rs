//! What drive and brakes can do at the most.

use super::definition::{Driving, as_they_are, effects, parameters};

/// Below this the force is that of this speed [m/s].
const SLOWEST_MPS: f64 = 0.3;

effects! {
    Drive on_drive(Driving<L>, speed) by as_they_are;

    /// What drive and brakes can do.
    DriveLimit "drive_limit": "drive limit: -B <= acceleration of the drive <= A"
        role Calibration
    {
        /// Largest acceleration A [m/s2].
        acceleration_mps2 in "m/s2": 0.05 to 50.0, neutral 50.0, tried [1.0, 1.5, 2.0, 2.7, 3.5, 4.5, 6.0];
        /// Largest deceleration B [m/s2].
        deceleration_mps2 in "m/s2": 0.05 to 50.0, neutral 50.0, tried [1.0, 1.5, 2.0, 2.7, 3.5, 4.5, 6.0];
    } |most, least; state| state.give(state.acceleration.clamp(-least, most));

    /// A drive whose force falls as the speed grows.
    DrivePower "drive_power": "drive power: acceleration of the drive <= P / max(|v|, 0.3 m/s)"
        role Calibration
    {
        /// Largest power over mass P [m2/s3].
        power_m2_per_s3 in "m2/s3": 0.05 to 1e4, neutral 1e4, tried [0.5, 1.0, 2.0, 4.0, 8.0, 16.0, 32.0];
    } |power; state| {
        let slowest = state.speed.0.real(SLOWEST_MPS);
        state.give(state.acceleration.min(power / state.speed.abs().max(slowest)));
    };

    /// A drive and brakes weaker than the simulator's.
    DriveForceLimit "drive_force_limit": "acceleration limit made by a weak drive: |drive force| <= A mass"
        cause "accel_limit"
    {
        /// Largest force over mass A [m/s2].
        acceleration_mps2 in "m/s2": 0.05 to 1e6, neutral 1e6, tried [0.5, 1.0, 1.8, 3.0];
    } |limit; state| state.give(state.acceleration.clamp(-limit, limit));
}
