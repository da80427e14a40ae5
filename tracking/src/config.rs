//! Settings of the tracking.

use serde::{Deserialize, Serialize};

/// What counts as a thing that may move, and how it is expected to. The defaults are meant for people and vehicles among
/// people, seen by a range sensor some five times a second.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct TrackingConfig {
    /// Points count from this height above the ground on [m], > 0.
    pub height_min_m: f64,
    /// Up to this height [m], > `height_min_m`; what hangs higher does not touch the vehicle.
    pub height_max_m: f64,
    /// Edge of the cells in which points are gathered; things that are less than that apart are one [m], > 0.
    pub cell_m: f64,
    /// Fewest points of a thing, > 0.
    pub points_min: usize,
    /// Things of a larger radius are walls and groves, which do not move [m], > 0.
    pub radius_max_m: f64,
    /// Standard deviation of a cluster's centre along each axis, close by [m], > 0.
    pub position_noise_m: f64,
    /// Growth of that standard deviation with range [m/m], >= 0.
    pub position_noise_per_range: f64,
    /// Spectral density of the acceleration that nobody foresees, along each axis [m2/s3], > 0.
    pub acceleration_density_m2ps3: f64,
    /// Fastest that anything is expected to move [m/s], > 0.
    pub speed_max_mps: f64,
    /// Standard deviations within which a cluster is taken for a track's, > 0.
    pub gate_std: f64,
    /// Scans that must show a thing before it counts as moving, > 1.
    pub scans_min: u32,
    /// Slower than this is standing [m/s], > 0.
    pub speed_min_mps: f64,
    /// A thing must be this much farther than its radius from where it was first seen to count as moving [m], > 0.
    pub moved_min_m: f64,
    /// What is larger than people, has moved and stands for so long is told of no longer until it sets off again [s], > 0.
    pub standing_max_s: f64,
    /// A moving thing is given up that its place has not shown for so long [s], > 0.
    pub unseen_max_s: f64,
    /// A thing beside the vehicle, where no ray comes back from, is taken to stand there for so long [s], > 0.
    pub hidden_max_s: f64,
}

impl Default for TrackingConfig {
    fn default() -> Self {
        Self {
            height_min_m: 0.3,
            height_max_m: 2.5,
            cell_m: 0.4,
            points_min: 3,
            radius_max_m: 2.5,
            position_noise_m: 0.08,
            position_noise_per_range: 0.005,
            acceleration_density_m2ps3: 0.6,
            speed_max_mps: 6.0,
            gate_std: 3.0,
            scans_min: 3,
            speed_min_mps: 0.25,
            moved_min_m: 0.2,
            standing_max_s: 60.0,
            unseen_max_s: 1.5,
            hidden_max_s: 600.0,
        }
    }
}

/// A setting that cannot be.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("tracking: {field}: expected {expected}, found {found}")]
pub struct TrackingConfigError {
    /// Name of the field.
    pub field: &'static str,
    /// The range that would do.
    pub expected: &'static str,
    /// The value that was given.
    pub found: f64,
}

impl TrackingConfig {
    /// Refuses the first setting that nothing can be tracked by.
    pub fn validate(&self) -> Result<(), TrackingConfigError> {
        let positive = [
            ("height_min_m", self.height_min_m),
            ("cell_m", self.cell_m),
            ("points_min", self.points_min as f64),
            ("radius_max_m", self.radius_max_m),
            ("position_noise_m", self.position_noise_m),
            ("acceleration_density_m2ps3", self.acceleration_density_m2ps3),
            ("speed_max_mps", self.speed_max_mps),
            ("gate_std", self.gate_std),
            ("speed_min_mps", self.speed_min_mps),
            ("moved_min_m", self.moved_min_m),
            ("standing_max_s", self.standing_max_s),
            ("unseen_max_s", self.unseen_max_s),
            ("hidden_max_s", self.hidden_max_s),
        ];
        let positive = positive.into_iter().map(|(field, found)| (field, found, found > 0.0));
        let above = "a finite number above height_min_m";
        let others = [
            ("height_max_m", above, self.height_max_m, self.height_max_m > self.height_min_m),
            (
                "position_noise_per_range",
                "a finite number >= 0",
                self.position_noise_per_range,
                self.position_noise_per_range >= 0.0,
            ),
            ("scans_min", "at least 2", f64::from(self.scans_min), self.scans_min >= 2),
        ];
        positive
            .map(|(field, found, allowed)| (field, "a finite number > 0", found, allowed))
            .chain(others)
            .find(|(.., found, allowed)| !(found.is_finite() && *allowed))
            .map_or(Ok(()), |(field, expected, found, _)| Err(TrackingConfigError { field, expected, found }))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn settings_that_track_nothing_are_refused_by_name() {
        let good = TrackingConfig::default();
        assert_eq!(good.validate(), Ok(()));
        for (bad, field) in [
            (TrackingConfig { cell_m: 0.0, ..good }, "cell_m"),
            (TrackingConfig { gate_std: f64::NAN, ..good }, "gate_std"),
            (TrackingConfig { speed_max_mps: f64::INFINITY, ..good }, "speed_max_mps"),
            (TrackingConfig { height_max_m: 0.2, ..good }, "height_max_m"),
            (TrackingConfig { position_noise_per_range: -0.1, ..good }, "position_noise_per_range"),
            (TrackingConfig { scans_min: 1, ..good }, "scans_min"),
            (TrackingConfig { points_min: 0, ..good }, "points_min"),
        ] {
            assert_eq!(bad.validate().unwrap_err().field, field);
        }
    }
}
