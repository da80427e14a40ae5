//! `surefoot bench navigation`: the drives, a bar meanwhile, and the table as text, JSON and picture.

use ::bench::navigation::{Report, Request, measure};
use traversability::CvarLevel;

use super::sweep::told;
use crate::arguments::BenchNavigationArguments;
use crate::output::WithRevision;
use crate::{UsageError, progress};

pub(crate) fn run_navigation(arguments: &BenchNavigationArguments) -> anyhow::Result<()> {
    let request = request(arguments)?;
    arguments.results.prepare()?;
    let bar = progress::bar(request.n_drives(), "{pos}/{len} drives, {eta} left   {msg}");
    let measured = measure(&request, |drive| {
        bar.set_message(report::navigation::drive_text(drive));
        bar.inc(1);
    });
    bar.finish_and_clear();
    let report = measured.map_err(told)?;
    print!("{}", report::navigation::text(&report));
    write(&report, arguments)
}

fn request(arguments: &BenchNavigationArguments) -> Result<Request, UsageError> {
    let levels = arguments.alpha.iter().map(|&alpha| CvarLevel::new(alpha));
    Ok(Request {
        methods: arguments.methods.iter().map(|&method| method.into()).collect(),
        levels: levels.collect::<Result<_, _>>().map_err(UsageError::from_input)?,
        n_seeds: arguments.seeds,
        time_limit_s: arguments.time_limit,
        n_threads: arguments.kernels.threads.count(),
        isa: arguments.kernels.isa.into(),
    })
}

fn write(report: &Report, arguments: &BenchNavigationArguments) -> anyhow::Result<()> {
    arguments.results.write_json("navigation.json", &WithRevision::of(report))?;
    arguments.results.write("navigation.png", &report::navigation::picture(report)?)?;
    println!("\n  navigation.json and navigation.png in {}", arguments.results.out.display());
    Ok(())
}
