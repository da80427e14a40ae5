//! `surefoot bench route`: routes of every method driven by the plant, as text, JSON and pictures.

use ::bench::route::grip::{GripError, GripRow, measure_grip};
use ::bench::route::{Method, Report, Request, RouteBenchError, measure, measure_reference, n_drives};
use bicycle::Vehicle;
use scenarios::LandscapeKind;
use serde::Serialize;

use crate::arguments::BenchRouteArguments;
use crate::output::WithRevision;
use crate::{UsageError, progress};

/// The table, and what friction foretells of turns and climbs.
#[derive(Serialize)]
struct Results<'a> {
    #[serde(flatten)]
    table: &'a Report,
    grip: &'a [GripRow],
}

pub(crate) fn run_route(arguments: &BenchRouteArguments) -> anyhow::Result<()> {
    let vehicle = formats::read_vehicle(&arguments.vehicle).map_err(UsageError::from_input)?;
    arguments.results.prepare()?;
    if let Some(n_tasks) = arguments.reference {
        return run_reference(arguments, &vehicle, n_tasks as usize);
    }
    let request = Request {
        vehicle,
        seed: arguments.seed,
        n_tasks: arguments.tasks as usize,
        n_mppi_tasks: arguments.mppi_tasks as usize,
        methods: Method::ALL.to_vec(),
        n_threads: arguments.threads.count(),
    };
    let (n_grip_drives, n_threads) = (u64::from(arguments.grip_drives), request.n_threads);
    let bar = progress::bar(n_grip_drives, "{pos}/{len} drives and grounds");
    let grip = measure_grip((&request.vehicle, n_threads), (request.seed, n_grip_drives), |n| {
        bar.set_length(n as u64);
        bar.inc(1);
    });
    bar.finish_and_clear();
    let grip = grip.map_err(refused)?;
    print!("{}", report::routes::grip(&grip));
    let bar = progress::bar(n_drives(&request) as u64, "{pos}/{len} drives");
    let report = measure(&request, || bar.inc(1));
    bar.finish_and_clear();
    let report = report.map_err(told)?;
    print!("{}", report::routes::text(&report));
    let results = &arguments.results;
    results.write_json("route_table.json", &WithRevision::of(&Results { table: &report, grip: &grip }))?;
    results.write("route_table.png", &report::routes::picture(&report)?)?;
    for shown in &report.shown {
        let name = format!("route_{}.png", shown.landscape.kind.name());
        results.write(&name, &report::routes::map(shown)?)?;
    }
    println!("\n  route_table.json and pictures in {}", results.out.display());
    Ok(())
}

fn run_reference(arguments: &BenchRouteArguments, vehicle: &Vehicle, n_tasks: usize) -> anyhow::Result<()> {
    let bar = progress::bar((LandscapeKind::ALL.len() * n_tasks) as u64, "{pos}/{len} tasks");
    let size = (arguments.seed, n_tasks, arguments.threads.count());
    let report = measure_reference(vehicle, size, || bar.inc(1));
    bar.finish_and_clear();
    let report = report.map_err(told)?;
    print!("{}", report::routes::experts(&report));
    let results = &arguments.results;
    results.write_json("route_reference.json", &WithRevision::of(&report))?;
    results.write("route_reference.png", &report::routes::experts_picture(&report)?)?;
    println!("\n  route_reference.json and route_reference.png in {}", results.out.display());
    Ok(())
}

/// A vehicle that cannot be put there, or more tasks than a landscape has, is the user's choice.
fn told(error: RouteBenchError) -> anyhow::Error {
    match error {
        RouteBenchError::Landscape(_) | RouteBenchError::Track(_) => UsageError::from_input(error).into(),
        other => other.into(),
    }
}

/// A vehicle that does not stay on its wheels is the user's choice.
fn refused(error: GripError) -> anyhow::Error {
    match error {
        GripError::Friction(_) | GripError::Track(_) => UsageError::from_input(error).into(),
        other => other.into(),
    }
}
