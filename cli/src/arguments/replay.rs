//! `surefoot replay`.

use std::path::PathBuf;

use clap::Args;

/// What to make again.
#[derive(Args, Clone, Debug)]
#[command(after_long_help = AFTER_HELP)]
pub struct ReplayArguments {
    /// Recordings of `surefoot up`; files that follow one another, in their order
    #[arg(value_name = "FILE", required = true)]
    pub files: Vec<PathBuf>,

    /// Networks that were used, when they did not come with the program: a folder with weights.safetensors and
    /// weights.json
    #[arg(long, value_name = "DIR")]
    pub weights: Option<PathBuf>,

    /// Networks that corrected commands, where some did: a folder with kinodynamics.safetensors and kinodynamics.json
    #[arg(long, value_name = "DIR")]
    pub kinodynamics_weights: Option<PathBuf>,

    /// Where the numbers go, besides the terminal.
    #[command(flatten)]
    pub copy: super::JsonArguments,
}

pub(super) const LONG_ABOUT: &str = "\
Makes every decision of a recording again: the maps from the recorded scans and the networks, checked by their hashes, \
and the commands from the maps and what control says it used. Every command must come out to the last bit; the first \
that does not is told. Each decision must also have been made on the newest maps that there were, and on the one of them \
that is to be driven on. What corrected commands for the ground corrects them again. Jumps of the localisation and places of scans are made out again from the recorded odometry and \
must be those of the maps. What the recording lacks is told too, and what hangs on it is not counted as made again.";

const AFTER_HELP: &str = "\
Example:
  surefoot replay surefoot-out/drive-000.mcap

Exit codes:
  0  every decision was made again to the last bit; where odometry was not recorded, maps whose localisation could not
     be verified are counted and told
  1  one was not, or was made on another map than it had to be, or something that it needs was not recorded, or
     there is none, or a map tells of another jump or place than the odometry shows; one line says which
  2  bad usage or input; one line says what was expected and what was found";
