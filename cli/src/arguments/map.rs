//! `surefoot map`.

use std::path::PathBuf;

use bus::channel::RunName;
use clap::Args;

use super::values::Goal;

/// Which map, and what comes to it.
#[derive(Args, Clone, Debug)]
#[command(after_long_help = AFTER_HELP)]
pub struct MapArguments {
    /// Folder of the map; made if missing
    #[arg(value_name = "FOLDER")]
    pub map: PathBuf,

    /// What is merged into it, in this order: elevation files (.npz, GeoTIFF, 16-bit PNG) and other maps in tiles
    #[arg(value_name = "FILE|FOLDER")]
    pub sources: Vec<PathBuf>,

    /// Edge of the cells of a new map [m] [default: that of what is merged first]
    #[arg(long, value_name = "M", allow_hyphen_values = true)]
    pub cell: Option<f64>,

    /// Where the south-west corner of the elevation files lies in the map [m]
    #[arg(long, value_name = "X,Y", allow_hyphen_values = true, default_value = "0,0")]
    pub at: Goal,

    /// Standard deviation of the heights of the elevation files [m]
    #[arg(long, value_name = "M", allow_hyphen_values = true, default_value = "0.1")]
    pub deviation: f64,

    /// Keep what the vehicle of a run sees, until the run ends or Ctrl-C
    #[arg(long, value_name = "RUN", conflicts_with_all = ["sources", "cell"])]
    pub listen: Option<RunName>,

    /// How much the ground holds, of files and of what is seen.
    #[command(flatten)]
    pub kinds: super::GroundKinds,

    /// Where the results go.
    #[command(flatten)]
    pub results: super::ResultArguments,
}

pub(super) const LONG_ABOUT: &str = "\
Keeps a map of the ground that outgrows memory, in tiles of 256 x 256 cells in files of a folder, and merges into it what \
elevation files, other such maps and the vehicles of runs know.

Heights that agree within three of their standard deviations are averaged by their variances, of those that contradict \
each other the more certain is kept; both are counted. What was merged is on disk: a kill at any moment leaves a tile as \
it was or as it became.";

const AFTER_HELP: &str = "\
Writes map.png and map.json to --out. Without anything to merge it shows what is there.

A tile takes 786 kB, larger cells for the search are made of it when they are asked for, a third more in all.

Examples:
  surefoot map valley hills.npz
  surefoot map valley north.tif --at 0,1000 --deviation 0.3
  surefoot map valley of_another_robot
  surefoot map valley --listen field
      What the vehicle of the run `field` sees.
  surefoot drive --world hills.npz --keep valley
      What a simulated vehicle sees.
  surefoot route --world valley --start 20,20,0.8 --goal 3600,3500";
