//! What a recording must hold for its decisions to be made again.

use bicycle::{Model, Vehicle};
use navigator::Config;
use serde::{Deserialize, Serialize};

use crate::ages::AgeLimits;

/// What was run. Settings are TOML, which knows infinity.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RecordedSetup {
    /// Name of the vehicle.
    pub vehicle_name: String,
    /// Its description.
    pub vehicle_toml: String,
    /// What was believed of it.
    pub model_toml: String,
    /// Settings of the pipeline.
    pub config_toml: String,
    /// What was known of the ground, as `--method` names it.
    pub method: String,
    /// SHA-256 of the networks' weights, in hexadecimal digits; empty without networks.
    pub checkpoint_sha256: String,
    /// Share of the worst outcomes planned for.
    pub alpha: f64,
    /// Decided the samples; as text, because not every reader of JSON knows numbers so large.
    pub seed: String,
    /// How old what was driven on might be.
    pub ages: AgeLimits,
    /// Revision of the program.
    pub revision: String,
}

/// A setup that cannot be written or read back.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("recorded {what}: expected TOML that this program knows, found: {problem}")]
pub struct SetupError {
    /// Which part.
    pub what: &'static str,
    /// What the reader said.
    pub problem: String,
}

/// The parts of a setup that are described in TOML.
#[derive(Clone, Debug, PartialEq)]
pub struct MachineSetup {
    /// The machine.
    pub vehicle: Vehicle,
    /// What is believed of it.
    pub model: Model,
    /// Settings of the pipeline.
    pub config: Config,
}

impl MachineSetup {
    /// As texts: vehicle, model, settings.
    pub fn texts(&self) -> Result<[String; 3], SetupError> {
        fn text(what: &'static str, value: &impl Serialize) -> Result<String, SetupError> {
            toml::to_string(value).map_err(|error| SetupError { what, problem: error.to_string() })
        }
        Ok([
            text("vehicle", &self.vehicle)?,
            text("model", &self.model)?,
            text("configuration", &self.config)?,
        ])
    }

    /// Out of a recorded setup.
    pub fn read(setup: &RecordedSetup) -> Result<Self, SetupError> {
        fn part<T: for<'de> Deserialize<'de>>(what: &'static str, text: &str) -> Result<T, SetupError> {
            toml::from_str(text).map_err(|error| SetupError { what, problem: error.to_string() })
        }
        Ok(Self {
            vehicle: part("vehicle", &setup.vehicle_toml)?,
            model: part("model", &setup.model_toml)?,
            config: part("configuration", &setup.config_toml)?,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ages::Periods;

    #[test]
    fn settings_survive_the_recording_to_the_last_bit() {
        let vehicle = formats::read_vehicle("rc_car").unwrap();
        let model = Model::of(&vehicle);
        let mut config = Config::for_vehicle(&vehicle);
        config.controller.recovery.patience_s = f64::INFINITY;
        config.prior.obstacle_margin_m = 0.1 + 0.2;
        let machine_guard = config.guard;
        let machine = MachineSetup { vehicle, model, config };
        let [vehicle_toml, model_toml, config_toml] = machine.texts().unwrap();
        let setup = RecordedSetup {
            vehicle_name: String::new(),
            vehicle_toml,
            model_toml,
            config_toml,
            method: "physics".to_owned(),
            checkpoint_sha256: String::new(),
            alpha: 0.6,
            seed: u64::MAX.to_string(),
            ages: AgeLimits::new(&Periods::default(), &machine_guard, None).unwrap(),
            revision: String::new(),
        };
        assert_eq!(MachineSetup::read(&setup), Ok(machine));
        let broken = RecordedSetup { model_toml: "wheelbase_m = 'long'".to_owned(), ..setup };
        assert_eq!(MachineSetup::read(&broken).unwrap_err().what, "model");
    }
}
