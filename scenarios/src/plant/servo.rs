//! From commanded to actual steering: transport delay, response, rate limit, Ackermann linkage.

use bicycle::{Command, Vehicle};

/// Commands on their way to the actuators.
pub(crate) struct DelayQueue {
    waiting: Vec<Command>,
    next: usize,
}

impl DelayQueue {
    pub(crate) fn new(delay_s: f64, step_s: f64) -> Self {
        let n_steps = (delay_s / step_s).round() as usize;
        Self { waiting: vec![Command::default(); n_steps + 1], next: 0 }
    }

    /// Puts in this step's command and takes out the one that arrives.
    pub(crate) fn pass(&mut self, command: Command) -> Command {
        self.waiting[self.next] = command;
        self.next = (self.next + 1) % self.waiting.len();
        self.waiting[self.next]
    }
}

/// Turns the front wheels.
pub(crate) struct SteeringServo {
    steering_rad: f64,
    response_s: f64,
    rate_max_radps: f64,
    steering_max_rad: f64,
    wheelbase_m: f64,
    track_m: f64,
}

impl SteeringServo {
    pub(crate) fn new(vehicle: &Vehicle) -> Self {
        Self {
            steering_rad: 0.0,
            response_s: vehicle.servo.response_s,
            rate_max_radps: vehicle.limits.steering_rate_max_radps,
            steering_max_rad: vehicle.limits.steering_max_rad,
            wheelbase_m: vehicle.geometry.wheelbase_m,
            track_m: vehicle.geometry.track_m,
        }
    }

    pub(crate) fn step(&mut self, commanded_rad: f64, step_s: f64) {
        let target_rad = commanded_rad.clamp(-self.steering_max_rad, self.steering_max_rad);
        // Implicit in the response, so that a response faster than the step is no trouble.
        let wanted_rad = (target_rad - self.steering_rad) * step_s / (self.response_s + step_s);
        let most_rad = self.rate_max_radps * step_s;
        self.steering_rad += wanted_rad.clamp(-most_rad, most_rad);
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
