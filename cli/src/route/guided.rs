//! A route that a vehicle is led along: what to head for, and another route where the ground is not as the map says.

use ::route::{Guide, Planner, Route, RouteError, SpeedLimits};
use bicycle::Vehicle;
use formats::MapReference;
use navigator::Config;
use serde::{Deserialize, Serialize};
use terrain::{GridMap, SurfaceCell, TerrainClass};

/// How far ahead the vehicle heads for, as a share of the edge of its map: well within what it sees.
const REACH_SHARE: f64 = 0.3;
/// Who makes no more way than this [m] in so long [s] does not get on.
const STANDSTILL: (f64, f64) = (1.0, 20.0);
/// Time between two searches [s].
const SEARCH_PERIOD_S: f64 = 2.0;

/// Where a vehicle is.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Place {
    /// In the map frame [m].
    pub at_m: [f64; 2],
    /// Counter-clockwise from east [rad].
    pub yaw_rad: f64,
    /// When it was there [s].
    pub time_s: f64,
}

/// A map that routes are searched on.
pub(super) struct SearchedMap {
    pub planner: Planner,
    /// Name of its file.
    pub name: String,
    /// Where it lies on the globe, if the file tells.
    pub reference: Option<MapReference>,
}

/// Leads a vehicle along a route.
pub(crate) struct Guided {
    planner: Planner,
    reference: Option<MapReference>,
    limits: SpeedLimits,
    goal_m: [f64; 2],
    reach_m: f64,
    length_m: f64,
    guide: Guide,
    route: Route,
    told: GuidedSummary,
    /// The way made on this route [m] when it was last more by a step, and when that was [s].
    made: (f64, f64),
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
    /// A route from a place to a goal for a vehicle whose own map has the extent of its settings.
    ///
    /// # Errors
    /// There is none.
    pub(super) fn plan(
        SearchedMap { planner, name, reference }: SearchedMap,
        limits: SpeedLimits,
        (vehicle, config): (&Vehicle, &Config),
        start: Place,
        goal_m: [f64; 2],
    ) -> Result<Self, RouteError> {
        let route = planner.route((start.at_m, start.yaw_rad), goal_m, &limits)?;
        let told = GuidedSummary {
            map: name,
            length_m: route.line.length_m(),
            expected_s: route.line.duration_s,
            ..GuidedSummary::default()
        };
        let reach_m = REACH_SHARE * config.risk_map.n_cols as f64 * config.risk_resolution_m();
        Ok(Self {
            guide: Guide::new(&route, reach_m),
            route,
            planner,
            reference,
            limits,
            goal_m,
            reach_m,
            length_m: vehicle.geometry.length_m,
            told,
            made: (0.0, start.time_s),
            searched_at_s: start.time_s,
        })
    }

    /// What to head for now, where that is something else than before: a place on the way and then the goal, or that alone.
    pub fn advance(&mut self, at_m: [f64; 2]) -> Option<Vec<[f64; 2]>> {
        let place_m = self.guide.advance(at_m)?;
        Some(if place_m == self.goal_m { vec![place_m] } else { vec![place_m, self.goal_m] })
    }

    /// Takes in what the vehicle sees, and searches another route where this one is blocked by it or leads no farther.
    pub fn look(&mut self, surface: &GridMap<SurfaceCell>, place: Place) {
        self.planner.note_obstacles(obstacles_m(surface));
        let made_m = self.guide.way_made_m();
        if made_m >= self.made.0 + STANDSTILL.0 {
            self.made = (made_m, place.time_s);
        }
        if place.time_s - self.searched_at_s < SEARCH_PERIOD_S {
            return;
        }
        let stands = place.time_s - self.made.1 > STANDSTILL.1;
        if stands {
            // What it is that keeps the vehicle is not known, but that it is there.
            let ahead = (self.length_m / self.route.line.spacing_m) as usize;
            self.planner.note_obstacles(self.guide.ahead_m().get(ahead).copied());
        }
        if stands || self.planner.first_barrier(self.guide.ahead_m()).is_some() {
            self.search(place);
        }
    }

    /// The vehicle was told to stand: that it makes no way says nothing.
    pub fn rest(&mut self, time_s: f64) {
        self.made.1 = time_s;
    }

    fn search(&mut self, Place { at_m, yaw_rad, time_s }: Place) {
        (self.made, self.searched_at_s) = ((0.0, time_s), time_s);
        match self.planner.route((at_m, yaw_rad), self.goal_m, &self.limits) {
            Ok(next) => {
                self.guide = Guide::new(&next, self.reach_m);
                self.route = next;
                self.told.n_again += 1;
            }
            Err(_) => self.told.n_kept += 1,
        }
    }

    /// What became of it.
    pub fn told(&self) -> &GuidedSummary {
        &self.told
    }

    /// The route that is driven now, or was last.
    pub fn route(&self) -> &Route {
        &self.route
    }

    /// Where the map lies on the globe, if its file tells.
    pub fn reference(&self) -> Option<MapReference> {
        self.reference
    }

    /// The map, with the obstacles that were seen.
    pub fn planner(&self) -> &Planner {
        &self.planner
    }
}

/// Where obstacles are seen [m].
fn obstacles_m(surface: &GridMap<SurfaceCell>) -> impl Iterator<Item = [f64; 2]> + '_ {
    let geometry = surface.geometry();
    let obstacles =
        surface.values().iter().enumerate().filter(|(_, cell)| cell.class() == TerrainClass::Obstacle);
    obstacles.map(|(index, _)| geometry.centre_m(geometry.cell(index)))
}
