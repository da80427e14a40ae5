//! `surefoot drive`.

use std::path::PathBuf;

use clap::{Args, ValueEnum};
use scenarios::ArenaConfig;

use super::AskedDeviation;
use super::values::{self, Goal, StartPose, WorldSource};
use crate::UsageError;

/// What says how to plan: it means nothing where nobody does.
const PLANNING: [&str; 10] =
    ["goal", "method", "weights", "correct", "model", "alpha", "config", "oracle_map", "threads", "isa"];

/// What to drive, where, and what to believe.
#[derive(Args, Clone, Debug)]
#[command(after_long_help = AFTER_HELP)]
pub struct DriveArguments {
    /// Ground to drive on: rocks, arena, navigation:MAP,PAIR, fast:MAP,PAIR, or an elevation file (.npz, GeoTIFF, 16-bit PNG)
    ///
    /// `rocks` is a generated field of 50 x 50 m, another one for every seed. `arena` is a hall of 9.6 x 8 m with a
    /// ramp and bushes. `navigation:7,3` is the third start and goal on the seventh map of `surefoot bench navigation`:
    /// with the benchmark's --seed, one of its drives again; `fast:7,3` that of its `--ground fast`. A file holds heights
    /// in metres, and where it ends the planner is told, as a fence; see "Elevation files" below.
    #[arg(
        long,
        value_name = "rocks|arena|navigation:MAP,PAIR|fast:MAP,PAIR|FILE",
        default_value = "rocks",
        help_heading = "World"
    )]
    pub world: WorldSource,

    /// Height of the arena's bushes [m]; only with --world arena [default: 0.05]
    #[arg(long, value_name = "METRES", value_parser = values::height_m, allow_hyphen_values = true,
          help_heading = "World")]
    pub bush_height: Option<f64>,

    /// Where the vehicle starts: x [m], y [m], yaw [rad]; left out: a feasible place by the seed
    ///
    /// The place of the rear axle's centre, x east, y north, yaw counter-clockwise from east in radians
    /// (1.5708 faces north).
    #[arg(long, value_name = "X,Y,YAW", allow_hyphen_values = true, help_heading = "World")]
    pub start: Option<StartPose>,

    /// Where to go: x [m], y [m]; repeatable, in this order; left out: a feasible place by the seed
    #[arg(long, value_name = "X,Y", allow_hyphen_values = true, help_heading = "World")]
    pub goal: Vec<Goal>,

    /// How near to a goal counts as there [m] [default: 1 on the rock field, 0.3 in the arena, else 0.3 lengths of the
    /// vehicle]
    #[arg(long, value_name = "METRES", value_parser = values::tolerance_m, allow_hyphen_values = true,
          help_heading = "World")]
    pub tolerance: Option<f64>,

    /// People who cross the way to the goal, at most 16; they are tracked and kept away from
    #[arg(long, value_name = "N", value_parser = walker_count, default_value = "0", allow_hyphen_values = true,
          help_heading = "World")]
    pub walkers: usize,

    /// Drive along a route, searched on the file of --world as `surefoot route` does, or on a map of the ground of before;
    /// another one is searched where this is blocked by what the vehicle sees, or leads no farther
    ///
    /// The vehicle heads for a place of the route within what it sees, on whatever way its own map shows to be best.
    #[arg(long, value_name = "MAP", num_args = 0..=1, require_equals = true, conflicts_with = "commands",
          help_heading = "World")]
    pub route: Option<Option<PathBuf>>,

    /// Keep what is seen of the ground in a map in tiles, the folder is made if missing; later drives take it with
    /// --route=FOLDER, `surefoot route` with --world FOLDER
    #[arg(long, value_name = "FOLDER", conflicts_with = "commands", help_heading = "World")]
    pub keep: Option<PathBuf>,

    /// What the ground is made of.
    #[command(flatten, next_help_heading = "World")]
    pub ground: super::RouteGround,

    /// The machine that is simulated: a name or a TOML file [default: pietra_full_size; rc_car in the arena]
    ///
    /// Names: pietra_full_size (3.4 x 1.8 m), rc_car (0.33 x 0.25 m), buggy_fifth (1/5 scale), sedan.
    #[arg(long, value_name = "NAME|FILE", help_heading = "Vehicle and controller")]
    pub vehicle: Option<String>,

    /// Fastest speed that is commanded [m/s] [default: the machine's]
    #[arg(long, value_name = "M/S", value_parser = values::speed_mps, allow_hyphen_values = true,
          help_heading = "Vehicle and controller")]
    pub speed: Option<f64>,

    /// How the simulated machine departs from its description, which the controller is not told: PART=NUMBER,.. as in
    /// steering_delay=0.2; repeatable, see "Deviations" below
    #[arg(long, value_name = "PART=NUMBER,..", help_heading = "Vehicle and controller")]
    pub deviation: Vec<AskedDeviation>,

    /// What the controller believes of the machine, a TOML file [default: the vehicle's geometry, no effects]
    #[arg(long, value_name = "FILE", help_heading = "Vehicle and controller")]
    pub model: Option<PathBuf>,

    /// What the controller knows of the ground [default: pietra where its networks fit the vehicle, else physics; with
    /// --weights the method that these were trained for]
    #[arg(long, value_enum, help_heading = "Vehicle and controller")]
    pub method: Option<Method>,

    /// Networks in place of those that come with the program: a folder with weights.safetensors and weights.json, as
    /// `surefoot train` leaves it
    #[arg(long, value_name = "DIR", help_heading = "Vehicle and controller")]
    pub weights: Option<PathBuf>,

    /// Correct commands between controller and vehicle for the ground under the wheels
    #[arg(long, value_enum, requires = "kinodynamics_weights", help_heading = "Vehicle and controller")]
    pub correct: Option<Correct>,

    /// Networks that correct commands: a folder with kinodynamics.safetensors and kinodynamics.json, as `surefoot train
    /// kinodynamics` leaves it
    #[arg(long, value_name = "DIR", requires = "correct", help_heading = "Vehicle and controller")]
    pub kinodynamics_weights: Option<PathBuf>,

    /// Risk tolerance in (0, 1]: the share of worst outcomes to plan for; 1 plans for the mean
    #[arg(long, value_name = "LEVEL", value_parser = values::cvar_level, default_value = "0.6",
          allow_hyphen_values = true, help_heading = "Vehicle and controller")]
    pub alpha: f64,

    /// Controller settings, a TOML file; what it leaves out keeps its default
    #[arg(long, value_name = "FILE", help_heading = "Vehicle and controller")]
    pub config: Option<PathBuf>,

    /// Plan on the true map instead of the one built from simulated scans, for comparison
    #[arg(long, help_heading = "Vehicle and controller")]
    oracle_map: bool,

    /// Number that decides everything random: the world, the sensors' noise, the samples
    #[arg(long, value_name = "NUMBER", value_parser = values::seed, default_value = "1",
          allow_hyphen_values = true, help_heading = "Run")]
    pub seed: u64,

    /// Give up after this much simulated time [s]
    #[arg(long, value_name = "SECONDS", value_parser = values::duration_s, default_value = "120",
          allow_hyphen_values = true, help_heading = "Run")]
    pub time_limit: f64,

    /// As fast as the machine allows, or wall-clock time [default: fast; real where processes drive]
    #[arg(long, value_enum, help_heading = "Run")]
    pub pace: Option<Pace>,

    /// How maps and controller compute.
    #[command(flatten, next_help_heading = "Run")]
    pub kernels: super::KernelArguments,

    /// Where the results go.
    #[command(flatten, next_help_heading = "Output")]
    pub results: super::ResultArguments,

    /// Carry out the commands of this drive log (.csv or .mcap: t, cmd_speed, cmd_steer) instead of planning; nothing but
    /// the world's edge, a fall or a standstill ends the drive before they do
    #[arg(long, value_name = "FILE", conflicts_with_all = PLANNING, help_heading = "Run")]
    pub commands: Option<PathBuf>,
}

impl DriveArguments {
    /// Height of the arena's bushes [m].
    ///
    /// # Errors
    /// A height was given for a world that has no bushes to set.
    pub fn bush_height_m(&self) -> Result<f64, UsageError> {
        match (self.bush_height, &self.world) {
            (Some(_), world) if *world != WorldSource::Arena => Err(UsageError(
                "--bush-height: expected together with --world arena, found without it".into(),
            )),
            (height, _) => Ok(height.unwrap_or(ArenaConfig::default().bush_height_m)),
        }
    }

    /// The machine to simulate, a shipped name or a path: the one asked for, else the one that fits the world.
    pub fn vehicle_name_or_path(&self) -> &str {
        let fitting = match self.world {
            WorldSource::Arena => "rc_car",
            WorldSource::Rocks | WorldSource::Navigation { .. } | WorldSource::File(_) => "pietra_full_size",
        };
        self.vehicle.as_deref().unwrap_or(fitting)
    }

    /// Where the controller's map comes from.
    pub fn map_source(&self) -> MapSource {
        if self.oracle_map { MapSource::Oracle } else { MapSource::Sensed }
    }
}

fn walker_count(word: &str) -> Result<usize, String> {
    if word.trim() == "0" { Ok(0) } else { values::count(word, 16, "walkers") }
}

/// Where the controller's map comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MapSource {
    /// Fused online from simulated range scans.
    Sensed,
    /// The world itself.
    Oracle,
}

/// What the controller knows of the ground.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Method {
    /// What was learned from driving, and physics where the evidence ends
    Pietra,
    /// The same; ground unlike the training data is avoided
    PietraAvoid,
    /// What was learned, with nothing to fall back on; ground unlike the training data is avoided
    Evora,
    /// What was learned with a loss that keeps it close to physics, without evidence
    PhysicsInformed,
    /// What was learned, without evidence
    Vanilla,
    /// Traction and attitude from the physics prior on the map
    Physics,
    /// No slip and full traction everywhere: what ignoring the ground costs
    Nominal,
    /// The plant's true traction and attitude: the best any prediction could do
    Truth,
}

impl From<Method> for bench::closed_loop::Method {
    fn from(asked: Method) -> Self {
        match asked {
            Method::Pietra => Self::Pietra,
            Method::PietraAvoid => Self::PietraAvoid,
            Method::Evora => Self::Evora,
            Method::PhysicsInformed => Self::PhysicsInformed,
            Method::Vanilla => Self::Vanilla,
            Method::Physics => Self::Physics,
            Method::Nominal => Self::Nominal,
            Method::Truth => Self::Truth,
        }
    }
}

/// What corrects commands for the ground under the wheels.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Correct {
    /// The curvature, as half a second of the inertial measurement unit tells: by at most correction.curvature_change_max_per_m
    /// of the settings, and not at all where the unit is silent, saturated or turned, or the moment unlike the training
    Kinodynamics,
}

/// How simulated time passes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Pace {
    /// As fast as the machine allows
    Fast,
    /// One simulated second takes one second
    Real,
}

pub(super) const LONG_ABOUT: &str = "\
Drives a simulated vehicle over rough ground to a goal, in closed loop.

Ten times a second a simulated range sensor sees the ground around the vehicle, the map grows, the risk map follows, \
and the controller picks the next command. The plant that carries it out is a rigid body on four sprung wheels with \
tyres that slip; the controller knows it only by what it measures.";

const AFTER_HELP: &str = "\
Examples:
  surefoot drive
      40 m over a generated rock field.
  surefoot drive --seed 7 --alpha 0.2 --out careful
      Another field, planned for the worst fifth of outcomes.
  surefoot drive --seed 7 --method nominal
      The same field for a controller that believes in full traction everywhere.
  surefoot drive --world arena --bush-height 0.3
      Tall bushes: does it take the ramp?
  surefoot drive --world navigation:7,3 --method truth
      A drive of `surefoot bench navigation` again, with its picture and recording.
  surefoot drive --deviation steering_delay=0.25 --deviation tyre_grip=0.6
      A robot that is not what its simulator says. Record it, diagnose it with
      `surefoot gap`, and drive again with --model.
  surefoot drive --correct kinodynamics --kinodynamics-weights wheels
      Commands are corrected for what the wheels stand on, by networks of
      `surefoot train kinodynamics` for this vehicle.
  surefoot drive --world hills.npz --start 12,-3,1.57 --goal 60,20
      Real elevation; negative coordinates are fine.
  surefoot drive --world hills.npz --start 12,-3,1.57 --goal 260,240 --route --time-limit 900
      Along a route over the whole file.
  surefoot drive --world hills.npz --start 12,-3,1.57 --goal 60,20 --keep hills --route=hills
      Along a route over what earlier drives kept, and keeps what this one sees.
  surefoot drive --walkers 3
      Among people who cross the way.
  surefoot drive --goal 30,25 --goal 12,14
      One goal after the other.

Files written to --out:
  drive.png     terrain with hill shading, risk map, vegetation and obstacles,
                the path driven coloured by speed, people's ways, start and goal; below it
                speed, roll and pitch over time
  drive.mcap    poses, commands, the drive log of what the sensors said, elevation
                and risk grids, best rollouts and controller diagnostics; opens
                in Foxglove
  summary.json  outcome, time to goal, path length, largest roll and pitch,
                control and map milliseconds, stops by reason, jumps of the
                localisation, measurements refused, scans and their points, and
                all that is needed to repeat the drive

Outcomes:
  goal            the goal was reached
  rolled_over     the vehicle lies on its side
  attitude_limit  roll or pitch went beyond the vehicle's limit
  stuck           it moved less than 0.1 m in 5 s, stops left out
  out_of_bounds   it left the world
  timeout         --time-limit passed
  stopped         the controller stopped for good, all of --commands were carried out,
                  or Ctrl-C
  collision       body or wheels touched an obstacle
  in_water        a wheel stood in water, whose depth nobody knows
  walker_struck   the moving vehicle touched somebody who walks; summary.json says with
                  was_avoidable whether the plant would have stood in time, had it been
                  told to when it could first be foreseen

Elevation files:
  .npz        elevation [row, col] in metres, row 0 = south, column 0 = west;
              cell in metres; optional layers of the same shape:
              canopy_height [m], low_veg_fraction [0 to 1], water [0 or 1]
  .tif        GeoTIFF, one band of heights in metres
  .png        16-bit greyscale heights, scaled by FILE.png.toml beside it

Deviations (SECONDS and ADDED are added to the described value, FACTORs multiply it):
  steering   steering_delay=SECONDS, steering_response=SECONDS, steering_rate=RAD/S, steering_trim=RAD,
             steering_ratio=LEFT,RIGHT, steering_play=RAD, steering_compliance=RAD/N
  tyres      tyre_grip=FACTOR, tyre_stiffness=FRONT,REAR, rolling_resistance=ADDED, wheel_radius=FACTOR,
             flat_tyre=WHEEL,RADIUS,STIFFNESS,RESISTANCE
  motor      motor_delay=SECONDS, motor_response=SECONDS, motor_ramp=M/S2, motor_torque=NM,
             motor_dead_band=M/S, motor_droop, battery_sag=PER_S, command_drop_out=PERIOD_S,LENGTH_S
  body       mass=FACTOR, slope_pull=ALONG,ACROSS, wind=EAST_N,NORTH_N, drag_area=M2, dense_vegetation=FACTOR,
             trailer=KG,DRAWBAR_M,RESISTANCE, yaw_moment=NM, sway=NM,PERIOD_S
  sensors    pose_latency=SECONDS, odometry_scale=FACTOR, gyro_bias=RAD/S, yaw_misalignment=RAD

Exit codes:
  0  the goal was reached, or all of --commands were carried out
  1  it was not, or a result could not be written; one line on standard error says why
  2  bad usage or input; one line says what was expected and what was found";

#[cfg(test)]
mod tests {
    use super::*;
    use crate::arguments::NavigationGround;
    use clap::Parser;

    #[derive(Parser)]
    struct Only {
        #[command(flatten)]
        drive: DriveArguments,
    }

    fn parse(words: &[&str]) -> DriveArguments {
        Only::try_parse_from(std::iter::once(&"surefoot").chain(words)).unwrap().drive
    }

    #[test]
    fn defaults_are_those_of_the_help() {
        let drive = parse(&[]);
        assert_eq!(drive.world, WorldSource::Rocks);
        assert_eq!((drive.alpha, drive.seed, drive.time_limit), (0.6, 1, 120.0));
        assert_eq!((drive.method, drive.map_source()), (None, MapSource::Sensed));
        assert_eq!(drive.vehicle_name_or_path(), "pietra_full_size");
        assert!(drive.kernels.threads.count() >= 1);
    }

    #[test]
    fn arena_brings_the_small_car_and_its_bushes() {
        let drive = parse(&["--world", "arena"]);
        assert_eq!(drive.vehicle_name_or_path(), "rc_car");
        assert_eq!(drive.bush_height_m(), Ok(0.05), "the help says so");
        assert_eq!(parse(&["--world", "arena", "--bush-height", "0.4"]).bush_height_m(), Ok(0.4));
    }

    #[test]
    fn places_of_the_benchmark_are_told_from_one() {
        let navigation = |ground| WorldSource::Navigation { ground, map: 6, pair: 2 };
        assert_eq!(parse(&["--world", "navigation:7,3"]).world, navigation(NavigationGround::Rocks));
        assert_eq!(parse(&["--world", "fast:7,3"]).world, navigation(NavigationGround::Fast));
        assert!("fast:0,1".parse::<WorldSource>().unwrap_err().contains("fast:MAP,PAIR, both from 1"));
        for wrong in
            ["navigation:0,1", "navigation:1,0", "navigation:1", "navigation:a,1", "navigation:1,1001"]
        {
            let told = wrong.parse::<WorldSource>().unwrap_err();
            assert!(told.contains("navigation:MAP,PAIR, both from 1") && told.contains(wrong), "{told}");
        }
    }

    #[test]
    fn bushes_elsewhere_are_refused() {
        assert!(parse(&["--bush-height", "0.1"]).bush_height_m().is_err());
        assert!(parse(&["--world", "navigation:1,1", "--bush-height", "0.1"]).bush_height_m().is_err());
    }

    #[test]
    fn negative_coordinates_need_no_quoting() {
        let drive = parse(&["--start", "-1,-2,-0.5", "--goal", "-3,4", "--oracle-map"]);
        assert_eq!(drive.start, Some(StartPose { x_m: -1.0, y_m: -2.0, yaw_rad: -0.5 }));
        assert_eq!(drive.goal, [Goal { x_m: -3.0, y_m: 4.0 }]);
        assert_eq!(drive.map_source(), MapSource::Oracle);
    }
}
