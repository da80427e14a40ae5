//! `surefoot doctor`.

use std::path::PathBuf;

use clap::Args;

use super::{AskedRun, JsonArguments, values};

/// What to look at.
#[derive(Args, Clone, Debug)]
#[command(after_long_help = AFTER_HELP)]
pub struct DoctorArguments {
    /// A bag of ROS 2 that the robot recorded, in place of machine and run: its folder, or a file ending in .mcap or .db3
    #[arg(value_name = "BAG", requires = "robot", conflicts_with_all = ["run", "seconds", "recordings"])]
    pub bag: Option<PathBuf>,

    /// The robot: its run, vehicle, rates and sensors; a TOML file
    #[arg(long, value_name = "FILE")]
    pub robot: Option<PathBuf>,

    /// Which run is meant.
    #[command(flatten)]
    pub run: AskedRun,

    /// How long to look on at the run [s]
    #[arg(long, value_name = "SECONDS", default_value_t = 5.0, value_parser = values::watch_s, allow_hyphen_values = true)]
    pub seconds: f64,

    /// Folder that recordings would go to
    #[arg(long, value_name = "DIR", default_value = ".")]
    pub recordings: PathBuf,

    /// Where the findings go, besides the terminal.
    #[command(flatten)]
    pub copy: JsonArguments,
}

pub(super) const LONG_ABOUT: &str = "\
Checks the machine that this runs on (cores, priority, locked memory, how late it wakes, shared memory, disk) and, where a \
run is there, looks on at it for some seconds: rates, gaps and delays of odometry, scans and inertial samples beside the \
robot file's; velocities against positions and rates against headings; the ground that each range sensor sees against the \
ground under the wheels, and whether what stands out of the ground stays where it is while the vehicle drives; gravity \
where the odometry has it; and how every process keeps its times. Nothing is sent. Of a bag the same is checked, but for machine \
and processes.";

const AFTER_HELP: &str = "\
Each check is one line:
  fine      as it should be
  look      it may be meant so; the line says what usually causes it
  WRONG     nobody should drive with this
  unknown   it could not be told; the line says what would tell it

A mount is judged by the ground within two lengths of the vehicle, so stand on even ground for it; a velocity by half a
metre that is driven, a yaw rate by a turn of 0.2 rad, and a sensor's yaw by some metres past trees, posts or rocks.
A run needs a place for one reader more (--third-parties).

Examples:
  surefoot doctor                                    the machine, and the run if there is one
  surefoot doctor --robot mine.toml --seconds 20     while somebody drives a circle by hand
  surefoot doctor field_1 --robot mine.toml          what a bag of ROS 2 says of the robot's sensors

Exit codes:
  0  nothing is wrong
  1  something is, or the run could not be looked on at
  2  bad usage or input; one line says what was expected and what was found";
