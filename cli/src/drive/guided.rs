//! A drive along a route over a map of before: what to head for, and another route where the ground is not as the map says.

use std::path::Path;

use ::route::{Guide, Planner, Route, SpeedLimits};
use bench::closed_loop::ClosedLoop;
use serde::{Deserialize, Serialize};
use terrain::TerrainClass;

use super::scene::Scene;
use crate::arguments::{DriveArguments, RouteGround, WorldSource};
use crate::{UsageError, route};

/// How far ahead the vehicle heads for, as a share of the edge of its map: well within what it sees.
const REACH_SHARE: f64 = 0.3;
/// Who makes no more way than this [m] in so long [s] does not get on.
const STANDSTILL: (f64, f64) = (1.0, 20.0);
/// Time between two searches [s].
const SEARCH_PERIOD_S: f64 = 2.0;
/// How far ahead the route then counts as blocked, in lengths of the vehicle.
const BLOCKED_LENGTHS: f64 = 1.0;

/// Keeps a drive on a route.
pub(super) struct Guided {
    planner: Planner,
    limits: SpeedLimits,
    reach_m: f64,
    length_m: f64,
    goal_m: [f64; 2],
    tolerance_m: f64,
    guide: Guide,
    /// Where the route leads [m].
    line_m: Vec<[f64; 2]>,
    told: GuidedSummary,
    /// The way made on this route [m] when it was last more by a step, and when that was [s].
    made: (f64, f64),
    /// When a route was searched last [s].
    searched_at_s: f64,
}

/// What became of the routes of a drive; a part of `summary.json`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct GuidedSummary {
    /// File of the map that they were searched on.
    pub map: String,
    /// Length of the first [m].
    pub length_m: f64,
    /// Its expected time [s].
    pub expected_s: f64,
    /// Routes that were driven for what was seen on the one before.
    pub n_again: usize,
    /// How often none other was found.
    pub n_kept: usize,
}

impl Guided {
    /// The route of a drive; `None` where nobody asked for one.
    ///
    /// # Errors
    /// There is none, or no map to search one on.
    pub fn plan(arguments: &DriveArguments, scene: &Scene) -> anyhow::Result<Option<Self>> {
        let Some(map) = map(arguments)? else { return Ok(None) };
        // Whoever turns on the way sweeps his length.
        let clear_width_m = scene.vehicle.geometry.length_m + route::MARGIN_M;
        let planner = route::planner(&scene.vehicle, map, &RouteGround::default(), clear_width_m)?;
        let limits = route::speed_limits(&scene.vehicle, None);
        let [x_m, y_m, yaw_rad] = scene.task.start;
        let goal_m = scene.task.goal_m;
        let first = planner.route(([x_m, y_m], yaw_rad), goal_m, &limits).map_err(route::failed)?;
        let told = GuidedSummary {
            map: map.file_name().unwrap_or_default().to_string_lossy().into_owned(),
            length_m: first.length_m(),
            expected_s: first.duration_s,
            ..GuidedSummary::default()
        };
        let reach_m = REACH_SHARE * scene.config.risk_map.n_cols as f64 * scene.config.risk_resolution_m();
        Ok(Some(Self {
            guide: Guide::new(&first, reach_m),
            line_m: line_m(&first),
            planner,
            limits,
            reach_m,
            length_m: scene.vehicle.geometry.length_m,
            goal_m,
            tolerance_m: scene.task.goal_tolerance_m,
            told,
            made: (0.0, 0.0),
            searched_at_s: 0.0,
        }))
    }

    /// Has the drive head for what comes next, after a cycle that may have renewed the map.
    pub fn lead(&mut self, closed: &mut ClosedLoop, is_renewed: bool) -> anyhow::Result<()> {
        let odometry = closed.episode.observe().odometry;
        let ([x_m, y_m, _], [_, _, yaw_rad]) = (odometry.position_m, odometry.attitude_rad);
        let (at_m, time_s) = ([x_m, y_m], closed.episode.time_s());
        if is_renewed {
            self.planner.note_obstacles(obstacles_m(closed));
            self.look(at_m, yaw_rad, time_s);
        }
        if let Some(place_m) = self.guide.advance(at_m) {
            let goals_m = if place_m == self.goal_m { vec![place_m] } else { vec![place_m, self.goal_m] };
            closed.follow(navigator::Route::goals(goals_m, self.tolerance_m)?)?;
        }
        Ok(())
    }

    /// Another route where this one is blocked by what was seen, or leads no farther.
    fn look(&mut self, at_m: [f64; 2], yaw_rad: f64, time_s: f64) {
        let made_m = self.guide.way_made_m();
        if made_m >= self.made.0 + STANDSTILL.0 {
            self.made = (made_m, time_s);
        }
        if time_s - self.searched_at_s < SEARCH_PERIOD_S {
            return;
        }
        let stands = time_s - self.made.1 > STANDSTILL.1;
        if stands {
            let skipped = (BLOCKED_LENGTHS * self.length_m / self.guide.spacing_m()) as usize;
            self.planner.note_obstacles(self.guide.ahead_m().get(skipped).copied());
        }
        if stands || self.planner.first_barrier(self.guide.ahead_m()).is_some() {
            (self.made, self.searched_at_s) = ((0.0, time_s), time_s);
            match self.planner.route((at_m, yaw_rad), self.goal_m, &self.limits) {
                Ok(next) => self.take(&next),
                Err(_) => self.told.n_kept += 1,
            }
        }
    }

    fn take(&mut self, next: &Route) {
        self.guide = Guide::new(next, self.reach_m);
        self.line_m = line_m(next);
        self.told.n_again += 1;
    }

    /// What became of it.
    pub fn told(&self) -> &GuidedSummary {
        &self.told
    }

    /// Where the last route leads [m].
    pub fn line_m(&self) -> &[[f64; 2]] {
        &self.line_m
    }
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

fn line_m(route: &Route) -> Vec<[f64; 2]> {
    route.points.iter().map(|point| point.at_m).collect()
}

/// Where the vehicle sees obstacles [m].
fn obstacles_m(closed: &ClosedLoop) -> Vec<[f64; 2]> {
    let surface = closed.navigator.surface();
    let geometry = surface.geometry();
    let obstacles =
        surface.values().iter().enumerate().filter(|(_, cell)| cell.class() == TerrainClass::Obstacle);
    obstacles.map(|(index, _)| geometry.centre_m(geometry.cell(index))).collect()
}
