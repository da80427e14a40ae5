//! `surefoot bench arena`: the training, the drives, a bar meanwhile, and what they add up to as text, JSON, picture and page.

use ::bench::arena::{ArenaTableError, Report, Request, Stage, measure};
use ::bench::closed_loop::Method;
use traversability::CvarLevel;

use super::sweep::told;
use crate::arguments::BenchArenaArguments;
use crate::output::WithRevision;
use crate::{UsageError, progress, summary};

pub(crate) fn run_arena(arguments: &BenchArenaArguments) -> anyhow::Result<()> {
    let request = request(arguments)?;
    arguments.results.prepare()?;
    let n_runs = 2 * request.n_runs * request.methods.len() as u64;
    let bar = progress::bar(n_runs, "{pos}/{len} drives, {eta} left   {msg}");
    let on_stage = |stage: Stage| {
        bar.set_message(match stage {
            Stage::Learning => "driving and training on level ground",
            Stage::Driving => "",
        });
    };
    let measured = measure(&request, summary::revision(), on_stage, |run| {
        bar.set_message(report::arena::run_text(run));
        bar.inc(1);
    });
    bar.finish_and_clear();
    let report = measured.map_err(|error| match error {
        ArenaTableError::Sweep(error) => told(error),
        other => other.into(),
    })?;
    print!("{}", report::arena::text(&report));
    write(&report, arguments)
}

fn request(arguments: &BenchArenaArguments) -> Result<Request, UsageError> {
    let mut methods: Vec<Method> = Vec::new();
    for &method in &arguments.methods {
        if methods.contains(&method.into()) {
            let name = Method::from(method).name();
            return Err(UsageError(format!("--methods: expected each method once, found {name} again")));
        }
        methods.push(method.into());
    }
    Ok(Request {
        methods,
        n_runs: arguments.runs,
        level: CvarLevel::new(arguments.alpha).map_err(UsageError::from_input)?,
        seed: arguments.seed,
        time_limit_s: arguments.time_limit,
        n_threads: arguments.kernels.threads.count(),
        isa: arguments.kernels.isa.into(),
    })
}

fn write(report: &Report, arguments: &BenchArenaArguments) -> anyhow::Result<()> {
    let results = &arguments.results;
    results.write_json("arena.json", &WithRevision::of(report))?;
    let picture = report::arena::picture(report)?;
    results.write(picture.file, &picture.png)?;
    let page = report::arena::page(report, &picture, summary::revision());
    results.write("arena.html", page.as_bytes())?;
    println!("\n  arena.json, arena.html and arena.png in {}", results.out.display());
    Ok(())
}
