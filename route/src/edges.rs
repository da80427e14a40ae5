//! What it costs to go from a cell to its neighbour, and what forbids it (AnyNav, equations 37 to 40).

use crate::{GroundCell, RouteConfig};
use rayon::prelude::*;
use terrain::{Cell, CellRegion, GridGeometry, GridMap};

/// Columns and rows to the neighbour in each of the eight directions: east, north-east, and on counter-clockwise.
pub(crate) const STEPS: [[isize; 2]; 8] =
    [[1, 0], [1, 1], [0, 1], [-1, 1], [-1, 0], [-1, -1], [0, -1], [1, -1]];

/// Directions whose edges are stored at the cell; the other four are the neighbour's, backwards.
const N_STORED: usize = 4;

/// Why a vehicle does not go from a cell to its neighbour.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Barrier {
    /// Nothing is known of the ground.
    Unknown,
    /// An obstacle stands there, or so near that the vehicle would touch it.
    Obstacle,
    /// It is too rough.
    Rough,
    /// It is too slippery for its slope.
    Slippery,
    /// It is steeper than the vehicle may lean.
    Steep,
    /// The map ends.
    Edge,
}

impl std::fmt::Display for Barrier {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        formatter.write_str(match self {
            Self::Unknown => "nothing is known of the ground",
            Self::Obstacle => "an obstacle stands in the way",
            Self::Rough => "the ground is too rough",
            Self::Slippery => "the ground is too slippery for its slope",
            Self::Steep => "the ground is steeper than the vehicle may lean",
            Self::Edge => "the map ends",
        })
    }
}

/// One step's price.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Edge {
    /// Distance, friction, slope and roughness [cells of level ground without friction's or slope's cost].
    pub cost: f32,
    /// Reciprocal of the friction coefficient, which turns cost in proportion to.
    pub per_friction: f32,
}

impl Edge {
    const CLOSED: Self = Self { cost: f32::INFINITY, per_friction: 0.0 };
}

/// The edges of a whole map.
#[derive(Clone, Debug)]
pub(crate) struct Edges {
    geometry: GridGeometry,
    edges: Vec<[Edge; N_STORED]>,
    /// Within half of the clear width of an obstacle.
    is_crowded: Vec<bool>,
}

impl Edges {
    pub fn new(ground: &GridMap<GroundCell>, config: &RouteConfig) -> Self {
        let geometry = *ground.geometry();
        let n_cells = geometry.n_cells();
        let mut edges = Self {
            geometry,
            edges: vec![[Edge::CLOSED; N_STORED]; n_cells],
            is_crowded: vec![false; n_cells],
        };
        edges.update(ground, config, &CellRegion::whole(&geometry));
        edges
    }

    pub fn geometry(&self) -> &GridGeometry {
        &self.geometry
    }

    /// Takes over what changed of the ground.
    pub fn update(&mut self, ground: &GridMap<GroundCell>, config: &RouteConfig, changed: &CellRegion) {
        let reach = reach_cells(config, self.geometry.resolution_m);
        let crowded = changed.grown(reach, &self.geometry);
        self.crowd(ground, config, &crowded);
        // Slopes across an edge look one cell further than its ends.
        let dirty = crowded.grown(2, &self.geometry);
        let (is_crowded, n_cols) = (&self.is_crowded, self.geometry.n_cols);
        let rows = self.edges.par_chunks_mut(n_cols).enumerate();
        rows.filter(|(row, _)| dirty.rows.contains(row)).for_each(|(row, edges)| {
            for col in dirty.cols.clone() {
                for (direction, edge) in edges[col].iter_mut().enumerate() {
                    let found = judge(ground, is_crowded, config, Cell { row, col }, direction);
                    *edge = found.unwrap_or(Edge::CLOSED);
                }
            }
        });
    }

    /// Marks the cells of a region that an obstacle is too near to.
    fn crowd(&mut self, ground: &GridMap<GroundCell>, config: &RouteConfig, region: &CellRegion) {
        let reach = reach_cells(config, self.geometry.resolution_m);
        let reach_squared = (0.5 * config.clear_width_m / self.geometry.resolution_m).powi(2);
        let cells = region.rows.clone().flat_map(|row| region.cols.clone().map(move |col| Cell { row, col }));
        for cell in cells.clone() {
            let index = self.geometry.index(cell);
            self.is_crowded[index] = false;
        }
        let around = region.grown(reach, &self.geometry);
        let obstacles = around.rows.flat_map(|row| around.cols.clone().map(move |col| Cell { row, col }));
        for obstacle in obstacles.filter(|cell| ground[*cell].is_obstacle) {
            let near = CellRegion::of_cell(obstacle).grown(reach, &self.geometry);
            for row in near.rows.start.max(region.rows.start)..near.rows.end.min(region.rows.end) {
                for col in near.cols.start.max(region.cols.start)..near.cols.end.min(region.cols.end) {
                    let away = row.abs_diff(obstacle.row).pow(2) + col.abs_diff(obstacle.col).pow(2);
                    if away as f64 <= reach_squared {
                        self.is_crowded[row * self.geometry.n_cols + col] = true;
                    }
                }
            }
        }
    }

    /// Multiplies the costs of the edges that are stored with a cell.
    pub fn make_dearer(&mut self, index: usize, factor: f32) {
        self.edges[index].iter_mut().for_each(|edge| edge.cost *= factor);
    }

    /// Closes every edge from or to a cell of a region.
    pub fn close(&mut self, region: &CellRegion) {
        let geometry = self.geometry;
        let is_inside = |cell: Cell| region.rows.contains(&cell.row) && region.cols.contains(&cell.col);
        for cell in region.grown(1, &geometry).cells() {
            for (direction, step) in STEPS.iter().enumerate().take(N_STORED) {
                if is_inside(cell) || stepped(&geometry, cell, *step).is_some_and(is_inside) {
                    self.edges[geometry.index(cell)][direction] = Edge::CLOSED;
                }
            }
        }
    }

    /// The edge from the cell with an index in a direction; closed beyond the map.
    #[inline]
    pub fn at(&self, index: usize, direction: usize) -> Edge {
        if direction < N_STORED {
            return self.edges[index][direction];
        }
        let [east, north] = STEPS[direction];
        let (row, col) = (index / self.geometry.n_cols, index % self.geometry.n_cols);
        let back = |place: usize, by: isize, n: usize| place.checked_add_signed(by).filter(|to| *to < n);
        let to = back(row, north, self.geometry.n_rows).zip(back(col, east, self.geometry.n_cols));
        to.map_or(Edge::CLOSED, |(row, col)| {
            self.edges[row * self.geometry.n_cols + col][direction - N_STORED]
        })
    }

    /// Least and largest cost of open edges, those along an axis and the diagonal ones apart: `[[least, most]; 2]`.
    pub fn extent(&self) -> [[f32; 2]; 2] {
        let none = [[f32::INFINITY, 0.0_f32]; 2];
        let of_cell = |mut extent: [[f32; 2]; 2], edges: &[Edge; N_STORED]| {
            for (direction, edge) in edges.iter().enumerate().filter(|(_, edge)| edge.cost.is_finite()) {
                let [least, most] = &mut extent[direction % 2];
                *least = least.min(edge.cost);
                *most = most.max(edge.cost);
            }
            extent
        };
        let joined = |a: [[f32; 2]; 2], b: [[f32; 2]; 2]| {
            [0, 1].map(|kind| [a[kind][0].min(b[kind][0]), a[kind][1].max(b[kind][1])])
        };
        self.edges.par_iter().fold(|| none, of_cell).reduce(|| none, joined)
    }

    /// Largest reciprocal of a friction on an open edge.
    pub fn per_friction_max(&self) -> f32 {
        let of_cell =
            |edges: &[Edge; N_STORED]| edges.iter().fold(0.0_f32, |most, edge| most.max(edge.per_friction));
        self.edges.par_iter().map(of_cell).reduce(|| 0.0, f32::max)
    }

    /// What stands against leaving a cell in a direction, if anything does.
    pub fn barrier(
        &self,
        ground: &GridMap<GroundCell>,
        config: &RouteConfig,
        cell: Cell,
        direction: usize,
    ) -> Option<Barrier> {
        judge(ground, &self.is_crowded, config, cell, direction).err()
    }

    /// Whether a cell can be left in every direction.
    pub fn is_free(&self, cell: Cell) -> bool {
        let index = self.geometry.index(cell);
        (0..STEPS.len()).all(|direction| self.at(index, direction).cost.is_finite())
    }

    /// What forbids standing on a cell, if anything does.
    pub fn barrier_at(
        &self,
        ground: &GridMap<GroundCell>,
        config: &RouteConfig,
        cell: Cell,
    ) -> Option<Barrier> {
        open(ground, &self.is_crowded, config, cell).err()
    }
}

fn reach_cells(config: &RouteConfig, resolution_m: f64) -> usize {
    (0.5 * config.clear_width_m / resolution_m).floor() as usize
}

/// Whether a cell alone can be driven on.
fn open(
    ground: &GridMap<GroundCell>,
    is_crowded: &[bool],
    config: &RouteConfig,
    cell: Cell,
) -> Result<GroundCell, Barrier> {
    let found = ground[cell];
    if !found.is_known() {
        return Err(Barrier::Unknown);
    }
    if found.is_obstacle || is_crowded[ground.geometry().index(cell)] {
        return Err(Barrier::Obstacle);
    }
    if f64::from(found.roughness_m) >= config.roughness_max_m {
        return Err(Barrier::Rough);
    }
    Ok(found)
}

/// The edge from a cell in a direction, or what forbids it.
fn judge(
    ground: &GridMap<GroundCell>,
    is_crowded: &[bool],
    config: &RouteConfig,
    from: Cell,
    direction: usize,
) -> Result<Edge, Barrier> {
    let geometry = ground.geometry();
    let to = stepped(geometry, from, STEPS[direction]).ok_or(Barrier::Edge)?;
    let here = open(ground, is_crowded, config, from)?;
    let there = open(ground, is_crowded, config, to)?;
    if direction % 2 == 1 {
        // A diagonal step passes the corner that two more cells share.
        let [east, north] = STEPS[direction];
        for side in [[east, 0], [0, north]] {
            open(ground, is_crowded, config, stepped(geometry, from, side).ok_or(Barrier::Edge)?)?;
        }
    }
    let length_cells = if direction % 2 == 1 { std::f32::consts::SQRT_2 } else { 1.0 };
    let along = (there.height_m - here.height_m).abs() / (length_cells * geometry.resolution_m as f32);
    let across = 0.5 * (across(ground, from, direction) + across(ground, to, direction)).abs();
    let curve = here.friction.between(&there.friction);
    let friction = curve.at(config.sliding_mps as f32);
    if f64::from(along) > config.pitch_max_rad.tan() || f64::from(across) > config.roll_max_rad.tan() {
        return Err(Barrier::Steep);
    }
    if libm::hypotf(along, across) > config.friction_share as f32 * friction {
        return Err(Barrier::Slippery);
    }
    let per_friction = 1.0 / friction;
    let weight = config.slope_weight as f32;
    let friction_cost = per_friction + config.viscous_weight_mps as f32 * curve.viscous_friction;
    let slope_cost = libm::expf(weight * along * per_friction) + libm::expf(weight * across * per_friction);
    let roughness = 0.5 * (here.roughness_m + there.roughness_m) * config.roughness_weight as f32;
    let cost = length_cells * (1.0 + friction_cost + slope_cost + roughness);
    Ok(Edge { cost, per_friction })
}

/// Height change per metre to the left of a direction, from the neighbours to both sides that are known.
fn across(ground: &GridMap<GroundCell>, cell: Cell, direction: usize) -> f32 {
    let geometry = ground.geometry();
    let height_m = |direction: usize| {
        let beside = stepped(geometry, cell, STEPS[direction % 8]);
        beside.map(|beside| ground[beside]).filter(GroundCell::is_known).map(|known| known.height_m)
    };
    let here_m = ground[cell].height_m;
    let (left_m, right_m) = (height_m(direction + 2), height_m(direction + 6));
    let n_steps = f32::from(u8::from(left_m.is_some()) + u8::from(right_m.is_some())).max(1.0);
    let length_cells = if direction % 2 == 1 { std::f32::consts::SQRT_2 } else { 1.0 };
    let rise_m = left_m.unwrap_or(here_m) - right_m.unwrap_or(here_m);
    rise_m / (n_steps * length_cells * geometry.resolution_m as f32)
}

/// The cell a step away, if the map reaches that far.
pub(crate) fn stepped(geometry: &GridGeometry, cell: Cell, [east, north]: [isize; 2]) -> Option<Cell> {
    let row = cell.row.checked_add_signed(north).filter(|row| *row < geometry.n_rows)?;
    let col = cell.col.checked_add_signed(east).filter(|col| *col < geometry.n_cols)?;
    Some(Cell { row, col })
}
