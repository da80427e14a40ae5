//! What a route costs on this machine: the search, the profile, a change of the map, and a way over kilometres in
//! tiles.

use std::path::Path;

use bicycle::Vehicle;
use route::{
    Bend, FarRouteError, FrictionCurve, GroundCell, GroundError, MeasuredCell, Planner, PlannerError,
    RouteError, SpeedError, TileError, TileMap, far_route, fastest_speeds,
};
use scenarios::{Landscape, LandscapeError, LandscapeKind, RouteTask};
use serde::Serialize;
use terrain::{CellRegion, GridGeometry, GridMap};

use super::method::known;
use super::plan::{config, limits};
use super::unbound;
use crate::Spread;
use crate::stopwatch::timed_ms;

/// Checkpoints of a profile.
const N_CHECKPOINTS: usize = 500;
/// Edge of the part of the map that changes [m].
const CHANGED_M: f64 = 50.0;

/// Times of planning over the island.
#[derive(Clone, Debug, Serialize)]
pub struct Timing {
    /// Cells of the map; eight headings and three motions each.
    pub n_cells: usize,
    /// Starts and goals with a route.
    pub n_tasks: usize,
    /// The search over cells [ms].
    pub search_ms: Spread,
    /// The longest of these [ms].
    pub search_most_ms: f64,
    /// States that it expanded: in the middle and at most.
    pub n_expanded: [usize; 2],
    /// A whole route: search, line and speeds [ms].
    pub route_ms: Spread,
    /// The fastest speeds at 500 checkpoints [ms].
    pub profile_ms: Spread,
    /// Taking over what changed on 50 x 50 m [ms].
    pub change_ms: Spread,
    /// That and another search from half way [ms].
    pub again_ms: Spread,
}

/// Why nothing was measured.
#[derive(Debug, thiserror::Error)]
pub enum TimingError {
    /// There is no island.
    #[error(transparent)]
    Landscape(#[from] LandscapeError),
    /// It cannot be searched.
    #[error(transparent)]
    Planner(#[from] PlannerError),
    /// No task has a route.
    #[error(transparent)]
    Route(#[from] RouteError),
    /// No speed will do.
    #[error(transparent)]
    Speed(#[from] SpeedError),
    /// What changes is no ground.
    #[error(transparent)]
    Ground(#[from] GroundError),
    /// Tiles cannot be kept.
    #[error(transparent)]
    Tiles(#[from] TileError),
    /// There is no far route.
    #[error(transparent)]
    Far(#[from] FarRouteError),
}

/// Times the tasks of the island of a seed, on one thread.
///
/// # Errors
/// A landscape without tasks, or one without any route.
pub fn measure_timing(vehicle: &Vehicle, seed: u64, n_tasks: usize) -> Result<Timing, TimingError> {
    let vehicle = unbound(vehicle);
    let landscape = Landscape::new(LandscapeKind::Island, seed)?;
    let tasks = landscape.tasks(n_tasks)?;
    let mut planner = Planner::new(known(&landscape), config(&vehicle))?;
    let limits = limits(&vehicle);
    let (mut searches, mut routes, mut profiles) = (Vec::new(), Vec::new(), Vec::new());
    let (mut changes, mut agains, mut expanded) = (Vec::new(), Vec::new(), Vec::new());
    for RouteTask { start_m, yaw_rad, goal_m } in tasks {
        let from = (start_m, yaw_rad);
        let (search_ms, found) = timed_ms(|| planner.cells(from, goal_m));
        let Ok((_, n_expanded)) = found else { continue };
        let (route_ms, route) = timed_ms(|| planner.route(from, goal_m, &limits));
        let Ok(route) = route else { continue };
        searches.push(search_ms);
        expanded.push(n_expanded);
        routes.push(route_ms);
        let bends: Vec<Bend> =
            route.line.points.iter().map(|point| point.bend).cycle().take(N_CHECKPOINTS).collect();
        let (profile_ms, speeds) = timed_ms(|| fastest_speeds(&bends, route.line.spacing_m, &limits));
        speeds?;
        profiles.push(profile_ms);
        let halfway = &route.line.points[route.line.points.len() / 2];
        let square = around(planner.ground().geometry(), halfway.at_m);
        let before: Vec<GroundCell> = square.cells().map(|cell| planner.ground()[cell]).collect();
        let muddy = |_, cell: GroundCell| GroundCell { friction: FrictionCurve::MUD, ..cell };
        let (change_ms, changed) = timed_ms(|| planner.change(&square, muddy));
        changed?;
        let (again_ms, _) = timed_ms(|| planner.cells((halfway.at_m, halfway.yaw_rad), goal_m));
        changes.push(change_ms);
        agains.push(change_ms + again_ms);
        let cells: std::collections::HashMap<_, _> =
            square.cells().map(|cell| (cell.row, cell.col)).zip(before).collect();
        planner.change(&square, |at, cell| cells.get(&(at.row, at.col)).copied().unwrap_or(cell))?;
    }
    expanded.sort_unstable();
    let most =
        |values: &[usize]| [values.get(values.len() / 2), values.last()].map(|n| n.copied().unwrap_or(0));
    Ok(Timing {
        n_cells: planner.ground().geometry().n_cells(),
        n_tasks: searches.len(),
        search_most_ms: searches.iter().copied().fold(0.0, f64::max),
        search_ms: Spread::of(searches),
        n_expanded: most(&expanded),
        route_ms: Spread::of(routes),
        profile_ms: Spread::of(profiles),
        change_ms: Spread::of(changes),
        again_ms: Spread::of(agains),
    })
}

fn around(geometry: &GridGeometry, [x_m, y_m]: [f64; 2]) -> CellRegion {
    let half = (0.5 * CHANGED_M / geometry.resolution_m) as usize;
    let cell = geometry.cell_at(x_m, y_m).map_or(CellRegion { rows: 0..1, cols: 0..1 }, CellRegion::of_cell);
    cell.grown(half, geometry)
}

/// What a map of kilometres in tiles takes.
#[derive(Clone, Debug, Serialize)]
pub struct FarTiming {
    /// Side of the map, and of its cells [m].
    pub side_m: f64,
    /// Of a cell [m].
    pub cell_m: f64,
    /// Length of the route, and its expected time [m].
    pub length_m: f64,
    /// Expected [s].
    pub duration_s: f64,
    /// Writing the map [s].
    pub written_s: f64,
    /// The first route, for which larger cells are made of all small ones [s].
    pub first_s: f64,
    /// The same over the map opened again [s].
    pub again_s: f64,
    /// States that its searches expanded.
    pub n_expanded: usize,
}

/// Memory that tiles may take.
const TILES_BYTES: usize = 256 << 20;

/// Writes a square of hills, woods and five grounds into a folder, and finds a way across it from corner to corner.
///
/// # Errors
/// The folder cannot be used, or there is no way.
pub fn measure_far(
    vehicle: &Vehicle,
    folder: &Path,
    side_m: f64,
    cell_m: f64,
) -> Result<FarTiming, TimingError> {
    let vehicle = unbound(vehicle);
    let (config, limits) = (config(&vehicle), limits(&vehicle));
    let mut map = TileMap::open(folder, cell_m, TILES_BYTES)?;
    let (written_ms, written) = timed_ms(|| write_hills(&mut map, side_m, cell_m));
    written?;
    // 1.41 x 0.71 of the side: 5 km on a map of 5 km.
    let [start_m, goal_m] = [0.145, 0.855].map(|share| [share * side_m; 2]);
    let from = (start_m, std::f64::consts::FRAC_PI_4);
    let (first_ms, first) = timed_ms(|| far_route(&mut map, 0, &config, from, goal_m, &limits));
    first?;
    drop(map);
    let mut map = TileMap::open(folder, cell_m, TILES_BYTES)?;
    let (again_ms, again) = timed_ms(|| far_route(&mut map, 0, &config, from, goal_m, &limits));
    let again = again?;
    Ok(FarTiming {
        side_m,
        cell_m,
        length_m: again.line.length_m(),
        duration_s: again.line.duration_s,
        written_s: 1e-3 * written_ms,
        first_s: 1e-3 * first_ms,
        again_s: 1e-3 * again_ms,
        n_expanded: again.n_expanded,
    })
}

/// Hills of products of waves, so that a cell costs four multiplications.
fn write_hills(map: &mut TileMap, side_m: f64, cell_m: f64) -> Result<(), TimingError> {
    const EDGE: usize = 512;
    let n = (side_m / cell_m).round() as usize;
    let wave = |length_m: f64, phase: f64| -> Vec<f64> {
        let place_m = |index: usize| (index as f64 + 0.5) * cell_m;
        (0..n).map(|index| libm::sin(std::f64::consts::TAU * place_m(index) / length_m + phase)).collect()
    };
    let east = [wave(730.0, 0.0), wave(290.0, 1.0), wave(113.0, 2.0), wave(61.0, 0.5)];
    let north = [wave(610.0, 0.7), wave(330.0, 1.9), wave(131.0, 0.3), wave(83.0, 2.6)];
    let deviation_m = 0.05;
    for (first_row, first_col) in
        (0..n).step_by(EDGE).flat_map(|row| (0..n).step_by(EDGE).map(move |col| (row, col)))
    {
        let (n_rows, n_cols) = (EDGE.min(n - first_row), EDGE.min(n - first_col));
        let geometry = GridGeometry {
            resolution_m: cell_m,
            origin: [first_col as i64, first_row as i64],
            n_rows,
            n_cols,
        };
        let cell = |index: usize| {
            let (row, col) = (first_row + index / n_cols, first_col + index % n_cols);
            let [broad, middle, narrow, patch] = [0, 1, 2, 3].map(|k| east[k][col] * north[k][row]);
            let friction = match patch {
                value if value > 0.6 => FrictionCurve::MUD,
                value if value > 0.2 => FrictionCurve::DIRT,
                value if value < -0.7 => FrictionCurve::ROCK,
                value if value < -0.4 => FrictionCurve::SAND,
                _ => FrictionCurve::GRASS,
            };
            // One cell in 40,000 holds a tree, by a hash of its place.
            let hash = (row as u64).wrapping_mul(0x9E37_79B9_7F4A_7C15)
                ^ (col as u64).wrapping_mul(0xC2B2_AE3D_27D4_EB4F);
            let is_obstacle =
                (hash ^ (hash >> 29)).wrapping_mul(0xBF58_476D_1CE4_E5B9) >> 40 < (1 << 24) / 40_000;
            let height_m = (25.0 * broad + 8.0 * middle + 1.5 * narrow) as f32;
            let ground = GroundCell { height_m, friction, roughness_m: 0.01, is_obstacle };
            MeasuredCell { ground, deviation_m }
        };
        let values: Vec<MeasuredCell> = (0..n_rows * n_cols).map(cell).collect();
        if let Some(patch) = GridMap::from_values(geometry, values) {
            map.merge(&patch)?;
        }
    }
    Ok(())
}
