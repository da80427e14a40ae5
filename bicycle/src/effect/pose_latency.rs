//! Poses that are older than their stamp.

use super::SensorModel;
use super::definition::{Definition, Stage, parameters};

parameters! {
    /// Poses that are older than their stamp.
    PoseLatency {
        /// Age D [s].
        age_s in "s": 0.0 to 1.0, neutral 0.0, tried [0.05, 0.12, 0.25];
    }
}

impl Definition for PoseLatency {
    const ID: &'static str = "pose_latency";
    const MEANING: &'static str = "pose latency: measured pose(t) = pose(t - D)";
    const STAGES: &'static [Stage] = &[Stage::Sensors];

    fn on_sensors(&self, sensors: &mut SensorModel) {
        sensors.pose_latency_s += self.age_s;
    }
}
