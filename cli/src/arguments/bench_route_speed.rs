//! `surefoot bench route-speed`.

use clap::Args;

use super::values;

/// What to time.
#[derive(Args, Clone, Debug)]
#[command(after_long_help = AFTER_HELP)]
pub struct BenchRouteSpeedArguments {
    /// The machine, a shipped name or a path
    #[arg(long, value_name = "NAME|FILE", default_value = "pietra_full_size")]
    pub vehicle: String,

    /// Starts and goals on the island
    #[arg(long, value_name = "N", value_parser = values::seed_count, default_value = "50",
          allow_hyphen_values = true)]
    pub tasks: u64,

    /// Of the island and its tasks
    #[arg(long, value_name = "N", value_parser = values::seed, default_value = "1000",
          allow_hyphen_values = true)]
    pub seed: u64,

    /// Side of the map in tiles, in kilometres; 0 for none. At 5 km and 0.2 m it takes 11 GB of disk for a while
    #[arg(long, value_name = "KM", value_parser = clap::value_parser!(u32).range(0..=5), default_value = "1")]
    pub far_km: u32,

    /// Edge of its cells, in centimetres
    #[arg(long, value_name = "CM", value_parser = clap::value_parser!(u32).range(10..=500), default_value = "20")]
    pub far_cell_cm: u32,

    /// Where the results go.
    #[command(flatten)]
    pub results: super::ResultArguments,
}

pub(super) const ABOUT: &str = "\
Times what a route takes on this machine, on one thread where it says nothing else.

The search over 1,000 x 1,000 cells, eight headings and three motions, for the tasks of `surefoot bench route`; the fastest speeds at \
500 checkpoints; taking over a change of 50 x 50 m and searching on from half way; and a way across a map in tiles that does not fit \
into memory, with the most memory that the process has taken.";

const AFTER_HELP: &str = "\
Writes route_speed.json. The map in tiles is made in the folder of the results, and removed.

Examples:
  surefoot bench route-speed
  surefoot bench route-speed --far-km 5";
