//! A simulated drive along a route.

use std::path::Path;

use bench::closed_loop::ClosedLoop;

use super::scene::Scene;
use crate::UsageError;
use crate::arguments::{DriveArguments, WorldSource};
use crate::route::{self, Guided, Place};

/// The route of a drive; `None` where nobody asked for one.
///
/// # Errors
/// There is none, or no map to search one on.
pub(super) fn plan(arguments: &DriveArguments, scene: &Scene) -> anyhow::Result<Option<Guided>> {
    let Some(map) = map(arguments)? else { return Ok(None) };
    let start = scene.task.start;
    let place = Place { at_m: [start[0], start[1]], yaw_rad: start[2], time_s: 0.0 };
    let machine = (&scene.vehicle, &scene.config);
    Ok(Some(route::guided(map, &arguments.ground, None, machine, place, scene.task.goal_m)?))
}

/// Has the drive head for what comes next, after a cycle that may have renewed the map.
pub(super) fn lead(
    guided: &mut Guided,
    closed: &mut ClosedLoop,
    tolerance_m: f64,
    is_renewed: bool,
) -> anyhow::Result<()> {
    let odometry = closed.episode.observe().odometry;
    let ([x_m, y_m, _], [_, _, yaw_rad]) = (odometry.position_m, odometry.attitude_rad);
    let place = Place { at_m: [x_m, y_m], yaw_rad, time_s: closed.episode.time_s() };
    if is_renewed {
        guided.look(closed.navigator.surface(), place);
    }
    if let Some(goals_m) = guided.advance(place.at_m) {
        closed.follow(navigator::Route::goals(goals_m, tolerance_m)?)?;
    }
    Ok(())
}

/// The file that a route is searched on.
fn map(arguments: &DriveArguments) -> Result<Option<&Path>, UsageError> {
    match (&arguments.route, &arguments.world) {
        (None, _) => Ok(None),
        _ if arguments.goal.len() > 1 => {
            Err(UsageError(format!("--route: expected one --goal, found {}", arguments.goal.len())))
        }
        (Some(Some(map)), _) => Ok(Some(map)),
        (Some(None), WorldSource::File(world)) => Ok(Some(world)),
        (Some(None), _) => Err(UsageError(
            "--route: expected --world FILE, or --route=FILE with a map of the ground, found neither"
                .to_owned(),
        )),
    }
}
