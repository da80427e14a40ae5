//! The one binary, `surefoot`: arguments, progress, pictures and reports around the crates that do the work.
//!
//! [`run`] reads the arguments, calls the command's handler and turns its result into an exit code: 0 success,
//! 1 the work failed, 2 bad usage or input. Errors are printed here and nowhere else, one line each.

pub mod arguments;
mod bench;
mod collect;
mod drive;
mod failure;
mod gap;
mod inspect;
pub mod interrupt;
pub mod output;
pub mod picture;
pub mod progress;
mod replay;
pub mod summary;
mod train;
mod up;

use std::io::Write;
use std::process::ExitCode;

use clap::Parser;
use clap::error::ErrorKind;

use arguments::{Arguments, BenchCommand, Command, TrainCommand};
pub use failure::{UsageError, WorkFailed};

/// Runs the command line of this process.
pub fn run() -> ExitCode {
    be_quiet_when_nobody_reads();
    let result = match Arguments::try_parse() {
        Ok(arguments) => dispatch(arguments.command),
        Err(error) => answer(&error),
    };
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            report(&format!("surefoot: {}", failure::one_line(&error)));
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
        Command::Replay(replay) => replay::run(&replay),
        Command::Inspect(inspect) => inspect::run(&inspect),
        Command::Gap { command } => gap::run(&command),
        Command::Collect(collect) => collect::run(&collect),
        Command::Train { command: TrainCommand::Traversability(traversability) } => {
            train::run(&traversability)
        }
        Command::Bench { command: BenchCommand::Control(control) } => bench::run_control(&control),
        Command::Bench { command: BenchCommand::PriorMap(prior_map) } => bench::run_prior_map(&prior_map),
        Command::Bench { command: BenchCommand::LearnedMap(learned_map) } => {
            bench::run_learned_map(&learned_map)
        }
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
        ErrorKind::DisplayHelp | ErrorKind::DisplayVersion => Ok(error.print()?),
        _ => Err(UsageError::from_parser(error).into()),
    }
}

/// A closed standard error must not turn a failure into a panic: the exit code still tells.
fn report(line: &str) {
    drop(writeln!(std::io::stderr(), "{line}"));
}
