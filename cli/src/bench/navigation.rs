//! `surefoot bench navigation`: the drives, a bar meanwhile, and the table as text, JSON, picture and page.

mod kept;
mod planners;

use std::sync::{Mutex, PoisonError};

use ::bench::navigation::{DriveResult, Plan, Report, Request, Shard};
use ::bench::sweep::SweepError;
use formats::{ConfigText, Journal, overlay, read_vehicle};
use navigator::Config;
use rustix::time::{ClockId, clock_gettime};
use traversability::CvarLevel;

use super::sweep::told;
use crate::arguments::BenchNavigationArguments;
use crate::output::WithRevision;
use crate::{UsageError, progress, summary};
use kept::{Header, JOURNAL};
use planners::Planners;

pub(crate) fn run_navigation(arguments: &BenchNavigationArguments) -> anyhow::Result<()> {
    if !arguments.merge.is_empty() {
        let (plan, drives) = kept::merged(&arguments.merge)?;
        arguments.results.prepare()?;
        return finish(&plan.report(&drives), arguments);
    }
    let plan = Plan::new(&request(arguments)?).map_err(told_request)?;
    // Before anything is written: a planner that does not start is to cost nobody a folder or a drive.
    let planners = Planners::start(arguments, plan.machine().map_err(told)?.limits)?;
    arguments.results.prepare()?;
    let header = Header::of(&plan);
    let path = arguments.results.file(JOURNAL);
    let (journal, mut drives) = match arguments.resume {
        true => kept::resumed(&path, &header)?,
        false => (Journal::create(&path, &header)?, Vec::new()),
    };
    drives.extend(drive((&plan, &planners), &drives, journal, arguments)?);
    finish(&plan.report(&drives), arguments)
}

fn drive(
    (plan, planners): (&Plan, &Planners),
    known: &[DriveResult],
    journal: Journal,
    arguments: &BenchNavigationArguments,
) -> anyhow::Result<Vec<DriveResult>> {
    let shard = arguments.shard.unwrap_or(Shard::WHOLE);
    let bar = progress::bar(plan.n_drives(shard) as u64, "{pos}/{len} drives, {eta} left   {msg}");
    bar.inc(known.len() as u64);
    let journal = Mutex::new(journal);
    let began_s = cpu_s();
    let driven = plan.drive(
        shard,
        known,
        arguments.kernels.threads.count(),
        &|name, episode| planners.drive(name, episode),
        |drive| {
            bar.set_message(report::navigation::drive_text(drive));
            bar.inc(1);
            // What a panic elsewhere left is still a file open for more.
            let mut journal = journal.lock().unwrap_or_else(PoisonError::into_inner);
            journal.append(drive).map_err(SweepError::from)
        },
    );
    bar.finish_and_clear();
    let driven = driven.map_err(told)?;
    if !driven.is_empty() {
        println!("  {:.1} core-seconds a drive\n", (cpu_s() - began_s) / driven.len() as f64);
    }
    Ok(driven)
}

/// What all threads of the process have computed so far [s].
fn cpu_s() -> f64 {
    let time = clock_gettime(ClockId::ProcessCPUTime);
    time.tv_sec as f64 + 1e-9 * time.tv_nsec as f64
}

fn request(arguments: &BenchNavigationArguments) -> Result<Request, UsageError> {
    let levels = arguments.alpha.iter().map(|&alpha| CvarLevel::new(alpha));
    let vehicle = read_vehicle(&arguments.vehicle).map_err(UsageError::from_input)?;
    let mut field = arguments.ground.field(&vehicle);
    if let Some(path) = &arguments.field {
        let text = ConfigText::read(path).map_err(UsageError::from_input)?;
        field = overlay(&text, &field).map_err(UsageError::from_input)?;
    }
    let mut settings = String::new();
    if let Some(path) = &arguments.config {
        let text = ConfigText::read(path).map_err(UsageError::from_input)?;
        let config = overlay(&text, &Config::for_vehicle(&vehicle)).map_err(UsageError::from_input)?;
        config.validate().map_err(UsageError::from_input)?;
        text.text().clone_into(&mut settings);
    }
    Ok(Request {
        vehicle: arguments.vehicle.clone(),
        speed_mps: arguments.speed,
        methods: arguments.methods.iter().map(|&method| method.into()).collect(),
        planners: arguments.planners.iter().map(|planner| planner.name.clone()).collect(),
        levels: levels.collect::<Result<_, _>>().map_err(UsageError::from_input)?,
        field,
        seed: arguments.seed,
        n_maps: arguments.maps,
        n_pairs: arguments.pairs,
        time_limit_s: arguments.time_limit,
        isa: arguments.kernels.isa.into(),
        plant: arguments.plant.into(),
        settings,
    })
}

/// A field, a plant or an instruction set that cannot be is the user's choice.
fn told_request(error: SweepError) -> anyhow::Error {
    match error {
        SweepError::Field(_) | SweepError::Isa(_) | SweepError::Plant(_) | SweepError::NoDrives { .. } => {
            UsageError::from_input(error).into()
        }
        other => told(other),
    }
}

fn finish(report: &Report, arguments: &BenchNavigationArguments) -> anyhow::Result<()> {
    print!("{}", report::navigation::text(report));
    let results = &arguments.results;
    results.write_json("navigation.json", &WithRevision::of(report))?;
    let levels = report::navigation::picture_of_levels(report)?;
    let pictures: Vec<_> = [report::navigation::picture(report)?].into_iter().chain(levels).collect();
    for picture in &pictures {
        results.write(picture.file, &picture.png)?;
    }
    let page = report::navigation::page(report, &pictures, summary::revision());
    results.write("navigation.html", page.as_bytes())?;
    let files: Vec<&str> = pictures.iter().map(|picture| picture.file).collect();
    println!("\n  navigation.json, navigation.html and {} in {}", files.join(" and "), results.out.display());
    Ok(())
}
