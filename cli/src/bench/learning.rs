//! `surefoot bench learning`: what was learned, judged on ground unlike that of the training.
#![allow(clippy::disallowed_methods, reason = "people are told how long the benchmark takes")]

mod progress;
mod traction_map;

use std::time::Instant;

use ::bench::learning::{LearningError, Plan, Report, Request, Testbed, Trained, judge};
use ::report::learning::duration;
use evidential::{Selections, TrainError};
use scenarios::RockFieldConfig;
use serde::Serialize;

use crate::arguments::BenchLearningArguments;
use crate::{UsageError, WorkFailed, interrupt, summary};
use progress::Progress;

/// The machine of PIETRA's simulations.
const VEHICLE: &str = "pietra_full_size";

/// How long the parts took [s].
#[derive(Clone, Copy, Debug, Serialize)]
struct Took {
    drives_s: f64,
    trainings_s: f64,
    judging_s: f64,
    /// What the trainings were expected to take after the first of them.
    trainings_estimated_s: f64,
}

impl Took {
    fn told(&self) -> String {
        format!(
            "  drives {}, trainings {} (expected {} after the first), judging {}",
            duration(self.drives_s),
            duration(self.trainings_s),
            duration(self.trainings_estimated_s),
            duration(self.judging_s)
        )
    }
}

/// The content of `learning.json`.
#[derive(Serialize)]
struct Written<'a> {
    revision: &'static str,
    took: Took,
    #[serde(flatten)]
    report: &'a Report,
}

pub(crate) fn run_learning(arguments: &BenchLearningArguments) -> anyhow::Result<()> {
    match &arguments.traction_map {
        Some(path) => traction_map::run(arguments, path),
        None => run_tables(arguments),
    }
}

fn run_tables(arguments: &BenchLearningArguments) -> anyhow::Result<()> {
    let request = request(arguments)?;
    arguments.results.prepare()?;
    let plan = Plan::new(&Selections::shipped()?, arguments.seeds, arguments.epochs);
    let (report, took) = measure(&request, &plan).map_err(told_error)?;
    print!("{}", report::learning::text(&report));
    println!("\n{}", took.told());
    write(arguments, &report, took)
}

fn request(arguments: &BenchLearningArguments) -> Result<Request, UsageError> {
    Ok(Request {
        vehicle: formats::read_vehicle(VEHICLE).map_err(UsageError::from_input)?,
        field: RockFieldConfig::testbed(),
        seed: arguments.seed,
        n_maps: arguments.maps,
        n_trials: arguments.trials,
        n_threads: arguments.threads.count(),
    })
}

/// Drives, trains and judges.
fn measure(request: &Request, plan: &Plan) -> Result<(Report, Took), LearningError> {
    let began = Instant::now();
    let progress = Progress::drives(request.n_drives());
    let testbed = Testbed::drive(request, &|stage| progress.stage(stage, request), &|| progress.step())?;
    progress.finish();
    let drives_s = began.elapsed().as_secs_f64();
    println!("  drives took {}", duration(drives_s));
    let began = Instant::now();
    let trained = train(&testbed, plan, request.n_threads)?;
    let trainings_s = began.elapsed().as_secs_f64();
    let (trained, trainings_estimated_s) = trained;
    let began = Instant::now();
    let report = judge(&testbed, plan, &trained, request.n_threads)?;
    let judging_s = began.elapsed().as_secs_f64();
    Ok((report, Took { drives_s, trainings_s, judging_s, trainings_estimated_s }))
}

/// All trainings, and what they were expected to take after the first [s].
fn train(testbed: &Testbed, plan: &Plan, n_threads: usize) -> Result<(Vec<Trained>, f64), LearningError> {
    let progress = Progress::trainings(plan.trainings.len(), n_threads);
    let is_interrupted = &interrupt::interrupted;
    let on_trained = &|trained: &Trained| progress.trained(trained);
    let trained = plan.train(testbed, summary::revision(), n_threads, is_interrupted, on_trained)?;
    Ok((trained, progress.finish()))
}

/// Too few maps or trials for anything to be learnt are the user's choice, as is an interruption; all else is not.
fn told_error(error: LearningError) -> anyhow::Error {
    let is_too_little = match &error {
        LearningError::Drives { .. } | LearningError::Data { .. } => true,
        LearningError::Training { source, .. } => {
            matches!(source.as_ref(), TrainError::Data { .. } | TrainError::OneClass { .. })
        }
        _ => false,
    };
    match error {
        little if is_too_little => UsageError::from_input(little).into(),
        LearningError::Interrupted => WorkFailed(error.to_string()).into(),
        other => other.into(),
    }
}

fn write(arguments: &BenchLearningArguments, report: &Report, took: Took) -> anyhow::Result<()> {
    let written = Written { revision: summary::revision(), took, report };
    arguments.results.write_json("learning.json", &written)?;
    arguments.results.write("learning.png", &report::learning::picture(report)?)?;
    let page = report::learning::page(report, &took.told());
    arguments.results.write("learning.html", page.as_bytes())?;
    println!("\n  learning.json, learning.html and learning.png in {}", arguments.results.out.display());
    Ok(())
}
