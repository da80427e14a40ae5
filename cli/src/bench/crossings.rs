//! `surefoot bench crossings`: the runs, a bar meanwhile, and what they add up to as text, JSON and picture.

use ::bench::closed_loop::DriveError;
use ::bench::crossings::{BrokenRun, CrossingsError, Report, Request, measure};
use navigator::NavigatorError;

use crate::arguments::BenchCrossingsArguments;
use crate::output::WithRevision;
use crate::{UsageError, WorkFailed, progress};

pub(crate) fn run_crossings(arguments: &BenchCrossingsArguments) -> anyhow::Result<()> {
    let request = request(arguments);
    arguments.results.prepare()?;
    let n_runs = request.n_runs * request.handlings.len() as u64;
    let bar = progress::bar(n_runs, "{pos}/{len} runs, {eta} left   {msg}");
    let measured = measure(&request, |run| {
        bar.set_message(report::crossings::run_text(run));
        bar.inc(1);
    });
    bar.finish_and_clear();
    let report = measured.map_err(told)?;
    print!("{}", report::crossings::text(&report));
    write(&report, arguments)?;
    if report.is_passed() {
        Ok(())
    } else {
        Err(WorkFailed("somebody was struck whom a stop would have spared".to_owned()).into())
    }
}

fn request(arguments: &BenchCrossingsArguments) -> Request {
    Request {
        handlings: arguments.handling.iter().map(|&handling| handling.into()).collect(),
        n_runs: arguments.runs,
        seed: arguments.seed,
        n_walkers: arguments.walkers,
        time_limit_s: arguments.time_limit,
        n_threads: arguments.kernels.threads.count(),
        isa: arguments.kernels.isa.into(),
    }
}

/// An instruction set that the machine lacks is the user's choice; all else is not.
fn told(error: CrossingsError) -> anyhow::Error {
    if let CrossingsError::Run { source, .. } = &error
        && let BrokenRun::Loop(DriveError::Navigator(NavigatorError::Controller(refused))) = source.as_ref()
        && matches!(refused, mppi::ConfigError::Isa(_))
    {
        return UsageError(refused.to_string()).into();
    }
    error.into()
}

fn write(report: &Report, arguments: &BenchCrossingsArguments) -> anyhow::Result<()> {
    arguments.results.write_json("crossings.json", &WithRevision::of(report))?;
    arguments.results.write("crossings.png", &report::crossings::picture(report)?)?;
    println!("\n  crossings.json and crossings.png in {}", arguments.results.out.display());
    Ok(())
}
