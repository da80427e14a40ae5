//! Simulated localisation: the true motion, with noise that comes and goes and an error that stays and grows.

use bicycle::Odometry;
use rand_xoshiro::Xoshiro256PlusPlus;

use crate::Motion;
use crate::random::{normal, stream};

/// How well the vehicle knows its own motion.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct OdometryConfig {
    /// Standard deviation of the position from sample to sample, each axis [m].
    pub position_noise_m: f64,
    /// The same of roll, pitch and yaw [rad].
    pub attitude_noise_rad: f64,
    /// The same of velocities and of the wheels' speed [m/s].
    pub velocity_noise_mps: f64,
    /// The same of the yaw rate [rad/s].
    pub yaw_rate_noise_radps: f64,
    /// The same of the steering angle [rad].
    pub steering_noise_rad: f64,
    /// Random walk of the position, each axis, over the way driven [m per root metre].
    pub position_drift: f64,
    /// Random walk of the yaw over the way driven [rad per root metre].
    pub yaw_drift: f64,
}

impl OdometryConfig {
    /// No error at all.
    pub const PERFECT: Self = Self {
        position_noise_m: 0.0,
        attitude_noise_rad: 0.0,
        velocity_noise_mps: 0.0,
        yaw_rate_noise_radps: 0.0,
        steering_noise_rad: 0.0,
        position_drift: 0.0,
        yaw_drift: 0.0,
    };

    /// A good lidar-inertial localisation on a vehicle of this length: over 40 m a full-size vehicle's position
    /// wanders by 3 cm and its yaw by a quarter of a degree.
    pub fn for_length(length_m: f64) -> Self {
        Self {
            position_noise_m: 0.002 * length_m,
            attitude_noise_rad: 0.002,
            velocity_noise_mps: 0.01 * length_m.min(2.0),
            yaw_rate_noise_radps: 0.005,
            steering_noise_rad: 0.002,
            // A random walk per body length driven is the same share of a body length for every size.
            position_drift: 0.0025 * length_m.sqrt(),
            yaw_drift: 0.0013 / length_m.sqrt(),
        }
    }
}

/// Localisation of one vehicle in one episode.
#[derive(Clone, Debug)]
pub struct OdometrySensor {
    config: OdometryConfig,
    rng: Xoshiro256PlusPlus,
    position_error_m: [f64; 3],
    yaw_error_rad: f64,
    last_position_m: Option<[f64; 3]>,
}

impl OdometrySensor {
    /// A localisation that starts without error.
    pub fn new(config: OdometryConfig, seed: u64) -> Self {
        let rng = stream(seed, &[0x0D0]);
        Self { config, rng, position_error_m: [0.0; 3], yaw_error_rad: 0.0, last_position_m: None }
    }

    /// Measures; the error grows with the way since the last measurement.
    pub fn measure(&mut self, motion: &Motion, valid_at_ns: u64) -> Odometry {
        self.drift(motion);
        let pose = &motion.pose;
        let config = self.config;
        let mut noisy = |value: f64, std: f64| value + std * normal(&mut self.rng);
        let [x_m, y_m, z_m] = self.position_error_m;
        Odometry {
            valid_at_ns,
            position_m: [pose.x_m + x_m, pose.y_m + y_m, pose.z_m + z_m]
                .map(|value| noisy(value, config.position_noise_m)),
            attitude_rad: [pose.roll_rad, pose.pitch_rad, pose.yaw_rad + self.yaw_error_rad]
                .map(|value| noisy(value, config.attitude_noise_rad)),
            velocity_mps: [motion.velocity_mps[0], motion.velocity_mps[1]]
                .map(|value| noisy(value, config.velocity_noise_mps)),
            yaw_rate_radps: noisy(motion.angular_rate_radps[2], config.yaw_rate_noise_radps),
            wheel_speed_mps: noisy(motion.wheel_speed_mps, config.velocity_noise_mps),
            steering_rad: noisy(motion.steering_rad, config.steering_noise_rad),
        }
    }

    fn drift(&mut self, motion: &Motion) {
        let here = [motion.pose.x_m, motion.pose.y_m, motion.pose.z_m];
        let last = self.last_position_m.replace(here).unwrap_or(here);
        let way_m = here.iter().zip(&last).map(|(a, b)| (a - b) * (a - b)).sum::<f64>().sqrt();
        for error_m in &mut self.position_error_m {
            *error_m += self.config.position_drift * way_m.sqrt() * normal(&mut self.rng);
        }
        self.yaw_error_rad += self.config.yaw_drift * way_m.sqrt() * normal(&mut self.rng);
    }
}
