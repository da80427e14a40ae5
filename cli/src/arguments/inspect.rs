//! `surefoot inspect`.

use std::path::PathBuf;

use clap::Args;

/// What to look into.
#[derive(Args, Clone, Debug)]
#[command(after_long_help = AFTER_HELP)]
pub struct InspectArguments {
    /// A recording (.mcap), a bag of ROS 2 (.mcap, .db3 or their folder), elevation (.npz, .tif, .png), a vehicle (.toml, or the name of a shipped one), or a folder
    /// with networks or a map in tiles
    #[arg(value_name = "FILE")]
    pub file: PathBuf,

    /// Where the numbers go, besides the terminal.
    #[command(flatten)]
    pub copy: super::JsonArguments,
}

pub(super) const LONG_ABOUT: &str = "\
Says what a file holds: topics, times and setup of a recording, also of one that breaks off; topics, types, counts and rates of a bag; size and heights of an \
elevation map or a map in tiles; the figures of a vehicle; method, training and size of networks.";

const AFTER_HELP: &str = "\
Examples:
  surefoot inspect surefoot-out/drive.mcap
  surefoot inspect rosbag2_2026_01_01
  surefoot inspect rc_car

Exit codes:
  0  the file was understood
  2  it was not; one line says what was expected and what was found";
