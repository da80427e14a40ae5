//! Routes over maps that do not fit into memory: coarsely over the whole way, then finely along it, a leg at a time.

use crate::line::{self, Gate, Line, RouteLine, Undrivable, heading_of};
use crate::planner::{Planner, PlannerError, RouteError};
use crate::speed::{Bend, SpeedLimits};
use crate::tiles::{TileError, TileMap};
use crate::{GroundCell, RouteConfig};
use terrain::{Cell, CellRegion, GridMap};

/// Cells that the coarse search may have: with its edges and states less than half a gigabyte.
const COARSE_CELLS_MAX: f64 = 2e6;
/// Levels between the cells that were asked for and those between them and the coarse ones.
const MIDDLE_LEVELS: u8 = 2;
/// Room around a leg is twice, four and eight times as much where there is no way.
const WIDENINGS: [f64; 4] = [1.0, 2.0, 4.0, 8.0];
/// Points of the line whose ground is read at a time.
const READ_POINTS: usize = 128;
/// How often the last search is made again around places where no speed will do, at most.
const DETOURS_MAX: usize = 16;

/// How a way over larger cells is searched again over smaller ones, a leg at a time.
#[derive(Clone, Copy)]
struct Refinement {
    /// How far ahead a leg is searched [m].
    searched_m: f64,
    /// And how much of it is kept [m].
    kept_m: f64,
    /// Room around it [m].
    margin_m: f64,
}

/// Along the coarse way, whose cells are metres long.
const BROAD: Refinement = Refinement { searched_m: 150.0, kept_m: 100.0, margin_m: 40.0 };
/// Along a way over cells four times as large: what is left to find is how it passes what these do not show.
const NARROW: Refinement = Refinement { searched_m: 60.0, kept_m: 40.0, margin_m: 3.0 };

/// Why there is no far route.
#[derive(Debug, thiserror::Error)]
pub enum FarRouteError {
    /// The map cannot be read.
    #[error(transparent)]
    Tiles(#[from] TileError),
    /// A part of it makes no map for a search.
    #[error(transparent)]
    Planner(#[from] PlannerError),
    /// There is no way.
    #[error(transparent)]
    Route(#[from] RouteError),
}

/// A route over a map in tiles.
#[derive(Clone, Debug, PartialEq)]
pub struct FarRoute {
    /// The smooth line, and how fast to drive it.
    pub line: RouteLine,
    /// Legs that it was searched in.
    pub n_legs: usize,
    /// States that all searches expanded.
    pub n_expanded: usize,
}

/// The route from a pose to a point over the cells of a map's `level`, as [`Planner::route`] finds it on one grid, but
/// that larger cells decide which side of a hill is taken: a search over cells so large that two million hold the way,
/// then one along that over cells four times as large as the level's, and one along that over these.
///
/// # Errors
/// A map that cannot be read, or no way, and why.
pub fn far_route(
    map: &mut TileMap,
    level: u8,
    config: &RouteConfig,
    (start_m, yaw_rad): ([f64; 2], f64),
    goal_m: [f64; 2],
    limits: &SpeedLimits,
) -> Result<FarRoute, FarRouteError> {
    if !yaw_rad.is_finite() {
        return Err(RouteError::Yaw { found_rad: yaw_rad }.into());
    }
    let from = (start_m, heading_of(yaw_rad));
    let mut search = Search { map, level, config, goal_m, closed_m: Vec::new(), n_legs: 0, n_expanded: 0 };
    let (coarse, mut guide) = search.coarse(from)?;
    let middle = level + MIDDLE_LEVELS;
    let is_broad = coarse <= middle;
    if !is_broad {
        let gates = search.refined(middle, BROAD, &guide, from)?;
        guide = gates.iter().map(|gate| gate.at_m).chain([goal_m]).collect();
    }
    let refinement = if is_broad { BROAD } else { NARROW };
    let mut n_detours = 0;
    loop {
        let mut corridor = search.refined(level, refinement, &guide, from)?;
        line::fix_ends(&mut corridor, start_m, goal_m);
        let line = Line::through(&corridor, search.map.cell_m(level))?;
        let grounded = search.grounded(&line)?;
        let Undrivable { error, mut places_m } = match line.driven(grounded, limits) {
            Ok(line) => return Ok(FarRoute { line, n_legs: search.n_legs, n_expanded: search.n_expanded }),
            Err(undrivable) => undrivable,
        };
        n_detours += 1;
        let is_off = |end_m: [f64; 2], [x_m, y_m]: [f64; 2]| {
            libm::hypot(x_m - end_m[0], y_m - end_m[1]) > config.clear_width_m
        };
        places_m.retain(|place_m| is_off(start_m, *place_m) && is_off(goal_m, *place_m));
        if places_m.is_empty() || n_detours > DETOURS_MAX {
            return Err(RouteError::from(error).into());
        }
        search.closed_m.extend(places_m);
    }
}

/// A search over several levels of a map.
struct Search<'a> {
    map: &'a mut TileMap,
    level: u8,
    config: &'a RouteConfig,
    goal_m: [f64; 2],
    /// Places that no line over the cells of the level is to pass again [m].
    closed_m: Vec<[f64; 2]>,
    n_legs: usize,
    n_expanded: usize,
}

impl Search<'_> {
    /// The way over so large cells that all of it can be searched at once, and their level.
    fn coarse(
        &mut self,
        (start_m, heading): ([f64; 2], usize),
    ) -> Result<(u8, Vec<[f64; 2]>), FarRouteError> {
        let goal_m = self.goal_m;
        let ends_m = [start_m, goal_m];
        let level = self.map.level_within(self.level, ends_m, COARSE_CELLS_MAX);
        let level = level.ok_or(RouteError::Outside { name: "goal", found_m: goal_m })?;
        let ground = self.map.around(level, &ends_m, TileMap::room_m(ends_m))?;
        let planner = self.planner(level, ground)?;
        let (start, goal) = (planner.open_cell("start", start_m)?, planner.open_cell("goal", goal_m)?);
        let path = planner.search((start, heading), goal, goal_m)?;
        self.n_expanded += path.n_expanded;
        let geometry = *planner.ground().geometry();
        let centres_m = path.cells.iter().map(|cell| geometry.centre_m(*cell));
        Ok((level, centres_m.chain([goal_m]).collect()))
    }

    /// A planner over a part of a level.
    fn planner(&self, level: u8, ground: GridMap<GroundCell>) -> Result<Planner, FarRouteError> {
        // Ground of larger cells is rougher by the shape that small ones follow.
        let growth = self.map.cell_m(level) / self.map.cell_m(self.level);
        let roughness_max_m = (self.config.roughness_max_m * growth).min(100.0);
        let mut planner = Planner::new(ground, RouteConfig { roughness_max_m, ..*self.config })?;
        if level == self.level {
            self.closed_m.iter().for_each(|place_m| planner.close_around(*place_m));
        }
        Ok(planner)
    }

    /// The way over the cells of a level along one over larger cells.
    fn refined(
        &mut self,
        level: u8,
        refinement: Refinement,
        guide: &[[f64; 2]],
        (mut at_m, mut heading): ([f64; 2], usize),
    ) -> Result<Vec<Gate>, FarRouteError> {
        let mut corridor: Vec<Gate> = Vec::new();
        loop {
            let leg = Leg::ahead(guide, at_m, refinement.searched_m);
            let kept = self.searched(level, refinement, &leg, (at_m, heading))?;
            self.n_legs += 1;
            corridor.extend_from_slice(if corridor.is_empty() { &kept.gates } else { &kept.gates[1..] });
            if leg.is_last {
                return Ok(corridor);
            }
            if kept.gates.len() < 2 {
                return Err(RouteError::Smooth { n_cells: corridor.len() }.into());
            }
            (at_m, heading) = (kept.end_m, kept.heading);
        }
    }

    /// The way of a leg, as far as it is kept.
    fn searched(
        &mut self,
        level: u8,
        Refinement { kept_m, margin_m, .. }: Refinement,
        leg: &Leg,
        (from_m, heading): ([f64; 2], usize),
    ) -> Result<Kept, FarRouteError> {
        let mut found = None;
        for widening in WIDENINGS {
            let ground = leg.ground(self.map, level, from_m, widening * margin_m)?;
            let planner = self.planner(level, ground)?;
            match leg.attempt(&planner, (from_m, heading)) {
                Ok((cells, n)) => {
                    self.n_expanded += n;
                    return Ok(leg.kept(&planner, &cells, kept_m));
                }
                Err(error) => found = Some(error),
            }
        }
        Err(found.unwrap_or(RouteError::Smooth { n_cells: 0 }).into())
    }

    /// The ground under a line.
    fn grounded(&mut self, line: &Line) -> Result<Vec<(Bend, f64)>, FarRouteError> {
        let sliding_mps = self.config.sliding_mps as f32;
        let mut grounded = Vec::with_capacity(line.samples.len());
        for samples in line.samples.chunks(READ_POINTS) {
            let points_m: Vec<[f64; 2]> = samples.iter().map(|sample| sample.at_m).collect();
            let ground = self.map.around(self.level, &points_m, 3.0 * self.map.cell_m(self.level))?;
            grounded.extend(samples.iter().map(|sample| line::grounded(&ground, sliding_mps, sample)));
        }
        Ok(grounded)
    }
}

/// A piece of a way over larger cells.
struct Leg {
    /// From about where it begins [m].
    guide: Vec<[f64; 2]>,
    is_last: bool,
}

/// What is kept of a leg's way.
struct Kept {
    gates: Vec<Gate>,
    /// Where it ends [m].
    end_m: [f64; 2],
    /// And in which direction of the search.
    heading: usize,
}

impl Leg {
    fn ahead(guide: &[[f64; 2]], from_m: [f64; 2], searched_m: f64) -> Self {
        let away_m = |point: &[f64; 2]| libm::hypot(point[0] - from_m[0], point[1] - from_m[1]);
        let nearest = (0..guide.len()).min_by(|a, b| away_m(&guide[*a]).total_cmp(&away_m(&guide[*b])));
        let nearest = nearest.unwrap_or(0);
        let mut left_m = searched_m;
        let step_m = |index: usize| {
            let [from, to] = [guide[index - 1], guide[index]];
            libm::hypot(to[0] - from[0], to[1] - from[1])
        };
        let end = (nearest + 1..guide.len()).find(|index| {
            left_m -= step_m(*index);
            left_m <= 0.0
        });
        let end = end.unwrap_or(guide.len() - 1);
        Self { guide: guide[nearest..=end].to_vec(), is_last: end == guide.len() - 1 }
    }

    /// The ground that is nearer to it than a margin [m].
    fn ground(
        &self,
        map: &mut TileMap,
        level: u8,
        from_m: [f64; 2],
        margin_m: f64,
    ) -> Result<GridMap<GroundCell>, TileError> {
        let points_m: Vec<[f64; 2]> = self.guide.iter().copied().chain([from_m]).collect();
        let all = map.around(level, &points_m, margin_m)?;
        let geometry = *all.geometry();
        let reach = (margin_m / geometry.resolution_m) as usize;
        let mut near = GridMap::filled(geometry, GroundCell::UNKNOWN);
        for cell in points_m.iter().filter_map(|[x_m, y_m]| geometry.cell_at(*x_m, *y_m)) {
            let CellRegion { rows, cols } = CellRegion::of_cell(cell).grown(reach, &geometry);
            for first in rows.map(|row| row * geometry.n_cols) {
                let part = first + cols.start..first + cols.end;
                near.values_mut()[part.clone()].copy_from_slice(&all.values()[part]);
            }
        }
        Ok(near)
    }

    fn attempt(
        &self,
        planner: &Planner,
        (from_m, heading): ([f64; 2], usize),
    ) -> Result<(Vec<Cell>, usize), RouteError> {
        let start = planner.open_cell("start", from_m)?;
        // The coarse way's end may lie on something that only fine cells show: an earlier point will do, but the goal.
        let n_tried = if self.is_last { 1 } else { self.guide.len() / 3 };
        let mut error = None;
        for end_m in self.guide.iter().rev().take(n_tried.max(1)) {
            let found = planner
                .open_cell("goal", *end_m)
                .and_then(|end| planner.search((start, heading), end, *end_m));
            match found {
                Ok(path) => return Ok((path.cells, path.n_expanded)),
                Err(blocked @ RouteError::Blocked { .. }) => error = Some(blocked),
                Err(other) => return Err(other),
            }
        }
        Err(error.unwrap_or(RouteError::Smooth { n_cells: 0 }))
    }

    fn kept(&self, planner: &Planner, cells: &[Cell], kept_m: f64) -> Kept {
        let geometry = *planner.ground().geometry();
        let n_kept = (kept_m / geometry.resolution_m) as usize;
        let n = if self.is_last { cells.len() } else { n_kept.max(2).min(cells.len()) };
        let kept = &cells[..n];
        let heading = match kept {
            [.., before, last] => {
                let [from, to] = [before, last].map(|cell| geometry.centre_m(*cell));
                heading_of(libm::atan2(to[1] - from[1], to[0] - from[0]))
            }
            _ => 0,
        };
        let end_m = geometry.centre_m(kept[n - 1]);
        Kept { gates: planner.corridor(kept), end_m, heading }
    }
}
