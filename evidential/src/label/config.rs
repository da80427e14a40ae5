//! What is labelled and what is masked.

use bicycle::{Geometry, Limits};
use serde::{Deserialize, Serialize};

/// Thresholds of [`crate::labels`].
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LabelConfig {
    /// Between two labels [s].
    pub period_s: f64,
    /// Between two labels of a vehicle that has moved less than [`LabelConfig::moved_min_m`] since the last [s].
    pub standing_period_s: f64,
    /// See [`LabelConfig::standing_period_s`] [m].
    pub moved_min_m: f64,
    /// Length of the window, centred on the label, over which motion and commands are averaged against noise [s].
    pub window_s: f64,
    /// Left out at the beginning of a run, where the commands before it are unknown [s].
    pub start_s: f64,
    /// Left out at the end of a run [s].
    pub end_s: f64,
    /// Linear traction means nothing below this commanded speed [m/s].
    pub speed_min_mps: f64,
    /// Angular traction means nothing below this commanded yaw rate [rad/s].
    pub yaw_rate_min_radps: f64,
    /// Linear traction means nothing where the commanded speed and what has arrived of it differ by more than this
    /// share of the latter: a response that is wrong by a fifth makes traction wrong by a fifth of this share [-].
    pub unsettled_speed_share_max: f64,
    /// The same of angular traction and the commanded yaw rate [-].
    pub unsettled_turn_share_max: f64,
    /// What is done with reverse commands.
    pub reversing: Reversing,
}

/// What is done with reverse commands.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Reversing {
    /// Traction is masked: a vehicle that backs up has its steering behind it.
    Masked,
    /// Labelled like driving forward, for machines that do not care.
    Labelled,
}

/// Why there are no labels.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum LabelError {
    /// A setting is out of range.
    #[error("labels, {field}: expected {expected}, found {found}")]
    Setting {
        /// Name of the field.
        field: &'static str,
        /// The range that would do.
        expected: &'static str,
        /// The value that was given.
        found: f64,
    },
    /// The log lacks columns.
    #[error("run '{run}': expected the columns {missing} too, found only {found}")]
    MissingColumns {
        /// Run.
        run: String,
        /// What is missing, comma separated.
        missing: String,
        /// What is there, comma separated.
        found: String,
    },
}

impl LabelConfig {
    /// Thresholds that fit a vehicle: a tenth of its speed limit, a fifth of the yaw rate at full lock and that speed.
    pub fn for_vehicle(geometry: &Geometry, limits: &Limits) -> Self {
        let turn_radps = limits.speed_max_mps * limits.steering_max_rad.tan() / geometry.wheelbase_m;
        Self {
            period_s: 0.2,
            standing_period_s: 1.0,
            moved_min_m: 0.01 * geometry.length_m,
            window_s: 0.3,
            start_s: 1.0,
            end_s: 0.2,
            speed_min_mps: 0.1 * limits.speed_max_mps,
            yaw_rate_min_radps: 0.2 * turn_radps,
            unsettled_speed_share_max: 0.1,
            unsettled_turn_share_max: 0.3,
            reversing: Reversing::Masked,
        }
    }

    /// Refuses values outside their ranges.
    pub fn validate(&self) -> Result<(), LabelError> {
        let positive = [
            ("period_s", self.period_s),
            ("standing_period_s", self.standing_period_s),
            ("speed_min_mps", self.speed_min_mps),
            ("yaw_rate_min_radps", self.yaw_rate_min_radps),
            ("unsettled_speed_share_max", self.unsettled_speed_share_max),
            ("unsettled_turn_share_max", self.unsettled_turn_share_max),
        ];
        let not_negative = [
            ("moved_min_m", self.moved_min_m),
            ("window_s", self.window_s),
            ("start_s", self.start_s),
            ("end_s", self.end_s),
        ];
        let refuse = |field, expected, found| Err(LabelError::Setting { field, expected, found });
        if let Some((field, found)) = positive.into_iter().find(|(_, v)| !(v.is_finite() && *v > 0.0)) {
            return refuse(field, "a finite number > 0", found);
        }
        if let Some((field, found)) = not_negative.into_iter().find(|(_, v)| !(v.is_finite() && *v >= 0.0)) {
            return refuse(field, "a finite number >= 0", found);
        }
        Ok(())
    }
}
