//! From start to goal: search, smooth line, speeds.

use crate::RouteConfig;
use crate::edges::{Barrier, Edges, STEPS, stepped};
use crate::ground::{self, GroundCell, GroundError};
use crate::line::{self, Gate, Line, RouteLine, RoutePoint, Undrivable, heading_of};
use crate::search::{self, CellPath, Unreachable};
use crate::smooth::SplinePoint;
use crate::speed::{Bend, SpeedError, SpeedLimits};
use terrain::{Cell, CellRegion, GridMap, SettingError};

/// Share of friction that makes ground as good as other ground to smooth a line over, and of roughness likewise.
const AS_GOOD: f32 = 0.9;

/// How often a route is searched again around places where no speed will do, at most.
const DETOURS_MAX: usize = 32;
/// How often around the first of them alone: another way often leaves the others out.
const SINGLE_DETOURS: usize = 16;

/// Searches one map for routes.
#[derive(Clone, Debug)]
pub struct Planner {
    ground: GridMap<GroundCell>,
    config: RouteConfig,
    edges: Edges,
}

/// A way from start to goal.
#[derive(Clone, Debug, PartialEq)]
pub struct Route {
    /// The cells that it was searched over.
    pub cells: Vec<Cell>,
    /// Cost of the way over the cells (sum of equations 37 to 41) [metres of way].
    pub cost_m: f64,
    /// States that the search expanded.
    pub n_expanded: usize,
    /// The smooth line, and how fast to drive it.
    pub line: RouteLine,
}

/// Why there is no planner.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum PlannerError {
    /// A setting is out of range.
    #[error(transparent)]
    Setting(#[from] SettingError),
    /// A cell holds no usable numbers.
    #[error(transparent)]
    Ground(#[from] GroundError),
    /// The map has more states than can be numbered.
    #[error("map: expected at most {max} cells, found {found}")]
    TooLarge {
        /// Most cells.
        max: usize,
        /// Cells of the map.
        found: usize,
    },
}

/// Why there is no route.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum RouteError {
    /// Start or goal is not a point of the map, or lies farther away than can be searched.
    #[error("{name}: expected a point of the map, found ({:.1}, {:.1})", .found_m[0], .found_m[1])]
    Outside {
        /// Start or goal.
        name: &'static str,
        /// The point that was given [m].
        found_m: [f64; 2],
    },
    /// The heading at the start is no angle.
    #[error("yaw at the start: expected a finite angle, found {found_rad} rad")]
    Yaw {
        /// The angle that was given [rad].
        found_rad: f64,
    },
    /// Nobody can stand there.
    #[error("{name} at ({:.1}, {:.1}) m: {barrier}", .at_m[0], .at_m[1])]
    Blocked {
        /// Start or goal.
        name: &'static str,
        /// The point that was given [m].
        at_m: [f64; 2],
        /// What is there.
        barrier: Barrier,
    },
    /// No way leads from one to the other.
    #[error(
        "no route: {n_reached} cells can be reached from the start; the one nearest to the goal is {left_m:.1} m away \
         at ({:.1}, {:.1}) m, and beyond it {barrier}",
        .at_m[0], .at_m[1]
    )]
    Unreachable {
        /// Cells that can be reached.
        n_reached: usize,
        /// The one nearest to the goal [m].
        at_m: [f64; 2],
        /// From there to the goal [m].
        left_m: f64,
        /// What ends the way there.
        barrier: Barrier,
    },
    /// No smooth line was found near the cells.
    #[error("smooth line: expected one near {n_cells} cells, found none")]
    Smooth {
        /// Cells of the way.
        n_cells: usize,
    },
    /// No speed will do.
    #[error(transparent)]
    Speed(#[from] SpeedError),
}

/// Why an attempt at a route failed.
struct Refusal {
    error: RouteError,
    /// Where no speed will do, if that is why [m].
    places_m: Vec<[f64; 2]>,
}

impl From<RouteError> for Refusal {
    fn from(error: RouteError) -> Self {
        Self { error, places_m: Vec::new() }
    }
}

impl Planner {
    /// A planner for a map.
    ///
    /// # Errors
    /// A setting out of range, a cell with unusable numbers, or too large a map.
    pub fn new(ground: GridMap<GroundCell>, config: RouteConfig) -> Result<Self, PlannerError> {
        config.validate()?;
        ground::check(&ground)?;
        let found = ground.geometry().n_cells();
        if found > search::CELLS_MAX {
            return Err(PlannerError::TooLarge { max: search::CELLS_MAX, found });
        }
        let edges = Edges::new(&ground, &config);
        Ok(Self { ground, config, edges })
    }

    /// The map.
    pub fn ground(&self) -> &GridMap<GroundCell> {
        &self.ground
    }

    /// Changes a part of the map.
    ///
    /// # Errors
    /// A cell with unusable numbers; the map then stays as it was.
    pub fn change(
        &mut self,
        region: &CellRegion,
        cell: impl Fn(Cell, GroundCell) -> GroundCell,
    ) -> Result<(), GroundError> {
        let cells = region.rows.clone().flat_map(|row| region.cols.clone().map(move |col| Cell { row, col }));
        let changed: Vec<(Cell, GroundCell)> = cells.map(|at| (at, cell(at, self.ground[at]))).collect();
        let geometry = *self.ground.geometry();
        changed.iter().try_for_each(|(at, cell)| ground::check_cell(&geometry, *at, cell))?;
        for (at, cell) in changed {
            self.ground[at] = cell;
        }
        self.edges.update(&self.ground, &self.config, region);
        Ok(())
    }

    /// What is weighed and forbidden.
    pub(crate) fn config(&self) -> &RouteConfig {
        &self.config
    }

    /// Has an obstacle stand on a cell.
    pub(crate) fn block(&mut self, cell: Cell) {
        self.ground[cell].is_obstacle = true;
        self.edges.update(&self.ground, &self.config, &CellRegion::of_cell(cell));
    }

    /// Makes every way from or over a cell dearer; for this planner alone, until the ground there changes.
    pub(crate) fn make_dearer(&mut self, index: usize, factor: f32) {
        self.edges.make_dearer(index, factor);
    }

    /// Room that a route leaves to both sides together [m].
    pub(crate) fn clear_width_m(&self) -> f64 {
        self.config.clear_width_m
    }

    /// What forbids standing on a cell, if anything does.
    pub(crate) fn barrier_at(&self, cell: Cell) -> Option<Barrier> {
        self.edges.barrier_at(&self.ground, &self.config, cell)
    }

    /// The cheapest route from a pose to a point, and the fastest speeds along it. The smooth line meets other slopes than
    /// the cells that it was laid along: where no speed will do on it, it is searched again around that place.
    ///
    /// # Errors
    /// There is none, and why.
    pub fn route(
        &self,
        (start_m, yaw_rad): ([f64; 2], f64),
        goal_m: [f64; 2],
        limits: &SpeedLimits,
    ) -> Result<Route, RouteError> {
        if !yaw_rad.is_finite() {
            return Err(RouteError::Yaw { found_rad: yaw_rad });
        }
        let (mut planner, mut refused, mut n_detours) = (std::borrow::Cow::Borrowed(self), None, 0);
        loop {
            let Refusal { error, places_m } = match planner.attempt((start_m, yaw_rad), goal_m, limits) {
                Ok(route) => return Ok(route),
                Err(refusal) => refusal,
            };
            let first = *refused.get_or_insert(error);
            if places_m.is_empty() || n_detours == DETOURS_MAX {
                return Err(first);
            }
            let n_places = if n_detours < SINGLE_DETOURS { 1 } else { places_m.len() };
            let closed: Vec<CellRegion> = places_m
                .into_iter()
                .take(n_places)
                .filter_map(|at_m| planner.around(at_m, [start_m, goal_m]))
                .collect();
            // Nothing leads around start and goal.
            if closed.is_empty() {
                return Err(error);
            }
            closed.iter().for_each(|region| planner.to_mut().edges.close(region));
            n_detours += 1;
        }
    }

    /// The cheapest route as the edges are, or what is wrong with it, and where.
    fn attempt(
        &self,
        (start_m, yaw_rad): ([f64; 2], f64),
        goal_m: [f64; 2],
        limits: &SpeedLimits,
    ) -> Result<Route, Refusal> {
        let start = self.open_cell("start", start_m)?;
        let goal = self.open_cell("goal", goal_m)?;
        let path = self.search((start, heading_of(yaw_rad)), goal, goal_m)?;
        let mut corridor = self.corridor(&path.cells);
        line::fix_ends(&mut corridor, start_m, goal_m);
        let resolution_m = self.ground.geometry().resolution_m;
        let line = Line::through(&corridor, resolution_m)?;
        let sliding_mps = self.config.sliding_mps as f32;
        let grounded = line.samples.iter().map(|sample| line::grounded(&self.ground, sliding_mps, sample));
        let driven = line.driven(grounded.collect(), limits);
        let line =
            driven.map_err(|Undrivable { error, places_m }| Refusal { error: error.into(), places_m })?;
        Ok(Route { cost_m: path.cost * resolution_m, cells: path.cells, n_expanded: path.n_expanded, line })
    }

    /// Bars the cells within half of the clear width of a place.
    pub(crate) fn close_around(&mut self, [x_m, y_m]: [f64; 2]) {
        let geometry = *self.ground.geometry();
        let reach = (0.5 * self.config.clear_width_m / geometry.resolution_m) as usize;
        if let Some(cell) = geometry.cell_at(x_m, y_m) {
            self.edges.close(&CellRegion::of_cell(cell).grown(reach.max(1), &geometry));
        }
    }

    /// The cells around a place that no line is to pass again; none where they hold an end of the way.
    fn around(&self, at_m: [f64; 2], ends_m: [[f64; 2]; 2]) -> Option<CellRegion> {
        let geometry = self.ground.geometry();
        let around = CellRegion::of_cell(geometry.cell_at(at_m[0], at_m[1])?).grown(1, geometry);
        let is_inside = |end_m: &[f64; 2]| {
            let cell = geometry.cell_at(end_m[0], end_m[1]);
            cell.is_some_and(|cell| around.rows.contains(&cell.row) && around.cols.contains(&cell.col))
        };
        (!ends_m.iter().any(is_inside)).then_some(around)
    }

    /// What a route begins with: the cheapest way over the cells alone, and how many states were expanded for it.
    ///
    /// # Errors
    /// There is none, and why.
    pub fn cells(
        &self,
        (start_m, yaw_rad): ([f64; 2], f64),
        goal_m: [f64; 2],
    ) -> Result<(Vec<Cell>, usize), RouteError> {
        let (start, goal) = (self.open_cell("start", start_m)?, self.open_cell("goal", goal_m)?);
        let path = self.search((start, heading_of(yaw_rad)), goal, goal_m)?;
        Ok((path.cells, path.n_expanded))
    }

    /// What a line that was found on another map is like on this one.
    pub fn bends(&self, points: &[RoutePoint]) -> Vec<Bend> {
        let sliding_mps = self.config.sliding_mps as f32;
        let bend = |point: &RoutePoint| {
            let curvature_per_m = point.bend.curvature_per_m;
            let sample = SplinePoint { at_m: point.at_m, yaw_rad: point.yaw_rad, curvature_per_m };
            line::grounded(&self.ground, sliding_mps, &sample).0
        };
        points.iter().map(bend).collect()
    }

    /// The cell of a point that a vehicle can stand on.
    pub(crate) fn open_cell(&self, name: &'static str, at_m: [f64; 2]) -> Result<Cell, RouteError> {
        let cell = self.ground.geometry().cell_at(at_m[0], at_m[1]);
        let cell = cell.ok_or(RouteError::Outside { name, found_m: at_m })?;
        match self.barrier_at(cell) {
            Some(barrier) => Err(RouteError::Blocked { name, at_m, barrier }),
            None => Ok(cell),
        }
    }

    /// What ends the way where it comes nearest to the goal.
    fn explain(&self, unreachable: &Unreachable, goal_m: [f64; 2]) -> RouteError {
        let geometry = *self.ground.geometry();
        let left_m = |cell: Cell| {
            let [x_m, y_m] = geometry.centre_m(cell);
            libm::hypot(x_m - goal_m[0], y_m - goal_m[1])
        };
        let reached = unreachable.is_reached.iter().enumerate().filter(|(_, is_reached)| **is_reached);
        let cells: Vec<Cell> = reached.map(|(index, _)| geometry.cell(index)).collect();
        let nearest = cells.iter().copied().min_by(|a, b| left_m(*a).total_cmp(&left_m(*b)));
        let nearest = nearest.unwrap_or(Cell { row: 0, col: 0 });
        let ahead = (0..STEPS.len()).filter(|direction| {
            let to = stepped(&geometry, nearest, STEPS[*direction]);
            to.is_some_and(|to| left_m(to) < left_m(nearest))
        });
        let mut barriers =
            ahead.filter_map(|direction| self.edges.barrier(&self.ground, &self.config, nearest, direction));
        RouteError::Unreachable {
            n_reached: cells.len(),
            at_m: geometry.centre_m(nearest),
            left_m: left_m(nearest),
            barrier: barriers.next_back().unwrap_or(Barrier::Edge),
        }
    }

    /// The cheapest way over cells between two of them.
    pub(crate) fn search(
        &self,
        (start, heading): (Cell, usize),
        goal: Cell,
        goal_m: [f64; 2],
    ) -> Result<CellPath, RouteError> {
        search::cheapest(&self.edges, self.config.steering_weight as f32, (start, heading), goal)
            .map_err(|unreachable| self.explain(&unreachable, goal_m))
    }

    /// Where a line along cells may run.
    pub(crate) fn corridor(&self, cells: &[Cell]) -> Vec<Gate> {
        let geometry = self.ground.geometry();
        let gate = |cell: &Cell| Gate { at_m: geometry.centre_m(*cell), freedom_m: self.freedom_m(*cell) };
        cells.iter().map(gate).collect()
    }

    /// How far the line may go from a cell's centre along each axis: half a cell, more where the ground around is as
    /// good [m].
    fn freedom_m(&self, cell: Cell) -> f64 {
        const LARGEST_CELLS: usize = 3;
        let geometry = self.ground.geometry();
        let friction = |cell: Cell| self.ground[cell].friction.at(self.config.sliding_mps as f32);
        let is_as_good = |other: Cell| {
            self.edges.is_free(other)
                && friction(other) >= AS_GOOD * friction(cell)
                && AS_GOOD * self.ground[other].roughness_m <= self.ground[cell].roughness_m
        };
        let is_free = |reach: usize| {
            let around = CellRegion::of_cell(cell).grown(reach, geometry);
            let is_whole = around.n_cells() == (2 * reach + 1).pow(2);
            let mut cells = around.rows.flat_map(|row| around.cols.clone().map(move |col| Cell { row, col }));
            is_whole && cells.all(is_as_good)
        };
        let reach = (1..=LARGEST_CELLS).take_while(|reach| is_free(*reach)).count();
        (reach as f64 - 0.5).max(0.5) * geometry.resolution_m
    }
}
