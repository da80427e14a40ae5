//! `surefoot gap seal` and `score`.

use std::path::PathBuf;

use clap::Args;

use super::values;

/// Which cases to make, and where they go.
#[derive(Args, Clone, Debug)]
#[command(after_long_help = SEAL_AFTER_HELP)]
pub struct GapSealArguments {
    /// Cases to make, 1 to 10000
    #[arg(long, value_name = "N", value_parser = case_count, allow_hyphen_values = true)]
    pub cases: usize,

    /// Seed of machines, hills, drivers, noise and of what is wrong
    #[arg(long, value_name = "N", value_parser = values::seed, allow_hyphen_values = true)]
    pub seed: u64,

    /// Folder of the case set; must not exist yet, or be empty
    #[arg(long, value_name = "DIR")]
    pub out: PathBuf,

    /// File for the labels, outside of the case set; must not exist yet
    #[arg(long, value_name = "FILE")]
    pub labels: PathBuf,

    /// How much is done at a time.
    #[command(flatten)]
    pub threads: super::ThreadArguments,
}

/// Which cases to diagnose, and what to hold the answers against.
#[derive(Args, Clone, Debug)]
#[command(after_long_help = SCORE_AFTER_HELP)]
pub struct GapScoreArguments {
    /// Folder of a case set: its cases lie in DIR/cases
    #[arg(value_name = "DIR")]
    pub set: PathBuf,

    /// The set's labels
    #[arg(long, value_name = "FILE")]
    pub labels: PathBuf,

    /// Diagnose the first N cases only, by name
    #[arg(long, value_name = "N", value_parser = case_count, allow_hyphen_values = true)]
    pub first: Option<usize>,

    /// Take answers from this folder (NAME.json) instead of diagnosing
    #[arg(long, value_name = "DIR")]
    pub answers: Option<PathBuf>,

    /// Cases at a time, 1 to 256; the answers do not depend on it
    #[arg(long, value_name = "N", value_parser = values::thread_count, default_value = "2",
          allow_hyphen_values = true)]
    pub threads: usize,

    /// Where the results go.
    #[command(flatten)]
    pub results: super::ResultArguments,
}

fn case_count(word: &str) -> Result<usize, String> {
    values::count(word, 10_000, "cases")
}

pub(super) const SEAL_ABOUT: &str = "\
Makes cases whose cause is known to nobody but the labels' file.

Machines are drawn at random around the shipped ones and drive on hills of their own. The simulator is the plant as \
described; the robot is the same plant with a part that departs from it: servo, linkage, tyre, motor, load, sensor or \
queue, never a formula of the catalogue. Nothing wrong, one effect, two, or something without a name, small to large, \
all drawn at random. The set holds the SHA-256 of its labels.";

const SEAL_AFTER_HELP: &str = "\
Examples:
  surefoot gap seal --cases 60 --seed 7 --out cases --labels labels.json
  surefoot gap score cases --labels labels.json

Files in --out:
  vehicles/NAME/   vehicle.toml, sim_1..4.csv (4 is another driver), heightmap.csv,
                   terrain_class.csv
  cases/NAME/      case.toml, real_train_1.csv, real_train_2.csv, real_heldout.csv
  sealed.json      number of cases, SHA-256 of the labels

--labels holds per case: vehicle, plant, kind (none, single, pair, unknown), effects,
magnitude (s, m, l), style (rich, poor, track), injection (numbers by key).

The set appears when it is whole; an interrupted run leaves a folder .NAME.partial beside
it, which the next run replaces.

Exit codes:
  0  the set stands
  1  a drive or a file failed; one line on standard error says why
  2  bad usage or input, or a place that is taken";

pub(super) const SCORE_ABOUT: &str = "\
Diagnoses every case of a set and holds the answers against the labels, which no diagnosis sees.";

const SCORE_AFTER_HELP: &str = "\
Examples:
  surefoot gap score cases --labels labels.json --out score
  surefoot gap score cases --labels labels.json --answers score/answers
      The same answers against the labels once more, without diagnosing.

What is counted, with 95 % Wilson intervals:
  first name, first two      of single effects, by the ranking
  credible set               of single effects: holds the truth; its mean size
  exactly announced          of singles and pairs: those names, no other, nothing unknown
  false alarms               something announced where nothing was added
  unknown, flagged           where no effect can stand for it; where one can, naming that
                             one counts too: trailer (mass, rolling_drag, speed_lag,
                             slope_gravity, accel_limit), flat tyre (steer_bias,
                             rolling_drag, speed_scale), yaw moment (steer_bias)
  first place                of singles and pairs: a condition under which the effect shows
  closed, predicted          on the held-out drives; median, p10; distance
  parameter error            over the distance of the true value from doing nothing
  calibration                scores against shares, Brier score; unknowns left out

Files in --out:
  score.json       every number, and every case
  score.html       tables and pictures on one page, without network
  confusion.png, reliability.png, closure.png
  answers/         NAME.json of every case; an interrupted run goes on with those that are there

Exit codes:
  0  every case was scored, however well
  1  a diagnosis failed; one line on standard error says why
  2  bad usage or input, or labels that are not the set's";
