//! `surefoot bench control`, `prior-map`, `navigation` and `learning`.

use std::path::PathBuf;

use clap::{Args, Subcommand, ValueEnum};

use super::{Method, values};

/// What can be measured.
#[derive(Clone, Debug, Subcommand)]
pub enum BenchCommand {
    /// One update of the shipped controller
    #[command(long_about = CONTROL_ABOUT)]
    Control(BenchControlArguments),
    /// The risk map of the physics prior, whole and after a part of the ground has changed
    #[command(long_about = PRIOR_MAP_ABOUT)]
    PriorMap(BenchPriorMapArguments),
    /// The risk map of what was learned, whole and after a part of the ground has changed
    #[command(long_about = super::learned_map::LONG_ABOUT)]
    LearnedMap(super::BenchLearnedMapArguments),
    /// Drives over the default rock field, with every method and risk tolerance
    #[command(long_about = NAVIGATION_ABOUT)]
    Navigation(BenchNavigationArguments),
    /// How well traction is foretold on ground that a network never saw
    #[command(long_about = LEARNING_ABOUT)]
    Learning(BenchLearningArguments),
}

/// How to measure the controller.
#[derive(Args, Clone, Debug)]
#[command(after_long_help = CONTROL_AFTER_HELP)]
pub struct BenchControlArguments {
    /// Threads of the controller, 1 to 256 [default: the machine's]
    #[arg(long, value_name = "N", value_parser = values::thread_count, allow_hyphen_values = true)]
    pub threads: Option<usize>,

    /// Updates to measure, after a warm-up
    #[arg(long, value_name = "N", value_parser = values::update_count, default_value = "2000",
          allow_hyphen_values = true)]
    pub updates: usize,

    /// How much the controller has to do
    #[arg(long = "config", value_enum, default_value_t = BenchWork::Bound)]
    pub work: BenchWork,

    /// Instruction set of the controller; auto takes the best the machine has
    #[arg(long, value_enum, default_value_t = super::InstructionSet::Auto)]
    pub isa: super::InstructionSet,

    /// Write the result to this file too
    #[arg(long, value_name = "FILE")]
    pub json: Option<PathBuf>,
}

impl BenchControlArguments {
    /// Threads of the controller: as asked, else as many as the machine runs at once.
    pub fn n_threads(&self) -> usize {
        self.threads.unwrap_or_else(values::machine_threads)
    }
}

/// How much the controller has to do.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum BenchWork {
    /// The work of the hand-written bound: time to goal with latch, attitude limits, white noise on the controls
    Bound,
    /// The bound's work with two effects in the model
    Effects,
    /// The default configuration of `surefoot drive`, everything on
    Drive,
}

/// How to measure the risk map.
#[derive(Args, Clone, Debug)]
pub struct BenchPriorMapArguments {
    /// Threads, 1 to 256 [default: the machine's]
    #[arg(long, value_name = "N", value_parser = values::thread_count, allow_hyphen_values = true)]
    pub threads: Option<usize>,

    /// Maps to build
    #[arg(long, value_name = "N", value_parser = values::update_count, default_value = "50",
          allow_hyphen_values = true)]
    pub updates: usize,

    /// Write the result to this file too
    #[arg(long, value_name = "FILE")]
    pub json: Option<PathBuf>,
}

impl BenchPriorMapArguments {
    /// Threads: as asked, else as many as the machine runs at once.
    pub fn n_threads(&self) -> usize {
        self.threads.unwrap_or_else(values::machine_threads)
    }
}

/// Which drives to do.
#[derive(Args, Clone, Debug)]
#[command(after_long_help = NAVIGATION_AFTER_HELP)]
pub struct BenchNavigationArguments {
    /// What the controller knows of the ground, separated by commas
    #[arg(
        long,
        value_enum,
        value_name = "METHOD,..",
        value_delimiter = ',',
        default_value = "truth,physics,nominal"
    )]
    pub methods: Vec<Method>,

    /// Risk tolerances of physics in (0, 1], separated by commas; truth and nominal know none and are driven once
    #[arg(long, value_name = "LEVEL,..", value_delimiter = ',', value_parser = values::cvar_level,
          default_value = "0.4,0.6,0.8", allow_hyphen_values = true)]
    pub alpha: Vec<f64>,

    /// Drive with the seeds 1 to N, at most 1000
    #[arg(long, value_name = "N", value_parser = values::seed_count, default_value = "20",
          allow_hyphen_values = true)]
    pub seeds: u64,

    /// Give up a drive after this much simulated time [s]
    #[arg(long, value_name = "SECONDS", value_parser = values::duration_s, default_value = "120",
          allow_hyphen_values = true)]
    pub time_limit: f64,

    /// Drives at a time, 1 to 256 [default: the machine's threads]; the result does not depend on it
    #[arg(long, value_name = "N", value_parser = values::thread_count, allow_hyphen_values = true)]
    pub threads: Option<usize>,

    /// Instruction set of the controller; auto takes the best the machine has
    #[arg(long, value_enum, default_value_t = super::InstructionSet::Auto)]
    pub isa: super::InstructionSet,

    /// Folder for navigation.json and navigation.png; made if missing, earlier files are replaced
    #[arg(long, value_name = "DIR", default_value = "surefoot-out")]
    pub out: PathBuf,

    /// Write the result to this file too
    #[arg(long, value_name = "FILE")]
    pub json: Option<PathBuf>,
}

impl BenchNavigationArguments {
    /// Drives at a time: as asked, else as many as the machine runs threads at once.
    pub fn n_threads(&self) -> usize {
        self.threads.unwrap_or_else(values::machine_threads)
    }
}

/// What to judge.
#[derive(Args, Clone, Debug)]
#[command(after_long_help = LEARNING_AFTER_HELP)]
pub struct BenchLearningArguments {
    /// Judge the posterior on measured traction: a map with measured and predicted distributions, density, heights and
    /// classes (.npz)
    #[arg(long, value_name = "FILE")]
    pub traction_map: PathBuf,

    /// Folder for traction_map.json and traction_map.png; made if missing, earlier files are replaced
    #[arg(long, value_name = "DIR", default_value = "surefoot-out")]
    pub out: PathBuf,

    /// Write the result to this file too
    #[arg(long, value_name = "FILE")]
    pub json: Option<PathBuf>,
}

const CONTROL_ABOUT: &str = "\
Measures one update of the controller that `surefoot drive` uses: 1024 rollouts of 50 steps over a risk map of \
81 x 96 cells and 13 yaws, with fresh noise every update.";

const PRIOR_MAP_ABOUT: &str = "\
Measures the risk map of the physics prior over 81 x 96 cells and 13 yaws: built whole, and brought up to date \
after one contiguous block of 2 % of the cells has changed.";

const NAVIGATION_ABOUT: &str = "\
Drives 40 m over the default rock field again and again: every method, every risk tolerance, the same seeds. Says how \
often the goal was reached, with the 95 % Wilson interval, how long that took, and how every other drive failed. \
The exit code is 0 once all drives are done, however they ended.";

const NAVIGATION_AFTER_HELP: &str = "\
Writes navigation.png, and navigation.json with
  rows    of each method and alpha: n, n_goal, success, wilson_low, wilson_high, median_time_to_goal_s, outcomes
  drives  of each seed too: outcome, time_s, path_length_m, distance_to_goal_m, largest_roll_deg,
          largest_pitch_deg, failed_at_m, stops

Example, minutes to half an hour:
  surefoot bench navigation
Example, a few seconds:
  surefoot bench navigation --methods physics --alpha 0.6 --seeds 2 --time-limit 5";

const LEARNING_ABOUT: &str = "\
Judges what a network predicts about ground it never saw against the traction that was measured there: its prediction \
as it is, fused by density with the uniform distribution (EVORA) and with a physics prior of a skid-steered machine \
(PIETRA), the prior alone, and a switch between the two. Nothing is fitted to the measured traction.";

const LEARNING_AFTER_HELP: &str = "\
Writes traction_map.png, and traction_map.json with
  n_cells, n_out_of_distribution, n_obstructed, n_blocks, prediction_weight
  linear, angular  of every source: emd2, less_prediction, over_uniform, each with value, low and high (95 %,
                   bootstrap over blocks of 5 m); density_auroc

Example:
  surefoot bench learning --traction-map forest.npz";

const CONTROL_AFTER_HELP: &str = "\
Prints JSON, and with --json writes it to a file too:
  threads, updates, config, isa
  ms        min, median, p99 of an update
  split_ms  medians of its parts: noise, rollout, update

Examples:
  surefoot bench control --threads 1
  surefoot bench control --threads 2 --updates 10000 --config drive --json control.json";
