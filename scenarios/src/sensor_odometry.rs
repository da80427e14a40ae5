//! Simulated localisation: the true motion, with noise that comes and goes and an error that stays and grows.

use std::collections::VecDeque;

use bicycle::Odometry;
use rand_xoshiro::Xoshiro256PlusPlus;
use terrain::Pose;

use crate::random::{normal, stream};
use crate::{Deviation, Motion};

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
    faults: SensorFaults,
}

/// How the sensors depart from their description.
#[derive(Clone, Debug)]
struct SensorFaults {
    latency_ns: u64,
    velocity_factor: f64,
    yaw_rate_radps: f64,
    yaw_rad: f64,
    /// Poses that are not older than the latency, and one that is.
    past: VecDeque<(u64, Pose)>,
}

impl SensorFaults {
    fn new(deviations: &[Deviation]) -> Self {
        let mut faults = Self {
            latency_ns: 0,
            velocity_factor: 1.0,
            yaw_rate_radps: 0.0,
            yaw_rad: 0.0,
            past: VecDeque::new(),
        };
        for deviation in deviations {
            match *deviation {
                Deviation::PoseLatency { delay_s } => faults.latency_ns += (delay_s * 1e9).round() as u64,
                Deviation::OdometryScale { factor } => faults.velocity_factor *= factor,
                Deviation::GyroBias { rate_radps } => faults.yaw_rate_radps += rate_radps,
                Deviation::YawMisalignment { angle_rad } => faults.yaw_rad += angle_rad,
                _ => {}
            }
        }
        faults
    }

    /// The pose as it was one latency ago, between two measurements on the straight line; the first one until then.
    fn told(&mut self, pose: Pose, now_ns: u64) -> Pose {
        self.past.push_back((now_ns, pose));
        let then_ns = now_ns.saturating_sub(self.latency_ns);
        while self.past.len() > 1 && self.past[1].0 <= then_ns {
            self.past.pop_front();
        }
        let (before_ns, before) = self.past[0];
        match self.past.get(1) {
            Some(&(after_ns, after)) if then_ns > before_ns => {
                between(&before, &after, (then_ns - before_ns) as f64 / (after_ns - before_ns) as f64)
            }
            _ => before,
        }
    }
}

fn between(before: &Pose, after: &Pose, share: f64) -> Pose {
    let mean = |a: f64, b: f64| a + share * (b - a);
    let turned_rad = after.yaw_rad - before.yaw_rad;
    Pose {
        x_m: mean(before.x_m, after.x_m),
        y_m: mean(before.y_m, after.y_m),
        z_m: mean(before.z_m, after.z_m),
        roll_rad: mean(before.roll_rad, after.roll_rad),
        pitch_rad: mean(before.pitch_rad, after.pitch_rad),
        yaw_rad: before.yaw_rad + share * turned_rad.sin().atan2(turned_rad.cos()),
    }
}

impl OdometrySensor {
    /// A localisation that starts without error.
    pub fn new(config: OdometryConfig, seed: u64) -> Self {
        Self::deviating(config, &[], seed)
    }

    /// The same with sensors that depart from their description; what is no sensor's is left alone.
    pub fn deviating(config: OdometryConfig, deviations: &[Deviation], seed: u64) -> Self {
        Self {
            config,
            rng: stream(seed, &[0x0D0]),
            position_error_m: [0.0; 3],
            yaw_error_rad: 0.0,
            last_position_m: None,
            faults: SensorFaults::new(deviations),
        }
    }

    /// Measures; the error grows with the way since the last measurement.
    pub fn measure(&mut self, motion: &Motion, valid_at_ns: u64) -> Odometry {
        self.drift(motion);
        let pose = self.faults.told(motion.pose, valid_at_ns);
        let config = self.config;
        let (factor, bias_radps) = (self.faults.velocity_factor, self.faults.yaw_rate_radps);
        let yaw_rad = pose.yaw_rad + self.yaw_error_rad + self.faults.yaw_rad;
        let mut noisy = |value: f64, std: f64| value + std * normal(&mut self.rng);
        let [x_m, y_m, z_m] = self.position_error_m;
        Odometry {
            valid_at_ns,
            position_m: [pose.x_m + x_m, pose.y_m + y_m, pose.z_m + z_m]
                .map(|value| noisy(value, config.position_noise_m)),
            attitude_rad: [pose.roll_rad, pose.pitch_rad, yaw_rad]
                .map(|value| noisy(value, config.attitude_noise_rad)),
            velocity_mps: [motion.velocity_mps[0], motion.velocity_mps[1]]
                .map(|value| noisy(factor * value, config.velocity_noise_mps)),
            yaw_rate_radps: noisy(motion.angular_rate_radps[2] + bias_radps, config.yaw_rate_noise_radps),
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
