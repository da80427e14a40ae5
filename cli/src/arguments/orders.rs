//! `surefoot goal`, `path`, `pause` and the other words to a run that is under way.

use bus::channel::RunName;
use clap::Args;

use super::values::{self, Goal};

/// Which run is meant.
#[derive(Args, Clone, Debug)]
pub struct AskedRun {
    /// Name of the run [default: the one that there is]
    #[arg(long, value_name = "NAME")]
    pub run: Option<RunName>,
}

/// Goals, one after the other.
#[derive(Args, Clone, Debug)]
#[command(after_long_help = AFTER_HELP)]
pub struct GoalArguments {
    /// Where to go, in this order: x [m], y [m]
    #[arg(value_name = "X,Y", required = true)]
    pub goals: Vec<Goal>,

    /// How near to a goal counts as there [m] [default: as the run was started]
    #[arg(long, value_name = "METRES", value_parser = values::tolerance_m, allow_hyphen_values = true)]
    pub tolerance: Option<f64>,

    /// Which run is meant.
    #[command(flatten)]
    pub run: AskedRun,
}

/// A path to follow.
#[derive(Args, Clone, Debug)]
#[command(after_long_help = AFTER_HELP)]
pub struct PathArguments {
    /// Corners of the path, two or more: x [m], y [m]
    #[arg(value_name = "X,Y", required = true, num_args = 2..)]
    pub corners: Vec<Goal>,

    /// Speed along it [m/s]
    #[arg(long, value_name = "M/S", value_parser = values::speed_mps, allow_hyphen_values = true)]
    pub speed: f64,

    /// How near to its end counts as there [m] [default: as the run was started]
    #[arg(long, value_name = "METRES", value_parser = values::tolerance_m, allow_hyphen_values = true)]
    pub tolerance: Option<f64>,

    /// Which run is meant.
    #[command(flatten)]
    pub run: AskedRun,
}

/// A risk tolerance.
#[derive(Args, Clone, Debug)]
pub struct AlphaArguments {
    /// Share of worst outcomes to plan for from now on, in (0, 1]
    #[arg(value_name = "LEVEL", value_parser = values::cvar_level, allow_hyphen_values = true)]
    pub alpha: f64,

    /// Which run is meant.
    #[command(flatten)]
    pub run: AskedRun,
}

const AFTER_HELP: &str = "\
Examples:
  surefoot up --standby                        in one terminal: a run that waits
  surefoot goal 30,25 40,10                    in another: two goals, one after the other
  surefoot path 30,25 35,25 35,40 --speed 0.8  a path instead
  surefoot pause, resume, cancel               stand, go on, drop the mission
  surefoot estop, reset                        stop, whatever else is said, until reset

A new mission takes the place of the one before. Places are in the map frame: x east, y north.

Exit codes:
  0  the order was taken; one line says what the vehicle does now
  1  it was refused, or nobody answered; one line says why
  2  bad usage, no run to talk to, or several";
