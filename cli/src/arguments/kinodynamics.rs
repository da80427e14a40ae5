//! `surefoot train kinodynamics` and `surefoot bench kinodynamics`.

use std::path::PathBuf;

use clap::{Args, ValueEnum};
use kinodynamics::Teacher;

use super::values;

/// What to fit, to what, and how.
#[derive(Args, Clone, Debug)]
#[command(after_long_help = TRAIN_AFTER_HELP)]
pub struct TrainKinodynamicsArguments {
    /// Recording of `surefoot collect --teleop-random` to learn from
    #[arg(long, value_name = "FILE")]
    pub train: PathBuf,

    /// What the model knows of the ground
    #[arg(long, value_enum, default_value_t = KinodynamicsSensing::Imu)]
    pub sensing: KinodynamicsSensing,

    /// Numbers of the embedding
    #[arg(long, value_name = "N", value_parser = embedding, default_value = "2", allow_hyphen_values = true)]
    pub embedding: usize,

    /// What the model answers
    #[arg(long, value_enum, default_value_t = KinodynamicsAnswer::Curvature)]
    pub answer: KinodynamicsAnswer,

    /// How examples are made.
    #[command(flatten)]
    pub labels: KinodynamicsLabelArguments,

    /// Passes over the data
    #[arg(long, value_name = "N", value_parser = epochs, default_value = "50", allow_hyphen_values = true)]
    pub epochs: usize,

    /// Seed of the initial weights, of the split and of the order of examples
    #[arg(long, value_name = "N", value_parser = values::seed, default_value = "1", allow_hyphen_values = true)]
    pub seed: u64,

    /// Where the results go.
    #[command(flatten)]
    pub results: super::ResultArguments,
}

/// How examples are made, and who judges by them.
#[derive(Args, Clone, Debug)]
pub struct KinodynamicsLabelArguments {
    /// Which part of a command's effect the command is the answer to
    #[arg(long, value_enum, default_value_t = KinodynamicsEffect::Middle)]
    pub effect: KinodynamicsEffect,

    /// Which examples are kept
    #[arg(long, value_enum, default_value_t = KinodynamicsFilter::Paper)]
    pub filter: KinodynamicsFilter,

    /// Speed that the driven curvature is taken over
    #[arg(long, value_enum, default_value_t = KinodynamicsSpeed::Commanded)]
    pub speed: KinodynamicsSpeed,

    /// Who judges the answers of a model while it learns
    #[arg(long, value_enum, default_value_t = KinodynamicsTeacher::Examples)]
    pub teacher: KinodynamicsTeacher,
}

/// Who judges the answers of a model while it learns.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum KinodynamicsTeacher {
    /// The examples, as the paper: the command of an example is the answer to what was driven
    Examples,
    /// A forward model that learns from the examples beforehand: what it foretells of an answer should be the wish
    ForwardModel,
}

impl From<KinodynamicsTeacher> for Teacher {
    fn from(teacher: KinodynamicsTeacher) -> Self {
        match teacher {
            KinodynamicsTeacher::Examples => Self::Examples,
            KinodynamicsTeacher::ForwardModel => Self::ForwardModel,
        }
    }
}

/// Which part of a command's effect counts.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum KinodynamicsEffect {
    /// Its middle, where commands and yaw rates correlate most: the vehicle's lag stays as it is
    Middle,
    /// Its beginning, from the dead time on: a model that feels how the vehicle turns learns to lead its lag
    Beginning,
}

/// What the model knows of the ground.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum KinodynamicsSensing {
    /// Half a second of the inertial measurement unit
    Imu,
    /// Nothing: the ablation
    Blind,
}

/// What the model answers.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum KinodynamicsAnswer {
    /// The curvature to command, as the paper's code
    Curvature,
    /// Curvature and speed, as the paper's text
    SpeedAndCurvature,
}

/// Which examples are kept.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum KinodynamicsFilter {
    /// Understeer of at most 0.2 1/m, as the paper's code
    Paper,
    /// Understeer of any size
    Understeer,
    /// All
    None,
}

/// Speed that the driven curvature is taken over.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum KinodynamicsSpeed {
    /// The commanded one, as the paper's code
    Commanded,
    /// That of the wheels, as the paper's text
    Wheels,
}

/// What to drive and train.
#[derive(Args, Clone, Debug)]
#[command(after_long_help = BENCH_AFTER_HELP)]
pub struct BenchKinodynamicsArguments {
    /// Which models, or groups of them
    #[arg(long, value_enum, value_delimiter = ',', default_value = "all")]
    pub rows: Vec<KinodynamicsRows>,

    /// How examples are made.
    #[command(flatten)]
    pub labels: KinodynamicsLabelArguments,

    /// Minutes of random driving to learn from, 1 to 600
    #[arg(long, value_name = "N", value_parser = minutes, default_value = "30", allow_hyphen_values = true)]
    pub minutes: u32,

    /// Passes over the data
    #[arg(long, value_name = "N", value_parser = epochs, default_value = "50", allow_hyphen_values = true)]
    pub epochs: usize,

    /// Laps at every speed, 1 to 1000
    #[arg(long, value_name = "N", value_parser = values::trial_count, default_value = "10",
          allow_hyphen_values = true)]
    pub laps: u32,

    /// Decides ground, commands, noise and initial weights
    #[arg(long, value_name = "N", value_parser = values::seed, default_value = "1", allow_hyphen_values = true)]
    pub seed: u64,

    /// From the line that the planner would drive if its model were right to the walls [m] [default: 0.29, tuned once on the nominal model]
    #[arg(long, value_name = "METRES", value_parser = half_width_m, allow_hyphen_values = true)]
    pub half_width: Option<f64>,

    /// Drive the nominal model alone between walls of these half-widths [m], and tell how many turns succeed
    #[arg(long, value_name = "METRES,..", value_parser = half_width_m, value_delimiter = ',',
          allow_hyphen_values = true, conflicts_with_all = ["rows", "half_width"])]
    pub tune_walls: Vec<f64>,

    /// Train on the first so many minutes of one drive, and judge the models on another
    #[arg(long, value_name = "MINUTES,..", value_parser = minutes, value_delimiter = ',',
          allow_hyphen_values = true, conflicts_with_all = ["rows", "half_width", "tune_walls", "minutes", "laps"])]
    pub data_minutes: Vec<u32>,

    /// Judge models of a real car's recorded drives instead: CSV with run, t, wz, cmd_speed and cmd_steer
    #[arg(long, value_name = "FILE", conflicts_with_all = ["rows", "half_width", "tune_walls", "data_minutes", "minutes", "laps"])]
    pub log: Option<PathBuf>,

    /// How much is done at a time.
    #[command(flatten)]
    pub threads: super::ThreadArguments,

    /// Where the results go.
    #[command(flatten)]
    pub results: super::ResultArguments,
}

/// Which models.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum KinodynamicsRows {
    /// Baseline, ablation and learned model
    Paper,
    /// These, the oracle, control experiments, and an embedding of 16
    Controls,
    /// These, and what else departs from the paper
    All,
    /// The nominal model, without training
    Baseline,
    /// Learned without the inertial measurement unit
    Ablation,
    /// Learned with it
    Learned,
    /// Learned and driven with the true coefficients of the ground under the wheels, instead of the unit
    Oracle,
    /// Learned and driven with the histories of other moments
    Shuffled,
    /// Learned and driven with one history for all moments
    Constant,
    /// Learned with an embedding of 16
    Wide,
}

fn embedding(word: &str) -> Result<usize, String> {
    values::count(word, 64, "numbers")
}

pub(super) fn epochs(word: &str) -> Result<usize, String> {
    values::count(word, 65_536, "passes")
}

fn minutes(word: &str) -> Result<u32, String> {
    Ok(values::count(word, 600, "minutes")? as u32)
}

pub(super) fn minutes_of_driving(word: &str) -> Result<u32, String> {
    minutes(word)
}

fn half_width_m(word: &str) -> Result<f64, String> {
    values::number_where(word, "a number of metres from 0.05 to 2", |value| (0.05..=2.0).contains(&value))
}

pub(super) const TRAIN_LONG_ABOUT: &str = "\
Fits a model that says which curvature to command so that the vehicle drives the desired one, on the ground that its \
inertial measurement unit has felt for half a second (inverse kinodynamics: Xiao, Biswas and Stone 2021, as their \
published code does it). The latency from command to motion is estimated from the recording; examples are split into \
blocks of ten seconds, of which every tenth is kept to choose the best pass by; filters are counted.

Ctrl-C ends the training and keeps the best weights so far.";

const TRAIN_AFTER_HELP: &str = "\
Refuses a unit whose axes, signs, units or rate are not what they should be, told by gravity and by the localisation's
yaw rate, and a recording on one ground alone for a model that senses grounds.

Writes kinodynamics.safetensors and kinodynamics.json, which belong together, and kinodynamics_training.json:
  revision, settings, latency, n_examples, counts (what the filters took), identity_rmse_per_m, curves

Example:
  surefoot collect --teleop-random --minutes 30 --out drive.safetensors
  surefoot train kinodynamics --train drive.safetensors --out weights
  surefoot train kinodynamics --train drive.safetensors --effect beginning --filter none --teacher forward-model --out leading";

pub(super) const BENCH_LONG_ABOUT: &str = "\
Repeats the experiments of inverse kinodynamics in simulation: thirty minutes of random driving on four surfaces, then \
laps of the paper's two tracks at ten and five speeds, with the nominal model, with one that learned without the inertial \
measurement unit and with one that learned with it; table I and figures 4 to 9, beside the paper's numbers. Controls: \
models that learned and drive with shuffled and with constant histories, and an oracle that is told the ground's true \
friction, looseness and roughness instead: the most that knowledge of the ground can bring. For every rule that was fixed beforehand it says \
whether it holds; the exit code is 0 whether the rules hold or not.

With --log it judges on recorded drives of a real car how well a yaw rate is foretold from speed and curvature commands, and \
which curvature was commanded from the one that was driven: by the nominal model, by a fitted bicycle with understeer and \
slip, and by the network without the unit, on runs that none was fitted to.";

const BENCH_AFTER_HELP: &str = "\
Writes kinodynamics_outdoor.png, kinodynamics_indoor.png, kinodynamics.html and kinodynamics.json with
  latency, probe      what the drives show, and what can be told of the ground
  trainings           errors, filters and curves of every model
  outdoor, indoor     of every model: n, failures, success, its interval, shares per speed and turn, distances
  oracle_over_ablation  failures of who is told the ground over those of who knows nothing of it
  verdicts            rule, what was found, whether it holds
Intervals are 95 %: Wilson's of shares, of ratios a bootstrap over laps. With --log writes kinodynamics_log.json.

Examples:
  surefoot bench kinodynamics                          all models, about a quarter of an hour
  surefoot bench kinodynamics --rows baseline,ablation,oracle
  surefoot bench kinodynamics --rows paper --effect beginning --filter none --teacher forward-model
  surefoot bench kinodynamics --rows paper --minutes 5 --epochs 10 --laps 2
  surefoot bench kinodynamics --data-minutes 1,5,20,60
  surefoot bench kinodynamics --tune-walls 0.3,0.35,0.4
  surefoot bench kinodynamics --log drives.csv";
