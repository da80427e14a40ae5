//! What the physics prior assumes.

use bicycle::{AxleDemand, Geometry, Vehicle};
use serde::{Deserialize, Serialize};
use terrain::SettingError;

/// Parameters of the physics prior (PIETRA, equations 15 to 18, and the extensions stated here).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct PriorConfig {
    /// Share of the spread distribution in equation 18, in [0, 1].
    pub uniform_weight: f64,
    /// How linear traction falls with the slope along the heading.
    pub slope_law: SlopeLaw,
    /// Slope along the heading at which linear traction is gone by [`SlopeLaw::Linear`] (equation 15) [rad].
    pub linear_slope_max_rad: f64,
    /// Slope along the heading at which a bump that works against the turn takes all of it (equation 15); by
    /// [`SlopeLaw::Friction`] by how much the slope under a wheel differs from that under all of them [rad].
    pub angular_slope_max_rad: f64,
    /// Height of vegetation at which traction is gone (equation 16) [m]. The paper takes 0.2 m for wheels of
    /// 0.15 m diameter; see [`PriorConfig::for_vehicle`].
    pub vegetation_height_max_m: f64,
    /// Friction of the ground lies anywhere between these two, each value as likely [-]. Slopes take part of it, across the
    /// heading and under every wheel along it; where there is less than the steepest wheel needs, nothing moves.
    pub friction: [f64; 2],
    /// Pseudo-count of the prior in a Dirichlet posterior; the paper takes the number of bins.
    pub evidence: f64,
    /// Half-width of the triangle around the estimated angle that takes the place of the uniform distribution
    /// for roll and pitch [rad]. Over the whole range of 60 degrees, the uniform one would break a limit of
    /// 30 degrees on level ground.
    pub attitude_spread_rad: f64,
    /// Roll and pitch of the body over those of the ground under its wheels, from 1 on: springs give way on the lower
    /// side; see [`bicycle::Vehicle::lean`].
    pub lean: [f64; 2],
    /// A footprint of which more than this share is unknown is judged as unknown ground, in [0, 1].
    pub unknown_share_max: f64,
    /// Traction, linear and angular, expected of a wheel on unknown ground: low, so that known ground is
    /// preferred; not zero, so that the frontier can be approached, in [0, 1].
    pub unknown_traction: f64,
    /// Largest |roll| and |pitch| expected of unknown ground [rad]; a triangle falls from zero to here. Below
    /// the vehicle's limits the frontier can be approached at every CVaR level.
    pub unknown_attitude_rad: f64,
    /// A wheel stands on the first ground that a ball of this share of its radius touches, in [0, 1]; with 0 it
    /// is the height under its centre, as in the paper.
    pub wheel_envelope: f64,
    /// Ground between the axles that rises above the plane of the wheels' contacts by more than the ground
    /// clearance takes traction away, all of it from this many clearances on, above 1. A very large number turns
    /// the check off.
    pub high_centred_clearances: f64,
    /// Widens the footprint that must not touch an obstacle, on every side [m].
    pub obstacle_margin_m: f64,
}

/// How linear traction falls with the slope along the heading.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum SlopeLaw {
    /// In a straight line to nothing (PIETRA, equation 15), whatever the vehicle: how its tables are made.
    /// In settings a table without keys, as every choice is a table.
    Linear {},
    /// As the friction leaves it: with the probability that it is less than the slope asks for there is none, else what
    /// is lost is the slip of the tyres, a brush (Pacejka, Tire and Vehicle Dynamics, section 3.2), and the way up.
    /// Takes it that the motor can spin the wheels.
    Friction {
        /// Force per slip and load of a tyre that slips little [-].
        slip_stiffness: f64,
        /// The axle that slides first.
        axle: AxleDemand,
    },
}

impl SlopeLaw {
    /// What friction leaves this vehicle.
    pub fn of(vehicle: &Vehicle) -> Self {
        Self::Friction { slip_stiffness: vehicle.tyre.slip_stiffness, axle: vehicle.axle_demand() }
    }
}

/// Friction that is expected of natural ground: earth from wet, 0.55, to dry, 0.68, and gravel, 0.6, as peaks (Wong,
/// Theory of Ground Vehicles, on road adhesion), and as far again to either side for what neither is.
const FRICTION_OF_EARTH: [f64; 2] = [0.5, 0.8];

impl Default for PriorConfig {
    fn default() -> Self {
        Self {
            uniform_weight: 0.2,
            slope_law: SlopeLaw::Linear {},
            linear_slope_max_rad: 30f64.to_radians(),
            angular_slope_max_rad: 15f64.to_radians(),
            vegetation_height_max_m: 0.2,
            friction: FRICTION_OF_EARTH,
            evidence: traversability::N_BINS as f64,
            attitude_spread_rad: 15f64.to_radians(),
            lean: [1.0; 2],
            unknown_share_max: 0.5,
            unknown_traction: 0.3,
            unknown_attitude_rad: 25f64.to_radians(),
            wheel_envelope: 1.0,
            high_centred_clearances: 1.5,
            obstacle_margin_m: 0.0,
        }
    }
}

impl PriorConfig {
    /// The defaults with the height of vegetation scaled to the wheels: the paper's 0.2 m for 0.15 m diameter.
    pub fn for_vehicle(geometry: &Geometry) -> Self {
        let per_diameter = 0.2 / 0.15;
        Self { vegetation_height_max_m: per_diameter * 2.0 * geometry.wheel_radius_m, ..Self::default() }
    }

    /// Refuses values outside their documented ranges.
    pub fn validate(&self) -> Result<(), SettingError> {
        let shares = [
            ("uniform_weight", self.uniform_weight),
            ("unknown_share_max", self.unknown_share_max),
            ("unknown_traction", self.unknown_traction),
            ("wheel_envelope", self.wheel_envelope),
        ];
        SettingError::check_finite(&shares, "a number from 0 to 1", |v| (0.0..=1.0).contains(&v))?;
        let angles = [
            ("linear_slope_max_rad", self.linear_slope_max_rad),
            ("angular_slope_max_rad", self.angular_slope_max_rad),
            ("attitude_spread_rad", self.attitude_spread_rad),
            ("unknown_attitude_rad", self.unknown_attitude_rad),
        ];
        SettingError::check_finite(&angles, "an angle in radians above 0 and below pi/2", |v| {
            v > 0.0 && v < std::f64::consts::FRAC_PI_2
        })?;
        let positive =
            [("vegetation_height_max_m", self.vegetation_height_max_m), ("evidence", self.evidence)];
        SettingError::check_finite(&positive, "a finite number > 0", |v| v > 0.0)?;
        let clearances = [("high_centred_clearances", self.high_centred_clearances)];
        SettingError::check_finite(&clearances, "a finite number > 1", |v| v > 1.0)?;
        SettingError::check_finite(
            &[("obstacle_margin_m", self.obstacle_margin_m)],
            "a finite number >= 0",
            |v| v >= 0.0,
        )?;
        let leans = [("lean[0]", self.lean[0]), ("lean[1]", self.lean[1])];
        SettingError::check_finite(&leans, "a number from 1 to 10", |v| (1.0..=10.0).contains(&v))?;
        if let SlopeLaw::Friction { slip_stiffness, axle } = self.slope_law {
            let positive =
                [("slope_law.slip_stiffness", slip_stiffness), ("slope_law.axle.share", axle.share)];
            SettingError::check_finite(&positive, "a finite number > 0", |v| v > 0.0)?;
            SettingError::check_finite(
                &[("slope_law.axle.unloading", axle.unloading)],
                "a finite number",
                |_| true,
            )?;
        }
        let [least, most] = self.friction;
        SettingError::check_finite(&[("friction[0]", least)], "a finite number > 0", |v| v > 0.0)?;
        SettingError::check_finite(&[("friction[1]", most)], "a finite number above friction[0]", |v| {
            v > least
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_defaults_are_valid() {
        assert_eq!(PriorConfig::default().validate(), Ok(()));
    }

    fn with_law(slip_stiffness: f64, share: f64, unloading: f64) -> PriorConfig {
        let slope_law = SlopeLaw::Friction { slip_stiffness, axle: AxleDemand { share, unloading } };
        PriorConfig { slope_law, ..PriorConfig::default() }
    }

    #[test]
    fn a_wrong_value_is_refused_with_field_range_and_number() {
        let default = PriorConfig::default();
        let wrong = [
            (PriorConfig { uniform_weight: 1.1, ..default }, "uniform_weight"),
            (PriorConfig { linear_slope_max_rad: 0.0, ..default }, "linear_slope_max_rad"),
            (PriorConfig { angular_slope_max_rad: f64::NAN, ..default }, "angular_slope_max_rad"),
            (PriorConfig { vegetation_height_max_m: -0.2, ..default }, "vegetation_height_max_m"),
            (PriorConfig { evidence: 0.0, ..default }, "evidence"),
            (PriorConfig { unknown_share_max: -0.1, ..default }, "unknown_share_max"),
            (PriorConfig { wheel_envelope: 1.5, ..default }, "wheel_envelope"),
            (PriorConfig { high_centred_clearances: 1.0, ..default }, "high_centred_clearances"),
            (PriorConfig { obstacle_margin_m: -1.0, ..default }, "obstacle_margin_m"),
            (PriorConfig { lean: [0.9, 1.0], ..default }, "lean[0]"),
            (PriorConfig { lean: [1.0, f64::NAN], ..default }, "lean[1]"),
            (PriorConfig { friction: [0.0, 0.8], ..default }, "friction[0]"),
            (PriorConfig { friction: [f64::NAN, 0.8], ..default }, "friction[0]"),
            (PriorConfig { friction: [0.6, 0.6], ..default }, "friction[1]"),
            (PriorConfig { friction: [0.6, f64::INFINITY], ..default }, "friction[1]"),
            (with_law(0.0, 1.0, 0.5), "slope_law.slip_stiffness"),
            (with_law(12.0, f64::INFINITY, 0.5), "slope_law.axle.share"),
            (with_law(12.0, 1.0, f64::NAN), "slope_law.axle.unloading"),
        ];
        for (config, field) in wrong {
            assert_eq!(config.validate().unwrap_err().field, field);
        }
        let message = PriorConfig { uniform_weight: 1.1, ..default }.validate().unwrap_err().to_string();
        assert_eq!(message, "uniform_weight: expected a number from 0 to 1, found 1.1");
    }
}
