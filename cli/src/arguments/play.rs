//! `surefoot play`.

use std::path::PathBuf;

use clap::Args;

use super::{Goal, Pace, ResultArguments};

/// What to play, and for which robot.
#[derive(Args, Clone, Debug)]
#[command(after_long_help = AFTER_HELP)]
pub struct PlayArguments {
    /// The bag of ROS 2: its folder, or a file ending in .mcap or .db3
    #[arg(value_name = "BAG")]
    pub bag: PathBuf,

    /// The robot: its vehicle, settings, topics, frames and clock; a TOML file with a part [ros]
    #[arg(long, value_name = "FILE")]
    pub robot: PathBuf,

    /// Where to go in the robot's map: x [m], y [m]; repeatable, in this order [default: the goals of the robot file, else
    /// where the bag's odometry ends]
    ///
    /// Goals and paths that the bag itself holds go before them once they come.
    #[arg(long, value_name = "X,Y", allow_hyphen_values = true)]
    pub goal: Vec<Goal>,

    /// As fast as the machine allows, or as fast as it was recorded
    #[arg(long, value_enum, default_value_t = Pace::Fast)]
    pub pace: Pace,

    /// Where results go.
    #[command(flatten)]
    pub results: ResultArguments,
}

pub(super) const LONG_ABOUT: &str = "\
Feeds a bag of ROS 2 through the pipeline as if the robot drove now, and shows what would have been decided: odometry, \
clouds, frames, inertial samples and goals go the same way as with `surefoot up --robot FILE`, on the clock that the bag \
was recorded by. Nothing drives: the next odometry is that of the bag, whatever was decided before.";

const AFTER_HELP: &str = "\
Leaves in the folder of the results:
  play.mcap   poses, decisions, maps and futures, for Foxglove
  play.json   counts, what was left out and why, and every decision beside what the vehicle did
  play.png    the ground as it was seen, the risk on it, and the way that was driven

Examples:
  surefoot play rosbag2_2026_01_01 --robot mine.toml
  surefoot play drive_0.db3 --robot mine.toml --goal 20,5 --pace real

Exit codes:
  0  the bag was played as far as it is whole; where it breaks off is told
  1  the work failed; one line says why
  2  bad usage or input; one line says what was expected and what was found";
