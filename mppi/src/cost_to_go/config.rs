//! What the field assumes beyond the risk map, and why there is none.

use super::lattice::N_HEADINGS;
use bicycle::MotionLimits;
use serde::{Deserialize, Serialize};

/// How far one edge of the search reaches.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Neighbourhood {
    /// The 8 adjacent cells; on uniform ground at most 8.3 % longer than the straight line.
    Eight,
    /// And the 8 cells a knight's move away; at most 2.8 % longer.
    Sixteen,
}

/// What the field assumes beyond the risk map.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct CostToGoConfig {
    /// Directions of travel that the search knows.
    pub neighbourhood: Neighbourhood,
    /// Speed on unknown cells over the vehicle's speed limit, in [0.01, 1]; whatever the risk map says of them, unless
    /// the footprint touches an obstacle.
    pub unknown_speed_share: f64,
    /// Speed beyond the window over the vehicle's speed limit, in [0.01, 1]: the smaller, the more memory the queue
    /// takes.
    pub outside_speed_share: f64,
    /// How many times longer than at the speed limit a forbidden pose takes, in [1, 10000]. Finite, so that an
    /// enclosed vehicle still knows which way is out; ground too slippery for this speed counts as forbidden.
    pub forbidden_slowdown: f64,
    /// Radius of the rear axle's tightest turn, at most 1000; 0 = it turns on the spot [m].
    pub turning_radius_m: f64,
    /// Speed in reverse over the vehicle's speed limit, the less the more else a metre in reverse costs, in [0.01, 1];
    /// 0 = the field never leads backwards.
    pub reverse_speed_share: f64,
}

impl CostToGoConfig {
    /// Headings for which is found what turning adds: all of the search's, or none for who turns on the spot.
    pub fn n_headings(&self) -> usize {
        if self.turning_radius_m > 0.0 { N_HEADINGS } else { 0 }
    }
}

impl Default for CostToGoConfig {
    fn default() -> Self {
        Self {
            neighbourhood: Neighbourhood::Sixteen,
            unknown_speed_share: 0.5,
            outside_speed_share: 0.5,
            forbidden_slowdown: 1000.0,
            turning_radius_m: 0.0,
            reverse_speed_share: 0.0,
        }
    }
}

/// Why there is no cost-to-go field.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum CostToGoError {
    /// A value of the configuration or of the vehicle's limits is out of range.
    #[error("{field}: expected {expected}, found {found}")]
    Config {
        /// Name of the field.
        field: &'static str,
        /// The range that would do.
        expected: &'static str,
        /// The value that was given.
        found: f64,
    },
    /// The window has no cell inside its border.
    #[error("cost-to-go window: expected at least 3 x 3 cells, found {n_rows} x {n_cols}")]
    WindowTooSmall {
        /// Rows asked for.
        n_rows: usize,
        /// Columns asked for.
        n_cols: usize,
    },
    /// The risk map is not of the shape that the field was made for.
    #[error(
        "risk map: expected {expected_rows} x {expected_cols} cells with as many grounds and risks for every yaw, \
         found {n_rows} x {n_cols}, {n_ground} grounds, {n_risks} risks of {n_yaws} yaws"
    )]
    MapShape {
        /// Rows of the field.
        expected_rows: usize,
        /// Columns of the field.
        expected_cols: usize,
        /// Rows of the map.
        n_rows: usize,
        /// Columns of the map.
        n_cols: usize,
        /// Length of the map's ground array.
        n_ground: usize,
        /// Length of the map's risk array.
        n_risks: usize,
        /// Yaw bins of the map.
        n_yaws: usize,
    },
    /// The goal is not a point.
    #[error("goal: expected finite coordinates and tolerance, found ({x_m}, {y_m}) and {tolerance_m}")]
    Goal {
        /// East [m].
        x_m: f64,
        /// North [m].
        y_m: f64,
        /// Distance at which it counts as reached [m].
        tolerance_m: f64,
    },
}

/// Refuses what makes no field.
pub(super) fn validate(config: &CostToGoConfig, limits: &MotionLimits) -> Result<(), CostToGoError> {
    let check = |field, found: f64, expected, allowed: bool| {
        if allowed { Ok(()) } else { Err(CostToGoError::Config { field, expected, found }) }
    };
    let share =
        |field, found: f64| check(field, found, "a number from 0.01 to 1", (0.01..=1.0).contains(&found));
    let positive =
        |field, found: f64| check(field, found, "a finite number > 0", found > 0.0 && found.is_finite());
    share("unknown_speed_share", config.unknown_speed_share)?;
    share("outside_speed_share", config.outside_speed_share)?;
    let slowdown = config.forbidden_slowdown;
    check("forbidden_slowdown", slowdown, "a number from 1 to 10000", (1.0..=1e4).contains(&slowdown))?;
    let radius_m = config.turning_radius_m;
    check("turning_radius_m", radius_m, "a length from 0 to 1000 m", (0.0..=1e3).contains(&radius_m))?;
    let reverse = config.reverse_speed_share;
    let is_share = reverse == 0.0 || (0.01..=1.0).contains(&reverse);
    check("reverse_speed_share", reverse, "a number from 0.01 to 1, or 0", is_share)?;
    positive("limits.speed_max_mps", limits.high[0])?;
    positive("limits.roll_max_rad", limits.roll_max_rad)?;
    positive("limits.pitch_max_rad", limits.pitch_max_rad)
}
