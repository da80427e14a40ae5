//! `surefoot bench friction`: what was found beside the truth, as text, JSON and picture.

use ::bench::friction::{FrictionBenchError, Request, measure, seen};
use bicycle::Vehicle;

use crate::arguments::{BenchFrictionArguments, FrictionSource};
use crate::output::WithRevision;
use crate::{UsageError, progress};

pub(crate) fn run_friction(arguments: &BenchFrictionArguments) -> anyhow::Result<()> {
    let read = |name: &String| formats::read_vehicle(name).map_err(UsageError::from_input);
    let vehicles = arguments.vehicles().iter().map(read).collect::<Result<Vec<_>, _>>()?;
    arguments.results.prepare()?;
    match arguments.from {
        FrictionSource::Drives => from_drives(arguments, vehicles),
        FrictionSource::Pictures => from_pictures(arguments, vehicles),
    }
}

/// Drives to learn from.
const LEARNED_DRIVES: u64 = 24;
/// Length of each, and of each test [s], and batches of each training.
const DRIVE_S: f64 = 40.0;
const BATCHES: usize = 500;
/// Trainings of a run, from scratch and without labels.
const TRAININGS: u64 = 6;

fn from_pictures(arguments: &BenchFrictionArguments, vehicles: Vec<Vehicle>) -> anyhow::Result<()> {
    let n_tests = arguments.seeds * vehicles.len() as u64;
    let bar = progress::bar(LEARNED_DRIVES + 3 * n_tests + TRAININGS, "{pos}/{len} drives and trainings");
    let request = seen::Request {
        vehicles,
        n_drives: [LEARNED_DRIVES, n_tests],
        duration_s: DRIVE_S,
        batches: BATCHES,
        first_seed: arguments.first_seed,
        n_threads: arguments.threads.count(),
    };
    let report = seen::measure(&request, |_| bar.inc(1));
    bar.finish_and_clear();
    let report = report.map_err(told)?;
    print!("{}", report::friction_seen::text(&report));
    arguments.results.write_json("friction.json", &WithRevision::of(&report))?;
    arguments.results.write("friction.png", &report::friction_seen::picture(&report)?)?;
    arguments.results.write("friction.safetensors", &report.weights)?;
    let out = arguments.results.out.display();
    println!("\n  friction.json, friction.png and friction.safetensors in {out}");
    Ok(())
}

fn from_drives(arguments: &BenchFrictionArguments, vehicles: Vec<Vehicle>) -> anyhow::Result<()> {
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
