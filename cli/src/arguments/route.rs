//! `surefoot route`.

use std::path::PathBuf;

use bus::channel::RunName;
use clap::{Args, ValueEnum};

use super::values::{Goal, StartPose};

/// From where to where, over what.
#[derive(Args, Clone, Debug)]
#[command(after_long_help = AFTER_HELP)]
pub struct RouteArguments {
    /// Elevation file: .npz, GeoTIFF or 16-bit PNG with its scale; or the folder of a map in tiles, as `surefoot map` and
    /// `surefoot drive --keep` leave one
    #[arg(long, value_name = "FILE|FOLDER")]
    pub world: PathBuf,

    /// Where the vehicle stands [m, m, rad] [default with --lead: where it says to be]
    #[arg(long, value_name = "X,Y,YAW", allow_hyphen_values = true, required_unless_present = "lead")]
    pub start: Option<StartPose>,

    /// Where it shall go [m]
    #[arg(long, value_name = "X,Y", allow_hyphen_values = true)]
    pub goal: Goal,

    /// The machine, a shipped name or a path
    #[arg(long, value_name = "NAME|FILE", default_value = "pietra_full_size")]
    pub vehicle: String,

    /// What the map is made of.
    #[command(flatten)]
    pub ground: RouteGround,

    /// Fastest [m/s] [default: the vehicle's]
    #[arg(long, value_name = "M/S", allow_hyphen_values = true)]
    pub speed: Option<f64>,

    /// Other ways to show beside the best, at most: of ways of their own for two fifths of their length, and at most half as
    /// long again in time
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u8).range(..=5), default_value_t = 2)]
    pub alternatives: u8,

    /// Lead the vehicle of a run (`surefoot up --standby`) along the route until it is at the goal; another route is searched
    /// where this one is blocked by what the vehicle sees, or leads no farther
    ///
    /// It is told to head for a place of the route within what it sees; on which way it gets there, its own map decides.
    #[arg(long, value_name = "RUN")]
    pub lead: Option<RunName>,

    /// Where the results go.
    #[command(flatten)]
    pub results: super::ResultArguments,
}

/// What is known of the ground, beside its heights.
#[derive(Args, Clone, Debug, Default)]
pub struct RouteGround {
    /// Edge of the cells that a route is searched on [m] [default: that of the file, between 0.5 and 2; of a map in tiles the
    /// next to it that it has, and over one that is too large for a search at once, larger ones]
    #[arg(long, value_name = "M", allow_hyphen_values = true)]
    pub cell: Option<f64>,

    /// How much it holds.
    #[command(flatten)]
    pub kinds: GroundKinds,
}

/// How much the ground holds; a map in tiles says it of every cell itself.
#[derive(Args, Clone, Debug, Default)]
pub struct GroundKinds {
    /// Ground where no plants grow [default: dirt]
    #[arg(long, value_name = "GROUND")]
    pub bare: Option<BareGround>,

    /// Friction of the vehicle's own drives in place of the published, as `surefoot train friction` writes it (TOML)
    ///
    /// Of a drive, its controller pays for it, too: turns and slopes that ask for more than three quarters of what the ground
    /// holds at a sliding speed of 1 m/s cost in proportion; brakes and motor do not. Open ground is that of --bare, loose ground is sand, plants are grass.
    #[arg(long, value_name = "FILE")]
    pub friction: Option<PathBuf>,
}

/// Grounds that AnyNav states coefficients for.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub enum BareGround {
    /// 0.98 static, 0.70 sliding
    Asphalt,
    /// 0.93, 0.62
    Rock,
    /// 0.68, 0.76
    #[default]
    Dirt,
    /// 0.61, 0.65
    Grass,
    /// 0.55, 0.55
    Mud,
    /// 0.60, 0.60
    Sand,
    /// 0.40, 0.20
    Ice,
}

pub(super) const LONG_ABOUT: &str = "\
Searches a route over measured ground, from one place to another, and the fastest speeds along it.

The search weighs length, friction, slope, roughness and turns (AnyNav, equations 37 to 42); the speeds are the fastest \
that friction, traction, brakes and roughness allow (equations 43 to 51). Ground too slippery for its slope, steeper \
than nine tenths of the vehicle's limits, or under water is not driven on. Where there is no way, the line that says so \
names what blocks it, and where.";

const AFTER_HELP: &str = "\
Writes route.png, route.csv and route.json; for a GeoTIFF that names its reference system (EPSG) also route.geojson, in
longitude and latitude.
  route.csv   x_m, y_m, yaw_rad, height_m, speed_mps, curvature_per_m, grade, friction along the way
  path        `surefoot path` takes the corners that are printed

The file's share of low plants (grass) and --bare say what the ground is; how much it holds comes from the published
table, or from --friction for the grounds that are in it. Nothing is learned from images.

Examples:
  surefoot route --world hills.npz --start 20,20,0.8 --goal 250,240
  surefoot route --world hills.npz --start 20,20,0.8 --goal 250,240 --bare mud --speed 5 --vehicle mine.toml
  surefoot route --world hills.npz --start 20,20,0.8 --goal 250,240 --friction friction.toml
  surefoot route --world hills.npz --goal 250,240 --lead field
      The vehicle of the run `field`, from where it stands.
  surefoot route --world valley --start 20,20,0.8 --goal 3600,3500
      Over a map in tiles. Where four million cells do not hold the way with the room around it, it is searched coarsely
      as a whole and then finely along that, a leg of 100 m at a time.";
