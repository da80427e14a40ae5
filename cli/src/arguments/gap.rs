//! `surefoot gap`; this file holds `diagnose` and `apply`.

use std::path::PathBuf;

use clap::{Args, Subcommand, ValueEnum};

use super::values;

/// What can be asked about the gap between simulator and robot.
#[derive(Clone, Debug, Subcommand)]
pub enum GapCommand {
    /// Say where simulator and robot disagree, which effect causes it and how far the gap shrinks
    #[command(long_about = DIAGNOSE_ABOUT)]
    Diagnose(Box<GapDiagnoseArguments>),
    /// Put the effects of a diagnosis into the controller's model
    #[command(long_about = APPLY_ABOUT)]
    Apply(GapApplyArguments),
    /// Say where the belief about the ground and what drives met on it part, and what has changed
    #[command(long_about = super::ground::GAP_ABOUT)]
    Ground(super::GapGroundArguments),
    /// List the effects that a diagnosis knows: equations, parameters and what each does to a drive
    Effects(GapEffectsArguments),
    /// Make cases with withheld causes, to try a diagnosis on
    #[command(long_about = super::gap_check::SEAL_ABOUT)]
    Seal(super::GapSealArguments),
    /// Diagnose a set of cases and hold the answers against their labels
    #[command(long_about = super::gap_check::SCORE_ABOUT)]
    Score(super::GapScoreArguments),
}

/// Where the catalogue goes.
#[derive(Args, Clone, Debug)]
#[command(after_long_help = EFFECTS_AFTER_HELP)]
pub struct GapEffectsArguments {
    /// Write the catalogue as effects.md with a picture of every effect's signature into this folder, which is made if
    /// missing; without it, the catalogue is printed
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
}

const EFFECTS_AFTER_HELP: &str = "\
Examples:
  surefoot gap effects
  surefoot gap effects --out docs";

/// Which drives to diagnose, and where the answer goes.
#[derive(Args, Clone, Debug)]
#[command(after_long_help = DIAGNOSE_AFTER_HELP)]
pub struct GapDiagnoseArguments {
    /// Folder with a case.toml, or such a file
    #[arg(required_unless_present = "vehicle", conflicts_with_all = ["vehicle", "sim", "real", "heldout"])]
    pub case: Option<PathBuf>,

    /// Vehicle: a file of a case's kind, one of --vehicle of `surefoot drive`, or the name of a shipped one
    #[arg(long, value_name = "VEHICLE", requires = "real", help_heading = "Drives without a case file")]
    pub vehicle: Option<String>,

    /// Nominal drives: what the simulator did: .csv, .mcap, or bags of ROS 2
    ///
    /// Without any, the gap to the bare kinematic bicycle is diagnosed: the physics that every vehicle has can then
    /// not be told from what this one adds.
    #[arg(long, value_name = "FILE", num_args = 1.., value_delimiter = ',',
          help_heading = "Drives without a case file")]
    pub sim: Vec<PathBuf>,

    /// Drives of the robot to find the cause in: .csv, .mcap, or bags of ROS 2
    #[arg(long, value_name = "FILE", num_args = 1.., value_delimiter = ',', requires = "vehicle",
          help_heading = "Drives without a case file")]
    pub real: Vec<PathBuf>,

    /// Drives of the robot to verify the answer on; opened after the prediction stands
    #[arg(long, value_name = "FILE", num_args = 1.., value_delimiter = ',',
          help_heading = "Drives without a case file")]
    pub heldout: Vec<PathBuf>,

    /// Columns of CSV drives that have names of their own, and topics of bags, separated by commas: ours=theirs
    ///
    /// Of bags, odometry, command and imu are topics: odometry=/ekf/odom,command=/drive. Of those that are not named the
    /// only one of a fitting type counts.
    /// Ours are t, run, x, y, z, roll, pitch, yaw, vx, vy, wz, cmd_speed, cmd_steer and the others of a drive log. A file
    /// without the named column is read as it is.
    #[arg(
        long,
        value_name = "OURS=THEIRS,..",
        value_delimiter = ',',
        help_heading = "Drives without a case file"
    )]
    pub map: Vec<String>,

    /// Robot file whose part [ros] says topics, frames and clock of drives that are bags; --map goes before its topics
    #[arg(long, value_name = "FILE", help_heading = "Drives without a case file")]
    pub robot: Option<PathBuf>,

    /// Estimate this of the robot's pose sensor first, from its drives alone, and take it out of them
    ///
    /// For poses that were recorded by another clock than the rest, or of an antenna that does not sit over the rear axle.
    /// What was found is told with its interval, and the held-out drives are corrected by the same. A pose that is late in
    /// the robot and not in the simulator is no cause any more then.
    #[arg(long, value_name = "WHAT,..", value_enum, value_delimiter = ',')]
    pub estimate: Vec<PoseUnknown>,

    /// Where the answer goes, besides the folder.
    #[command(flatten)]
    pub copy: super::JsonArguments,

    /// Folder for the report, its pictures and the answer; made if missing, earlier files are replaced
    /// [default: surefoot-out, unless --json or --predictions is given]
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,

    /// Write every prediction of a held-out measurement to this file (CSV)
    #[arg(long, value_name = "FILE")]
    pub predictions: Option<PathBuf>,

    /// Design the drive that would separate what these leave open, and write its commands to this file (CSV), for
    /// `surefoot drive --commands` [default: manoeuvre.csv beside the report, if there is one]
    #[arg(long, value_name = "FILE")]
    pub manoeuvre: Option<PathBuf>,

    /// Fit a learned correction to what is left and tell how much it closes of the held-out drives: what no model could
    /// surpass by far; always done for a report
    #[arg(long)]
    pub learned_bound: bool,

    /// End with exit code 3 if the simulator misses the held-out drives by more than ERROR times what it misses its own by
    ///
    /// 1 is what one nominal drive shows against the others; below 1.2 there is no gap. With --simulator, it is your
    /// simulator itself that is measured, else the model that was calibrated on its drives. Everything is written all the
    /// same.
    #[arg(long, value_name = "ERROR", value_parser = values::limit, allow_hyphen_values = true)]
    pub fail_above: Option<f64>,

    /// The controller's model to begin with (TOML), else the one that the simulator's drives calibrate
    ///
    /// What is announced is fitted beside its effects for `surefoot gap apply`; what is announced does not depend on it.
    #[arg(long, value_name = "IN.toml")]
    pub model: Option<PathBuf>,

    /// Who decides besides the calibrated model.
    #[command(flatten)]
    pub simulator: GapSimulatorArguments,

    /// Folder that keeps what was calibrated on nominal drives, for the next case of the same vehicle
    /// [default: surefoot/baselines in the user's cache folder]
    #[arg(long, value_name = "DIR")]
    pub baseline_cache: Option<PathBuf>,
}

/// What is not known of a pose sensor.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum PoseUnknown {
    /// How late its poses are against speed and yaw rate, at most half a second
    TimeOffset,
    /// Where it sits, ahead and to the left of the middle of the rear axle
    LeverArm,
}

/// The user's own simulator.
#[derive(Args, Clone, Debug)]
pub struct GapSimulatorArguments {
    /// Let this simulator decide: a command that speaks JSON lines on standard input and output
    ///
    /// The likeliest effects on commands and sensors are wrapped around it, its own knobs are turned, and what brings it
    /// nearest to the robot is told and verified in it. The protocol is in docs/simulator_protocol.md, a simulator that
    /// speaks it in examples/python/double_track_simulator.py.
    #[arg(long, value_name = "COMMAND", value_parser = values::command, help_heading = "Your own simulator")]
    pub simulator: Option<String>,

    /// Instances of the simulator that run side by side
    #[arg(long, value_name = "N", default_value = "1", value_parser = values::simulator_count,
          allow_hyphen_values = true, requires = "simulator", help_heading = "Your own simulator")]
    pub simulators: usize,

    /// Longest time that it may take for one drive [s]
    #[arg(long, value_name = "SECONDS", default_value = "60", value_parser = values::timeout_s,
          allow_hyphen_values = true, requires = "simulator", help_heading = "Your own simulator")]
    pub simulator_timeout: f64,
}

impl GapDiagnoseArguments {
    /// Folder of the report: as asked, else `surefoot-out` unless the answer goes elsewhere.
    pub fn report_folder(&self) -> Option<PathBuf> {
        let goes_elsewhere = self.copy.json.is_some() || self.predictions.is_some();
        self.out.clone().or_else(|| (!goes_elsewhere).then(|| PathBuf::from("surefoot-out")))
    }
}

/// Which model to repair.
#[derive(Args, Clone, Debug)]
#[command(after_long_help = APPLY_AFTER_HELP)]
pub struct GapApplyArguments {
    /// The answer that `surefoot gap diagnose` has written (JSON)
    pub diagnosis: PathBuf,

    /// What the controller believes so far (TOML): wheelbase, limits, effects
    #[arg(long, value_name = "IN.toml")]
    pub model: PathBuf,

    /// Where the repaired model goes
    #[arg(long, value_name = "OUT.toml")]
    pub out: PathBuf,

    /// Apply the effects of a diagnosis that leaves a part of the gap unknown as well
    ///
    /// What stands for something that the catalogue does not know foretells the drives that it was fitted to, and may be
    /// wrong on others.
    #[arg(long)]
    pub force: bool,
}

const DIAGNOSE_ABOUT: &str = "\
Says where simulator and robot disagree, which unmodelled effect causes it, and how far the gap shrinks once that \
effect is added.

The simulator's own drives come first: they calibrate what the kinematic bicycle cannot do although nothing is wrong, \
and show how much two nominal drives differ anyway. Against that the robot's drives are held: effects of the \
catalogue are added one at a time as long as they explain more than chance. Last, the held-out drives are opened and \
the shrinkage that was predicted is verified on them. 'none' and 'unknown' are answers too, and where the drives \
cannot tell explanations apart, all of them are named.";

const DIAGNOSE_AFTER_HELP: &str = "\
Examples:
  surefoot gap diagnose cases/steering
      The case described by cases/steering/case.toml; report in surefoot-out.
  surefoot gap diagnose cases/steering --json answer.json --predictions rollouts.csv
      Only the answer and the predictions, for a script.
  surefoot gap diagnose --vehicle car.toml --sim sim_1.csv sim_2.csv sim_3.csv \\
      --real monday.csv tuesday.mcap --heldout friday.csv --out report
      Drives without a case file. At least three nominal and two real drives of 40 s, with
      turns and changes of speed in them, tell the most.
  surefoot gap diagnose cases/steering --simulator \"python3 my_sim.py\" --simulators 4
      Your own simulator decides: what it lacks, which of its parameters are off, and how
      far the gap shrinks in it.
  surefoot gap diagnose cases/own --map t=stamp,vx=wheel_speed
      Logs whose columns have names of their own.
  surefoot gap diagnose --vehicle car.toml --sim sim_1.csv sim_2.csv sim_3.csv \\
      --real a/gnss.csv+can.csv b/gnss.csv+can.csv --estimate time-offset,lever-arm
      Every drive in several files of other rates, poses by another clock and of an antenna.
  surefoot gap diagnose --vehicle rc_car --sim nominal_bag --real bag_1,bag_2 --map odometry=/odom,command=/drive
      Drives out of bags of ROS 2.
  surefoot gap diagnose cases/nightly --fail-above 1.5 --json answer.json
      A gate for a build: exit code 3 once simulator and robot have come apart.
  surefoot gap apply report/answer.json --model model.toml --out repaired.toml
  surefoot drive --model repaired.toml
      The controller plans with what was found.

case.toml:
  name, vehicle (path), sim, real, heldout (lists of paths); from the case's folder

Vehicle file:
  name, wheelbase [m]             needed
  max_steer [rad], max_speed [m/s]
                                  else the largest command of the drives
  [noise] x, y [m], yaw [rad], vx [m/s], wz [rad/s]
                                  standard deviations; else estimated
  [map] heightmap, terrain_class (CSV: row = x, column = y), resolution,
        origin_x, origin_y [m]    the ground; else level

Drives:
  needed columns   t, and a command: cmd_speed, cmd_steer or steer_meas
                   (cmd_wz for a skid-steered machine)
  used if there    x, y, yaw, vx, vy, wz, roll, pitch; run (t restarts per run)
  A drive may lie in several files with + between them (pose.csv+can.csv), of one
  clock and each with columns and a rate of its own; those after the first are
  looked for beside it. Columns of a slower sensor are filled in between, unless
  it is silent for one and a half of its usual period.
  Gaps and leaps split a drive, which is told. Degrees, km/h, a mirrored sign,
  standstill and their like are refused with what gave them away.

Files in --out:
  report.html      everything below on one page, without network
  answer.json      the answer, as --json
  manoeuvre.csv    what to drive next, where something is left open
  prediction.json  the answer before the held-out drives were opened
  *.png            places, residuals, map, ranking, a held-out drive

Exit codes:
  0  the diagnosis stands, whatever it says
  1  it failed; one line on standard error says why
  2  bad usage or input; one line says what was expected and what was found
  3  the diagnosis stands and the gap is larger than --fail-above; one line says by how much";

const APPLY_ABOUT: &str = "\
Puts what a diagnosis measured for the controller into its model, and never into the plant.

Wheelbase and limits stay. The effects become those that were measured: what the simulator's drives calibrated, or the \
effects of the model that `gap diagnose --model` began with, and beside them what was announced as it fits there; or \
all of it fitted to the robot's drives, or none of it, whichever foretells drives best that were left out. An older \
answer, which measured none, has its effects put after those of the model. Effects of the sensors correct the state \
estimate.";

const APPLY_AFTER_HELP: &str = "\
Examples:
  surefoot gap apply surefoot-out/answer.json --model model.toml --out repaired.toml
  surefoot drive --model repaired.toml --seed 3

Exit codes:
  0  the model was written; 'none' adds nothing to what was calibrated
  1  it was not; one line on standard error says why
  2  bad usage or input, a diagnosis that names no effect ('unknown'), or one that leaves
     a part unknown ('effects_and_unknown') without --force";
