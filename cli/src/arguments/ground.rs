//! `surefoot gap ground` and `surefoot bench ground`.

use std::path::PathBuf;

use clap::Args;

use super::drive::Method;
use super::values;

/// Which drives to hold a belief about the ground against.
#[derive(Args, Clone, Debug)]
#[command(after_long_help = GAP_AFTER_HELP)]
pub struct GapGroundArguments {
    /// Drives: recordings with maps (.mcap), as `surefoot drive` writes them; or logs (.csv) with --elevation
    #[arg(value_name = "DRIVE", required = true, num_args = 1..)]
    pub drives: Vec<PathBuf>,

    /// Drives of before, or of the simulator, on which all was right, separated by commas; what has changed since is
    /// then named
    #[arg(long, value_name = "DRIVE,..", num_args = 1.., value_delimiter = ',')]
    pub reference: Vec<PathBuf>,

    /// The ground below the logs, where they hold no maps: .npz, GeoTIFF or 16-bit PNG
    #[arg(long, value_name = "FILE")]
    pub elevation: Option<PathBuf>,

    /// Vehicle: the name of a shipped one, or a TOML file
    #[arg(long, value_name = "VEHICLE", default_value = "pietra_full_size")]
    pub vehicle: String,

    /// What judges the ground: physics, or networks [default: networks that come with the program for this vehicle, else
    /// physics]
    #[arg(long, value_enum, value_name = "METHOD")]
    pub method: Option<Method>,

    /// Networks that judge the ground: a folder as `surefoot train` leaves it
    #[arg(long, value_name = "DIR")]
    pub weights: Option<PathBuf>,

    /// Where ground.html, ground.json and ground.png go.
    #[command(flatten)]
    pub results: super::ResultArguments,
}

/// Which cases to make and to diagnose.
#[derive(Args, Clone, Debug)]
#[command(after_long_help = BENCH_AFTER_HELP)]
pub struct BenchGroundArguments {
    /// Machines, separated by commas: names of shipped vehicles, or TOML files
    #[arg(long, value_name = "VEHICLE,..", value_delimiter = ',', default_value = "buggy_fifth,ut_automata")]
    pub vehicles: Vec<String>,

    /// Cases of each machine, at most 1000; of six kinds in turn
    #[arg(long, value_name = "N", value_parser = case_count, default_value = "24", allow_hyphen_values = true)]
    pub cases: u64,

    /// Number of the first case of each machine, to look at one again: --first-case 7 --cases 1
    #[arg(long, value_name = "NUMBER", value_parser = values::seed, default_value = "0", allow_hyphen_values = true)]
    pub first_case: u64,

    /// Number that decides ground, drivers, noise and what is wrong
    #[arg(long, value_name = "NUMBER", value_parser = values::seed, default_value = "1", allow_hyphen_values = true)]
    pub seed: u64,

    /// Cases at a time.
    #[command(flatten)]
    pub threads: super::ThreadArguments,

    /// Where ground_score.json and ground_score.png go.
    #[command(flatten)]
    pub results: super::ResultArguments,
}

fn case_count(word: &str) -> Result<u64, String> {
    values::count(word, 1000, "cases").map(|n| n as u64)
}

pub(super) const GAP_ABOUT: &str = "\
Tells where the belief about the ground and what drives met on it part: linear and angular traction, roll and pitch, each \
foretold as a distribution from the map of before, and then measured. By class, slope, roughness, familiarity, distance, \
speed and time; whether the belief is too sure or not sure enough; and which of its layers says so: the physics prior, the \
networks, the heights of the map.

With --reference, what has changed since those drives is named, or said to be unknown: other friction of one class or of \
all, a sensor that sits elsewhere, a class that is called by another's name, a heavier vehicle.";

const GAP_AFTER_HELP: &str = "\
Needed of a drive: x, y, yaw, vx, wz and the commands; z tells of heights, wheel_speed tells slip from a weak motor.

Writes ground.html, ground.png, and ground.json with
  calibration  of each parameter: bias (met less foretold), coverage of the central 90 %, the histogram of the probability
               integral transform, and in what it parts
  places       of each parameter and condition: the share of the residual that it explains, and the bias of every bin
  layers       EMD2 of prior, networks, posterior and of knowing nothing
  heights      of the map less those measured [m]
  change       with --reference: what is named, what could be meant too, and every cause with its score
All means have 90 % intervals from stretches of three seconds.

Examples:
  surefoot gap ground surefoot-out/drive.mcap --method pietra
  surefoot gap ground wet1.mcap wet2.mcap --reference dry1.mcap,dry2.mcap --vehicle my.toml
  surefoot gap ground drive.csv --elevation field.npz --vehicle my.toml";

pub(super) const BENCH_ABOUT: &str = "\
Makes drives of simulated machines over hills with open, loose and overgrown ground, changes something that the diagnosis \
is not told, and asks `surefoot gap ground` what it was: nothing, friction of one class, wet ground, the sensor's height, \
a class called by another's name, a load. Says what was taken for what. The exit code is 0 once all are done.";

const BENCH_AFTER_HELP: &str = "\
Writes ground_score.png, and ground_score.json with
  cases      of each: vehicle, what was changed, what was named, what could be meant too
  confusion  what was named (columns) for what had been changed (rows)

Example, twenty minutes on two cores:
  surefoot bench ground --cases 18
Example, half a minute:
  surefoot bench ground --vehicles rc_car --first-case 3 --cases 1";
