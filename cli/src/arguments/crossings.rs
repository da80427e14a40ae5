//! `surefoot bench crossings`.

use ::bench::crossings::Handling;
use clap::{Args, ValueEnum};

use super::values;

/// Which crossings to drive.
#[derive(Args, Clone, Debug)]
#[command(after_long_help = AFTER_HELP)]
pub struct BenchCrossingsArguments {
    /// Runs of each row, at most 1000
    #[arg(long, value_name = "N", value_parser = run_count, default_value = "200", allow_hyphen_values = true)]
    pub runs: u64,

    /// Number of the first run, to look at one again: --first-run 29 --runs 1
    #[arg(long, value_name = "NUMBER", value_parser = values::seed, default_value = "0", allow_hyphen_values = true)]
    pub first_run: u64,

    /// Number that decides everything random: ground, people, the sensors' noise, the samples
    #[arg(long, value_name = "NUMBER", value_parser = values::seed, default_value = "1", allow_hyphen_values = true)]
    pub seed: u64,

    /// People in each run, 1 to 16
    #[arg(long, value_name = "N", value_parser = walker_count, default_value = "2", allow_hyphen_values = true)]
    pub walkers: usize,

    /// How people are dealt with, separated by commas; a row each
    #[arg(
        long,
        value_enum,
        value_name = "HANDLING,..",
        value_delimiter = ',',
        default_value = "tracked,mapped"
    )]
    pub handling: Vec<CrossingHandling>,

    /// Give up a run after this much simulated time [s]
    #[arg(long, value_name = "SECONDS", value_parser = values::duration_s, default_value = "90",
          allow_hyphen_values = true)]
    pub time_limit: f64,

    /// How maps and controller compute.
    #[command(flatten)]
    pub kernels: super::KernelArguments,

    /// Where crossings.json and crossings.png go.
    #[command(flatten)]
    pub results: super::ResultArguments,
}

/// How people are dealt with.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum CrossingHandling {
    /// They are tracked, and where they will be is kept away from
    Tracked,
    /// They are obstacles of the map, where they stand
    Mapped,
}

impl From<CrossingHandling> for Handling {
    fn from(asked: CrossingHandling) -> Self {
        match asked {
            CrossingHandling::Tracked => Self::Tracked,
            CrossingHandling::Mapped => Self::Mapped,
        }
    }
}

fn run_count(word: &str) -> Result<u64, String> {
    values::count(word, 1000, "runs").map(|n| n as u64)
}

fn walker_count(word: &str) -> Result<usize, String> {
    values::count(word, 16, "walkers")
}

pub(super) const LONG_ABOUT: &str = "\
Drives 18 m over open ground while people cross the way: straight, with a stop on the way, or turning, at 0.5 to 2 m/s, \
timed to meet the vehicle. Says how often somebody was struck, and whether the plant would have stood in time had it been \
told to stop when the conflict could first be foreseen: with what moves tracked there must be none of those. The exit code \
is 1 if there is one.";

const AFTER_HELP: &str = "\
Writes crossings.png, and crossings.json with
  rows  of each handling: n_runs, n_goal, n_struck, n_avoidable, n_walked_into, n_stopped_for, median_time_s, n_other
  runs  of each run: outcome, time_s, contact, n_walked_into, n_stops_for_moving, least_clearance_m, and a trail of
        where everybody was, twice a second

Example, an hour on two cores:
  surefoot bench crossings --runs 200 --seed 1
Example, a minute:
  surefoot bench crossings --runs 2 --handling tracked";
