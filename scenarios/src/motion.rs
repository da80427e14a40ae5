//! The true motion of the vehicle at one instant.

use terrain::Pose;

/// How the vehicle really moves: what simulated sensors measure and a trace records.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Motion {
    /// Pose of the body frame (rear axle's centre) in the map frame.
    pub pose: Pose,
    /// Velocity of the body frame's origin, along the body's axes [m/s].
    pub velocity_mps: [f64; 3],
    /// Angular rate, along the body's axes [rad/s].
    pub angular_rate_radps: [f64; 3],
    /// Specific force at the body frame's origin, along the body's axes [m/s2]; (0, 0, +9.81) at rest on level
    /// ground.
    pub specific_force_mps2: [f64; 3],
    /// Mean circumferential speed of the driven wheels [m/s].
    pub wheel_speed_mps: f64,
    /// Angle of the front wheels, left positive [rad].
    pub steering_rad: f64,
}
