//! `surefoot bench correction`: the runs, a bar meanwhile, and what they add up to as text, JSON and picture.

use ::bench::kinodynamics::{HALF_WIDTH_M, MixedGroundReport, Request, VEHICLE, mixed_ground};

use super::kinodynamics::{Progress, told_error};
use crate::arguments::BenchCorrectionArguments;
use crate::output::WithRevision;
use crate::train::labels;
use crate::{UsageError, interrupt, progress, summary};

pub(crate) fn run_correction(arguments: &BenchCorrectionArguments) -> anyhow::Result<()> {
    arguments.results.prepare()?;
    interrupt::catch_interrupts()?;
    let request = Request {
        vehicle: formats::read_vehicle(VEHICLE).map_err(UsageError::from_input)?,
        seed: arguments.seed,
        minutes: arguments.minutes,
        epochs: arguments.epochs,
        laps: arguments.runs,
        labels: labels(&arguments.labels),
        teacher: arguments.labels.teacher.into(),
        rows: Vec::new(),
        half_width_m: HALF_WIDTH_M,
    };
    let mut methods: Vec<_> = Vec::new();
    for method in arguments.methods.iter().map(|&method| method.into()) {
        if !methods.contains(&method) {
            methods.push(method);
        }
    }
    let pool = rayon::ThreadPoolBuilder::new().num_threads(arguments.threads.count()).build()?;
    let progress = Progress(progress::bar(0, "{pos}/{len} {msg}, {eta} left"));
    let report = pool.install(|| mixed_ground(&request, &methods, summary::revision(), &progress));
    let report = report.map_err(told_error)?;
    progress.0.finish_and_clear();
    print!("{}", report::correction::text(&report));
    write(&report, arguments)
}

fn write(report: &MixedGroundReport, arguments: &BenchCorrectionArguments) -> anyhow::Result<()> {
    arguments.results.write_json("correction.json", &WithRevision::of(report))?;
    arguments.results.write("correction.png", &report::correction::picture(report)?)?;
    println!("\n  correction.json and correction.png in {}", arguments.results.out.display());
    Ok(())
}
