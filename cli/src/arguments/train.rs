//! `surefoot train`; this file holds `traversability`.

use std::path::PathBuf;

use clap::{Args, Subcommand};
use evidential::{Method, Selections, Settings};

use super::values;

/// What can be fitted.
#[derive(Clone, Debug, Subcommand)]
pub enum TrainCommand {
    /// Networks that predict traction, roll and pitch from the ground under the vehicle, and know where they cannot
    #[command(long_about = LONG_ABOUT)]
    Traversability(Box<TrainArguments>),
    /// A model that says which command does what is wanted on the ground that the IMU feels
    #[command(long_about = super::kinodynamics::TRAIN_LONG_ABOUT)]
    Kinodynamics(Box<super::TrainKinodynamicsArguments>),
    /// How much each ground holds, from drives over it, for `surefoot route --friction`
    #[command(long_about = super::friction::TRAIN_ABOUT)]
    Friction(super::TrainFrictionArguments),
}

/// What to fit, to what, and how.
#[derive(Args, Clone, Debug)]
#[command(after_long_help = AFTER_HELP)]
pub struct TrainArguments {
    /// Method: pietra, evora-physics-prior, evora-physics-loss, evora, physics-informed or vanilla; with --sweep
    /// several, separated by commas [default: pietra, with --sweep all]
    #[arg(long = "method", value_name = "METHOD,..", value_delimiter = ',', value_parser = method)]
    pub methods: Vec<Method>,

    /// Dataset of `surefoot collect` to learn from
    #[arg(long, value_name = "FILE")]
    pub train: PathBuf,

    /// Dataset to choose by: of other worlds or drives, same vehicle
    #[arg(long, value_name = "FILE")]
    pub validation: PathBuf,

    /// Seed of the initial weights and of the order of examples
    #[arg(long, value_name = "N", value_parser = values::seed, default_value = "1", allow_hyphen_values = true)]
    pub seed: u64,

    /// Where the results go.
    #[command(flatten)]
    pub results: super::ResultArguments,

    /// Keep the examples up to this percentile of the training data's unevenness, of both datasets; 100 keeps all
    #[arg(long, value_name = "PERCENT", value_parser = percentile, default_value = "50",
          allow_hyphen_values = true, help_heading = "Data")]
    pub unevenness_percentile: f64,

    /// Keep the examples up to this unevenness instead [m]
    #[arg(long, value_name = "METRES", value_parser = unevenness_m, allow_hyphen_values = true,
          conflicts_with = "unevenness_percentile", help_heading = "Data")]
    pub unevenness_max: Option<f32>,

    /// Learning rate of Adam [default: what the shipped sweep chose]
    #[arg(long, value_name = "RATE", value_parser = learning_rate, allow_hyphen_values = true,
          help_heading = "Parameters")]
    pub learning_rate: Option<f64>,

    /// Weight of the physics loss [default: what the shipped sweep chose]
    #[arg(long, value_name = "WEIGHT", value_parser = weight, allow_hyphen_values = true,
          help_heading = "Parameters")]
    pub kappa: Option<f64>,

    /// Weight of the entropy bonus [default: what the shipped sweep chose]
    #[arg(long, value_name = "WEIGHT", value_parser = weight, allow_hyphen_values = true,
          help_heading = "Parameters")]
    pub entropy: Option<f64>,

    /// Passes over the data at most
    #[arg(long, value_name = "N", value_parser = epochs, allow_hyphen_values = true, help_heading = "Parameters")]
    pub epochs: Option<usize>,

    /// Passes without a better validation error after which training ends
    #[arg(long, value_name = "N", value_parser = epochs, allow_hyphen_values = true, help_heading = "Parameters")]
    pub patience: Option<usize>,

    /// Examples per step
    #[arg(long, value_name = "N", value_parser = batch, allow_hyphen_values = true, help_heading = "Parameters")]
    pub batch: Option<usize>,

    /// Widths of the encoder's hidden layers, separated by commas [default: what the shipped sweep was run with]
    #[arg(long, value_name = "W,..", value_parser = width, value_delimiter = ',', allow_hyphen_values = true,
          help_heading = "Parameters")]
    pub hidden: Vec<usize>,

    /// Width of the latent
    #[arg(long, value_name = "N", value_parser = width, allow_hyphen_values = true, help_heading = "Parameters")]
    pub latent: Option<usize>,

    /// Search learning rate, unless one is given, kappa and entropy weight on the validation data, and write
    /// selections.json
    #[arg(long, conflicts_with_all = ["seed", "kappa", "entropy", "json"], help_heading = "Search")]
    pub sweep: bool,

    /// Train every candidate with the seeds 1 to N
    #[arg(long, value_name = "N", value_parser = values::seed_count, default_value = "5", requires = "sweep",
          allow_hyphen_values = true, help_heading = "Search")]
    pub seeds: u64,

    /// Trainings at a time, 1 to 256 [default: the machine's threads]; the result does not depend on it
    #[arg(long, value_name = "N", value_parser = values::thread_count, allow_hyphen_values = true,
          requires = "sweep", help_heading = "Search")]
    pub threads: Option<usize>,
}

impl TrainArguments {
    /// Trainings at a time: as asked, else as many as the machine runs threads at once.
    pub fn n_threads(&self) -> usize {
        self.threads.unwrap_or_else(values::machine_threads)
    }

    /// Methods as asked, else the usual ones.
    pub fn methods(&self) -> Vec<Method> {
        match (self.methods.is_empty(), self.sweep) {
            (false, _) => self.methods.clone(),
            (true, true) => Method::ALL.to_vec(),
            (true, false) => vec![Method::Pietra],
        }
    }

    /// The settings of a method: what was asked, else what was selected, else the defaults.
    pub fn settings(&self, method: Method, selected: &Selections) -> Settings {
        let usual = selected.settings(method, self.seed).unwrap_or_else(|| Settings::new(method, self.seed));
        Settings {
            learning_rate: self.learning_rate.unwrap_or(usual.learning_rate),
            physics_weight: self.kappa.unwrap_or(usual.physics_weight),
            entropy_weight: self.entropy.unwrap_or(usual.entropy_weight),
            epochs_max: self.epochs.unwrap_or(usual.epochs_max),
            patience: self.patience.unwrap_or(usual.patience),
            batch: self.batch.unwrap_or(usual.batch),
            encoder_hidden: if self.hidden.is_empty() { usual.encoder_hidden } else { self.hidden.clone() },
            n_latent: self.latent.unwrap_or(usual.n_latent),
            ..usual
        }
    }
}

fn method(word: &str) -> Result<Method, String> {
    Method::ALL.into_iter().find(|method| method.name() == word).ok_or_else(|| {
        let names = Method::ALL.map(Method::name).join(", ");
        format!("expected one of {names}, found {word:?}")
    })
}

fn percentile(word: &str) -> Result<f64, String> {
    values::number_where(word, "a percentile above 0, at most 100", |value| value > 0.0 && value <= 100.0)
}

fn unevenness_m(word: &str) -> Result<f32, String> {
    let metres = values::number_where(word, "a finite number of metres above 0", |value| {
        value > 0.0 && value.is_finite()
    })?;
    Ok(metres as f32)
}

fn learning_rate(word: &str) -> Result<f64, String> {
    values::number_where(word, "a number above 0, at most 1", |value| value > 0.0 && value <= 1.0)
}

fn weight(word: &str) -> Result<f64, String> {
    values::number_where(word, "a finite number >= 0", |value| value >= 0.0 && value.is_finite())
}

fn epochs(word: &str) -> Result<usize, String> {
    values::count(word, 65_536, "passes")
}

fn batch(word: &str) -> Result<usize, String> {
    values::count(word, 65_536, "examples")
}

fn width(word: &str) -> Result<usize, String> {
    values::count(word, 1024, "numbers")
}

const LONG_ABOUT: &str = "\
Fits the networks of a method to a dataset of `surefoot collect`: an encoder of the ground under the vehicle, a \
distribution each of linear and angular traction, |roll| and |pitch|, and for methods with evidence a density that \
tells how familiar the ground is. Predictor and density are trained together until the validation error no longer \
falls, then the density alone. One thread does it in seconds; the same seed gives the same weights, bit for bit.

Ctrl-C ends the training and keeps the best weights so far.";

const AFTER_HELP: &str = "\
Writes weights.safetensors and weights.json, which belong together, training.png with the curves and training.json:
  settings, unevenness_max_m, n_training, n_validation
  validation_emd2   mean EMD2 of the expected distribution to what was measured, per parameter
  learned_weight    percentiles of n / (n + n_prior) over the validation data
  end, took_s, curves

With --sweep every combination of learning rate (1e-3, 1e-4, 1e-5), kappa (0.1, 0.5, 1) and entropy weight (1e-3,
1e-4, 1e-5) is trained with every seed, as far as the method looks at them. Finished trainings are kept in
trials.jsonl, and the same command goes on where it was broken off. selections.json holds the parameters of each
method: within one standard error of the least mean validation EMD2 the largest kappa, and of that the least mean.

Examples:
  surefoot train traversability --train train.safetensors --validation validation.safetensors --out weights
  surefoot train traversability --method evora,vanilla --sweep --seeds 5 --train train.safetensors \\
      --validation validation.safetensors --out sweep";

#[cfg(test)]
mod tests {
    use super::*;
    use crate::arguments::{Arguments, Command};
    use clap::Parser;

    fn parse(words: &[&str]) -> Result<TrainArguments, String> {
        let fixed = ["surefoot", "train", "traversability", "--train", "t", "--validation", "v"];
        let parsed =
            Arguments::try_parse_from(fixed.iter().chain(words)).map_err(|error| error.to_string())?;
        match parsed.command {
            Command::Train { command: TrainCommand::Traversability(arguments) } => Ok(*arguments),
            _ => unreachable!("the words say train"),
        }
    }

    #[test]
    fn what_is_asked_goes_before_what_was_selected() {
        let selected = |learning_rate: f64| {
            let settings = Settings { learning_rate, epochs_max: 7, ..Settings::new(Method::Evora, 1) };
            let selection = evidential::Selection {
                settings,
                validation_emd2: [0.0; 4],
                validation_total: 0.0,
                validation_deviation: 0.0,
                validation_standard_error: 0.0,
                n_seeds: 1,
            };
            Selections { selections: vec![selection], ..Selections::default() }
        };
        let arguments = parse(&["--method", "evora", "--kappa", "0.5", "--seed", "4"]).unwrap();
        let settings = arguments.settings(Method::Evora, &selected(2e-4));
        let found = (settings.learning_rate, settings.physics_weight, settings.epochs_max, settings.seed);
        assert_eq!(found, (2e-4, 0.5, 7, 4));
        let settings = arguments.settings(Method::Vanilla, &selected(2e-4));
        assert_eq!(settings.learning_rate, Settings::new(Method::Vanilla, 4).learning_rate);
    }

    #[test]
    fn methods_have_defaults_and_names() {
        assert_eq!(parse(&[]).unwrap().methods(), [Method::Pietra]);
        assert_eq!(parse(&["--sweep"]).unwrap().methods(), Method::ALL);
        assert_eq!(
            parse(&["--method", "vanilla,evora"]).unwrap().methods(),
            [Method::Vanilla, Method::Evora]
        );
        assert!(parse(&["--method", "petra"]).unwrap_err().contains("found \"petra\""));
    }

    #[test]
    fn options_of_the_search_and_of_one_training_exclude_each_other() {
        for words in [["--sweep", "--kappa", "1"], ["--sweep", "--seed", "2"]] {
            assert!(parse(&words).is_err());
        }
        assert!(parse(&["--seeds", "3"]).is_err());
        assert!(parse(&["--unevenness-max", "0.1", "--unevenness-percentile", "60"]).is_err());
        for (option, value) in [
            ("--learning-rate", "0"),
            ("--kappa", "-1"),
            ("--entropy", "nan"),
            ("--epochs", "0"),
            ("--unevenness-percentile", "0"),
            ("--unevenness-max", "-0.1"),
            ("--latent", "5000"),
            ("--hidden", "32,0"),
        ] {
            assert!(parse(&[option, value]).unwrap_err().contains("expected"), "{option}");
        }
    }
}
