//! `surefoot bench`; this file holds `control`, `prior-map`, `navigation` and `learning`.

use std::path::PathBuf;

use ::bench::navigation::{PlannerName, PlannerNameError, Shard};
use bicycle::Vehicle;
use clap::{Args, Subcommand, ValueEnum};
use scenarios::RockFieldConfig;

use super::{Method, values};

/// What can be measured.
#[derive(Clone, Debug, Subcommand)]
pub enum BenchCommand {
    /// One update of the shipped controller
    #[command(long_about = CONTROL_ABOUT)]
    Control(BenchControlArguments),
    /// The risk map of the physics prior, whole and after a part of the ground has changed
    #[command(long_about = PRIOR_MAP_ABOUT)]
    PriorMap(BenchPriorMapArguments),
    /// The risk map of what was learned, whole and after a part of the ground has changed
    #[command(long_about = super::learned_map::LONG_ABOUT)]
    LearnedMap(super::BenchLearnedMapArguments),
    /// How the cost of an update and of a map grows: rollouts, steps, threads, cells, yaws, changed share
    #[command(long_about = super::scaling::LONG_ABOUT)]
    Scaling(super::BenchScalingArguments),
    /// Drives over the same rock fields with every method and risk tolerance
    #[command(long_about = NAVIGATION_ABOUT)]
    Navigation(BenchNavigationArguments),
    /// A car among bushes and a ramp that it never drove on: PIETRA's hall
    #[command(long_about = super::bench_arena::LONG_ABOUT)]
    Arena(super::BenchArenaArguments),
    /// How the risk tolerance decides between a way through bushes and one around them: EVORA's grid
    #[command(long_about = super::risk::LONG_ABOUT)]
    Risk(super::BenchRiskArguments),
    /// Drives among people who cross the way
    #[command(long_about = super::crossings::LONG_ABOUT)]
    Crossings(super::BenchCrossingsArguments),
    /// What friction that is known cell by cell brings the local planner
    #[command(long_about = super::slippery::LONG_ABOUT)]
    Slippery(super::BenchSlipperyArguments),
    /// Causes of wrong beliefs about the ground, withheld from who names them
    #[command(long_about = super::ground::BENCH_ABOUT)]
    Ground(super::BenchGroundArguments),
    /// The simulated machine: its tyre, what its drives teach, and how fast it runs
    #[command(long_about = super::plant::LONG_ABOUT)]
    Plant(super::BenchPlantArguments),
    /// Friction found from drives without labels, beside the truth
    #[command(long_about = super::friction::BENCH_ABOUT)]
    Friction(super::BenchFrictionArguments),
    /// Routes planned with and without knowledge of friction, driven
    #[command(long_about = super::bench_route::ABOUT)]
    Route(super::BenchRouteArguments),
    /// What planning a route takes on this machine, and one over kilometres in tiles
    #[command(long_about = super::bench_route_speed::ABOUT)]
    RouteSpeed(super::BenchRouteSpeedArguments),
    /// Drives of plants with a gap, with nominal, repaired and true models
    #[command(long_about = super::bench_gap::LONG_ABOUT)]
    Gap(super::BenchGapArguments),
    /// How well traction, roll and pitch are foretold on ground unlike that of the training
    #[command(long_about = LEARNING_ABOUT)]
    Learning(BenchLearningArguments),
    /// Laps of a small car with and without learned inverse kinodynamics
    #[command(long_about = super::kinodynamics::BENCH_LONG_ABOUT)]
    Kinodynamics(super::BenchKinodynamicsArguments),
    /// Inverse kinodynamics behind the controller beside a model that adapts inside it, on mixed ground
    #[command(long_about = super::correction::LONG_ABOUT)]
    Correction(super::BenchCorrectionArguments),
}

/// How to measure the controller.
#[derive(Args, Clone, Debug)]
#[command(after_long_help = CONTROL_AFTER_HELP)]
pub struct BenchControlArguments {
    /// How maps and controller compute.
    #[command(flatten)]
    pub kernels: super::KernelArguments,

    /// Updates to measure, after a warm-up
    #[arg(long, value_name = "N", value_parser = values::update_count, default_value = "2000",
          allow_hyphen_values = true)]
    pub updates: usize,

    /// How much the controller has to do
    #[arg(long = "config", value_enum, default_value_t = BenchWork::Bound)]
    pub work: BenchWork,

    /// Where the numbers go, besides the terminal.
    #[command(flatten)]
    pub copy: super::JsonArguments,
}

/// How much the controller has to do.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum BenchWork {
    /// The work of the hand-written bound: time to goal with latch, attitude limits, white noise on the controls
    Bound,
    /// The bound's work with two effects in the model
    Effects,
    /// The default configuration of `surefoot drive`, everything on
    Drive,
}

/// How to measure the risk map.
#[derive(Args, Clone, Debug)]
pub struct BenchPriorMapArguments {
    /// How maps and controller compute.
    #[command(flatten)]
    pub kernels: super::KernelArguments,

    /// Maps to build
    #[arg(long, value_name = "N", value_parser = values::update_count, default_value = "50",
          allow_hyphen_values = true)]
    pub updates: usize,

    /// Where the numbers go, besides the terminal.
    #[command(flatten)]
    pub copy: super::JsonArguments,
}

/// Which drives to do.
#[derive(Args, Clone, Debug)]
#[command(after_long_help = NAVIGATION_AFTER_HELP)]
pub struct BenchNavigationArguments {
    /// What the controller knows of the ground, separated by commas
    #[arg(
        long,
        value_enum,
        value_name = "METHOD,..",
        value_delimiter = ',',
        default_value = "pietra,pietra-avoid,evora,physics-informed,vanilla,physics,nominal,truth"
    )]
    pub methods: Vec<Method>,

    /// Have a planner of your own drive, too, as often as there are planners: this command, which joins the run that
    /// SUREFOOT_RUN names and answers every odometry with a command, see docs/navigation.md
    #[arg(long = "planner", value_name = "NAME=COMMAND", value_parser = planner, help_heading = "Your own planner")]
    pub planners: Vec<PlannerArgument>,

    /// Longest time that a planner may take to join and for one command [s]
    #[arg(long, value_name = "SECONDS", default_value = "60", value_parser = values::timeout_s,
          allow_hyphen_values = true, requires = "planners", help_heading = "Your own planner")]
    pub planner_timeout: f64,

    /// Risk tolerances in (0, 1], separated by commas; truth, nominal and planners of your own know none and are driven once
    #[arg(long, value_name = "LEVEL,..", value_delimiter = ',', value_parser = values::cvar_level,
          default_value = "0.4,0.6,0.8", allow_hyphen_values = true)]
    pub alpha: Vec<f64>,

    /// The machine, a shipped name or a file; without networks of its own it is driven by physics, nominal and truth
    #[arg(long, value_name = "NAME|FILE", default_value = "pietra_full_size")]
    pub vehicle: String,

    /// Fastest speed that is commanded [m/s] [default: the machine's]
    #[arg(long, value_name = "M/S", value_parser = values::speed_mps, allow_hyphen_values = true)]
    pub speed: Option<f64>,

    /// What lies on the ground
    #[arg(long, value_enum, default_value_t = NavigationGround::Rocks)]
    pub ground: NavigationGround,

    /// Maps, 1 to 1000
    #[arg(long, value_name = "N", value_parser = values::map_count, default_value = "10",
          allow_hyphen_values = true)]
    pub maps: u32,

    /// Starts with their goals on each map, 1 to 1000
    #[arg(long, value_name = "N", value_parser = pair_count, default_value = "10", allow_hyphen_values = true)]
    pub pairs: u32,

    /// Seed of the maps, starts, goals, sensor noise and samples
    #[arg(long, value_name = "N", value_parser = values::seed, default_value = "1", allow_hyphen_values = true)]
    pub seed: u64,

    /// Drive over rock fields of your own: a TOML file of what differs from the benchmark's, such as
    /// boulders.density_per_m2 = 0.01
    #[arg(long, value_name = "FILE")]
    pub field: Option<PathBuf>,

    /// Settings of the planner that differ from the machine's, as `surefoot drive --config` takes them (TOML): what one of
    /// them is worth
    #[arg(long, value_name = "FILE")]
    pub config: Option<PathBuf>,

    /// Give up a drive after this much simulated time [s]
    #[arg(long, value_name = "SECONDS", value_parser = values::duration_s, default_value = "120",
          allow_hyphen_values = true)]
    pub time_limit: f64,

    /// What simulates the vehicle
    #[arg(long, value_enum, default_value_t = BenchPlant::Rapier)]
    pub plant: BenchPlant,

    /// Do only the I-th of N parts of the work: every method over the same starts and goals
    #[arg(long, value_name = "I/N", help_heading = "Long work")]
    pub shard: Option<Shard>,

    /// Go on with the drives that --out holds already
    #[arg(long, help_heading = "Long work")]
    pub resume: bool,

    /// Drive nothing and make the table of the drives in these folders, separated by commas
    #[arg(long, value_name = "DIR,..", value_delimiter = ',', help_heading = "Long work",
          conflicts_with_all = ["methods", "planners", "vehicle", "speed", "ground", "alpha", "maps", "pairs", "seed", "field", "config", "time_limit", "plant", "shard", "resume",
                                "threads", "isa"])]
    pub merge: Vec<PathBuf>,

    /// How maps and controller compute.
    #[command(flatten)]
    pub kernels: super::KernelArguments,

    /// Where the results go.
    #[command(flatten)]
    pub results: super::ResultArguments,
}

/// A planner of the user's own.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PlannerArgument {
    /// Under which name it drives.
    pub name: PlannerName,
    /// What starts it.
    pub command: String,
}

/// What simulates the vehicle of a benchmark.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum BenchPlant {
    /// The built-in plant
    Rapier,
    /// MuJoCo, in a build with --features mujoco (docs/plant.md)
    Mujoco,
}

impl From<BenchPlant> for scenarios::Engine {
    fn from(plant: BenchPlant) -> Self {
        match plant {
            BenchPlant::Rapier => Self::Rapier,
            BenchPlant::Mujoco => Self::Mujoco,
        }
    }
}

/// What to train and judge.
#[derive(Args, Clone, Debug)]
#[command(after_long_help = LEARNING_AFTER_HELP)]
pub struct BenchLearningArguments {
    /// Train every method with the seeds 1 to N, at most 1000
    #[arg(long, value_name = "N", value_parser = values::seed_count, default_value = "5",
          allow_hyphen_values = true, help_heading = "Tables")]
    pub seeds: u64,

    /// Seed of the testbed: maps, starts, steering, sensor noise
    #[arg(long, value_name = "N", value_parser = values::seed, default_value = "1", allow_hyphen_values = true,
          help_heading = "Tables")]
    pub seed: u64,

    /// Maps for training, as many for validation and for the test, 1 to 1000
    #[arg(long, value_name = "N", value_parser = values::map_count, default_value = "10",
          allow_hyphen_values = true, help_heading = "Tables")]
    pub maps: u32,

    /// Trials on each map, 1 to 1000
    #[arg(long, value_name = "N", value_parser = values::trial_count, default_value = "20",
          allow_hyphen_values = true, help_heading = "Tables")]
    pub trials: u32,

    /// Passes of each phase of a training at most [default: what the shipped selections say]
    #[arg(long, value_name = "N", value_parser = pass_count, allow_hyphen_values = true, help_heading = "Tables")]
    pub epochs: Option<usize>,

    /// How much is done at a time.
    #[command(flatten, next_help_heading = "Tables")]
    pub threads: super::ThreadArguments,

    /// Judge the posterior on measured traction instead: a map with measured and predicted distributions, density,
    /// heights and classes (.npz)
    #[arg(long, value_name = "FILE", help_heading = "Measured traction",
          conflicts_with_all = ["seeds", "seed", "maps", "trials", "epochs", "threads"])]
    pub traction_map: Option<PathBuf>,

    /// Where the results go.
    #[command(flatten)]
    pub results: super::ResultArguments,
}

fn planner(word: &str) -> Result<PlannerArgument, String> {
    let (name, command) = word.split_once('=').unwrap_or((word, ""));
    let name = name.parse().map_err(|error: PlannerNameError| error.to_string())?;
    Ok(PlannerArgument { name, command: values::command(command)? })
}

/// What lies on the ground of the navigation benchmark.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum NavigationGround {
    /// Boulders to drive around among rocks that the full-size vehicle rolls over: crawling
    Rocks,
    /// Mounds to fly off, crests and a few boulders, in proportion to the vehicle: driving fast
    Fast,
}

impl NavigationGround {
    /// The field for a vehicle.
    pub fn field(self, vehicle: &Vehicle) -> RockFieldConfig {
        match self {
            Self::Rocks => RockFieldConfig::navigation(),
            Self::Fast => RockFieldConfig::fast(vehicle.geometry.length_m),
        }
    }
}

fn pair_count(word: &str) -> Result<u32, String> {
    values::count(word, 1000, "pairs").map(|n| n as u32)
}

fn pass_count(word: &str) -> Result<usize, String> {
    values::count(word, 65_536, "passes")
}

const CONTROL_ABOUT: &str = "\
Measures one update of the controller that `surefoot drive` uses: 1024 rollouts of 50 steps over a risk map of \
81 x 96 cells and 13 yaws, with fresh noise every update.";

const PRIOR_MAP_ABOUT: &str = "\
Measures the risk map of the physics prior over 81 x 96 cells and 13 yaws: built whole, and brought up to date \
after one contiguous block of 2 % of the cells has changed.";

const NAVIGATION_ABOUT: &str = "\
Drives 40 m over rock fields again and again: every method, every risk tolerance, over the same maps, starts and goals \
(PIETRA, figure 7). Says how often the goal was reached, with the 95 % Wilson interval, how long that took, how every \
other drive failed, what the methods are worth against one another on the same starts, and whether the rules that were \
fixed beforehand hold. The exit code is 0 once all drives are done, however they ended and whether the rules hold or \
not.";

const NAVIGATION_AFTER_HELP: &str = "\
Writes navigation.png, navigation.html, every drive as it ends into navigation.jsonl, with several alphas
navigation_alpha.png (success, time and tilt over alpha), and navigation.json with
  rows         of each method and alpha: n, n_goal, success, wilson_low, wilson_high, median_time_to_goal_s,
               largest_tilt_deg (mean, bootstrap), outcomes
  comparisons  of two rows on the same starts: n, n_only_one, n_only_other, p_value (exact McNemar),
               time_difference_s where both arrived (mean, low, high: bootstrap)
  verdicts     rule, found, is_passed
  drives       of each map and pair, from 0: outcome, time_s, path_length_m, distance_to_goal_m, largest_roll_deg,
               largest_pitch_deg, failed_at_m, stops
Rows and drives of a planner of your own also have compute: n_cycles, median_ms and p99_ms of its commands by the
machine's clock. It is compared with pietra on the same starts; the rules are of the methods alone.
What is broken off goes on with --resume. Parts that --shard did on several machines become one table with --merge; it
is the table of one run to the byte, for any number of threads.

Example, half a minute:
  surefoot bench navigation --methods physics,nominal --alpha 0.6 --maps 1 --pairs 1
Example, what the risk tolerance does to one method:
  surefoot bench navigation --methods pietra,truth --alpha 0.1,0.2,0.4,0.6,0.8,1 --maps 5 --pairs 4
Example, the same in another physics engine (docs/plant.md says how to build it):
  surefoot bench navigation --plant mujoco --methods physics,nominal --alpha 0.6 --maps 1 --pairs 1
Example, days in pieces:
  surefoot bench navigation --out table; surefoot bench navigation --out table --resume
Example, one of 40 jobs of an array, and what its last one does:
  surefoot bench navigation --shard 7/40 --out part7
  surefoot bench navigation --merge part1,part2,part3 --out table
Example, a planner of your own beside two methods on the first pair of every map:
  surefoot bench navigation --planner \"mine=python my_planner.py\" --methods pietra,nominal --alpha 0.6 --pairs 1";

const LEARNING_ABOUT: &str = "\
Repeats PIETRA's learning benchmark: drives a testbed of rock fields, trains six methods on its even ground with every \
seed, and judges them on fields whose heights are scaled until 90 to 92 % of the footprints are more uneven than half \
of the training drives. Prints tables I and II and the numbers of figure 6, how much evidence there is on familiar, \
uneven and absurd ground, calibration, and for every rule that was fixed beforehand whether it holds. Hyperparameters \
are those of the shipped search on validation data. The exit code is 0 whether the rules hold or not.

With --traction-map it judges what a network predicts about ground it never saw against the traction that was measured \
there: its prediction as it is, fused by density with the uniform distribution (EVORA) and with a physics prior of a \
skid-steered machine (PIETRA), the prior alone, and a switch between the two. Nothing is fitted to the measured \
traction.";

const LEARNING_AFTER_HELP: &str = "\
Writes learning.png, learning.html and learning.json with
  testbed, settings  what was driven and trained
  rows               of every method: overall, in_distribution, out_of_distribution, each with total, heads,
                     ratio_to_uniform, excess and calibration; curve (figure 6); published
  achievable         an upper bound of the irreducible error: networks trained on other maps of the test's kind
  unevenness_bins, evidence, verdicts, took_s
Errors are EMD2 in squared bins, summed over linear traction, angular traction, |roll| and |pitch|, mean and standard
deviation over the seeds; null where nothing was measured.

With --traction-map writes traction_map.png, and traction_map.json with
  n_cells, n_out_of_distribution, n_obstructed, n_blocks, prediction_weight
  linear, angular  of every source: emd2, less_prediction, less_prior, over_uniform, each with value, low and high
                   (95 %, bootstrap over blocks of 5 m); density_auroc

Example, a quarter of an hour:
  surefoot bench learning --seeds 5
Example, half a minute:
  surefoot bench learning --seeds 1 --maps 2 --trials 4 --epochs 5
Example, measured traction:
  surefoot bench learning --traction-map forest.npz";

const CONTROL_AFTER_HELP: &str = "\
Prints JSON, and with --json writes it to a file too:
  threads, updates, config, isa
  ms        min, median, p99 of an update
  split_ms  medians of its parts: rollout (with the noise that it takes), update

Examples:
  surefoot bench control --threads 1
  surefoot bench control --threads 2 --updates 10000 --config drive --json control.json";
