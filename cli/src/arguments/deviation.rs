//! `--deviation`: a way in which the simulated machine departs from its description, in one word.

use std::str::FromStr;

use scenarios::Deviation;

/// A departure as it was asked for.
#[derive(Clone, Debug, PartialEq)]
pub struct AskedDeviation {
    /// As it stood on the command line.
    pub words: String,
    /// The plant's departure.
    pub deviation: Deviation,
}

/// One kind: its name, its numbers with their units, and how they make it.
struct Kind {
    name: &'static str,
    numbers: &'static [&'static str],
    make: fn(&[f64]) -> Deviation,
}

const fn kind(name: &'static str, numbers: &'static [&'static str], make: fn(&[f64]) -> Deviation) -> Kind {
    Kind { name, numbers, make }
}

/// All kinds, in the order of a machine from servo to sensor, then what breaks.
const KINDS: [Kind; 32] = [
    kind("steering_response", &["SECONDS"], |n| Deviation::SteeringResponse { added_s: n[0] }),
    kind("steering_rate", &["RAD/S"], |n| Deviation::SteeringRate { rate_radps: n[0] }),
    kind("steering_delay", &["SECONDS"], |n| Deviation::SteeringDelay { added_s: n[0] }),
    kind("steering_trim", &["RAD"], |n| Deviation::SteeringTrim { angle_rad: n[0] }),
    kind("steering_ratio", &["LEFT", "RIGHT"], |n| Deviation::SteeringRatio { left: n[0], right: n[1] }),
    kind("steering_play", &["RAD"], |n| Deviation::SteeringPlay { half_width_rad: n[0] }),
    kind("steering_compliance", &["RAD/N"], |n| Deviation::SteeringCompliance { rad_per_n: n[0] }),
    kind("tyre_grip", &["FACTOR"], |n| Deviation::TyreGrip { factor: n[0] }),
    kind("tyre_stiffness", &["FRONT", "REAR"], |n| Deviation::TyreStiffness { front: n[0], rear: n[1] }),
    kind("motor_response", &["SECONDS"], |n| Deviation::MotorResponse { added_s: n[0] }),
    kind("motor_delay", &["SECONDS"], |n| Deviation::MotorDelay { added_s: n[0] }),
    kind("motor_ramp", &["M/S2"], |n| Deviation::MotorRamp { acceleration_mps2: n[0] }),
    kind("motor_torque", &["NM"], |n| Deviation::MotorTorque { limit_nm: n[0] }),
    kind("motor_dead_band", &["M/S"], |n| Deviation::MotorDeadBand { speed_mps: n[0] }),
    kind("motor_droop", &[], |_| Deviation::MotorDroop),
    kind("wheel_radius", &["FACTOR"], |n| Deviation::WheelRadius { factor: n[0] }),
    kind("rolling_resistance", &["ADDED"], |n| Deviation::RollingResistance { added: n[0] }),
    kind("drag_area", &["M2"], |n| Deviation::DragArea { area_m2: n[0] }),
    kind("dense_vegetation", &["FACTOR"], |n| Deviation::DenseVegetation { factor: n[0] }),
    kind("slope_pull", &["ALONG", "ACROSS"], |n| Deviation::SlopePull { along: n[0], across: n[1] }),
    kind("wind", &["EAST_N", "NORTH_N"], |n| Deviation::Wind { force_n: [n[0], n[1]] }),
    kind("mass", &["FACTOR"], |n| Deviation::Mass { factor: n[0] }),
    kind("pose_latency", &["SECONDS"], |n| Deviation::PoseLatency { delay_s: n[0] }),
    kind("odometry_scale", &["FACTOR"], |n| Deviation::OdometryScale { factor: n[0] }),
    kind("gyro_bias", &["RAD/S"], |n| Deviation::GyroBias { rate_radps: n[0] }),
    kind("yaw_misalignment", &["RAD"], |n| Deviation::YawMisalignment { angle_rad: n[0] }),
    kind("trailer", &["KG", "DRAWBAR_M", "RESISTANCE"], |n| Deviation::Trailer {
        mass_kg: n[0],
        drawbar_m: n[1],
        resistance: n[2],
    }),
    kind("flat_tyre", &["WHEEL", "RADIUS", "STIFFNESS", "RESISTANCE"], |n| Deviation::FlatTyre {
        wheel: n[0] as usize,
        radius: n[1],
        stiffness: n[2],
        resistance: n[3],
    }),
    kind("yaw_moment", &["NM"], |n| Deviation::YawMoment { torque_nm: n[0] }),
    kind("sway", &["NM", "PERIOD_S"], |n| Deviation::Sway { torque_nm: n[0], period_s: n[1] }),
    kind("command_drop_out", &["PERIOD_S", "LENGTH_S"], |n| Deviation::CommandDropOut {
        period_s: n[0],
        length_s: n[1],
    }),
    kind("battery_sag", &["PER_S"], |n| Deviation::BatterySag { per_s: n[0] }),
];

impl Kind {
    /// As it is to be typed.
    fn usage(&self) -> String {
        if self.numbers.is_empty() {
            return self.name.to_owned();
        }
        format!("{}={}", self.name, self.numbers.join(","))
    }
}

impl FromStr for AskedDeviation {
    type Err = String;

    fn from_str(words: &str) -> Result<Self, String> {
        let (name, values) = words.split_once('=').unwrap_or((words, ""));
        let kind = KINDS.iter().find(|kind| kind.name == name).ok_or_else(|| {
            let known: Vec<String> = KINDS.iter().map(Kind::usage).collect();
            format!("expected one of {}, found {name:?}", known.join(", "))
        })?;
        let refused = || format!("expected {}, found {words:?}", kind.usage());
        let parts = values.split(',').filter(|_| !values.is_empty());
        let numbers: Vec<f64> =
            parts.map(|part| part.trim().parse().map_err(|_| refused())).collect::<Result<_, _>>()?;
        let whole =
            name != "flat_tyre" || numbers.first().is_none_or(|wheel| wheel.fract() == 0.0 && *wheel >= 0.0);
        if numbers.len() != kind.numbers.len() || !whole {
            return Err(refused());
        }
        let deviation = (kind.make)(&numbers);
        deviation.validate().map_err(|error| error.to_string())?;
        Ok(Self { words: words.to_owned(), deviation })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parse(words: &str) -> Result<AskedDeviation, String> {
        words.parse()
    }

    #[test]
    fn words_become_departures() {
        let expected = Deviation::SteeringDelay { added_s: 0.2 };
        assert_eq!(parse("steering_delay=0.2").unwrap().deviation, expected);
        let expected = Deviation::SlopePull { along: 0.8, across: -0.1 };
        assert_eq!(parse("slope_pull=0.8,-0.1").unwrap().deviation, expected);
        assert_eq!(parse("motor_droop").unwrap().deviation, Deviation::MotorDroop);
        let flat = Deviation::FlatTyre { wheel: 2, radius: 0.9, stiffness: 0.5, resistance: 0.02 };
        assert_eq!(parse("flat_tyre=2,0.9,0.5,0.02").unwrap().deviation, flat);
    }

    /// The plant's own name for a part stands in its refusals: every kind makes the departure of its name.
    #[test]
    fn names_are_the_parts_of_the_plant() {
        for kind in &KINDS {
            if let Err(error) = (kind.make)(&vec![f64::NAN; kind.numbers.len()]).validate() {
                assert_eq!(error.part, kind.name);
            } else {
                assert!(kind.numbers.is_empty(), "{}", kind.name);
            }
        }
    }

    #[test]
    fn what_is_no_departure_is_refused_with_what_would_be() {
        for (words, part) in [
            ("steering=0.2", "expected one of steering_response=SECONDS"),
            ("steering_delay", "expected steering_delay=SECONDS, found \"steering_delay\""),
            ("steering_delay=soon", "expected steering_delay=SECONDS"),
            ("wind=3", "expected wind=EAST_N,NORTH_N"),
            ("mass=1.2,3", "expected mass=FACTOR"),
            ("motor_droop=1", "expected motor_droop,"),
            ("flat_tyre=1.5,0.9,0.5,0.02", "expected flat_tyre=WHEEL"),
            ("flat_tyre=-1,0.9,0.5,0.02", "expected flat_tyre=WHEEL"),
            ("steering_delay=-1", "steering_delay.added_s: expected 0 to 5, found -1"),
            ("mass=nan", "mass.factor"),
        ] {
            let told = parse(words).unwrap_err();
            assert!(told.contains(part), "{words}: {told}");
        }
    }
}
