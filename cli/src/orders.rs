//! The words to a run that is under way: one order each, and what becomes of it.

use bus::channel::{Bus, RunName};
use navigator::{Order, Route};
use runtime::operator;
use traversability::CvarLevel;

use crate::arguments::{AlphaArguments, AskedRun, Goal, GoalArguments, PathArguments};
use crate::{UsageError, WorkFailed};

/// Where an order leaves the tolerance to the run, its own is checked with any that would do.
const ANY_TOLERANCE_M: f64 = 1.0;

pub(crate) fn goals(arguments: &GoalArguments) -> anyhow::Result<()> {
    let GoalArguments { goals, tolerance, run } = arguments;
    let route = Route::goals(points(goals), tolerance.unwrap_or(ANY_TOLERANCE_M));
    drive(run, route.map_err(UsageError::from_input)?, *tolerance)
}

pub(crate) fn path(arguments: &PathArguments) -> anyhow::Result<()> {
    let PathArguments { corners, speed, tolerance, run } = arguments;
    let route = Route::path(points(corners), *speed, tolerance.unwrap_or(ANY_TOLERANCE_M));
    drive(run, route.map_err(UsageError::from_input)?, *tolerance)
}

pub(crate) fn alpha(arguments: &AlphaArguments) -> anyhow::Result<()> {
    let level = CvarLevel::new(arguments.alpha).map_err(UsageError::from_input)?;
    tell(&arguments.run, &Order::Tolerate(level))
}

/// Says an order to the run that is meant, and shows what the vehicle does now.
pub(crate) fn tell(asked: &AskedRun, order: &Order) -> anyhow::Result<()> {
    let run = choose(asked)?;
    match operator::tell(&Bus::visit(&run)?, order) {
        Ok(mission) => {
            println!("run {run}: {mission}");
            Ok(())
        }
        Err(error) => Err(WorkFailed(format!("run {run}: {error}")).into()),
    }
}

fn drive(asked: &AskedRun, route: Route, tolerance_m: Option<f64>) -> anyhow::Result<()> {
    let order = Order::Drive(if tolerance_m.is_some() { route } else { route.without_tolerance() });
    tell(asked, &order)
}

fn points(goals: &[Goal]) -> Vec<[f64; 2]> {
    goals.iter().map(|goal| [goal.x_m, goal.y_m]).collect()
}

/// The run that was named, if it is there; else the only one.
pub(crate) fn choose(asked: &AskedRun) -> anyhow::Result<RunName> {
    let alive = RunName::alive()?;
    let named = |run: &RunName| asked.run.as_ref().is_none_or(|name| name == run);
    let found: Vec<&RunName> = alive.iter().filter(|run| named(run)).collect();
    let told = || alive.iter().map(RunName::to_string).collect::<Vec<_>>().join(", ");
    match (found[..].split_first(), &asked.run) {
        (Some((run, [])), _) => Ok((*run).clone()),
        (Some(_), _) => {
            let problem =
                format!("--run: expected one of the runs that are there, found none given and {}", told());
            Err(UsageError(problem).into())
        }
        (None, Some(name)) if alive.is_empty() => Err(UsageError(format!(
            "--run {name}: expected a run that `surefoot up` has started, found none"
        ))
        .into()),
        (None, Some(name)) => {
            Err(UsageError(format!("--run {name}: expected a run that is there, found {}", told())).into())
        }
        (None, None) => {
            Err(UsageError("expected a run that `surefoot up` has started, found none".to_owned()).into())
        }
    }
}
