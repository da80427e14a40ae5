//! What is said of a route, and what is left of it: text, CSV, JSON, GeoJSON and picture.

use ::route::{GroundCell, Planner, Route, RouteLine, RoutePoint};
use bicycle::Vehicle;
use formats::{GeoLine, MapReference};
use report::route::RoutePicture;
use serde::Serialize;
use serde_json::{Map, Value};
use terrain::GridMap;

use crate::arguments::RouteArguments;
use crate::{UsageError, summary};

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
    /// Null of a way that was searched in legs.
    cost_m: Option<f64>,
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
    fn of(line: &&RouteLine) -> Self {
        Self { length_m: line.length_m(), duration_s: line.duration_s, line_m: line.places_m() }
    }
}

impl Summary {
    fn of(answer: &Answer<'_>, vehicle: &Vehicle, arguments: &RouteArguments) -> Self {
        let line = answer.line;
        let points = &line.points;
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
            length_m: line.length_m(),
            duration_s: line.duration_s,
            climb_m: climbs_m.sum(),
            steepest_deg: largest(&slope).atan().to_degrees(),
            fastest_mps: largest(&|point| point.speed_mps),
            tightest_radius_m: 1.0 / largest(&|point| point.bend.curvature_per_m.abs()).max(1e-6),
            turning_radius_m: vehicle.geometry.wheelbase_m / vehicle.limits.steering_max_rad.tan(),
            cost_m: answer.cost_m,
            n_expanded: answer.n_expanded,
            corners_m: corners.map(|point| point.at_m).collect(),
            alternatives: answer.others.iter().map(Alternative::of).collect(),
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

/// A route that was found, on its map.
pub(super) struct Answer<'a> {
    pub ground: &'a GridMap<GroundCell>,
    pub line: &'a RouteLine,
    pub others: &'a [&'a RouteLine],
    /// Of the way over the cells, where it was searched as one [metres of way].
    pub cost_m: Option<f64>,
    /// States that the search expanded.
    pub n_expanded: usize,
    /// Where the map lies on the globe, if its file tells.
    pub reference: Option<MapReference>,
}

impl<'a> Answer<'a> {
    /// A route that was searched at once, alone, of a map that lies nowhere on the globe.
    pub fn of(planner: &'a Planner, route: &'a Route) -> Self {
        Self {
            ground: planner.ground(),
            line: &route.line,
            others: &[],
            reference: None,
            cost_m: Some(route.cost_m),
            n_expanded: route.n_expanded,
        }
    }

    /// Prints it and leaves its files.
    pub fn show(&self, vehicle: &Vehicle, arguments: &RouteArguments) -> anyhow::Result<()> {
        let summary = Summary::of(self, vehicle, arguments);
        print!("{}", summary.text());
        let results = &arguments.results;
        results.write_json("route.json", &summary)?;
        results.write("route.csv", csv(self.line).as_bytes())?;
        results.write("route.png", &self.picture(&summary)?)?;
        let told = match &self.reference {
            Some(reference) => {
                results.write_json("route.geojson", &self.geojson(reference)?)?;
                "route.png, route.csv, route.geojson and route.json"
            }
            None => "route.png, route.csv and route.json",
        };
        println!("\n  {told} in {}", results.out.display());
        Ok(())
    }

    fn picture(&self, summary: &Summary) -> Result<Vec<u8>, report::EncodeError> {
        let title = format!("{}: {:.0} m in {:.0} s", summary.vehicle, summary.length_m, summary.duration_s);
        let subtitle = format!(
            "{}, climb {:.0} m, steepest {:.0} deg, tightest radius {:.1} m",
            summary.world, summary.climb_m, summary.steepest_deg, summary.tightest_radius_m
        );
        let Self { ground, line, others, .. } = *self;
        report::route::picture(&RoutePicture { title: &title, subtitle: &subtitle, ground, line, others })
    }

    /// The best way first.
    fn geojson(&self, reference: &MapReference) -> Result<Value, UsageError> {
        let ways: Vec<&RouteLine> = std::iter::once(self.line).chain(self.others.iter().copied()).collect();
        let lines_m: Vec<Vec<[f64; 2]>> = ways.iter().map(|way| way.places_m()).collect();
        let lines: Vec<GeoLine<'_>> = ways
            .iter()
            .zip(&lines_m)
            .map(|(way, points_m)| GeoLine { points_m, properties: properties(way) })
            .collect();
        formats::geojson(&lines, reference).map_err(UsageError::from_input)
    }
}

fn properties(way: &RouteLine) -> Map<String, Value> {
    let told = [("length_m", way.length_m()), ("duration_s", way.duration_s)];
    told.into_iter().map(|(key, value)| (key.to_owned(), value.into())).collect()
}

fn csv(line: &RouteLine) -> String {
    let mut text = String::from("x_m,y_m,yaw_rad,height_m,speed_mps,curvature_per_m,grade,friction\n");
    for RoutePoint { at_m: [x_m, y_m], yaw_rad, height_m, bend, speed_mps } in &line.points {
        let (curvature, grade, friction) = (bend.curvature_per_m, bend.grade, bend.friction);
        let row = format!(
            "{x_m:.3},{y_m:.3},{yaw_rad:.5},{height_m:.3},{speed_mps:.4},{curvature:.5},{grade:.5},{friction:.4}\n"
        );
        text.push_str(&row);
    }
    text
}
