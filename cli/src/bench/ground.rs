//! `surefoot bench ground`: the cases, a bar meanwhile, and what was taken for what.

use ::bench::ground_score::{Request, measure};
use formats::read_vehicle;

use crate::arguments::BenchGroundArguments;
use crate::output::WithRevision;
use crate::{UsageError, progress};

pub(crate) fn run_ground(arguments: &BenchGroundArguments) -> anyhow::Result<()> {
    let vehicles = arguments.vehicles.iter().map(|name| read_vehicle(name));
    let request = Request {
        vehicles: vehicles.collect::<Result<_, _>>().map_err(UsageError::from_input)?,
        first_case: arguments.first_case,
        n_cases: arguments.cases,
        seed: arguments.seed,
        n_threads: arguments.threads.count(),
    };
    arguments.results.prepare()?;
    let n_cases = arguments.cases * request.vehicles.len() as u64;
    let bar = progress::bar(n_cases, "{pos}/{len} cases, {eta} left   {msg}");
    let measured = measure(&request, |case| {
        bar.set_message(report::ground_score::case_text(case));
        bar.inc(1);
    });
    bar.finish_and_clear();
    let report = measured?;
    print!("{}", report::ground_score::text(&report));
    arguments.results.write_json("ground_score.json", &WithRevision::of(&report))?;
    arguments.results.write("ground_score.png", &report::ground_score::picture(&report)?)?;
    println!("\n  ground_score.json and ground_score.png in {}", arguments.results.out.display());
    Ok(())
}
