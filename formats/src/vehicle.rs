//! Vehicles and models in TOML, and the vehicles that ship with the program.

use std::path::Path;

use bicycle::effect::EffectError;
use bicycle::{Model, ModelError, Vehicle};

use crate::{ConfigError, ConfigText};

/// The shipped vehicles, name and text.
const SHIPPED: [(&str, &str); 5] = [
    ("pietra_full_size", include_str!("../../scenarios/vehicles/pietra_full_size.toml")),
    ("rc_car", include_str!("../../scenarios/vehicles/rc_car.toml")),
    ("ut_automata", include_str!("../../scenarios/vehicles/ut_automata.toml")),
    ("buggy_fifth", include_str!("../../scenarios/vehicles/buggy_fifth.toml")),
    ("sedan", include_str!("../../scenarios/vehicles/sedan.toml")),
];

/// Names of the vehicles that ship with the program.
pub fn shipped_vehicle_names() -> impl Iterator<Item = &'static str> {
    SHIPPED.iter().map(|(name, _)| *name)
}

/// The TOML text of a shipped vehicle, to start one's own from; `None` for an unknown name.
pub fn shipped_vehicle_text(name: &str) -> Option<&'static str> {
    SHIPPED.iter().find(|(shipped, _)| *shipped == name).map(|(_, text)| *text)
}

/// A vehicle by the name of a shipped one or by the path of a TOML file.
///
/// Errors: the file cannot be read, holds an unknown, missing or mistyped key, or a value that no vehicle can have.
pub fn read_vehicle(name_or_path: &str) -> Result<Vehicle, ConfigError> {
    let text = match shipped_vehicle_text(name_or_path) {
        Some(text) => ConfigText::new(name_or_path, text),
        None => ConfigText::read(Path::new(name_or_path)).map_err(with_shipped_names)?,
    };
    parse_vehicle(&text)
}

/// A vehicle from a text already read. Errors as [`read_vehicle`].
pub fn parse_vehicle(text: &ConfigText) -> Result<Vehicle, ConfigError> {
    let vehicle: Vehicle = text.parse()?;
    match vehicle.validate() {
        Ok(()) => Ok(vehicle),
        Err(error) => Err(text.refuse(error.field, error.expected, error.found)),
    }
}

/// What a controller shall believe of its vehicle, from a TOML file with `wheelbase_m`, `[limits]` as in a vehicle's
/// file, and one `[[effects]]` per effect.
///
/// Errors: the file cannot be read, holds an unknown, missing or mistyped key, or a value that no model can have.
pub fn read_model(path: &Path) -> Result<Model, ConfigError> {
    parse_model(&ConfigText::read(path)?)
}

/// A model from a text already read. Errors as [`read_model`].
pub fn parse_model(text: &ConfigText) -> Result<Model, ConfigError> {
    let model: Model = text.parse()?;
    let place =
        |id: &str| model.effects.iter().rposition(|effect| effect.description().id == id).unwrap_or(0);
    match model.validate() {
        Ok(()) => Ok(model),
        Err(ModelError::Field { field, expected, found }) => Err(text.refuse(field, expected, found)),
        Err(ModelError::Effect(EffectError { id, parameter, low, high, unit, found })) => {
            let field = format!("effects[{}].{parameter}", place(id));
            Err(text.refuse(&field, format_args!("{low} to {high} {unit}"), found))
        }
        Err(ModelError::EffectAtSpeed { error, speed_mps }) => {
            let EffectError { id, parameter, low, high, unit, found } = error;
            let field = format!("effects[{}].{parameter}", place(id));
            let expected = format_args!("{low} to {high} {unit} for speeds of up to {speed_mps} m/s");
            Err(text.refuse(&field, expected, found))
        }
    }
}

/// A path that cannot be read may be a mistyped name: say which names exist.
fn with_shipped_names(error: ConfigError) -> ConfigError {
    match error {
        ConfigError::Unreadable { file, source } => {
            let names = shipped_vehicle_names().collect::<Vec<_>>().join(", ");
            let message = format!("{source} (shipped vehicles: {names})");
            ConfigError::Unreadable { file, source: std::io::Error::new(source.kind(), message) }
        }
        other => other,
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use super::*;

    const GRAVITY_MPS2: f64 = 9.81;

    fn fleet() -> Vec<Vehicle> {
        shipped_vehicle_names().map(|name| read_vehicle(name).unwrap()).collect()
    }

    fn total_mass_kg(vehicle: &Vehicle) -> f64 {
        vehicle.body.mass_kg + 4.0 * vehicle.wheel.mass_kg
    }

    /// Undamped frequency [Hz] and damping ratio of the sprung mass over one axle, wheel by wheel.
    fn bounce(vehicle: &Vehicle) -> [(f64, f64); 2] {
        let front_share = vehicle.body.cog_ahead_m / vehicle.geometry.wheelbase_m;
        [(vehicle.front, front_share), (vehicle.rear, 1.0 - front_share)].map(|(axle, share)| {
            let mass_kg = vehicle.body.mass_kg * share / 2.0;
            let omega = (axle.suspension.stiffness_n_per_m / mass_kg).sqrt();
            (omega / TAU, axle.suspension.damping_ns_per_m / (2.0 * mass_kg * omega))
        })
    }

    #[test]
    fn shipped_vehicles_are_valid_and_named_as_they_are_called() {
        let names: Vec<_> = fleet().into_iter().map(|vehicle| vehicle.name).collect();
        assert_eq!(names, ["pietra_full_size", "rc_car", "ut_automata", "buggy_fifth", "sedan"]);
    }

    #[test]
    fn stated_sizes_and_masses_hold() {
        let [pietra, rc, automata, buggy, sedan] = fleet().try_into().unwrap();
        assert_eq!([pietra.geometry.length_m, pietra.geometry.width_m], [3.4, 1.8]);
        assert_eq!([pietra.limits.speed_max_mps, total_mass_kg(&pietra)], [1.0, 1500.0]);
        assert_eq!(
            [rc.geometry.length_m, rc.geometry.width_m, rc.geometry.wheel_radius_m],
            [0.33, 0.25, 0.075]
        );
        assert_eq!([rc.limits.speed_max_mps, total_mass_kg(&rc)], [1.5, 3.0]);
        assert!((total_mass_kg(&automata) - 3.9).abs() < 1e-9 && automata.geometry.wheelbase_m == 0.324);
        assert_eq!([buggy.limits.speed_max_mps, total_mass_kg(&buggy)], [8.0, 13.0]);
        assert!((total_mass_kg(&sedan) - 2303.1).abs() < 1e-9);
        // lf + lr = 1.5213 + 1.4987
        assert!((sedan.geometry.wheelbase_m - 3.02).abs() < 1e-9 && sedan.body.cog_ahead_m == 1.4987);
        // Yaw inertia of the whole: body and four wheels at 1.51 m and half the track.
        let wheels = 4.0 * sedan.wheel.mass_kg * (1.51_f64.powi(2) + (sedan.geometry.track_m / 2.0).powi(2));
        assert!((sedan.body.inertia_kgm2[2] + wheels - 5520.1).abs() < 5.0);
        let degrees = |rad: f64| rad.to_degrees().round();
        assert_eq!([rc.limits.steering_max_rad, rc.limits.roll_max_rad].map(degrees), [30.0, 30.0]);
        assert_eq!(degrees(rc.limits.pitch_max_rad), 45.0);
    }

    #[test]
    fn suspensions_bounce_and_settle_as_their_class_does() {
        for vehicle in fleet() {
            let band_hz = if total_mass_kg(&vehicle) > 100.0 { 1.2..2.5 } else { 2.95..5.0 };
            for (frequency_hz, damping_ratio) in bounce(&vehicle) {
                assert!(band_hz.contains(&frequency_hz), "{}: {frequency_hz} Hz", vehicle.name);
                assert!((0.3..0.6).contains(&damping_ratio), "{}: {damping_ratio}", vehicle.name);
            }
        }
    }

    #[test]
    fn the_parts_fit_together() {
        for vehicle in fleet() {
            let (geometry, wheel) = (&vehicle.geometry, &vehicle.wheel);
            let front_overhang_m = geometry.length_m - geometry.wheelbase_m - geometry.rear_overhang_m;
            assert!(geometry.rear_overhang_m >= geometry.wheel_radius_m - 1e-9, "{}", vehicle.name);
            assert!(front_overhang_m >= geometry.wheel_radius_m - 1e-9, "{}", vehicle.name);
            assert!(geometry.track_m + wheel.width_m <= geometry.width_m + 1e-9, "{}", vehicle.name);
            // A wheel is between a disc (1/2) and a hoop (1).
            let hoop = wheel.mass_kg * geometry.wheel_radius_m.powi(2);
            assert!((0.5..1.0).contains(&(wheel.spin_inertia_kgm2 / hoop)), "{}", vehicle.name);
            // A rigid body obeys the triangle inequality.
            let [x, y, z] = vehicle.body.inertia_kgm2;
            assert!(x + y > z && y + z > x && z + x > y, "{}", vehicle.name);
        }
    }

    #[test]
    fn a_vehicle_at_its_attitude_limit_stands_and_can_climb() {
        for vehicle in fleet() {
            let (body, geometry, limits) = (&vehicle.body, &vehicle.geometry, &vehicle.limits);
            // Resting on two wheels, a body tips where the centre of gravity passes the contact line.
            let roll_tip_rad = (geometry.track_m / 2.0 / body.cog_height_m).atan();
            let to_axle_m = body.cog_ahead_m.min(geometry.wheelbase_m - body.cog_ahead_m);
            let pitch_tip_rad = (to_axle_m / body.cog_height_m).atan();
            assert!(limits.roll_max_rad < roll_tip_rad, "{}", vehicle.name);
            assert!(limits.pitch_max_rad < pitch_tip_rad, "{}", vehicle.name);
            let tip_mps2 = GRAVITY_MPS2 * geometry.track_m / (2.0 * body.cog_height_m);
            assert!(limits.lateral_acceleration_max_mps2 < 0.6 * tip_mps2, "{}", vehicle.name);
            let weight_n = total_mass_kg(&vehicle) * GRAVITY_MPS2;
            let climb_nm = weight_n * limits.pitch_max_rad.sin() * geometry.wheel_radius_m;
            assert!(vehicle.drivetrain.drive_torque_max_nm > climb_nm, "{}", vehicle.name);
        }
    }

    #[test]
    fn impossible_values_are_refused_with_their_line() {
        let text = shipped_vehicle_text("sedan").unwrap();
        let refuse = |from: &str, to: &str| {
            assert!(text.contains(from));
            parse_vehicle(&ConfigText::new("v.toml", text.replacen(from, to, 1))).unwrap_err().to_string()
        };
        let line = |needle: &str| 1 + text.lines().position(|line| line.contains(needle)).unwrap();
        assert_eq!(
            refuse("wheelbase_m = 3.02", "wheelbase_m = 0.0"),
            format!(
                "v.toml:{}: geometry.wheelbase_m: expected a finite number > 0, found 0",
                line("wheelbase_m")
            )
        );
        assert_eq!(
            refuse("cog_height_m = 0.55", "cog_height_m = nan"),
            format!(
                "v.toml:{}: body.cog_height_m: expected a finite number > 0, found NaN",
                line("cog_height_m")
            )
        );
        assert_eq!(
            refuse("length_m = 4.99", "length_m = 2.5"),
            format!(
                "v.toml:{}: geometry.length_m: expected at least 4.140, the wheelbase of 3.02 and 1.12 behind it, \
                 found 2.5",
                line("length_m")
            )
        );
        assert_eq!(
            refuse("width_m = 1.89", "width_m = 0.5"),
            format!(
                "v.toml:{}: geometry.width_m: expected at least the track of 1.63, found 0.5",
                line("width_m")
            )
        );
        assert!(
            refuse("wheelbase_m = 3.02", "wheel_base = 3.02")
                .contains("geometry.wheel_base: expected one of")
        );
        assert!(
            refuse("track_m = 1.63", "track_m = \"wide\"")
                .contains("geometry.track_m: expected f64, found string")
        );
    }

    /// A model of the rc_car's size; the effects are the caller's.
    fn model_text(effects: &str) -> ConfigText {
        let limits = shipped_vehicle_text("rc_car").unwrap().split("[limits]").nth(1).unwrap();
        let limits = limits.split("\n\n").next().unwrap();
        ConfigText::new("m.toml", format!("wheelbase_m = 0.18\n[limits]{limits}\n{effects}"))
    }

    #[test]
    fn a_model_reads_its_effects() {
        let vehicle = read_vehicle("rc_car").unwrap();
        assert_eq!(parse_model(&model_text("")).unwrap(), Model::of(&vehicle));
        let model =
            parse_model(&model_text("[[effects]]\nid = \"speed_lag\"\ntime_constant_s = 0.25")).unwrap();
        assert_eq!(model.effects.len(), 1);
        assert_eq!(model.effects[0].values()[0], 0.25);
    }

    #[test]
    fn a_model_is_refused_with_its_line() {
        let refuse = |effects: &str| {
            let message = parse_model(&model_text(effects)).unwrap_err().to_string();
            // The effects stand below wheelbase, [limits] and its eight lines.
            let (line, rest) = message.strip_prefix("m.toml:").unwrap().split_once(": ").unwrap();
            format!("{}: {rest}", line.parse::<usize>().unwrap() - 10)
        };
        let lag = "[[effects]]\nid = \"speed_lag\"\ntime_constant_s = ";
        assert_eq!(
            refuse(&format!("{lag}-0.5")),
            "3: effects[0].time_constant_s: expected 0 to 3 s, found -0.5"
        );
        assert_eq!(
            refuse("[[effects]]\nid = \"warp\"").split(", ").next(),
            Some("2: effects[0].id: expected one of steer_delay")
        );
        assert_eq!(
            refuse(&format!("{lag}0.5\ngain = 1")),
            "1: effects[0].gain: expected time_constant_s, found an unknown key"
        );
        assert_eq!(
            refuse("[[effects]]\nid = \"speed_lag\""),
            "1: effects[0].time_constant_s: expected a value, found no such key"
        );
    }

    #[test]
    fn an_unknown_name_lists_the_shipped_ones() {
        let message = read_vehicle("tank").unwrap_err().to_string();
        assert!(message.contains("tank: ") && message.contains("pietra_full_size, rc_car"), "{message}");
    }
}
