//! `surefoot bench arena`.

use clap::Args;

use super::{Method, values};

/// Which drives to do.
#[derive(Args, Clone, Debug)]
#[command(after_long_help = AFTER_HELP)]
pub struct BenchArenaArguments {
    /// What the controller knows of the ground, separated by commas
    #[arg(
        long,
        value_enum,
        value_name = "METHOD,..",
        value_delimiter = ',',
        default_value = "pietra,evora,physics"
    )]
    pub methods: Vec<Method>,

    /// Drives of every method over short bushes and as many over tall ones, at most 1000
    #[arg(long, value_name = "N", value_parser = run_count, default_value = "30", allow_hyphen_values = true)]
    pub runs: u64,

    /// Risk tolerance in (0, 1]
    #[arg(long, value_name = "LEVEL", value_parser = values::cvar_level, default_value = "0.5",
          allow_hyphen_values = true)]
    pub alpha: f64,

    /// Number that decides everything random: bushes, starts, what is learned from, the sensors' noise, the samples
    #[arg(long, value_name = "NUMBER", value_parser = values::seed, default_value = "1", allow_hyphen_values = true)]
    pub seed: u64,

    /// Give up a drive after this much simulated time [s]
    #[arg(long, value_name = "SECONDS", value_parser = values::duration_s, default_value = "60",
          allow_hyphen_values = true)]
    pub time_limit: f64,

    /// How maps and controller compute.
    #[command(flatten)]
    pub kernels: super::KernelArguments,

    /// Where arena.json, arena.html and arena.png go.
    #[command(flatten)]
    pub results: super::ResultArguments,
}

fn run_count(word: &str) -> Result<u64, String> {
    values::count(word, 1000, "runs").map(|n| n as u64)
}

pub(super) const LONG_ABOUT: &str = "\
Drives a small car through PIETRA's hall (section VI, figures 9 and 10) to a goal behind a bed of bushes: straight through \
them, over a ramp beside them, or around both on the floor. What it learned from are ten minutes on level concrete and \
turf, so that bushes and ramp are new to it; they are driven and learned from anew. Every method drives the same missions, \
over short bushes and over tall ones. Says how often and how fast it arrived, which way it took, and whether the rules that \
were fixed beforehand hold.";

const AFTER_HELP: &str = "\
Writes arena.png, arena.html, and arena.json with
  training     what was learned from
  rows         of each mission and method: n, n_goal, goal (share, Wilson), time_s, ways, outcomes
  comparisons  pietra beside the others on the same runs
  verdicts     rules that were settled before the first drive
  runs         of each drive: bush_height_m, outcome, time_s, way, largest_roll_deg, largest_pitch_deg, path_m

Example, a few minutes:
  surefoot bench arena --runs 5
Example, who avoids what it does not know, and who knows the truth:
  surefoot bench arena --methods pietra,pietra-avoid,evora,physics,nominal,truth";
