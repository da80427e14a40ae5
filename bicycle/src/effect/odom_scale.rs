//! Velocities out of proportion.

use super::SensorModel;
use super::definition::{Definition, Stage, parameters};

parameters! {
    /// Velocities out of proportion.
    OdomScale {
        /// Measured over true velocity S [-].
        ratio in "-": 0.3 to 3.0, neutral 1.0, tried [0.85, 0.95, 1.05, 1.15];
    }
}

impl Definition for OdomScale {
    const ID: &'static str = "odom_scale";
    const MEANING: &'static str = "odometry scale: measured velocity = S velocity";
    const STAGES: &'static [Stage] = &[Stage::Sensors];

    fn on_sensors(&self, sensors: &mut SensorModel) {
        sensors.velocity_ratio *= self.ratio;
    }
}
