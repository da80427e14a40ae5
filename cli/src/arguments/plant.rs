//! `surefoot bench plant`.

use clap::Args;

/// Which plant to measure.
#[derive(Args, Clone, Debug)]
#[command(after_long_help = AFTER_HELP)]
pub struct BenchPlantArguments {
    /// The machine, a shipped name or a path
    #[arg(long, value_name = "NAME|FILE", default_value = "pietra_full_size")]
    pub vehicle: String,

    /// Where the results go.
    #[command(flatten)]
    pub results: super::ResultArguments,
}

pub(super) const LONG_ABOUT: &str = "\
Holds the simulated machine against what is known of machines: the friction of its tyre over slip beside the brush in \
closed form and beside a published tyre, the linear traction that drives at different speeds would teach, and how much \
faster than real time it drives over rocks on one core.";

const AFTER_HELP: &str = "\
Writes plant.png, and plant.json with
  cornering         of each slip angle [degrees]: force over load at 1, 5 and 15 m/s, and in closed form
  published_across, published_along
                    a tyre of the published stiffness and peak, and the published one
  labels            achieved over commanded speed at 0.5, 1, 2, 3 and 4 m/s, by ground
  times_real_time   seconds driven per second

Example:
  surefoot bench plant --vehicle rc_car";
