//! Skid-steered vehicles in TOML, and the one that ships with the program.

use std::path::Path;

use bicycle::{ModelError, MotionModel, SkidSteerVehicle};

use crate::{ConfigError, ConfigText};

const WARTHOG: &str = include_str!("../../scenarios/vehicles/warthog.toml");

/// A skid-steered vehicle, "warthog" or the path of a TOML file: `name`, `[geometry]` as in the file of any vehicle, and
/// in `[model]` what its drives can do.
///
/// Errors: the file cannot be read, holds an unknown, missing or mistyped key, or a value that no vehicle can have.
pub fn read_skid_steer_vehicle(name_or_path: &str) -> Result<SkidSteerVehicle, ConfigError> {
    let text = match name_or_path {
        "warthog" => ConfigText::new(name_or_path, WARTHOG),
        path => ConfigText::read(Path::new(path))?,
    };
    parse_skid_steer_vehicle(&text)
}

/// A skid-steered vehicle from a text already read. Errors as [`read_skid_steer_vehicle`].
pub fn parse_skid_steer_vehicle(text: &ConfigText) -> Result<SkidSteerVehicle, ConfigError> {
    let vehicle: SkidSteerVehicle = text.parse()?;
    vehicle.geometry.validate().map_err(|error| text.refuse(error.field, error.expected, error.found))?;
    match vehicle.model.validate() {
        Ok(()) => Ok(vehicle),
        Err(ModelError::Field { field, expected, found }) => {
            Err(text.refuse(&format!("model.{field}"), expected, found))
        }
        Err(other) => Err(text.refuse("model", "values that a model can have", other)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn refusal(from: &str, to: &str) -> String {
        assert!(WARTHOG.contains(from), "{from}");
        let text = ConfigText::new("w.toml", WARTHOG.replacen(from, to, 1));
        parse_skid_steer_vehicle(&text).map_or_else(|error| error.to_string(), |_| "accepted".to_owned())
    }

    #[test]
    fn the_shipped_vehicle_turns_about_the_middle_of_its_axles() {
        let vehicle = read_skid_steer_vehicle("warthog").unwrap();
        assert_eq!(vehicle.model.turning_point_ahead_m, 0.5 * vehicle.geometry.wheelbase_m);
        let overhangs_m = vehicle.geometry.length_m - vehicle.geometry.wheelbase_m;
        assert!((2.0 * vehicle.geometry.rear_overhang_m - overhangs_m).abs() < 1e-9);
        assert_eq!(read_skid_steer_vehicle("warthog").unwrap(), vehicle);
    }

    #[test]
    fn impossible_values_are_refused_with_their_line() {
        let line = |needle: &str| 1 + WARTHOG.lines().position(|line| line.starts_with(needle)).unwrap();
        assert_eq!(
            refusal("yaw_rate_max_radps = 1.2", "yaw_rate_max_radps = -1.2"),
            format!(
                "w.toml:{}: model.limits.yaw_rate_max_radps: expected a yaw rate > 0 of at most 100 rad/s, found -1.2",
                line("yaw_rate_max_radps")
            )
        );
        assert_eq!(
            refusal("speed_lag_s = 0.4", "speed_lag_s = 11.0"),
            format!(
                "w.toml:{}: model.speed_lag_s: expected a time from 0 to 10 s, found 11",
                line("speed_lag_s")
            )
        );
        assert_eq!(
            refusal("track_m = 1.08", "track_m = 0"),
            format!("w.toml:{}: geometry.track_m: expected a finite number > 0, found 0", line("track_m"))
        );
        assert!(refusal("yaw_rate_lag_s", "steering_lag_s").contains("steering_lag_s"));
        assert_eq!(refusal("turning_point_ahead_m = 0.4575", ""), "accepted");
    }

    #[test]
    fn a_file_that_is_not_there_is_named() {
        let told = read_skid_steer_vehicle("no/such.toml").unwrap_err().to_string();
        assert!(told.starts_with("no/such.toml: expected a readable text file"), "{told}");
    }
}
