//! Yaw rates with an offset.

use super::SensorModel;
use super::definition::{Definition, Stage, parameters};

parameters! {
    /// Yaw rates with an offset.
    GyroBias {
        /// Measured less true yaw rate B [rad/s].
        bias_radps in "rad/s": -0.5 to 0.5, neutral 0.0, tried [-0.05, 0.05];
    }
}

impl Definition for GyroBias {
    const ID: &'static str = "gyro_bias";
    const MEANING: &'static str = "gyro bias: measured yaw rate = yaw rate + B";
    const STAGES: &'static [Stage] = &[Stage::Sensors];

    fn on_sensors(&self, sensors: &mut SensorModel) {
        sensors.yaw_rate_bias_radps += self.bias_radps;
    }
}
