//! `surefoot bench slippery`.

use clap::Args;

use super::values;

/// Which courses to drive.
#[derive(Args, Clone, Debug)]
#[command(after_long_help = AFTER_HELP)]
pub struct BenchSlipperyArguments {
    /// Courses, at most 1000; each is driven three times
    #[arg(long, value_name = "N", value_parser = course_count, default_value = "50", allow_hyphen_values = true)]
    pub courses: u64,

    /// Number that decides everything random: courses, ground, the sensors' noise, the samples
    #[arg(long, value_name = "NUMBER", value_parser = values::seed, default_value = "1", allow_hyphen_values = true)]
    pub seed: u64,

    /// Fastest speed that is commanded [m/s]
    #[arg(long, value_name = "M/S", value_parser = fastest_mps, default_value = "8", allow_hyphen_values = true)]
    pub speed: f64,

    /// Give up a drive after this much simulated time [s]
    #[arg(long, value_name = "SECONDS", value_parser = values::duration_s, default_value = "90",
          allow_hyphen_values = true)]
    pub time_limit: f64,

    /// How maps and controller compute.
    #[command(flatten)]
    pub kernels: super::KernelArguments,

    /// Where slippery.json and slippery.png go.
    #[command(flatten)]
    pub results: super::ResultArguments,
}

fn course_count(word: &str) -> Result<u64, String> {
    values::count(word, 1000, "courses").map(|n| n as u64)
}

fn fastest_mps(word: &str) -> Result<f64, String> {
    let expected = || format!("expected a speed from 0.5 to 15 m/s, found {word}");
    let speed_mps: f64 = word.trim().parse().map_err(|_| expected())?;
    if (0.5..=15.0).contains(&speed_mps) { Ok(speed_mps) } else { Err(expected()) }
}

pub(super) const LONG_ABOUT: &str = "\
Drives a sedan through five goals with turns between them, most of them on ice, mud or wet grass, with posts behind them. \
The same courses are driven three times: the controller is told nothing of the ground's friction, that all ground holds as \
little as ice does, or the friction of every cell. Says how often it slid, left its limits or ran into something, and how \
long it took.";

const AFTER_HELP: &str = "\
Writes slippery.png, and slippery.json with
  rows         of each: n, n_goal, n_slid, n_attitude, n_collision with shares, intervals and mean times
  comparisons  cells beside the others on the same courses
  verdicts     rules that were settled before the first drive
  courses      start, goals, slippery places and posts
  runs         of each drive: outcome, time_s, slid_s, largest_slip_rad, fastest_mps, and a trail

Example, a few courses:
  surefoot bench slippery --courses 4 --seed 7";
