//! `surefoot bench correction`.

use ::bench::kinodynamics::Method;
use clap::{Args, ValueEnum};

use super::values;

/// Which runs to do.
#[derive(Args, Clone, Debug)]
#[command(after_long_help = AFTER_HELP)]
pub struct BenchCorrectionArguments {
    /// Where knowledge of the ground comes in, separated by commas; a row each
    #[arg(
        long,
        value_enum,
        value_name = "METHOD,..",
        value_delimiter = ',',
        default_value = "plain,corrected-blind,corrected,adapted"
    )]
    pub methods: Vec<CorrectionMethod>,

    /// Runs of each method at each of three speeds, 1 to 1000
    #[arg(long, value_name = "N", value_parser = values::trial_count, default_value = "50",
          allow_hyphen_values = true)]
    pub runs: u32,

    /// How the examples of the corrections are made.
    #[command(flatten)]
    pub labels: super::KinodynamicsLabelArguments,

    /// Minutes of random driving that the corrections learn from, 1 to 600
    #[arg(long, value_name = "N", value_parser = super::kinodynamics::minutes_of_driving, default_value = "30",
          allow_hyphen_values = true)]
    pub minutes: u32,

    /// Passes over that data
    #[arg(long, value_name = "N", value_parser = super::kinodynamics::epochs, default_value = "50",
          allow_hyphen_values = true)]
    pub epochs: usize,

    /// Decides ground, random driving, noise, samples and initial weights
    #[arg(long, value_name = "N", value_parser = values::seed, default_value = "1", allow_hyphen_values = true)]
    pub seed: u64,

    /// How much is done at a time.
    #[command(flatten)]
    pub threads: super::ThreadArguments,

    /// Where correction.json and correction.png go.
    #[command(flatten)]
    pub results: super::ResultArguments,
}

/// Where knowledge of the ground comes in.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum CorrectionMethod {
    /// Nowhere: the bicycle model with the lags of servo and motor; the others are compared with it
    Plain,
    /// Behind the controller: a model that learned without the inertial measurement unit corrects curvatures
    CorrectedBlind,
    /// The same, learned and driven with the unit
    Corrected,
    /// Inside the controller's model: understeer, rear slip and drag from the odometry of the drive itself
    Adapted,
}

impl From<CorrectionMethod> for Method {
    fn from(method: CorrectionMethod) -> Self {
        match method {
            CorrectionMethod::Plain => Self::Plain,
            CorrectionMethod::CorrectedBlind => Self::CorrectedBlind,
            CorrectionMethod::Corrected => Self::Corrected,
            CorrectionMethod::Adapted => Self::Adapted,
        }
    }
}

pub(super) const LONG_ABOUT: &str = "\
What knowledge of the ground brings the controller, behind it or inside it: a small car laps a line on patches of four \
surfaces at three speeds, steered by the controller of `surefoot drive` over a risk map that is the same everywhere. Its \
commands go to the car as they are, or corrected by inverse kinodynamics (as `surefoot drive --correct kinodynamics`), or \
its model learns understeer, rear slip and drag from the odometry while it drives. Ground, noise and samples of a run are \
the same for every method.

Says how far from the line each drove, how often it stayed between the walls, and what it is worth against none, in all \
and on every surface. The exit code is 0 once all runs are done, however they ended.";

const AFTER_HELP: &str = "\
Writes correction.png, and correction.json with of each speed and method
  n, n_finished, n_within_walls, within_walls (share and its 95 % Wilson interval)
  distance_m, time_s   root mean square distance to the line and time once around: value, low, high (bootstrap, 95 %)
  less_plain           the same less that without correction, over pairs; n_only_method, n_only_plain, p_value (McNemar)
  runs                 each run

Example, about half an hour of two cores:
  surefoot bench correction
Example, without training:
  surefoot bench correction --methods plain,adapted --runs 5 --seed 1001";
