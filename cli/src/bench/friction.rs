//! `surefoot bench friction`: what was found beside the truth, as text, JSON and picture.

use ::bench::friction::{FrictionBenchError, Request, measure};

use crate::arguments::BenchFrictionArguments;
use crate::output::WithRevision;
use crate::{UsageError, progress};

pub(crate) fn run_friction(arguments: &BenchFrictionArguments) -> anyhow::Result<()> {
    let read = |name: &String| formats::read_vehicle(name).map_err(UsageError::from_input);
    let vehicles = arguments.vehicles.iter().map(read).collect::<Result<Vec<_>, _>>()?;
    arguments.results.prepare()?;
    let bar = progress::bar(vehicles.len() as u64 * arguments.seeds, "{pos}/{len} drives");
    let request = Request {
        vehicles,
        first_seed: arguments.first_seed,
        n_seeds: arguments.seeds,
        n_threads: arguments.threads.count(),
    };
    let report = measure(&request, || bar.inc(1));
    bar.finish_and_clear();
    let report = report.map_err(told)?;
    print!("{}", report::friction::text(&report));
    arguments.results.write_json("friction.json", &WithRevision::of(&report))?;
    arguments.results.write("friction.png", &report::friction::picture(&report)?)?;
    println!("\n  friction.json and friction.png in {}", arguments.results.out.display());
    Ok(())
}

/// A vehicle that does not stay on its wheels, or is none, is the user's choice.
fn told(error: FrictionBenchError) -> anyhow::Error {
    match error {
        FrictionBenchError::Plant(_) | FrictionBenchError::NoDrive { .. } => {
            UsageError::from_input(error).into()
        }
        other => other.into(),
    }
}
