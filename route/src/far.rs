//! Routes over maps that do not fit into memory: coarsely over the whole way, then finely along it, a leg at a time.

use crate::line::{self, Gate, Line, heading_of};
use crate::planner::{Planner, PlannerError, RouteError, RoutePoint};
use crate::speed::SpeedLimits;
use crate::tiles::{LEVEL_MAX, TileError, TileMap};
use crate::{GroundCell, RouteConfig};
use terrain::{Cell, GridGeometry, GridMap};

/// Cells that the coarse search may have: with its edges and states less than half a gigabyte.
const COARSE_CELLS_MAX: f64 = 2e6;
/// Room around start and goal that the coarse search sees, as a share of the way between them, and at least [m].
const COARSE_MARGIN: (f64, f64) = (0.25, 50.0);
/// How far ahead along the coarse way a leg is searched, and how much of it is kept [m].
const LEG_M: (f64, f64) = (150.0, 100.0);
/// Room around a leg [m]; twice and four times as much where there is no way.
const LEG_MARGIN_M: f64 = 40.0;
const WIDENINGS: [f64; 3] = [1.0, 2.0, 4.0];
/// Points of the line whose ground is read at a time.
const READ_POINTS: usize = 128;

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
    /// Points of the smooth line, evenly spaced.
    pub points: Vec<RoutePoint>,
    /// Between two points along the line [m].
    pub spacing_m: f64,
    /// Expected time [s].
    pub duration_s: f64,
    /// Legs that it was searched in.
    pub n_legs: usize,
    /// States that all searches expanded.
    pub n_expanded: usize,
}

/// The route from a pose to a point over the cells of a map's `level`, as [`Planner::route`] finds it on one grid, but
/// that the coarse search decides which side of a hill is taken: it sees cells so large that two million hold the way.
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
    let mut n_expanded = 0;
    let guide = guide(map, level, config, (start_m, yaw_rad), goal_m, &mut n_expanded)?;
    let (mut corridor, mut at_m, mut heading) = (Vec::new(), start_m, heading_of(yaw_rad));
    let mut n_legs = 0;
    loop {
        let leg = Leg::ahead(&guide, at_m);
        let kept = leg.searched(map, level, config, (at_m, heading), &mut n_expanded)?;
        n_legs += 1;
        corridor.extend_from_slice(if corridor.is_empty() { &kept.gates } else { &kept.gates[1..] });
        if leg.is_last {
            break;
        }
        if kept.gates.len() < 2 {
            return Err(RouteError::Smooth { n_cells: corridor.len() }.into());
        }
        (at_m, heading) = (kept.end_m, kept.heading);
    }
    line::fix_ends(&mut corridor, start_m, goal_m);
    let line = Line::through(&corridor, map.cell_m(level))?;
    let mut grounded = Vec::with_capacity(line.samples.len());
    for samples in line.samples.chunks(READ_POINTS) {
        let points_m: Vec<[f64; 2]> = samples.iter().map(|sample| sample.at_m).collect();
        let ground = read(map, level, &points_m, 3.0 * map.cell_m(level))?;
        let sliding_mps = config.sliding_mps as f32;
        grounded.extend(samples.iter().map(|sample| line::grounded(&ground, sliding_mps, sample)));
    }
    let (points, duration_s) = line.driven(grounded, limits).map_err(RouteError::from)?;
    Ok(FarRoute { points, spacing_m: line.spacing_m, duration_s, n_legs, n_expanded })
}

/// The way over large cells [m].
fn guide(
    map: &mut TileMap,
    level: u8,
    config: &RouteConfig,
    (start_m, yaw_rad): ([f64; 2], f64),
    goal_m: [f64; 2],
    n_expanded: &mut usize,
) -> Result<Vec<[f64; 2]>, FarRouteError> {
    let way_m = libm::hypot(goal_m[0] - start_m[0], goal_m[1] - start_m[1]);
    let margin_m = (COARSE_MARGIN.0 * way_m).max(COARSE_MARGIN.1);
    let n_cells = |level: u8| {
        let edge = |axis: usize| ((goal_m[axis] - start_m[axis]).abs() + 2.0 * margin_m) / map.cell_m(level);
        edge(0) * edge(1)
    };
    let coarse = (level..=LEVEL_MAX).find(|level| n_cells(*level) <= COARSE_CELLS_MAX);
    let coarse = coarse.ok_or(RouteError::Outside { name: "goal", found_m: goal_m })?;
    let ground = read(map, coarse, &[start_m, goal_m], margin_m)?;
    // Ground of larger cells is rougher by the shape that small ones follow.
    let growth = map.cell_m(coarse) / map.cell_m(level);
    let config = RouteConfig { roughness_max_m: (config.roughness_max_m * growth).min(100.0), ..*config };
    let planner = Planner::new(ground, config)?;
    let (start, goal) = (planner.open_cell("start", start_m)?, planner.open_cell("goal", goal_m)?);
    let path = planner.search((start, heading_of(yaw_rad)), goal, goal_m)?;
    *n_expanded += path.n_expanded;
    let geometry = *planner.ground().geometry();
    let mut guide: Vec<[f64; 2]> = path.cells.iter().map(|cell| geometry.centre_m(*cell)).collect();
    guide.push(goal_m);
    Ok(guide)
}

/// The part of the map around some points.
fn read(
    map: &mut TileMap,
    level: u8,
    points_m: &[[f64; 2]],
    margin_m: f64,
) -> Result<GridMap<GroundCell>, TileError> {
    let cell_m = map.cell_m(level);
    let along = |axis: usize| points_m.iter().map(move |point| point[axis]);
    let low =
        [0, 1].map(|axis| ((along(axis).fold(f64::INFINITY, f64::min) - margin_m) / cell_m).floor() as i64);
    let high = [0, 1]
        .map(|axis| ((along(axis).fold(f64::NEG_INFINITY, f64::max) + margin_m) / cell_m).ceil() as i64);
    let [n_cols, n_rows] = [0, 1].map(|axis| (high[axis] - low[axis]).max(1) as usize);
    map.window(level, &GridGeometry { resolution_m: cell_m, origin: low, n_rows, n_cols })
}

/// A piece of the coarse way.
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
    fn ahead(guide: &[[f64; 2]], from_m: [f64; 2]) -> Self {
        let away_m = |point: &[f64; 2]| libm::hypot(point[0] - from_m[0], point[1] - from_m[1]);
        let nearest = (0..guide.len()).min_by(|a, b| away_m(&guide[*a]).total_cmp(&away_m(&guide[*b])));
        let nearest = nearest.unwrap_or(0);
        let mut left_m = LEG_M.0;
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

    /// Its way over fine cells, as far as it is kept.
    fn searched(
        &self,
        map: &mut TileMap,
        level: u8,
        config: &RouteConfig,
        (from_m, heading): ([f64; 2], usize),
        n_expanded: &mut usize,
    ) -> Result<Kept, FarRouteError> {
        let mut found = None;
        for widening in WIDENINGS {
            let mut points_m = self.guide.clone();
            points_m.push(from_m);
            let ground = read(map, level, &points_m, widening * LEG_MARGIN_M)?;
            let planner = Planner::new(ground, *config)?;
            match self.attempt(&planner, (from_m, heading)) {
                Ok((cells, n)) => {
                    *n_expanded += n;
                    return Ok(self.kept(&planner, &cells));
                }
                Err(error) => found = Some(error),
            }
        }
        Err(found.unwrap_or(RouteError::Smooth { n_cells: 0 }).into())
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

    fn kept(&self, planner: &Planner, cells: &[Cell]) -> Kept {
        let geometry = *planner.ground().geometry();
        let n_kept = (LEG_M.1 / geometry.resolution_m) as usize;
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
