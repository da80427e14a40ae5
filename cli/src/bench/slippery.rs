//! `surefoot bench slippery`: the drives, a bar meanwhile, and what they add up to as text, JSON and picture.

use ::bench::slippery::{Report, Request, Told, measure};

use super::sweep::told;
use crate::arguments::BenchSlipperyArguments;
use crate::output::WithRevision;
use crate::progress;

pub(crate) fn run_slippery(arguments: &BenchSlipperyArguments) -> anyhow::Result<()> {
    let request = request(arguments);
    arguments.results.prepare()?;
    let n_runs = request.n_courses * Told::ALL.len() as u64;
    let bar = progress::bar(n_runs, "{pos}/{len} drives, {eta} left   {msg}");
    let measured = measure(&request, |run| {
        bar.set_message(report::slippery::run_text(run));
        bar.inc(1);
    });
    bar.finish_and_clear();
    let report = measured.map_err(told)?;
    print!("{}", report::slippery::text(&report));
    write(&report, arguments)
}

fn request(arguments: &BenchSlipperyArguments) -> Request {
    Request {
        n_courses: arguments.courses,
        seed: arguments.seed,
        speed_mps: arguments.speed,
        time_limit_s: arguments.time_limit,
        n_threads: arguments.kernels.threads.count(),
        isa: arguments.kernels.isa.into(),
    }
}

fn write(report: &Report, arguments: &BenchSlipperyArguments) -> anyhow::Result<()> {
    arguments.results.write_json("slippery.json", &WithRevision::of(report))?;
    arguments.results.write("slippery.png", &report::slippery::picture(report)?)?;
    println!("\n  slippery.json and slippery.png in {}", arguments.results.out.display());
    Ok(())
}
