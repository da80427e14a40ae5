//! `surefoot convert`.

use std::path::PathBuf;

use clap::Args;

/// What becomes what.
#[derive(Args, Clone, Debug)]
#[command(after_long_help = AFTER_HELP)]
pub struct ConvertArguments {
    /// Recordings of `surefoot drive`, `up` or `play`; files that follow one another, in their order
    #[arg(value_name = "FILE", required = true)]
    pub files: Vec<PathBuf>,

    /// The bag of ROS 2 that they become: a folder that is not there yet
    #[arg(long, value_name = "FOLDER")]
    pub ros2: PathBuf,

    /// The vehicle by whose limits a cell is risky, where the recording does not describe it: a shipped one, or a TOML
    /// file
    #[arg(long, value_name = "NAME|FILE")]
    pub vehicle: Option<String>,

    /// Where the numbers go, besides the terminal.
    #[command(flatten)]
    pub copy: super::JsonArguments,
}

pub(super) const LONG_ABOUT: &str = "\
Makes a bag of ROS 2 of recordings, as `ros2 bag record` of Jazzy leaves one: a folder with metadata.yaml and an MCAP \
file that holds every message in CDR, with its definition. No ROS is needed for it. What is recorded and has a message in ROS becomes one:
  /odom     nav_msgs/msg/Odometry, from frame map to frame base_link
  /tf       tf2_msgs/msg/TFMessage, the same
  /imu      sensor_msgs/msg/Imu                             recorded by `up` alone
  /points   sensor_msgs/msg/PointCloud2, in base_link
  /command  ackermann_msgs/msg/AckermannDriveStamped
  /plan     nav_msgs/msg/Path, the best future              recorded by `drive` and `play` alone
  /risk     nav_msgs/msg/OccupancyGrid, in the vehicle's heading";

const AFTER_HELP: &str = "\
Stamps of a run by `up` are of the time of day, those of `drive` count from its beginning, those of `play` are the bag's.
Recordings are read message by message. The folder appears once the bag is whole.

Examples:
  surefoot convert surefoot-out/drive.mcap --ros2 drive_bag
  surefoot convert surefoot-out/drive-000.mcap surefoot-out/drive-001.mcap --ros2 field_1

Exit codes:
  0  the bag is written; where a recording breaks off, what stands before that, and one line says where
  1  it could not be written
  2  bad usage or input; one line says what was expected and what was found";
