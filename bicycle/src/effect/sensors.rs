//! What the sensors say of a motion, and the motion that a measurement stands for.

use super::Effect;
use super::definition::{Definition, Stage, Values, parameters};
use crate::Odometry;

/// How sensors misstate the motion; the neutral one states it as it is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SensorModel {
    /// Age of the pose when it is stamped [s].
    pub pose_latency_s: f64,
    /// Measured over true velocity [-].
    pub velocity_ratio: f64,
    /// Measured less true yaw rate [rad/s].
    pub yaw_rate_bias_radps: f64,
    /// Measured less true yaw [rad].
    pub yaw_offset_rad: f64,
}

impl SensorModel {
    /// Sensors that state the motion as it is.
    pub const NEUTRAL: Self =
        Self { pose_latency_s: 0.0, velocity_ratio: 1.0, yaw_rate_bias_radps: 0.0, yaw_offset_rad: 0.0 };

    /// What the effects on the sensors amount to together.
    pub fn of(effects: &[Effect]) -> Self {
        let mut sensors = Self::NEUTRAL;
        effects.iter().for_each(|effect| effect.on_sensors(&mut sensors));
        sensors
    }

    /// The motion behind a measurement: velocity and yaw rate without ratio and bias, the pose without offset and
    /// carried forward by its age at that velocity and yaw rate.
    pub fn corrected(&self, measured: &Odometry) -> Odometry {
        let velocity_mps = measured.velocity_mps.map(|value| value / self.velocity_ratio);
        let yaw_rate_radps = measured.yaw_rate_radps - self.yaw_rate_bias_radps;
        let turned_rad = yaw_rate_radps * self.pose_latency_s;
        let yaw_rad = measured.attitude_rad[2] - self.yaw_offset_rad;
        let (sine, cosine) = libm::sincos(yaw_rad + turned_rad / 2.0);
        let [ahead_m, left_m] = velocity_mps.map(|value| value * self.pose_latency_s);
        let [x_m, y_m, z_m] = measured.position_m;
        let [roll_rad, pitch_rad, _] = measured.attitude_rad;
        Odometry {
            position_m: [x_m + ahead_m * cosine - left_m * sine, y_m + ahead_m * sine + left_m * cosine, z_m],
            attitude_rad: [roll_rad, pitch_rad, yaw_rad + turned_rad],
            velocity_mps,
            yaw_rate_radps,
            ..*measured
        }
    }
}

/// Effects by what their first parameter changes.
macro_rules! misstatements {
    ($($(#[$doc:meta])* $name:ident $id:literal: $meaning:literal $parameters:tt
        |$value:ident, $sensors:ident| $act:expr;)*) => {$(
        parameters! { $(#[$doc])* $name $parameters }

        impl Definition for $name {
            const ID: &'static str = $id;
            const MEANING: &'static str = $meaning;
            const STAGES: &'static [Stage] = &[Stage::Sensors];

            fn on_sensors(&self, $sensors: &mut SensorModel) {
                let [$value, ..] = self.values();
                $act;
            }
        }
    )*};
}

misstatements! {
    /// Poses that are older than their stamp.
    PoseLatency "pose_latency": "pose latency: measured pose(t) = pose(t - D)"
    {
        /// Age D [s].
        age_s in "s": 0.0 to 1.0, neutral 0.0, tried [0.05, 0.12, 0.25];
    } |age_s, sensors| sensors.pose_latency_s += age_s;

    /// Velocities out of proportion.
    OdomScale "odom_scale": "odometry scale: measured velocity = S velocity"
    {
        /// Measured over true velocity S [-].
        ratio in "-": 0.3 to 3.0, neutral 1.0, tried [0.85, 0.95, 1.05, 1.15];
    } |ratio, sensors| sensors.velocity_ratio *= ratio;

    /// Yaw rates with an offset.
    GyroBias "gyro_bias": "gyro bias: measured yaw rate = yaw rate + B"
    {
        /// Measured less true yaw rate B [rad/s].
        bias_radps in "rad/s": -0.5 to 0.5, neutral 0.0, tried [-0.05, 0.05];
    } |bias_radps, sensors| sensors.yaw_rate_bias_radps += bias_radps;

    /// Yaws with an offset.
    YawMisalign "yaw_misalign": "yaw misalignment: measured yaw = yaw + B"
    {
        /// Measured less true yaw B [rad].
        angle_rad in "rad": -0.5 to 0.5, neutral 0.0, tried [-0.04, 0.04];
    } |angle_rad, sensors| sensors.yaw_offset_rad += angle_rad;
}
