//! What of a run may be looked at and set as parameters of the node.

use ros2_client::ParameterValue;
use ros2_client::parameters::raw::{FloatingPointRange, ParameterDescriptor};

/// What whoever set a parameter wants changed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Change {
    /// Plan for this share of the worst outcomes, in (0, 1].
    Alpha(f64),
    /// Drive no faster [m/s].
    SpeedLimit(f64),
    /// Follow paths that come from now on at this speed [m/s].
    PathSpeed(f64),
}

/// Why a parameter is not set. Every message is one line.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ParameterError {
    /// There is none of the name.
    #[error("expected a parameter of this node, {}, found {found:?}", NAMES.join(", "))]
    Unknown {
        /// The name.
        found: String,
    },
    /// It is what it is for as long as the run lasts.
    #[error("{name}: expected to be left as the run was started, with {value}; the robot file says it")]
    ReadOnly {
        /// Its name.
        name: &'static str,
        /// What it is.
        value: String,
    },
    /// It is no number that would do.
    #[error("{name}: expected a double above 0 and at most {most}, found {found}")]
    Range {
        /// Its name.
        name: &'static str,
        /// The greatest that would do.
        most: f64,
        /// What it is.
        found: String,
    },
}

/// The names, in the order in which they are listed.
pub const NAMES: [&str; 5] = ["alpha", "method", "path_speed_mps", "speed_limit_mps", "use_sim_time"];

/// The parameters and what they are.
#[derive(Clone, Debug, PartialEq)]
pub struct Parameters {
    /// Share of the worst outcomes that is planned for, in (0, 1].
    pub alpha: f64,
    /// Who judges the ground, as `--method` names it.
    pub method: String,
    /// Speed along paths that come [m/s].
    pub path_speed_mps: f64,
    /// Greatest speed that the vehicle is told, either way [m/s].
    pub speed_limit_mps: f64,
    /// The vehicle's own [m/s].
    pub speed_max_mps: f64,
    /// Whether stamps are of a simulator's time.
    pub use_sim_time: bool,
}

impl Parameters {
    /// What a parameter is; not set where there is none of the name.
    pub fn value(&self, name: &str) -> ParameterValue {
        match name {
            "alpha" => ParameterValue::Double(self.alpha),
            "method" => ParameterValue::String(self.method.clone()),
            "path_speed_mps" => ParameterValue::Double(self.path_speed_mps),
            "speed_limit_mps" => ParameterValue::Double(self.speed_limit_mps),
            "use_sim_time" => ParameterValue::Boolean(self.use_sim_time),
            _ => ParameterValue::NotSet,
        }
    }

    /// What it would change to set a parameter; nothing is changed yet.
    ///
    /// # Errors
    /// See [`ParameterError`].
    pub fn change(&self, name: &str, value: &ParameterValue) -> Result<Change, ParameterError> {
        match name {
            "alpha" => Ok(Change::Alpha(within("alpha", value, 1.0)?)),
            "path_speed_mps" => Ok(Change::PathSpeed(within("path_speed_mps", value, self.speed_max_mps)?)),
            "speed_limit_mps" => {
                Ok(Change::SpeedLimit(within("speed_limit_mps", value, self.speed_max_mps)?))
            }
            "method" => Err(ParameterError::ReadOnly { name: "method", value: self.method.clone() }),
            "use_sim_time" => {
                Err(ParameterError::ReadOnly { name: "use_sim_time", value: self.use_sim_time.to_string() })
            }
            _ => Err(ParameterError::Unknown { found: name.to_owned() }),
        }
    }

    /// Takes a change over.
    pub fn apply(&mut self, change: Change) {
        match change {
            Change::Alpha(alpha) => self.alpha = alpha,
            Change::SpeedLimit(speed_mps) => self.speed_limit_mps = speed_mps,
            Change::PathSpeed(speed_mps) => self.path_speed_mps = speed_mps,
        }
    }

    /// Names of all parameters; where `prefixes` are said, of those alone.
    pub fn list(&self, prefixes: &[String]) -> Vec<String> {
        let is_asked = |name: &String| prefixes.is_empty() || prefixes.contains(name);
        NAMES.map(str::to_owned).into_iter().filter(is_asked).collect()
    }

    /// What a parameter means and may be; of one that there is not, its name alone.
    pub fn describe(&self, name: &str) -> ParameterDescriptor {
        let (description, most) = match name {
            "alpha" => ("share of the worst outcomes that is planned for", Some(1.0)),
            "method" => ("who judges the ground", None),
            "path_speed_mps" => ("speed along paths that come [m/s]", Some(self.speed_max_mps)),
            "speed_limit_mps" => ("greatest speed that is commanded [m/s]", Some(self.speed_max_mps)),
            "use_sim_time" => ("whether stamps are of the time on /clock", None),
            _ => ("", None),
        };
        let range = |to_value| FloatingPointRange { from_value: 0.0, to_value, step: 0.0 };
        ParameterDescriptor {
            name: name.to_owned(),
            r#type: ParameterValue::to_parameter_type_raw(&self.value(name)),
            description: description.to_owned(),
            additional_constraints: most.map_or_else(String::new, |_| "above 0".to_owned()),
            read_only: most.is_none(),
            dynamic_typing: false,
            floating_point_range: most.map(range).into_iter().collect(),
            integer_range: Vec::new(),
        }
    }
}

/// A number above 0 and no greater than `most`.
fn within(name: &'static str, value: &ParameterValue, most: f64) -> Result<f64, ParameterError> {
    match value {
        ParameterValue::Double(number) if *number > 0.0 && *number <= most => Ok(*number),
        _ => Err(ParameterError::Range { name, most, found: said(value) }),
    }
}

fn said(value: &ParameterValue) -> String {
    match value {
        ParameterValue::Double(number) => number.to_string(),
        ParameterValue::Integer(number) => format!("the integer {number}"),
        ParameterValue::String(text) => format!("{text:?}"),
        ParameterValue::Boolean(is_so) => is_so.to_string(),
        ParameterValue::NotSet => "nothing".to_owned(),
        _ => "an array".to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parameters() -> Parameters {
        Parameters {
            alpha: 0.6,
            method: "physics".into(),
            path_speed_mps: 1.0,
            speed_limit_mps: 2.0,
            speed_max_mps: 2.0,
            use_sim_time: false,
        }
    }

    #[test]
    fn what_is_set_is_what_is_found_then() {
        let mut parameters = parameters();
        for (name, number) in [("alpha", 0.25), ("path_speed_mps", 0.5), ("speed_limit_mps", 2.0)] {
            let value = ParameterValue::Double(number);
            let change = parameters.change(name, &value).unwrap();
            parameters.apply(change);
            assert_eq!(parameters.value(name), value);
        }
        assert_eq!(parameters.value("beta"), ParameterValue::NotSet);
    }

    #[test]
    fn what_would_not_do_is_refused_in_one_line() {
        let told =
            |name: &str, value: ParameterValue| parameters().change(name, &value).unwrap_err().to_string();
        for (number, found) in [(0.0, "0"), (1.5, "1.5"), (f64::NAN, "NaN"), (-0.1, "-0.1")] {
            let expected = format!("alpha: expected a double above 0 and at most 1, found {found}");
            assert_eq!(told("alpha", ParameterValue::Double(number)), expected);
        }
        let integer = told("speed_limit_mps", ParameterValue::Integer(1));
        assert_eq!(integer, "speed_limit_mps: expected a double above 0 and at most 2, found the integer 1");
        let method = told("method", ParameterValue::String("pietra".into()));
        assert!(method.starts_with("method: expected to be left as the run was started, with physics"));
        let unknown = told("beta", ParameterValue::Double(1.0));
        assert!(unknown.ends_with("speed_limit_mps, use_sim_time, found \"beta\""), "{unknown}");
    }

    #[test]
    fn descriptions_say_what_may_be_set() {
        let parameters = parameters();
        let settable = NAMES.map(|name| !parameters.describe(name).read_only);
        assert_eq!(settable, NAMES.map(|name| parameters.change(name, &ParameterValue::Double(0.5)).is_ok()));
        let limit = parameters.describe("speed_limit_mps");
        assert_eq!((limit.r#type, limit.floating_point_range[0].to_value), (3, 2.0));
        assert_eq!(parameters.describe("beta").r#type, 0);
        assert_eq!(parameters.list(&[]), NAMES);
        assert_eq!(parameters.list(&["alpha".into()]), ["alpha"]);
    }
}
