//! `surefoot bench risk`.

use clap::Args;

use super::values;

/// Which runs to do.
#[derive(Args, Clone, Debug)]
#[command(after_long_help = AFTER_HELP)]
pub struct BenchRiskArguments {
    /// Probabilities that an inner cell is a bush, in [0, 1], separated by commas
    #[arg(long, value_name = "SHARE,..", value_delimiter = ',', value_parser = density,
          default_value = "0.1,0.4,0.7,1", allow_hyphen_values = true)]
    pub densities: Vec<f64>,

    /// Risk tolerances in (0, 1], separated by commas: 1 plans with the mean
    #[arg(long, value_name = "LEVEL,..", value_delimiter = ',', value_parser = values::cvar_level,
          default_value = "0.2,0.4,0.6,0.8,1", allow_hyphen_values = true)]
    pub alpha: Vec<f64>,

    /// Runs of each density, risk tolerance and method, at most 1000
    #[arg(long, value_name = "N", value_parser = run_count, default_value = "200", allow_hyphen_values = true)]
    pub runs: u64,

    /// Seed of the first run, the others follow; it decides ground and samples, for both methods the same
    #[arg(long, value_name = "NUMBER", value_parser = values::seed, default_value = "1", allow_hyphen_values = true)]
    pub seed: u64,

    /// How the controller computes.
    #[command(flatten)]
    pub kernels: super::KernelArguments,

    /// Where risk.json and risk.png go.
    #[command(flatten)]
    pub results: super::ResultArguments,
}

fn density(word: &str) -> Result<f64, String> {
    values::number_where(word, "a number from 0 to 1", |value| (0.0..=1.0).contains(&value))
}

fn run_count(word: &str) -> Result<u64, String> {
    values::count(word, 1000, "runs").map(|n| n as u64)
}

pub(super) const LONG_ABOUT: &str = "\
Repeats EVORA's semantic-grid benchmark: a unicycle crosses nine by nine metres of dirt and bushes from corner to corner \
within 15 s. A bush lets nearly everything through or nearly nothing, and the planner knows only how likely either is: it \
plans with the mean traction of the worst share alpha. Every ground is driven twice with the same samples: with that mean \
taken in whole bins, as the published planner does, and taken exactly.

Says how often the goal was reached, whole bins against the published table and the exact mean against whole bins. The \
exit code is 0 once all runs are done, however they ended.";

const AFTER_HELP: &str = "\
Writes risk.png, and risk.json with of each density and alpha
  published         n_hit, n, success, time_to_goal_s; null where nothing is published
  whole_bin, exact  n_hit, n, success, wilson_low, wilson_high, mean_time_to_goal_s, times_to_goal_s of each run,
                    less_published: value, low, high (Newcombe, 95 %), p (Fisher, exact), p_holm (of all cells)
  exact_less_whole_bin
                    value, n_exact_only, n_whole_bin_only, p (McNemar, exact), p_holm

Example, the published table:
  surefoot bench risk
Example, a few seconds:
  surefoot bench risk --densities 1 --alpha 0.4,0.6 --runs 10 --seed 1001";
