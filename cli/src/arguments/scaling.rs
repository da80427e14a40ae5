//! `surefoot bench scaling`.

use bench::scaling::Over;
use clap::{Args, ValueEnum};

use super::values;

/// What to vary.
#[derive(Args, Clone, Debug)]
#[command(after_long_help = AFTER_HELP)]
pub struct BenchScalingArguments {
    /// How maps and controller compute.
    #[command(flatten)]
    pub kernels: super::KernelArguments,

    /// What to vary, separated by commas
    #[arg(
        long,
        value_enum,
        value_name = "WHAT,..",
        value_delimiter = ',',
        default_value = "rollouts,steps,threads,cells,yaws,changed"
    )]
    pub over: Vec<Varied>,

    /// Controller updates to measure at every place, after a warm-up
    #[arg(long, value_name = "N", value_parser = values::update_count, default_value = "500",
          allow_hyphen_values = true)]
    pub updates: usize,

    /// Maps to make at every place
    #[arg(long, value_name = "N", value_parser = values::update_count, default_value = "20",
          allow_hyphen_values = true)]
    pub maps: usize,

    /// Where the results go.
    #[command(flatten)]
    pub results: super::ResultArguments,
}

/// What is varied.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Varied {
    /// Sampled futures of a controller update, 128 to 4096
    Rollouts,
    /// Steps of the horizon of a controller update, 10 to 150
    Steps,
    /// Threads that share a controller update, and those that share a whole map, 1 to --threads
    Threads,
    /// Cells of a whole map, 32 x 32 to 192 x 192
    Cells,
    /// Yaw bins of a whole map, 4 to 36
    Yaws,
    /// Share of the cells that changed since the last map: in one square block, and here and there
    Changed,
}

impl Varied {
    /// The curves that it stands for.
    pub fn curves(self) -> &'static [Over] {
        match self {
            Self::Rollouts => &[Over::Rollouts],
            Self::Steps => &[Over::Steps],
            Self::Threads => &[Over::ControllerThreads, Over::MapThreads],
            Self::Cells => &[Over::Cells],
            Self::Yaws => &[Over::Yaws],
            Self::Changed => &[Over::ChangedBlock, Over::ChangedScattered],
        }
    }
}

pub(super) const LONG_ABOUT: &str = "\
Measures how the cost of one controller update and of one learned risk map grows with each of the things that it \
depends on. One thing is varied at a time; all others are those of `surefoot bench control --config drive` and of \
`surefoot bench learned-map --networks 32-32:16`. A map judges anew only the poses that read a cell which changed: the \
same share of the cells costs little in one block and much here and there, since every footprint holds many cells.";

const AFTER_HELP: &str = "\
Writes scaling.png, and scaling.json with
  isa, threads, updates, maps
  curves  of each: over (rollouts, steps, controller_threads, cells, yaws,
          changed_block, changed_scattered, map_threads), and points with
    value         what was varied: a number, or a share from 0 to 1
    judged_share  of a map: share of its poses that were judged anew
    ms            min, median, p99 of an update

Example, a minute or two:
  surefoot bench scaling --threads 2
Example, some seconds:
  surefoot bench scaling --over steps,changed --updates 50 --maps 3";
