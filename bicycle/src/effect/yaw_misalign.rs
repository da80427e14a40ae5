//! Yaws with an offset.

use super::SensorModel;
use super::definition::{Definition, Stage, parameters};

parameters! {
    /// Yaws with an offset.
    YawMisalign {
        /// Measured less true yaw B [rad].
        angle_rad in "rad": -0.5 to 0.5, neutral 0.0, tried [-0.04, 0.04];
    }
}

impl Definition for YawMisalign {
    const ID: &'static str = "yaw_misalign";
    const MEANING: &'static str = "yaw misalignment: measured yaw = yaw + B";
    const STAGES: &'static [Stage] = &[Stage::Sensors];

    fn on_sensors(&self, sensors: &mut SensorModel) {
        sensors.yaw_offset_rad += self.angle_rad;
    }
}
