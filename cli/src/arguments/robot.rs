//! `surefoot robot`.

use std::path::PathBuf;

use clap::Args;

/// What the robot is made out from.
#[derive(Args, Clone, Debug)]
#[command(after_long_help = AFTER_HELP)]
pub struct RobotArguments {
    /// The robot's own description, with four wheels
    #[arg(long, value_name = "FILE")]
    pub urdf: PathBuf,

    /// A bag of ROS 2 that the robot recorded: its folder, or a file ending in .mcap or .db3
    #[arg(long, value_name = "BAG")]
    pub bag: PathBuf,

    /// The robot file to write; the vehicle's file is written beside it. Neither may be there yet
    #[arg(long, value_name = "FILE", default_value = "robot.toml")]
    pub out: PathBuf,
}

pub(super) const LONG_ABOUT: &str = "\
Writes a robot file, and the file of its vehicle, from a URDF and a bag of ROS 2: axles, wheels, steering, mass, sensors' \
mounts and the box of the robot's own body from the one; topics, frames, clock and rates from the other. Every number has \
a comment that says where it comes from. What neither tells stands there as of the shipped vehicle of the nearest \
wheelbase, or as a comment, with what is expected, and is listed: go through it before the robot drives.";

const AFTER_HELP: &str = "\
The description's root looks forward, left and up, as ROS asks for; joints count as standing at zero.

Example:
  surefoot robot --urdf car.urdf --bag field_1 --out robot.toml
  surefoot doctor field_1 --robot robot.toml

Exit codes:
  0  both files are written
  1  they could not be written
  2  bad usage or input; one line says what was expected and what was found";
