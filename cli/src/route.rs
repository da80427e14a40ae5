//! `surefoot route`: a way over measured ground and the speeds along it, as text, CSV, JSON and picture.

mod guided;
mod lead;

use std::path::Path;

use ::route::{
    FrictionCurve, GroundLayers, Planner, Route, RouteConfig, RouteError, RoutePoint, SpeedLimits,
};
use bicycle::Vehicle;
use bus::channel::RunName;
use formats::{ConfigText, read_elevation, read_vehicle};
use friction::FrictionTable;
use navigator::Config;
use report::route::RoutePicture;
use serde::Serialize;

use crate::arguments::{BareGround, RouteArguments, RouteGround, StartPose};
use crate::{UsageError, WorkFailed, summary};
pub use guided::GuidedSummary;
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
    let planner =
        planner(&vehicle, &arguments.world, &arguments.ground, vehicle.geometry.width_m + MARGIN_M)?;
    arguments.results.prepare()?;
    let start =
        arguments.start.ok_or_else(|| UsageError("--start: expected X,Y,YAW, found none".to_owned()))?;
    let from = ([start.x_m, start.y_m], start.yaw_rad);
    let route = planner.route(from, goal_m, &limits).map_err(failed)?;
    let n_others = usize::from(arguments.alternatives);
    let others = planner.alternatives(from, goal_m, &limits, &route, n_others).map_err(failed)?;
    show(&planner, &route, &others, &vehicle, arguments)
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
    let mut guided = guided(&arguments.world, &arguments.ground, arguments.speed, machine, start, goal_m)?;
    let GuidedSummary { map, length_m, expected_s, .. } = guided.told();
    println!("run {name}: {length_m:.0} m in {expected_s:.0} s expected, over {map}");
    led.lead(&mut guided)?;
    let GuidedSummary { n_again, n_kept, .. } = guided.told();
    println!("run {name}: goal reached; {n_again} routes again, {n_kept} times none other was found");
    show(guided.planner(), guided.route(), &[], vehicle, arguments)
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
    let planner = planner(vehicle, world, asked, vehicle.geometry.length_m + MARGIN_M)?;
    let limits = speed_limits(vehicle, asked_mps)?;
    let map = world.file_name().unwrap_or_default().to_string_lossy().into_owned();
    Guided::plan((planner, limits, map), (vehicle, config), start, goal_m).map_err(failed)
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
    world: &Path,
    asked: &RouteGround,
    clear_width_m: f64,
) -> Result<Planner, UsageError> {
    let file = read_elevation(world).map_err(UsageError::from_input)?;
    let cell_m = asked.cell.unwrap_or_else(|| file.elevation.geometry().resolution_m.clamp(0.5, 2.0));
    let learned = learned(asked.friction.as_deref())?;
    let curve = |(name, published): (&str, FrictionCurve)| {
        learned.as_ref().map_or(published, |table| table.curve_or(name, published))
    };
    let layers = GroundLayers {
        elevation_m: &file.elevation,
        low_vegetation_fraction: file.layers.low_vegetation_fraction.as_ref(),
        water: file.layers.water.as_ref(),
        ground_gap_m: file.layers.ground_gap_m.as_ref(),
        bare: curve(asked.bare.published()),
        grass: curve(BareGround::Grass.published()),
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

/// What is said of a route.
#[derive(Serialize)]
struct Summary {
    revision: &'static str,
    world: String,
    vehicle: String,
    length_m: f64,
    duration_s: f64,
    climb_m: f64,
    steepest_deg: f64,
    fastest_mps: f64,
    tightest_radius_m: f64,
    turning_radius_m: f64,
    cost_m: f64,
    n_expanded: usize,
    corners_m: Vec<[f64; 2]>,
    alternatives: Vec<Alternative>,
}

/// Another way to the same goal.
#[derive(Serialize)]
struct Alternative {
    length_m: f64,
    duration_s: f64,
    line_m: Vec<[f64; 2]>,
}

impl Alternative {
    fn of(route: &Route) -> Self {
        Self { length_m: route.length_m(), duration_s: route.duration_s, line_m: route.line_m() }
    }
}

impl Summary {
    fn of(route: &Route, vehicle: &Vehicle, arguments: &RouteArguments) -> Self {
        let points = &route.points;
        let largest = |value: &dyn Fn(&RoutePoint) -> f64| points.iter().map(value).fold(0.0, f64::max);
        let climbs_m = points.windows(2).map(|ends| (ends[1].height_m - ends[0].height_m).max(0.0));
        let slope = |point: &RoutePoint| point.bend.grade.hypot(point.bend.cross_slope);
        let every = points.len().div_ceil(CORNERS).max(1);
        let corners = points
            .iter()
            .step_by(every)
            .chain(points.last().filter(|_| !(points.len() - 1).is_multiple_of(every)));
        Self {
            revision: summary::revision(),
            world: arguments.world.file_name().unwrap_or_default().to_string_lossy().into_owned(),
            vehicle: vehicle.name.clone(),
            length_m: route.length_m(),
            duration_s: route.duration_s,
            climb_m: climbs_m.sum(),
            steepest_deg: largest(&slope).atan().to_degrees(),
            fastest_mps: largest(&|point| point.speed_mps),
            tightest_radius_m: 1.0 / largest(&|point| point.bend.curvature_per_m.abs()).max(1e-6),
            turning_radius_m: vehicle.geometry.wheelbase_m / vehicle.limits.steering_max_rad.tan(),
            cost_m: route.cost_m,
            n_expanded: route.n_expanded,
            corners_m: corners.map(|point| point.at_m).collect(),
            alternatives: Vec::new(),
        }
    }

    fn text(&self) -> String {
        let corners: Vec<String> =
            self.corners_m.iter().map(|[x_m, y_m]| format!("{x_m:.1},{y_m:.1}")).collect();
        let warning = if self.tightest_radius_m < self.turning_radius_m {
            format!("\n  tighter than the vehicle turns ({:.1} m)", self.turning_radius_m)
        } else {
            String::new()
        };
        let other = |Alternative { length_m, duration_s, .. }: &Alternative| {
            format!("  another way        {length_m:.1} m in {duration_s:.1} s\n")
        };
        let others: String = self.alternatives.iter().map(other).collect();
        format!(
            "  {} over {}\n  length             {:.1} m\n  expected time      {:.1} s\n  climb              {:.1} m\n  \
             steepest           {:.1} deg\n  fastest            {:.1} m/s\n  tightest radius    {:.1} m{warning}\n  \
             states expanded    {}\n{others}  corners            {}\n",
            self.vehicle,
            self.world,
            self.length_m,
            self.duration_s,
            self.climb_m,
            self.steepest_deg,
            self.fastest_mps,
            self.tightest_radius_m,
            self.n_expanded,
            corners.join(" ")
        )
    }
}

/// Corners that are printed, at most.
const CORNERS: usize = 24;

/// Prints a route and leaves its files.
fn show(
    planner: &Planner,
    route: &Route,
    others: &[Route],
    vehicle: &Vehicle,
    arguments: &RouteArguments,
) -> anyhow::Result<()> {
    let alternatives = others.iter().map(Alternative::of).collect();
    let summary = Summary { alternatives, ..Summary::of(route, vehicle, arguments) };
    print!("{}", summary.text());
    arguments.results.write_json("route.json", &summary)?;
    arguments.results.write("route.csv", csv(route).as_bytes())?;
    let title = format!("{}: {:.0} m in {:.0} s", summary.vehicle, summary.length_m, summary.duration_s);
    let subtitle = format!(
        "{}, climb {:.0} m, steepest {:.0} deg, tightest radius {:.1} m",
        summary.world, summary.climb_m, summary.steepest_deg, summary.tightest_radius_m
    );
    let picture =
        RoutePicture { title: &title, subtitle: &subtitle, ground: planner.ground(), route, others };
    arguments.results.write("route.png", &report::route::picture(&picture)?)?;
    println!("\n  route.png, route.csv and route.json in {}", arguments.results.out.display());
    Ok(())
}

fn csv(route: &Route) -> String {
    let mut text = String::from("x_m,y_m,yaw_rad,height_m,speed_mps,curvature_per_m,grade,friction\n");
    for RoutePoint { at_m: [x_m, y_m], yaw_rad, height_m, bend, speed_mps } in &route.points {
        let (curvature, grade, friction) = (bend.curvature_per_m, bend.grade, bend.friction);
        let row = format!(
            "{x_m:.3},{y_m:.3},{yaw_rad:.5},{height_m:.3},{speed_mps:.4},{curvature:.5},{grade:.5},{friction:.4}\n"
        );
        text.push_str(&row);
    }
    text
}
