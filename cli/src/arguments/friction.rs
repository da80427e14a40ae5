//! `surefoot train friction` and `surefoot bench friction`.

use clap::{Args, ValueEnum};

use super::values;

/// Which drives to learn friction from.
#[derive(Args, Clone, Debug)]
#[command(after_long_help = TRAIN_AFTER_HELP)]
pub struct TrainFrictionArguments {
    /// Drive log (CSV) with a column `ground`, or FILE=GROUND for a drive on one ground; or recordings over pictures from above
    /// (.safetensors); several follow each other
    #[arg(long, value_name = "FILE[=GROUND]", num_args = 1.., required = true)]
    pub train: Vec<String>,

    /// The machine, a shipped name or a path
    #[arg(long, value_name = "NAME|FILE", default_value = "pietra_full_size")]
    pub vehicle: String,

    /// Names that the logs give to columns
    #[arg(long, value_name = "OURS=THEIRS,..", value_delimiter = ',')]
    pub columns: Vec<String>,

    /// Where the results go.
    #[command(flatten)]
    pub results: super::ResultArguments,
}

pub(super) const TRAIN_ABOUT: &str = "\
Finds how much each ground holds from the vehicle's own drives: no images, no labels of friction, only the class of the \
ground under each row.

Four wheels under one rigid body are held against what the inertial unit felt (AnyNav, sections 3.2 and 3.3.2): the \
coefficients of every class, and with them the tyres' stiffness, the inertia, the scale of the wheel speed, the trim of the \
steering and the unit's bias, are those under which the forces follow from the slip. Where tyres slid, a friction \
coefficient with an interval of 90 % is the result. Where they never came near their limit nobody can know how much \
more the ground holds: the result is \"at least\" what was used.";

const TRAIN_AFTER_HELP: &str = "\
Writes friction.toml, which `surefoot route --friction` reads in place of the published coefficients: for each ground the
curve to plan with, found or published, and what is known of its friction.

A drive log has the columns t, wheel_speed, wz, steer_meas or cmd_steer, and vx and vy or x, y and yaw; ax and ay of an
inertial unit at the rear axle, roll and pitch make it better. Grounds: asphalt, rock, dirt, grass, mud, sand, ice.

From recordings over pictures a network learns to see friction, and is written as friction.safetensors: from the motion, and
where every recording tells the class of its pixels, from published coefficients as well. A recording is a file of
safetensors with `image` (F32 [4, rows, columns]: red, green, blue from 0 to 1, height in metres; row 0 in the south), `moments`
(F64 [instants, 15]: t, x, y, yaw, vx, vy, wz, four wheel speeds, steering, ax, ay and wz of the inertial unit; every 0.1 s or
more often), if known `classes` (U8 [rows, columns], 0 asphalt to 6 ice) and resolution_m, west_m and south_m in its header.

Examples:
  surefoot train friction --train meadow.csv=grass lake.csv=ice --vehicle sedan
  surefoot train friction --train mixed.csv --vehicle mine.toml
  surefoot route --world hills.npz --start 20,20,0.8 --goal 250,240 --friction friction.toml";

/// Which simulated drives to find friction from.
#[derive(Args, Clone, Debug)]
#[command(after_long_help = BENCH_AFTER_HELP)]
pub struct BenchFrictionArguments {
    /// What friction is found from
    #[arg(long, value_enum, default_value = "drives")]
    pub from: FrictionSource,

    /// The machines, shipped names or paths, separated by commas [default: sedan,pietra_full_size, and from drives also
    /// buggy_fifth,ut_automata]
    #[arg(long, value_name = "NAME|FILE,..", value_delimiter = ',')]
    pub vehicles: Vec<String>,

    /// Drives of each machine; from pictures those of the test
    #[arg(long, value_name = "N", value_parser = values::seed_count, default_value = "10",
          allow_hyphen_values = true)]
    pub seeds: u64,

    /// The first seed; what is published comes from 1000 on, which nothing was developed on
    #[arg(long, value_name = "N", value_parser = first_seed, default_value = "1000",
          allow_hyphen_values = true)]
    pub first_seed: u64,

    /// How much of the machine to use.
    #[command(flatten)]
    pub threads: super::ThreadArguments,

    /// Where the results go.
    #[command(flatten)]
    pub results: super::ResultArguments,
}

/// Where friction comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum FrictionSource {
    /// Drives over grounds of known classes, without labels of friction
    Drives,
    /// Pictures of the ground from above: the paper's tables 1, 2, 4 and 5
    Pictures,
}

impl BenchFrictionArguments {
    /// The machines asked for, or those of the published tables.
    pub fn vehicles(&self) -> Vec<String> {
        let usual: &[&str] = match self.from {
            FrictionSource::Drives => &["sedan", "pietra_full_size", "buggy_fifth", "ut_automata"],
            FrictionSource::Pictures => &["sedan", "pietra_full_size"],
        };
        if self.vehicles.is_empty() {
            usual.iter().map(|name| (*name).to_owned()).collect()
        } else {
            self.vehicles.clone()
        }
    }
}

/// Leaves room above for as many as may be driven.
fn first_seed(word: &str) -> Result<u64, String> {
    let seed = values::seed(word)?;
    let most = u64::from(u32::MAX);
    if seed <= most {
        Ok(seed)
    } else {
        Err(format!("expected a whole number from 0 to {most}, found {word}"))
    }
}

pub(super) const BENCH_ABOUT: &str = "\
Finds friction without labels on drives of the plant whose friction is known, and holds it against the truth.

Every drive of 120 s crosses stripes of three grounds, each with its published friction times 0.6 to 1.4, some driven hard and \
some gently. Sensors are noisy; the stated inertia is off by up to 30 %, the wheel speed by up to 2 %.

With --from pictures a network sees friction in pictures from above (AnyNav, sections 3.1 to 3.3.1): it learns from drives \
over worlds of seven textured grounds, from motion, from published coefficients and from both, and predicts two seconds of \
motion over worlds of textures, light and season that it never saw, beside a kinematic bicycle, a particle filter, a residual \
network and one friction for all ground. Then (section 3.3.2) inertial unit, wheel speeds and localisation err, the stated \
inertia is off by 30 % and nobody tells classes: what drives say of places is found along with inertia and wheel speed, and \
learned as if it had been told.";

const BENCH_AFTER_HELP: &str = "\
Writes friction.png, and friction.json with
  rows      of each ground of each drive: truth and answer
  score     shares, with their cases
  verdict   whether each part of the rule holds

With --from pictures: friction.png, the network as friction.safetensors, and friction.json with
  rows        of each method: errors over all windows, and by ground
  grounds     friction as seen, by class
  tuned_rows  the same with biased sensors and without labels
  vehicles    what was found of each along with the ground
  verdicts    whether each part of the rule holds

Examples:
  surefoot bench friction --vehicles sedan --seeds 5 --first-seed 1
  surefoot bench friction --from pictures
  surefoot bench friction --from pictures --vehicles sedan,pietra_full_size,examples/side_by_side.toml";
