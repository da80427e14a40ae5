//! The command line: what can be asked, in which units, and what each word must look like.

mod bench;
mod bench_arena;
mod bench_gap;
mod bench_route;
mod bench_route_speed;
mod collect;
mod convert;
mod correction;
mod crossings;
mod deviation;
mod doctor;
mod drive;
mod friction;
mod gap;
mod gap_check;
mod ground;
mod inspect;
mod kernels;
mod kinodynamics;
mod learned_map;
mod map;
mod orders;
mod plant;
mod play;
mod replay;
mod results;
mod risk;
mod robot;
mod route;
mod scaling;
mod slippery;
mod train;
mod up;
mod values;

use clap::{Parser, Subcommand};

pub use bench::{
    BenchCommand, BenchControlArguments, BenchLearningArguments, BenchNavigationArguments,
    BenchPriorMapArguments, BenchWork, NavigationGround, PlannerArgument,
};
pub use bench_arena::BenchArenaArguments;
pub use bench_gap::BenchGapArguments;
pub use bench_route::BenchRouteArguments;
pub use bench_route_speed::BenchRouteSpeedArguments;
pub use collect::{CollectArguments, CollectMap, CollectSplit, CollectWorld};
pub use convert::ConvertArguments;
pub use correction::{BenchCorrectionArguments, CorrectionMethod};
pub use crossings::{BenchCrossingsArguments, CrossingHandling};
pub use deviation::AskedDeviation;
pub use doctor::DoctorArguments;
pub use drive::{Correct, DriveArguments, MapSource, Method, Pace};
pub use friction::{BenchFrictionArguments, FrictionSource, TrainFrictionArguments};
pub use gap::{
    GapApplyArguments, GapCommand, GapDiagnoseArguments, GapEffectsArguments, GapSimulatorArguments,
    PoseUnknown,
};
pub use gap_check::{GapScoreArguments, GapSealArguments};
pub use ground::{BenchGroundArguments, GapGroundArguments};
pub use inspect::InspectArguments;
pub use kernels::{InstructionSet, KernelArguments, ThreadArguments};
pub use kinodynamics::{
    BenchKinodynamicsArguments, KinodynamicsAnswer, KinodynamicsEffect, KinodynamicsFilter,
    KinodynamicsLabelArguments, KinodynamicsRows, KinodynamicsSensing, KinodynamicsSpeed,
    TrainKinodynamicsArguments,
};
pub use learned_map::{BenchLearnedMapArguments, NetworkSizes};
pub use map::MapArguments;
pub use orders::{AlphaArguments, AskedRun, GoalArguments, PathArguments};
pub use plant::BenchPlantArguments;
pub use play::PlayArguments;
pub use replay::ReplayArguments;
pub use results::{JsonArguments, ResultArguments};
pub use risk::BenchRiskArguments;
pub use robot::RobotArguments;
pub use route::{BareGround, GroundKinds, RouteArguments, RouteGround};
pub use scaling::BenchScalingArguments;
pub use slippery::BenchSlipperyArguments;
pub use train::{TrainArguments, TrainCommand};
pub use up::{LogLevel, UpArguments, UpRole};
pub use values::{Goal, StartPose, WorldSource, place_with_minus};

/// Everything after `surefoot`.
#[derive(Debug, Parser)]
#[command(
    name = "surefoot",
    version = concat!(env!("CARGO_PKG_VERSION"), " (revision ", env!("SUREFOOT_REVISION"), ")"),
    about = "Drives a ground vehicle where there is no road",
    long_about = LONG_ABOUT,
    after_long_help = AFTER_HELP,
    arg_required_else_help = false,
    subcommand_required = true
)]
pub struct Arguments {
    /// What to do.
    #[command(subcommand)]
    pub command: Command,
}

/// The commands.
#[derive(Debug, Subcommand)]
pub enum Command {
    /// Drive a simulated vehicle over rough ground to a goal
    #[command(long_about = drive::LONG_ABOUT)]
    Drive(Box<DriveArguments>),
    /// Drive with every part a process of its own, as on a robot
    #[command(long_about = up::LONG_ABOUT)]
    Up(Box<UpArguments>),
    /// Send a run to goals, one after the other
    Goal(GoalArguments),
    /// Send a run along a path
    Path(PathArguments),
    /// Let a run stand, and go on with `resume`
    Pause(AskedRun),
    /// Go on after `pause`, `manual` or `reset`
    Resume(AskedRun),
    /// Drop the mission of a run: it stands and waits for the next
    Cancel(AskedRun),
    /// Give the wheel to an operator, until `resume`: the run commands to stand meanwhile
    Manual(AskedRun),
    /// Stop a run, whatever else is said, until `reset`
    Estop(AskedRun),
    /// End an emergency stop; nothing moves before `resume` or the next goal
    Reset(AskedRun),
    /// Change the risk tolerance of a run
    Alpha(AlphaArguments),
    /// Write a robot file from a URDF and a bag of ROS 2
    #[command(long_about = robot::LONG_ABOUT)]
    Robot(RobotArguments),
    /// Check the machine and, if one is there, the sensors and processes of a run
    #[command(long_about = doctor::LONG_ABOUT)]
    Doctor(DoctorArguments),
    /// Make every decision of a recording again, to the last bit
    #[command(long_about = replay::LONG_ABOUT)]
    Replay(ReplayArguments),
    /// Feed a bag of ROS 2 through the pipeline, and show what it would have decided
    #[command(long_about = play::LONG_ABOUT)]
    Play(PlayArguments),
    /// Make a bag of ROS 2 of recordings
    #[command(long_about = convert::LONG_ABOUT)]
    Convert(ConvertArguments),
    /// Search a route over measured ground, and the fastest speeds along it
    #[command(long_about = route::LONG_ABOUT)]
    Route(RouteArguments),
    /// Merge what files and vehicles know of the ground into a map for routes that outgrows memory
    #[command(long_about = map::LONG_ABOUT)]
    Map(MapArguments),
    /// Say what a recording, an elevation map, a vehicle or networks hold
    #[command(long_about = inspect::LONG_ABOUT)]
    Inspect(InspectArguments),
    /// Gather data to learn from, by simulated drives or from a recorded one
    #[command(long_about = collect::LONG_ABOUT)]
    Collect(Box<CollectArguments>),
    /// Fit the networks to gathered data
    Train {
        /// What to fit.
        #[command(subcommand)]
        command: TrainCommand,
    },
    /// Measure how fast the controller and the risk map are, and how often drives reach their goal
    Bench {
        /// What to measure.
        #[command(subcommand)]
        command: BenchCommand,
    },
    /// Find out why the simulator and the robot disagree, and repair the controller's model
    Gap {
        /// What to ask.
        #[command(subcommand)]
        command: GapCommand,
    },
}

const LONG_ABOUT: &str = "\
Drives a ground vehicle where there is no road.

Surefoot maps the ground from range scans, asks physics how well the vehicle would move and how far it would tilt \
on every cell and heading, keeps the worst outcome that is likely enough to matter (CVaR), and steers by sampling \
a thousand futures ten times a second.";

const AFTER_HELP: &str = "\
Examples:
  surefoot drive                        40 m over a generated rock field, nothing else needed
  surefoot drive --world arena          an RC car in a hall with a ramp and bushes
  surefoot drive --help                 every option, with its unit and default
  surefoot up                           the same drive by processes that survive one another
  surefoot doctor                       whether machine and sensors are fit for it
  surefoot goal 30,25 40,10             where that run shall go next
  surefoot route --world hills.npz --start 20,20,0.8 --goal 250,240
                                        a way over measured ground, and how fast to drive it
  surefoot collect                      data to learn from, out of 200 simulated trials
  surefoot train traversability --train train.safetensors --validation validation.safetensors
                                        networks that know what the drives have taught
  surefoot bench control --threads 2    milliseconds of one control update
  surefoot gap diagnose CASE            why simulator and robot disagree, and how far that can be mended

Units are SI: metres, seconds, radians. x points east, y north; yaw is counter-clockwise from east.

Exit codes:
  0  success
  1  the work failed; one line on standard error says why
  2  bad usage or input; one line says what was expected and what was found";

#[cfg(test)]
mod tests {
    use super::*;
    use clap::CommandFactory;

    #[test]
    fn command_definition_is_consistent() {
        Arguments::command().debug_assert();
    }
}
