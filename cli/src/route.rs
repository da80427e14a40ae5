//! `surefoot route`: a way over measured ground and the speeds along it, and a vehicle led along it.

mod answer;
mod guided;
mod lead;

use std::path::Path;

use ::route::{FrictionCurve, GroundLayers, Planner, RouteConfig, RouteError, SpeedLimits};
use bicycle::Vehicle;
use bus::channel::RunName;
use formats::{ConfigText, ElevationFile, read_elevation, read_vehicle};
use friction::FrictionTable;
use navigator::{Config, FrictionConfig};

use crate::arguments::{BareGround, RouteArguments, RouteGround, StartPose};
use crate::{UsageError, WorkFailed};
use answer::Answer;
pub use guided::GuidedSummary;
use guided::SearchedMap;
pub(crate) use guided::{Guided, Place};
use lead::Led;

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
    let limits = speed_limits(&vehicle, arguments.speed)?;
    let file = read_elevation(&arguments.world).map_err(UsageError::from_input)?;
    let planner = planner(&vehicle, &file, &arguments.ground, vehicle.geometry.width_m + MARGIN_M)?;
    arguments.results.prepare()?;
    let start =
        arguments.start.ok_or_else(|| UsageError("--start: expected X,Y,YAW, found none".to_owned()))?;
    let from = ([start.x_m, start.y_m], start.yaw_rad);
    let route = planner.route(from, goal_m, &limits).map_err(failed)?;
    let n_others = usize::from(arguments.alternatives);
    let others = planner.alternatives(from, goal_m, &limits, &route, n_others);
    let reference = file.reference();
    Answer { planner: &planner, route: &route, others: &others, reference }.show(&vehicle, arguments)
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
    let (planner, route, reference) = (guided.planner(), guided.route(), guided.reference());
    Answer { planner, route, others: &[], reference }.show(vehicle, arguments)
}

/// A route to lead a vehicle along, over the ground of an elevation file.
pub(crate) fn guided(
    world: &Path,
    asked: &RouteGround,
    asked_mps: Option<f64>,
    (vehicle, config): (&Vehicle, &Config),
    start: Place,
    goal_m: [f64; 2],
) -> anyhow::Result<Guided> {
    // Whoever turns on the way sweeps his length.
    let file = read_elevation(world).map_err(UsageError::from_input)?;
    let planner = planner(vehicle, &file, asked, vehicle.geometry.length_m + MARGIN_M)?;
    let limits = speed_limits(vehicle, asked_mps)?;
    let name = world.file_name().unwrap_or_default().to_string_lossy().into_owned();
    let map = SearchedMap { planner, name, reference: file.reference() };
    Guided::plan(map, limits, (vehicle, config), start, goal_m).map_err(failed)
}

/// Places where nobody can stand are bad input; no way between them is an answer.
fn failed(error: RouteError) -> anyhow::Error {
    match error {
        RouteError::Outside { .. } | RouteError::Blocked { .. } => UsageError::from_input(error).into(),
        _ => WorkFailed(error.to_string()).into(),
    }
}

/// Searches the ground of an elevation file for routes of a vehicle, which are clear of obstacles by half of a width [m].
fn planner(
    vehicle: &Vehicle,
    file: &ElevationFile,
    asked: &RouteGround,
    clear_width_m: f64,
) -> Result<Planner, UsageError> {
    let cell_m = asked.cell.unwrap_or_else(|| file.elevation.geometry().resolution_m.clamp(0.5, 2.0));
    let learned = learned(asked.friction.as_deref())?;
    let curve = |ground: BareGround| {
        let (name, published) = ground.published();
        learned.as_ref().map_or(published, |table| table.curve_or(name, published))
    };
    let layers = GroundLayers {
        elevation_m: &file.elevation,
        low_vegetation_fraction: file.layers.low_vegetation_fraction.as_ref(),
        water: file.layers.water.as_ref(),
        ground_gap_m: file.layers.ground_gap_m.as_ref(),
        bare: curve(asked.bare),
        grass: curve(BareGround::Grass),
    };
    let ground = layers.ground(cell_m).map_err(UsageError::from_input)?;
    Planner::new(ground, config(vehicle, clear_width_m)).map_err(UsageError::from_input)
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

impl BareGround {
    fn published(self) -> (&'static str, FrictionCurve) {
        FrictionCurve::PUBLISHED[self as usize]
    }
}

/// Sliding speed at which the controller is told of friction [m/s].
const TOLD_AT_MPS: f32 = 1.0;

/// What the controller is told of friction, if a file was named.
pub(crate) fn known_friction(asked: &RouteGround) -> Result<Option<FrictionConfig>, UsageError> {
    let told = |table: FrictionTable| {
        let at = |ground: BareGround| {
            let (name, published) = ground.published();
            Some(f64::from(table.curve_or(name, published).at(TOLD_AT_MPS)))
        };
        FrictionConfig {
            open: at(asked.bare),
            loose: at(BareGround::Sand),
            vegetation: at(BareGround::Grass),
        }
    };
    Ok(learned(asked.friction.as_deref())?.map(told))
}

/// The friction that drives showed, if a file was named.
fn learned(path: Option<&Path>) -> Result<Option<FrictionTable>, UsageError> {
    let Some(path) = path else { return Ok(None) };
    let text = ConfigText::read(path).map_err(UsageError::from_input)?;
    let table: FrictionTable = text.parse().map_err(UsageError::from_input)?;
    match table.validate() {
        Ok(()) => Ok(Some(table)),
        Err(error) => Err(UsageError::from_input(text.refuse(&error.field, error.expected, error.found))),
    }
}
