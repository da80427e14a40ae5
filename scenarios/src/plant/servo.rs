//! The steering servo: response, rate limit, and the Ackermann geometry of the wheels behind it.

use bicycle::Vehicle;

use super::linkage::Linkage;

/// Turns the front wheels.
pub(crate) struct SteeringServo {
    servo_rad: f64,
    steering_rad: f64,
    linkage: Linkage,
    response_s: f64,
    rate_max_radps: f64,
    steering_max_rad: f64,
    wheelbase_m: f64,
    track_m: f64,
}

impl SteeringServo {
    pub(crate) fn new(vehicle: &Vehicle, linkage: Linkage) -> Self {
        Self {
            servo_rad: 0.0,
            steering_rad: 0.0,
            linkage,
            response_s: vehicle.servo.response_s,
            rate_max_radps: vehicle.limits.steering_rate_max_radps,
            steering_max_rad: vehicle.limits.steering_max_rad,
            wheelbase_m: vehicle.geometry.wheelbase_m,
            track_m: vehicle.geometry.track_m,
        }
    }

    /// Turns for a step under the ground's lateral force on the front axle, left positive [N].
    pub(crate) fn step(&mut self, commanded_rad: f64, lateral_n: f64, step_s: f64) {
        let target_rad = commanded_rad.clamp(-self.steering_max_rad, self.steering_max_rad);
        // Implicit in the response, so that a response faster than the step is no trouble.
        let wanted_rad = (target_rad - self.servo_rad) * step_s / (self.response_s + step_s);
        let most_rad = self.rate_max_radps * step_s;
        self.servo_rad += wanted_rad.clamp(-most_rad, most_rad);
        self.steering_rad = self.linkage.turn(self.servo_rad, lateral_n, step_s);
    }

    /// Angle of the bicycle's one front wheel [rad].
    pub(crate) fn steering_rad(&self) -> f64 {
        self.steering_rad
    }

    /// Angles of the left and right wheel, perpendicular to the lines from the turn's centre [rad].
    pub(crate) fn wheel_angles_rad(&self) -> [f64; 2] {
        let tan = self.steering_rad.tan();
        [-0.5, 0.5].map(|side| (tan / (1.0 + side * tan * self.track_m / self.wheelbase_m)).atan())
    }
}
