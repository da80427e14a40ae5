//! `surefoot collect`.

use std::path::PathBuf;

use clap::{Args, ValueEnum};
use scenarios::Split;

use super::values::{self, Goal};

/// What to gather, and where to put it.
#[derive(Args, Clone, Debug)]
#[command(after_long_help = AFTER_HELP)]
pub struct CollectArguments {
    /// Worlds to drive in
    #[arg(long, value_enum, default_value_t = CollectWorld::Testbed, help_heading = "Simulated drives")]
    pub world: CollectWorld,

    /// Which third of the worlds: to learn from, to choose by, or to report on
    ///
    /// No two splits share a world. The rock fields of the test split are higher, see --test-height-scale.
    #[arg(long, value_enum, default_value_t = CollectSplit::Train, help_heading = "Simulated drives")]
    pub split: CollectSplit,

    /// Worlds, 1 to 1000
    #[arg(long, value_name = "N", value_parser = values::map_count, default_value = "10",
          allow_hyphen_values = true, help_heading = "Simulated drives")]
    pub maps: u32,

    /// Trials in each world, 1 to 1000
    #[arg(long, value_name = "N", value_parser = values::trial_count, default_value = "20",
          allow_hyphen_values = true, help_heading = "Simulated drives")]
    pub trials: u32,

    /// Give up a trial after this much simulated time [s]
    #[arg(long, value_name = "SECONDS", value_parser = values::duration_s, default_value = "40",
          allow_hyphen_values = true, help_heading = "Simulated drives")]
    pub time_limit: f64,

    /// What the features are taken from
    #[arg(long, value_enum, default_value_t = CollectMap::Oracle, help_heading = "Simulated drives")]
    pub map: CollectMap,

    /// What all heights of the test rock fields are multiplied by [default: 2.2]
    #[arg(long, value_name = "FACTOR", value_parser = values::height_scale, allow_hyphen_values = true,
          conflicts_with = "harder_than", help_heading = "Simulated drives")]
    pub test_height_scale: Option<f64>,

    /// Find the height scale at which 91 % of the test footprints are more uneven than the median of this dataset
    ///
    /// Drives the test split up to eight times; the scale found is told and written to --json.
    #[arg(long, value_name = "DATASET", help_heading = "Simulated drives")]
    pub harder_than: Option<PathBuf>,

    /// A recorded drive instead of simulated ones: .csv, .mcap, or a bag of ROS 2
    #[arg(long, value_name = "FILE", requires = "elevation", help_heading = "Recorded drives")]
    pub log: Option<PathBuf>,

    /// The ground of the recorded drive: .npz, GeoTIFF or 16-bit PNG, in the frame of its poses
    #[arg(long, value_name = "FILE", requires = "log", help_heading = "Recorded drives")]
    pub elevation: Option<PathBuf>,

    /// Topics of a log that is a bag, and columns of one in CSV that have names of their own, separated by commas:
    /// odometry=/ekf/odom,command=/drive [default: the only one of a fitting type]
    #[arg(
        long,
        value_name = "OURS=THEIRS,..",
        value_delimiter = ',',
        requires = "log",
        help_heading = "Recorded drives"
    )]
    pub topics: Vec<String>,

    /// Robot file whose part [ros] says topics, frames and clock of a log that is a bag
    #[arg(long, value_name = "FILE", requires = "log", help_heading = "Recorded drives")]
    pub robot: Option<PathBuf>,

    /// Where the elevation's south-west corner lies in the log's frame: x [m], y [m] [default: 0,0]
    #[arg(
        long,
        value_name = "X,Y",
        requires = "elevation",
        allow_hyphen_values = true,
        help_heading = "Recorded drives"
    )]
    pub elevation_origin: Option<Goal>,

    /// Drive a small car by random speeds and curvatures over four surfaces, to learn inverse kinodynamics from
    ///
    /// The recording holds commands, odometry and the inertial measurement unit; see `surefoot train kinodynamics`.
    #[arg(long, help_heading = "Random driving",
          conflicts_with_all = ["world", "split", "maps", "trials", "time_limit", "map", "log", "elevation",
                                "test_height_scale", "harder_than"])]
    pub teleop_random: bool,

    /// Minutes of random driving, 1 to 600; each is a run on ground of its own
    #[arg(long, value_name = "N", value_parser = super::kinodynamics::minutes_of_driving, default_value = "30",
          allow_hyphen_values = true, requires = "teleop_random", help_heading = "Random driving")]
    pub minutes: u32,

    /// One surface alone instead of all four: cement, dirt, grass or leaves
    #[arg(long, value_name = "NAME", requires = "teleop_random", help_heading = "Random driving")]
    pub surface: Option<String>,

    /// The machine: a name or a TOML file [default: pietra_full_size; rc_car in the arena; ut_automata with
    /// --teleop-random]
    #[arg(long, value_name = "NAME|FILE", help_heading = "Run")]
    pub vehicle: Option<String>,

    /// Number that decides everything random: worlds, starts, steering, the sensors' noise
    #[arg(long, value_name = "NUMBER", value_parser = values::seed, default_value = "1",
          allow_hyphen_values = true, help_heading = "Run")]
    pub seed: u64,

    /// How much is done at a time.
    #[command(flatten, next_help_heading = "Run")]
    pub threads: super::ThreadArguments,

    /// The dataset; a picture of it goes beside it, with the ending .png
    #[arg(
        long,
        value_name = "FILE",
        default_value = "surefoot-out/dataset.safetensors",
        help_heading = "Output"
    )]
    pub out: PathBuf,

    /// Where the numbers go, besides the terminal.
    #[command(flatten, next_help_heading = "Output")]
    pub copy: super::JsonArguments,
}

impl CollectArguments {
    /// The machine, a shipped name or a path: the one asked for, else the one that fits the world.
    pub fn vehicle_name_or_path(&self) -> &str {
        let fitting = match self.world {
            _ if self.teleop_random => "ut_automata",
            CollectWorld::Arena | CollectWorld::Floor => "rc_car",
            CollectWorld::Testbed | CollectWorld::Rocks => "pietra_full_size",
        };
        self.vehicle.as_deref().unwrap_or(fitting)
    }
}

/// Families of worlds.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum CollectWorld {
    /// Generated maps of 50 x 50 m covered with rocks, to learn on
    Testbed,
    /// The rock fields of 50 x 50 m that `drive` and `bench navigation` drive over, with ways through
    Rocks,
    /// Halls of 9.6 x 8 m with a ramp, and bushes of many heights
    Arena,
    /// Level concrete and turf, 12 x 12 m
    Floor,
}

/// Thirds of the worlds.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum CollectSplit {
    /// To learn from
    Train,
    /// To choose by
    Validation,
    /// To report on
    Test,
}

impl From<CollectSplit> for Split {
    fn from(asked: CollectSplit) -> Self {
        match asked {
            CollectSplit::Train => Self::Train,
            CollectSplit::Validation => Self::Validation,
            CollectSplit::Test => Self::Test,
        }
    }
}

/// Where features come from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum CollectMap {
    /// The true surface, at the resolution of the robot's map
    Oracle,
    /// The robot's own map as known when it was there
    Sensed,
}

pub(super) const LONG_ABOUT: &str = "\
Gathers data to learn traversability from: what a vehicle did over what was asked of it, and the ground it did it on.

Drives a simulated vehicle over generated ground without a planner: random starts, sinusoidal steering, full speed, \
until it rolls over, is stuck, leaves the map or time is up. Or takes a recorded drive and the ground it went over. \
Either way four things are measured: linear traction (speed over commanded speed), angular traction (yaw rate over \
commanded yaw rate), |roll| and |pitch|, the commands first delayed and smoothed as the machine itself does, which is \
estimated from the log. What means nothing is masked: angular traction when hardly turning, traction near standstill \
or while a command is still on its way.";

const AFTER_HELP: &str = "\
Examples:
  surefoot collect --out data/train.safetensors
      20 trials on each of ten rock fields: about 11 000 labelled footprints in half a minute.
  surefoot collect --split validation --out data/validation.safetensors
      The same on ten other fields.
  surefoot collect --split test --harder-than data/train.safetensors --out data/test.safetensors
      Higher rocks, so that nine in ten footprints are unlike the training data.
  surefoot collect --world arena --vehicle rc_car --map sensed --out data/arena.safetensors
      A small car, and the ground as its own range sensor shows it.
  surefoot collect --log drive.mcap --elevation ground.npz --vehicle my.toml --out data/mine.safetensors
      A recorded drive.

  surefoot collect --teleop-random --minutes 30 --out data/teleoperation.safetensors
      Half an hour of random driving on cement, dirt, grass and leaves, with the IMU.

Recorded drives:
  needed columns   t, x, y, yaw, vx, wz, cmd_speed, and cmd_steer or cmd_wz (or
                   cmd_left and cmd_right instead of all commands)
  used if there    roll, pitch; run (t restarts per run)
  the elevation must lie under at least half of the labels; where its south-west
  corner is not at x = 0, y = 0 of the log, --elevation-origin says where it is

The dataset (safetensors), for N examples of F features:
  features [N,F] f32   measured [N,4] f32, NaN = means nothing   prior [N,4,12] f32
  unevenness [N] f32   drive [N] u32   pose [N,3] f64
  header entry 'surefoot': JSON with vehicle, layout of the features, physics
  prior, names of the drives

Exit codes:
  0  the dataset was written
  1  it was not; one line on standard error says why
  2  bad usage or input; one line says what was expected and what was found";
