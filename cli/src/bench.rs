//! `surefoot bench`: what was asked, handed to the benchmarks, and their result shown and written.

mod arena;
mod correction;
mod crossings;
mod friction;
mod gap;
mod ground;
mod kinodynamics;
mod learned_map;
mod learning;
mod navigation;
mod plant;
mod risk;
mod route;
mod route_speed;
mod scaling;
mod slippery;
mod sweep;

use ::bench::{BenchError, control, prior_map};
use serde::Serialize;

use crate::UsageError;
use crate::arguments::{BenchControlArguments, BenchPriorMapArguments, BenchWork, JsonArguments};
pub(crate) use arena::run_arena;
pub(crate) use correction::run_correction;
pub(crate) use crossings::run_crossings;
pub(crate) use friction::run_friction;
pub(crate) use gap::run_gap;
pub(crate) use ground::run_ground;
pub(crate) use kinodynamics::run_kinodynamics;
pub(crate) use learned_map::run_learned_map;
pub(crate) use learning::run_learning;
pub(crate) use navigation::run_navigation;
pub(crate) use plant::run_plant;
pub(crate) use risk::run_risk;
pub(crate) use route::run_route;
pub(crate) use route_speed::run_route_speed;
pub(crate) use scaling::run_scaling;
pub(crate) use slippery::run_slippery;

pub(crate) fn run_control(arguments: &BenchControlArguments) -> anyhow::Result<()> {
    arguments.copy.prepare()?;
    let report = control::measure(control::Request {
        n_threads: arguments.kernels.threads.count(),
        n_updates: arguments.updates,
        work: match arguments.work {
            BenchWork::Bound => control::Work::Bound,
            BenchWork::Effects => control::Work::Effects,
            BenchWork::Drive => control::Work::Drive,
        },
        isa: arguments.kernels.isa.into(),
    })
    .map_err(told)?;
    show(&report, &arguments.copy)
}

pub(crate) fn run_prior_map(arguments: &BenchPriorMapArguments) -> anyhow::Result<()> {
    arguments.copy.prepare()?;
    let request = prior_map::Request {
        n_threads: arguments.kernels.threads.count(),
        n_updates: arguments.updates,
        isa: arguments.kernels.isa.into(),
    };
    let report = prior_map::measure(request).map_err(told)?;
    show(&report, &arguments.copy)
}

/// An instruction set that the machine lacks is the user's choice; all else is not.
fn told(error: BenchError) -> anyhow::Error {
    match error {
        BenchError::Controller(refused @ mppi::ConfigError::Isa(_)) => UsageError::from_input(refused).into(),
        other => other.into(),
    }
}

/// JSON on standard output, and in the file if one was asked for.
fn show(report: &impl Serialize, copy: &JsonArguments) -> anyhow::Result<()> {
    println!("{}", serde_json::to_string_pretty(report)?);
    Ok(copy.write(report)?)
}
