//! What a recording must hold for its decisions to be made again.

use bicycle::{Model, Vehicle};
use navigator::Config;
use serde::{Deserialize, Serialize};

use bus::ages::AgeLimits;
use bus::clock;

/// The same moment on two clocks, which places a recording in time. Both as text, because not every reader of JSON knows
/// numbers so large.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ClockAnchor {
    /// On the clock of the recording's messages [ns].
    pub monotonic_ns: String,
    /// On that of the world: of UTC since 1970 [ns].
    pub utc_ns: String,
}

impl ClockAnchor {
    /// Of this moment.
    pub fn now() -> Self {
        let (before_ns, utc_ns, after_ns) = (clock::now_ns(), clock::utc_ns(), clock::now_ns());
        let monotonic_ns = before_ns + (after_ns - before_ns) / 2;
        Self { monotonic_ns: monotonic_ns.to_string(), utc_ns: utc_ns.to_string() }
    }
}

/// What was run. Settings are TOML, which knows infinity.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RecordedSetup {
    /// Version of all that makes up a recording, beside the layouts of its messages.
    pub format: u32,
    /// A moment near the beginning of the file.
    pub clock: ClockAnchor,
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
    /// The same of what corrected commands for the ground; empty where nothing did.
    pub corrector_sha256: String,
    /// Share of the worst outcomes planned for.
    pub alpha: f64,
    /// Decided the samples; as text, because not every reader of JSON knows numbers so large.
    pub seed: String,
    /// How old what was driven on might be.
    pub ages: AgeLimits,
    /// Revision of the program.
    pub revision: String,
}

impl RecordedSetup {
    /// The version that this program writes and reads. The first one did not say which it is.
    pub const FORMAT: u32 = 4;

    /// The version that a recorded setup is of; `None` for what is no setup.
    pub fn format_of(json: &[u8]) -> Option<u32> {
        #[derive(Deserialize)]
        struct Version {
            format: Option<u32>,
        }
        serde_json::from_slice(json).ok().map(|Version { format }| format.unwrap_or(1))
    }

    /// Whether both are of the same run.
    pub fn is_of_same_run(&self, other: &Self) -> bool {
        Self { clock: other.clock.clone(), ..self.clone() } == *other
    }
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
    use crate::ages::{self, AskedAges};
    use bus::ages::Periods;

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
            format: RecordedSetup::FORMAT,
            clock: ClockAnchor::now(),
            vehicle_name: String::new(),
            vehicle_toml,
            model_toml,
            config_toml,
            method: "physics".to_owned(),
            checkpoint_sha256: String::new(),
            corrector_sha256: String::new(),
            alpha: 0.6,
            seed: u64::MAX.to_string(),
            ages: ages::limits(&Periods::default(), &machine_guard, &AskedAges::default()).unwrap(),
            revision: String::new(),
        };
        assert_eq!(MachineSetup::read(&setup), Ok(machine));
        let broken = RecordedSetup { model_toml: "wheelbase_m = 'long'".to_owned(), ..setup };
        assert_eq!(MachineSetup::read(&broken).unwrap_err().what, "model");
    }

    #[test]
    fn the_two_clocks_of_an_anchor_are_read_at_the_same_moment() {
        let number = |text: &str| text.parse::<u64>().unwrap();
        let [one, other] = [0, 1].map(|_| {
            std::thread::sleep(std::time::Duration::from_millis(20));
            ClockAnchor::now()
        });
        let apart = |read: fn(&ClockAnchor) -> &String| number(read(&other)) - number(read(&one));
        let apart_ns = apart(|anchor| &anchor.monotonic_ns).abs_diff(apart(|anchor| &anchor.utc_ns));
        // Clocks may be slewed, and a loaded machine interrupts; a date is another matter.
        assert!(apart_ns < 1_000_000_000, "{apart_ns} ns");
        let since_2024_ns = number(&one.utc_ns).saturating_sub(1_704_067_200 * 1_000_000_000);
        assert!(since_2024_ns > 0 && number(&one.monotonic_ns) < since_2024_ns, "{one:?}");
    }

    #[test]
    fn a_setup_says_of_which_version_it_is_or_is_of_the_first() {
        assert_eq!(RecordedSetup::format_of(br#"{ "vehicle_name": "rc_car", "alpha": 0.6 }"#), Some(1));
        assert_eq!(RecordedSetup::format_of(br#"{ "format": 7, "anything": [] }"#), Some(7));
        assert_eq!(RecordedSetup::format_of(br#"{ "format": "#), None);
        assert_eq!(RecordedSetup::format_of(br#"{ "format": "two" }"#), None);
    }
}
