//! What a search and a speed profile weigh.

use serde::{Deserialize, Serialize};
use terrain::SettingError;

/// Weights of the costs, whose values the paper does not state, and what the vehicle can do.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct RouteConfig {
    /// Speed of sliding at which grounds are compared (v_rel of equation 38), in [0.01, 20] [m/s].
    pub sliding_mps: f64,
    /// Of the friction cost, the viscous coefficient's part (lambda_v of equation 37), in [0, 1000] [m/s].
    pub viscous_weight_mps: f64,
    /// How steeply slopes cost (lambda_s of equation 39), in [0, 10].
    pub slope_weight: f64,
    /// Of a metre of roughness, in metres of way per metre (equation 40), in [0, 1000].
    pub roughness_weight: f64,
    /// Roughness that is not driven on (sigma_th of equation 40), in (0, 100] [m].
    pub roughness_max_m: f64,
    /// Share of the friction that a slope may ask for, in [0.05, 1]: less than speeds may use
    /// ([`crate::SpeedLimits::friction_share`]), since the line between cells meets other slopes than theirs.
    pub friction_share: f64,
    /// Of equation 41's turns, in [0, 100].
    pub steering_weight: f64,
    /// Width that must be free of obstacles around the middle of the way, in [0, 100] [m].
    pub clear_width_m: f64,
    /// Steepest slope along the way, in (0, 1.5] [rad].
    pub pitch_max_rad: f64,
    /// Steepest slope across the way, in (0, 1.5] [rad].
    pub roll_max_rad: f64,
}

impl Default for RouteConfig {
    fn default() -> Self {
        Self {
            sliding_mps: 1.0,
            viscous_weight_mps: 10.0,
            slope_weight: 2.0,
            roughness_weight: 10.0,
            roughness_max_m: 0.3,
            friction_share: 0.7,
            steering_weight: 1.0,
            clear_width_m: 2.0,
            pitch_max_rad: 0.5,
            roll_max_rad: 0.5,
        }
    }
}

impl RouteConfig {
    /// Whether every number is in its range.
    ///
    /// # Errors
    /// The first one that is not.
    pub fn validate(&self) -> Result<(), SettingError> {
        let angle = "more than 0 and at most 1.5 rad";
        check("sliding_mps", self.sliding_mps, 0.01..=20.0, "0.01 to 20 m/s")?;
        check("viscous_weight_mps", self.viscous_weight_mps, 0.0..=1000.0, "0 to 1000 m/s")?;
        check("slope_weight", self.slope_weight, 0.0..=10.0, "0 to 10")?;
        check("roughness_weight", self.roughness_weight, 0.0..=1000.0, "0 to 1000")?;
        check("roughness_max_m", self.roughness_max_m, 1e-6..=100.0, "more than 0 and at most 100 m")?;
        check("friction_share", self.friction_share, 0.05..=1.0, "0.05 to 1")?;
        check("steering_weight", self.steering_weight, 0.0..=100.0, "0 to 100")?;
        check("clear_width_m", self.clear_width_m, 0.0..=100.0, "0 to 100 m")?;
        check("pitch_max_rad", self.pitch_max_rad, 1e-6..=1.5, angle)?;
        check("roll_max_rad", self.roll_max_rad, 1e-6..=1.5, angle)
    }
}

pub(crate) fn check(
    field: &'static str,
    found: f64,
    range: std::ops::RangeInclusive<f64>,
    expected: &'static str,
) -> Result<(), SettingError> {
    if range.contains(&found) { Ok(()) } else { Err(SettingError { field, expected, found }) }
}
