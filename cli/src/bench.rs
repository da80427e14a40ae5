//! `surefoot bench`: what was asked, handed to the benchmarks, and their result shown and written.

mod gap;
mod kinodynamics;
mod learned_map;
mod learning;
mod navigation;
mod plant;

use ::bench::{BenchError, control, prior_map};
use serde::Serialize;

use crate::arguments::{BenchControlArguments, BenchPriorMapArguments, BenchWork};
use crate::{UsageError, output};
pub(crate) use gap::run_gap;
pub(crate) use kinodynamics::run_kinodynamics;
pub(crate) use learned_map::run_learned_map;
pub(crate) use learning::run_learning;
pub(crate) use navigation::run_navigation;
pub(crate) use plant::run_plant;

pub(crate) fn run_control(arguments: &BenchControlArguments) -> anyhow::Result<()> {
    let json = arguments.json.as_deref();
    json.map_or(Ok(()), output::prepare_json)?;
    let report = control::measure(control::Request {
        n_threads: arguments.n_threads(),
        n_updates: arguments.updates,
        work: match arguments.work {
            BenchWork::Bound => control::Work::Bound,
            BenchWork::Effects => control::Work::Effects,
            BenchWork::Drive => control::Work::Drive,
        },
        isa: arguments.isa.into(),
    })
    .map_err(told)?;
    show(&report, json)
}

pub(crate) fn run_prior_map(arguments: &BenchPriorMapArguments) -> anyhow::Result<()> {
    let json = arguments.json.as_deref();
    json.map_or(Ok(()), output::prepare_json)?;
    let request = prior_map::Request {
        n_threads: arguments.n_threads(),
        n_updates: arguments.updates,
        isa: arguments.isa.into(),
    };
    let report = prior_map::measure(request).map_err(told)?;
    show(&report, json)
}

/// An instruction set that the machine lacks is the user's choice; all else is not.
fn told(error: BenchError) -> anyhow::Error {
    match error {
        BenchError::Controller(refused @ mppi::ConfigError::Isa(_)) => UsageError::from_input(refused).into(),
        other => other.into(),
    }
}

/// JSON on standard output, and in the file if one was asked for.
fn show(report: &impl Serialize, json: Option<&std::path::Path>) -> anyhow::Result<()> {
    println!("{}", serde_json::to_string_pretty(report)?);
    if let Some(path) = json {
        formats::write_json_atomic(path, report)?;
    }
    Ok(())
}
