//! `surefoot bench crossings`: the runs, a bar meanwhile, and what they add up to as text, JSON and picture.

use ::bench::crossings::{Report, Request, measure};

use super::sweep::told;
use crate::arguments::BenchCrossingsArguments;
use crate::output::WithRevision;
use crate::{WorkFailed, progress};

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
        first_run: arguments.first_run,
        seed: arguments.seed,
        n_walkers: arguments.walkers,
        time_limit_s: arguments.time_limit,
        n_threads: arguments.kernels.threads.count(),
        isa: arguments.kernels.isa.into(),
    }
}

fn write(report: &Report, arguments: &BenchCrossingsArguments) -> anyhow::Result<()> {
    arguments.results.write_json("crossings.json", &WithRevision::of(report))?;
    arguments.results.write("crossings.png", &report::crossings::picture(report)?)?;
    println!("\n  crossings.json and crossings.png in {}", arguments.results.out.display());
    Ok(())
}
