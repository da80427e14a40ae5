//! # Surefoot
//!
//! A real-time local planner for ground vehicles that drive where there is no road, and a tool that says why simulator
//! and robot disagree. This page is the guide to its crates; the README beside the code has commands and figures,
//! `ARCHITECTURE.md` the rules that the code keeps.
//!
//! ## The flow
//!
//! Ten times a second, from left to right and never back:
//!
//! | what | is made of it | by |
//! |---|---|---|
//! | scan, odometry | a map of the ground: heights, variance, plants, obstacles, holes | [`terrain`] |
//! | the ground | what it does to the vehicle as distributions of traction, roll and pitch | [`physics_prior`] |
//! | drives | what was learned from them, weighed against physics by how much like the training the ground is | [`evidential`] |
//! | distributions | the worst that is likely enough to matter, for every cell and heading: the [risk map](traversability::RiskMap) | [`traversability`] |
//! | risk map, goal | 1024 futures of the [model](bicycle::Model), and out of them one [decision](bicycle::Decision) | [`mppi`], [`bicycle`] |
//!
//! [`navigator`] is this chain as parts that tell one another messages, and as one object with two calls,
//! [`observe`](navigator::Navigator::observe) and [`decide`](navigator::Navigator::decide). The controller does not know
//! who made its map: a constant one drives it as well.
//!
//! Around it:
//!
//! - [`kinodynamics`]: which command does what is wanted on the ground that the inertial measurement unit feels.
//! - [`route`](::route): a route over kilometres of measured ground, and the speeds along it.
//! - [`friction`]: how much each ground holds, from the vehicle's own drives.
//! - [`tracking`]: what moves, how, and where it will be.
//! - [`scenarios`]: the truth that all of it is tested against: worlds, a plant of rigid bodies and tyres, sensors,
//!   episodes.
//! - [`bus`]: the contract with a vehicle: messages in shared memory, channels, ages, watchdog.
//! - [`runtime`]: the chain as processes over these channels, with recorder and replay.
//! - [`simulator`]: the simulated vehicle as one driver of that contract.
//! - [`ros`]: a robot's topics in ROS 2 as another.
//! - [`sim_to_real`]: which effect separates recorded drives of a robot from those of its simulator.
//! - [`formats`]: every file that is read or written.
//! - [`python`](../surefoot_native/index.html): the planner as a wheel for Python, over NumPy arrays.
//! - [`bench`](::bench): timings, the published tables, and plant and planner in a closed loop.
//! - [`report`]: what came of all this, as text, pictures and pages.
//!
//! ## Where to begin
//!
//! Each library has an example of less than a hundred lines that ends in a check of what it shows:
//!
//! | to | run |
//! |---|---|
//! | bring a map of your own | `cargo run -p terrain --example own_map` |
//! | follow a person through scans | `cargo run -p tracking --example track_a_walker` |
//! | bring a vehicle of your own | `cargo run -p bicycle --example own_vehicle`, from a file `cargo run -p formats --example own_files` |
//! | bring a risk map of your own | `cargo run -p traversability --example own_risk_map` |
//! | ask physics about ground | `cargo run -p physics_prior --example judge_a_ramp` |
//! | ask the networks about ground | `cargo run -p evidential --example learned_weight` |
//! | learn which command a car wants | `cargo run -p kinodynamics --example learn_understeer` |
//! | find how much each ground holds | `cargo run -p friction --example braking_distance` |
//! | search a route around slippery ground | `cargo run -p route --example around_ice` |
//! | drive the controller over a constant risk map | `cargo run -p mppi --example drive_constant_map` |
//! | give the controller costs of your own | `cargo run -p mppi --example own_costs` |
//! | drive the planner on your map, without sensors | `cargo run -p navigator --example own_surface` |
//! | simulate your world | `cargo run -p scenarios --example own_world` |
//! | drive everything in your world | `cargo run -p bench --example drive_own_world` |
//! | send and read messages of a run | `cargo run -p bus --example publish_and_read` |
//! | learn how old messages may be | `cargo run -p runtime --example limits_of_rates` |
//! | command the simulated vehicle from a program of your own | `cargo run -p simulator --example command_the_plant` |
//! | read a point cloud of ROS 2 | `cargo run -p ros --example read_a_cloud` |
//! | draw a drive of your own | `cargo run -p report --example draw_a_drive` |
//! | find out why simulator and robot disagree | `cargo run -p sim_to_real --example diagnose_a_delay` |
//!
//! Those who come to read code begin with [`navigator::Navigator`], then [`traversability::RiskMapView`], then
//! [`mppi::Controller`].
//!
//! ## Conventions
//!
//! - SI units. A name that holds a stored number ends in its unit: `speed_mps`, `yaw_rad`.
//! - Map frame: x east, y north, z up; yaw counter-clockwise from east, in radians.
//! - Body frame: forward, left, up, at the centre of the rear axle. Roll lifts the left side, pitch lowers the nose,
//!   steering is the angle of the front wheels, left positive.
//! - Grids are row-major from the south-west corner: rows count north, columns east. They lie on a lattice fixed to the
//!   map's origin.
//! - Time is nanoseconds on the clock of the measurements, and an argument: below [`runtime`] nothing reads a clock.
//! - Everything random has a seed, and no command depends on the number of threads.
//! - The **plant** is the truth, the **model** is what a controller believes; neither is built from the other.
//!
//! ## This crate
//!
//! The one binary, `surefoot`: arguments, progress and files around the crates that do the work. [`run`]
//! reads the arguments, calls the command's handler and turns its result into an exit code: 0 success, 1 the work
//! failed, 2 bad usage or input, 3 a limit that was asked for is exceeded. Errors are printed here and nowhere else, one line each.

pub mod arguments;
mod bench;
mod collect;
mod convert;
mod doctor;
mod drive;
mod drive_file;
mod failure;
mod gap;
mod inspect;
pub mod interrupt;
mod map;
mod orders;
pub mod output;
mod own_process;
mod play;
mod program;
pub mod progress;
mod replay;
mod robot;
mod route;
pub mod summary;
mod train;
mod up;

use std::ffi::OsString;
use std::io::Write;

use clap::Parser;
use clap::error::ErrorKind;
use navigator::Order;

use arguments::{Arguments, BenchCommand, Command, TrainCommand};
pub use failure::{LimitExceeded, UsageError, WorkFailed};
pub use program::Program;

/// Runs the command line of this process, whose executable it is; returns the exit code.
pub fn run() -> u8 {
    match Program::of_this_process() {
        Ok(program) => run_as(program),
        Err(error) => {
            report(&format!("expected to know its own file, found: {error}"));
            1
        }
    }
}

/// Runs the command line as another program than this process's executable; returns the exit code.
pub fn run_as(program: Program) -> u8 {
    be_quiet_when_nobody_reads();
    let words = program.claim().words.iter().cloned().map(arguments::place_with_minus);
    let result = match Arguments::try_parse_from([OsString::from("surefoot")].into_iter().chain(words)) {
        Ok(arguments) => dispatch(arguments.command),
        Err(error) => answer(&error),
    };
    match result {
        Ok(()) => 0,
        Err(error) => {
            report(&failure::one_line(&error));
            failure::exit_code(&error)
        }
    }
}

/// A reader that goes away early, as `head` does, ends a command; that is nothing to report.
fn be_quiet_when_nobody_reads() {
    let report_panic = std::panic::take_hook();
    std::panic::set_hook(Box::new(move |panic| {
        let message = panic.payload().downcast_ref::<String>();
        if !message.is_some_and(|message| message.starts_with("failed printing to stdout")) {
            report_panic(panic);
        }
    }));
}

fn dispatch(command: Command) -> anyhow::Result<()> {
    match command {
        Command::Drive(drive) => drive::run(&drive),
        Command::Up(up) => up::run(&up),
        Command::Goal(goal) => orders::goals(&goal),
        Command::Path(path) => orders::path(&path),
        Command::Pause(run) => orders::tell(&run, &Order::Pause),
        Command::Resume(run) => orders::tell(&run, &Order::Resume),
        Command::Cancel(run) => orders::tell(&run, &Order::Cancel),
        Command::Manual(run) => orders::tell(&run, &Order::TakeOver),
        Command::Estop(run) => orders::tell(&run, &Order::EmergencyStop),
        Command::Reset(run) => orders::tell(&run, &Order::Reset),
        Command::Alpha(alpha) => orders::alpha(&alpha),
        Command::Robot(robot) => robot::run(&robot),
        Command::Doctor(doctor) => doctor::run(&doctor),
        Command::Replay(replay) => replay::run(&replay),
        Command::Play(play) => play::run(&play),
        Command::Convert(convert) => convert::run(&convert),
        Command::Route(route) => route::run(&route),
        Command::Map(map) => map::run(&map),
        Command::Inspect(inspect) => inspect::run(&inspect),
        Command::Gap { command } => gap::run(&command),
        Command::Collect(collect) => collect::run(&collect),
        Command::Train { command: TrainCommand::Traversability(traversability) } => {
            train::run(&traversability)
        }
        Command::Train { command: TrainCommand::Kinodynamics(kinodynamics) } => {
            train::run_kinodynamics(&kinodynamics)
        }
        Command::Train { command: TrainCommand::Friction(friction) } => train::run_friction(&friction),
        Command::Bench { command: BenchCommand::Friction(friction) } => bench::run_friction(&friction),
        Command::Bench { command: BenchCommand::Route(route) } => bench::run_route(&route),
        Command::Bench { command: BenchCommand::RouteSpeed(speed) } => bench::run_route_speed(&speed),
        Command::Bench { command: BenchCommand::Control(control) } => bench::run_control(&control),
        Command::Bench { command: BenchCommand::PriorMap(prior_map) } => bench::run_prior_map(&prior_map),
        Command::Bench { command: BenchCommand::LearnedMap(learned_map) } => {
            bench::run_learned_map(&learned_map)
        }
        Command::Bench { command: BenchCommand::Kinodynamics(kinodynamics) } => {
            bench::run_kinodynamics(&kinodynamics)
        }
        Command::Bench { command: BenchCommand::Crossings(crossings) } => bench::run_crossings(&crossings),
        Command::Bench { command: BenchCommand::Arena(arena) } => bench::run_arena(&arena),
        Command::Bench { command: BenchCommand::Slippery(slippery) } => bench::run_slippery(&slippery),
        Command::Bench { command: BenchCommand::Risk(risk) } => bench::run_risk(&risk),
        Command::Bench { command: BenchCommand::Correction(correction) } => {
            bench::run_correction(&correction)
        }
        Command::Bench { command: BenchCommand::Plant(plant) } => bench::run_plant(&plant),
        Command::Bench { command: BenchCommand::Scaling(scaling) } => bench::run_scaling(&scaling),
        Command::Bench { command: BenchCommand::Ground(ground) } => bench::run_ground(&ground),
        Command::Bench { command: BenchCommand::Gap(gap) } => bench::run_gap(&gap),
        Command::Bench { command: BenchCommand::Learning(learning) } => bench::run_learning(&learning),
        Command::Bench { command: BenchCommand::Navigation(navigation) } => {
            bench::run_navigation(&navigation)
        }
    }
}

/// Help and version are answers, not errors; everything else that stops the parser is bad usage.
fn answer(error: &clap::Error) -> anyhow::Result<()> {
    match error.kind() {
        // Whoever reads only the first lines has read enough.
        ErrorKind::DisplayHelp | ErrorKind::DisplayVersion => match error.print() {
            Err(failure) if failure.kind() != std::io::ErrorKind::BrokenPipe => Err(failure.into()),
            _ => Ok(()),
        },
        _ => Err(UsageError::from_parser(error).into()),
    }
}

/// Says why there is no success: in the log of a process that keeps one, else on standard error. That it is closed must
/// not turn a failure into a panic: the exit code still tells.
fn report(line: &str) {
    if tracing::dispatcher::has_been_set() {
        tracing::error!("{line}");
    } else {
        drop(writeln!(std::io::stderr(), "surefoot: {line}"));
    }
}
