//! Which answers are right: the tables that no label holds.

use sim_to_real::Condition;

/// Effects that the physics of a machine makes, and not its actuators or sensors.
pub const PHYSICAL: [&str; 8] =
    ["friction", "mass", "slope_gravity", "cross_slope", "rolling_drag", "quad_drag", "veg_drag", "wind"];

/// Things without a name of their own that effects of the catalogue can stand for, and which: one of them announced is
/// as right as 'unknown'. Everything else without a name has to be flagged.
pub const MIMICS: [(&str, &[&str]); 4] = [
    // A weight that is pulled along: heavier, slower to answer, and it rolls with a resistance of its own.
    ("unk_trailer", &["mass", "rolling_drag", "speed_lag", "slope_gravity", "accel_limit"]),
    // A smaller wheel on one side bends the path, and it resists.
    ("unk_flat_tyre", &["steer_bias", "rolling_drag", "speed_scale"]),
    // Held by the tyres at a constant angle of the path.
    ("unk_yaw_moment", &["steer_bias"]),
    // The catalogue has come to name it.
    ("unk_loose_drag", &["loose_drag"]),
];

/// Names that can stand for an unknown, if there are any.
pub fn mimics(unknown: &str) -> Option<&'static [&'static str]> {
    MIMICS.iter().find(|(id, _)| *id == unknown).map(|(_, names)| *names)
}

/// Conditions under which an effect shows most; any of them as the first place is right.
pub fn places(effect: &str) -> &'static [Condition] {
    use Condition::{
        Constant, Heading, LateralAcceleration, Pitch, Roll, Speed, SpeedChange, Steering, SteeringChange,
        TerrainClass,
    };
    match effect {
        "steer_lag" | "steer_rate" | "steer_delay" => &[SteeringChange],
        "backlash" => &[SteeringChange, Steering],
        "steer_bias" => &[Constant, Speed],
        "steer_gain" => &[Steering, LateralAcceleration],
        "understeer" => &[LateralAcceleration, Steering, Speed],
        "friction" => &[LateralAcceleration],
        "speed_lag" | "speed_delay" | "accel_limit" => &[SpeedChange],
        "speed_scale" | "odom_scale" | "quad_drag" => &[Speed],
        "motor_deadband" => &[Speed, SpeedChange],
        "rolling_drag" => &[Constant, Speed],
        "veg_drag" | "loose_drag" => &[TerrainClass],
        "slope_gravity" => &[Pitch],
        "cross_slope" => &[Roll],
        "wind" => &[Heading],
        "mass" => &[SpeedChange, Pitch],
        // The pose lags behind by way and by turn.
        "pose_latency" => &[SteeringChange, SpeedChange, LateralAcceleration, Steering, Speed],
        "gyro_bias" => &[Constant],
        "yaw_misalign" => &[Constant, Speed],
        _ => &[],
    }
}

/// A number of a label that is a parameter of the catalogue.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Comparable {
    /// Key of the injection.
    pub key: &'static str,
    /// Index, where a list stands there.
    pub index: usize,
    /// Effect of the catalogue.
    pub effect: &'static str,
    /// Its parameter.
    pub parameter: &'static str,
    /// What the error is relative to: the distance from this value, at which nothing happens, or the value itself for
    /// limits.
    pub neutral: f64,
}

const fn of(key: &'static str, effect: &'static str, parameter: &'static str, neutral: f64) -> Comparable {
    Comparable { key, index: 0, effect, parameter, neutral }
}

/// Every number of a label that has a counterpart in the catalogue.
pub const COMPARABLE: [Comparable; 26] = [
    of("st_lag", "steer_lag", "time_constant_s", 0.0),
    of("st_rate", "steer_rate", "rate_radps", 0.0),
    of("st_delay", "steer_delay", "delay_s", 0.0),
    of("st_bias", "steer_bias", "angle_rad", 0.0),
    of("st_gain", "steer_gain", "ratio", 1.0),
    of("st_backlash", "backlash", "half_width_rad", 0.0),
    of("st_uspeed", "understeer", "gradient_s2_per_m2", 0.0),
    of("mu", "friction", "mu", 0.0),
    of("v_lag", "speed_lag", "time_constant_s", 0.0),
    of("v_delay", "speed_delay", "delay_s", 0.0),
    of("v_acc", "accel_limit", "acceleration_mps2", 0.0),
    of("v_scale", "speed_scale", "ratio", 1.0),
    of("v_deadband", "motor_deadband", "speed_mps", 0.0),
    of("drag_c", "rolling_drag", "deceleration_mps2", 0.0),
    of("drag_q", "quad_drag", "coefficient_per_m", 0.0),
    of("patch_drag", "veg_drag", "deceleration_mps2", 0.0),
    of("slope", "slope_gravity", "share", 0.0),
    of("cross", "cross_slope", "share", 0.0),
    of("wind", "wind", "east_mps2", 0.0),
    Comparable { key: "wind", index: 1, effect: "wind", parameter: "north_mps2", neutral: 0.0 },
    of("mass", "mass", "ratio", 1.0),
    of("pose_latency", "pose_latency", "age_s", 0.0),
    of("odom_scale", "odom_scale", "ratio", 1.0),
    of("gyro_bias", "gyro_bias", "bias_radps", 0.0),
    of("yaw_misalign", "yaw_misalign", "angle_rad", 0.0),
    of("loose_drag", "loose_drag", "deceleration_mps2", 0.0),
];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_counterpart_is_in_the_catalogue() {
        for comparable in COMPARABLE {
            let effect = bicycle::effect::CATALOGUE.iter().find(|effect| effect.id == comparable.effect);
            let parameters = effect.unwrap_or_else(|| panic!("{}", comparable.effect)).parameters;
            let parameter = parameters.iter().find(|parameter| parameter.name == comparable.parameter);
            assert!(
                parameter.is_some(),
                "{comparable:?}: {:?}",
                parameters.iter().map(|p| p.name).collect::<Vec<_>>()
            );
        }
    }

    #[test]
    fn every_cause_that_is_sealed_has_a_place_and_every_mimic_a_name() {
        for id in scenarios::EFFECTS {
            assert!(!places(id).is_empty(), "{id}");
            assert!(bicycle::effect::CATALOGUE.iter().any(|effect| effect.id == id), "{id}");
        }
        for id in MIMICS.iter().flat_map(|(_, names)| names.iter()) {
            assert!(bicycle::effect::CATALOGUE.iter().any(|effect| effect.id == *id), "{id}");
        }
        assert_eq!(mimics("unk_battery_sag"), None);
    }
}
