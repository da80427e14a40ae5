//! `surefoot route`: a way over measured ground and the speeds along it, and a vehicle led along it.

mod answer;
mod guided;
pub(crate) mod known;
mod lead;
pub(crate) mod tiles;

use std::path::Path;

use ::route::{Planner, RouteConfig, RouteError, RouteLine, SpeedLimits};
use bicycle::Vehicle;
use bus::channel::RunName;
use formats::read_vehicle;
use navigator::Config;

use crate::arguments::{GroundKinds, RouteArguments, RouteGround, StartPose};
use crate::{UsageError, WorkFailed};
use answer::Answer;
pub use guided::GuidedSummary;
use guided::SearchedMap;
pub(crate) use guided::{Guided, Place};
use known::{Known, known, of_file};
use lead::Led;
use tiles::Tiles;

/// Share of the attitude limits that a route may use; the rest is for what no map shows.
const ATTITUDE_SHARE: f64 = 0.9;
/// Room around the vehicle, in all [m].
const MARGIN_M: f64 = 0.6;

pub(crate) fn run(arguments: &RouteArguments) -> anyhow::Result<()> {
    let vehicle = read_vehicle(&arguments.vehicle).map_err(UsageError::from_input)?;
    let goal_m = [arguments.goal.x_m, arguments.goal.y_m];
    if let Some(name) = &arguments.lead {
        return lead(arguments, &vehicle, name, goal_m);
    }
    let start =
        arguments.start.ok_or_else(|| UsageError("--start: expected X,Y,YAW, found none".to_owned()))?;
    let from = ([start.x_m, start.y_m], start.yaw_rad);
    let limits = speed_limits(&vehicle, arguments.speed)?;
    let config = config(&vehicle, vehicle.geometry.width_m + MARGIN_M);
    let (world, asked, ends_m) = (&arguments.world, &arguments.ground, [from.0, goal_m]);
    let Known { ground, reference } = if world.is_dir() {
        refuse_kinds(&asked.kinds)?;
        let tiles = Tiles::open(world, asked)?;
        if !tiles.fits(ends_m) {
            arguments.results.prepare()?;
            return tiles.far((&vehicle, &config, &limits), from, goal_m, arguments);
        }
        tiles.known(ends_m)?
    } else {
        of_file(world, asked)?
    };
    let planner = Planner::new(ground, config).map_err(UsageError::from_input)?;
    arguments.results.prepare()?;
    let route = planner.route(from, goal_m, &limits).map_err(failed)?;
    let n_others = usize::from(arguments.alternatives);
    let others = planner.alternatives(from, goal_m, &limits, &route, n_others);
    let others: Vec<&RouteLine> = others.iter().map(|other| &other.line).collect();
    Answer { others: &others, reference, ..Answer::of(&planner, &route) }.show(&vehicle, arguments)
}

/// A map in tiles says of every cell itself how much it holds.
fn refuse_kinds(kinds: &GroundKinds) -> Result<(), UsageError> {
    let found = match (kinds.bare, &kinds.friction) {
        (Some(_), _) => "--bare",
        (None, Some(_)) => "--friction",
        (None, None) => return Ok(()),
    };
    Err(UsageError(format!(
        "{found}: expected with a file, or where `surefoot map` merges one, found with a map in tiles"
    )))
}

/// Leads the vehicle of a run to the goal, and shows the route that it drove in the end.
fn lead(
    arguments: &RouteArguments,
    vehicle: &Vehicle,
    name: &RunName,
    goal_m: [f64; 2],
) -> anyhow::Result<()> {
    arguments.results.prepare()?;
    let (mut led, heard) = Led::join(name)?;
    let start = arguments.start.map_or(heard, |StartPose { x_m, y_m, yaw_rad }| Place {
        at_m: [x_m, y_m],
        yaw_rad,
        ..heard
    });
    let machine = (vehicle, &Config::for_vehicle(vehicle));
    let world = &arguments.world;
    let mut guided = guided(world, &arguments.ground, arguments.speed, machine, start, goal_m)?;
    let GuidedSummary { map, length_m, expected_s, .. } = guided.told();
    println!("run {name}: {length_m:.0} m in {expected_s:.0} s expected, over {map}");
    led.lead(&mut guided)?;
    let GuidedSummary { n_again, n_kept, .. } = guided.told();
    println!("run {name}: goal reached; {n_again} routes again, {n_kept} times none other was found");
    let answer = Answer::of(guided.planner(), guided.route());
    Answer { reference: guided.reference(), ..answer }.show(vehicle, arguments)
}

/// A route to lead a vehicle along, over the ground of an elevation file or of a map in tiles.
pub(crate) fn guided(
    world: &Path,
    asked: &RouteGround,
    asked_mps: Option<f64>,
    (vehicle, settings): (&Vehicle, &Config),
    start: Place,
    goal_m: [f64; 2],
) -> anyhow::Result<Guided> {
    // Whoever turns on the way sweeps his length.
    let config = config(vehicle, vehicle.geometry.length_m + MARGIN_M);
    let Known { ground, reference } = known(world, asked, [start.at_m, goal_m])?;
    let planner = Planner::new(ground, config).map_err(UsageError::from_input)?;
    let limits = speed_limits(vehicle, asked_mps)?;
    let name = world.file_name().unwrap_or_default().to_string_lossy().into_owned();
    let map = SearchedMap { planner, name, reference };
    Guided::plan(map, limits, (vehicle, settings), start, goal_m).map_err(failed)
}

/// Places where nobody can stand are bad input; no way between them is an answer.
fn failed(error: RouteError) -> anyhow::Error {
    match error {
        RouteError::Outside { .. } | RouteError::Blocked { .. } => UsageError::from_input(error).into(),
        _ => WorkFailed(error.to_string()).into(),
    }
}

fn config(vehicle: &Vehicle, clear_width_m: f64) -> RouteConfig {
    RouteConfig {
        clear_width_m,
        pitch_max_rad: ATTITUDE_SHARE * vehicle.limits.pitch_max_rad,
        roll_max_rad: ATTITUDE_SHARE * vehicle.limits.roll_max_rad,
        ..RouteConfig::default()
    }
}

/// How fast a vehicle may become, at most as fast as asked [m/s].
fn speed_limits(vehicle: &Vehicle, asked_mps: Option<f64>) -> Result<SpeedLimits, UsageError> {
    let mass_kg = vehicle.body.mass_kg + 4.0 * vehicle.wheel.mass_kg;
    let per_torque = 1.0 / (vehicle.geometry.wheel_radius_m * mass_kg);
    let limits = SpeedLimits {
        speed_max_mps: asked_mps.unwrap_or(vehicle.limits.speed_max_mps),
        traction_max_mps2: (vehicle.drivetrain.drive_torque_max_nm * per_torque).min(100.0),
        braking_max_mps2: (vehicle.drivetrain.brake_torque_max_nm * per_torque).min(100.0),
        ..SpeedLimits::default()
    };
    limits.validate().map_err(UsageError::from_input)?;
    Ok(limits)
}
