//! Least time to the goal over the known map: the terminal cost that sees further than a rollout.
//!
//! The field solves the shortest-path problem on the grid, an edge costing the time that its length takes at the
//! speed that the ground allows in that direction: `length / (speed x worst-case traction)`, the risk being that of
//! the yaw bin along the edge. It drives forward only and ignores the turning circle: a car cannot follow every path
//! that the field promises, so the field is a lower bound for the vehicle. The rollouts before it keep it honest, and
//! where they end they pay for turning to it.

mod buckets;
mod stencil;

use bicycle::MotionLimits;
use buckets::BucketQueue;
use serde::{Deserialize, Serialize};
use stencil::{EDGES, Edge};
use traversability::{Cell, GridGeometry, GroundFlags, Risk, RiskMapView};

/// Cells of padding on every side, so that no neighbour of a cell lies outside the arrays.
const PADDING: usize = 2;

/// How far one edge of the search reaches.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Neighbourhood {
    /// The 8 adjacent cells; on uniform ground at most 8.3 % longer than the straight line.
    Eight,
    /// And the 8 cells a knight's move away; at most 2.8 % longer.
    Sixteen,
}

/// What the field assumes beyond the risk map.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct CostToGoConfig {
    /// Directions of travel that the search knows.
    pub neighbourhood: Neighbourhood,
    /// Speed on unknown cells over the vehicle's speed limit, in [0.01, 1]; whatever the risk map says of them, unless
    /// the footprint touches an obstacle.
    pub unknown_speed_share: f64,
    /// Speed beyond the window over the vehicle's speed limit, in [0.01, 1]: the smaller, the more memory the queue
    /// takes.
    pub outside_speed_share: f64,
    /// How many times longer than at the speed limit a forbidden pose takes, in [1, 10000]. Finite, so that an
    /// enclosed vehicle still knows which way is out; ground too slippery for this speed counts as forbidden.
    pub forbidden_slowdown: f64,
}

impl Default for CostToGoConfig {
    fn default() -> Self {
        Self {
            neighbourhood: Neighbourhood::Sixteen,
            unknown_speed_share: 0.5,
            outside_speed_share: 0.5,
            forbidden_slowdown: 1000.0,
        }
    }
}

/// Why there is no cost-to-go field.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum CostToGoError {
    /// A value of the configuration or of the vehicle's limits is out of range.
    #[error("{field}: expected {expected}, found {found}")]
    Config {
        /// Name of the field.
        field: &'static str,
        /// The range that would do.
        expected: &'static str,
        /// The value that was given.
        found: f64,
    },
    /// The window has no cell inside its border.
    #[error("cost-to-go window: expected at least 3 x 3 cells, found {n_rows} x {n_cols}")]
    WindowTooSmall {
        /// Rows asked for.
        n_rows: usize,
        /// Columns asked for.
        n_cols: usize,
    },
    /// The risk map is not of the shape that the field was made for.
    #[error(
        "risk map: expected {expected_rows} x {expected_cols} cells with as many grounds and risks for every yaw, \
         found {n_rows} x {n_cols}, {n_ground} grounds, {n_risks} risks of {n_yaws} yaws"
    )]
    MapShape {
        /// Rows of the field.
        expected_rows: usize,
        /// Columns of the field.
        expected_cols: usize,
        /// Rows of the map.
        n_rows: usize,
        /// Columns of the map.
        n_cols: usize,
        /// Length of the map's ground array.
        n_ground: usize,
        /// Length of the map's risk array.
        n_risks: usize,
        /// Yaw bins of the map.
        n_yaws: usize,
    },
    /// The goal is not a point.
    #[error("goal: expected finite coordinates, found ({x_m}, {y_m})")]
    Goal {
        /// East [m].
        x_m: f64,
        /// North [m].
        y_m: f64,
    },
}

/// The field of least time to the goal, with all the memory that its computation needs.
///
/// The risk map's outermost ring, which has no traction by construction, is the way out of the window when the goal
/// lies beyond it: ring cells that see the goal without looking through the window start with the straight line to it
/// at the speed assumed outside, the others lead around the window. With the goal inside, the ring is forbidden.
pub struct CostToGo {
    config: CostToGoConfig,
    speed_max_mps: f32,
    roll_max_rad: f32,
    pitch_max_rad: f32,
    /// Shape of the field; every map must have it.
    n_rows: usize,
    n_cols: usize,
    geometry: GridGeometry,
    /// Time per metre in each direction [s/m], shape [row, col] with padding.
    slowness: Vec<[f32; 16]>,
    /// Best times so far [s], same shape; 0 in the padding, which therefore never improves.
    labels_s: Vec<f32>,
    queue: BucketQueue,
    /// The result [s], shape [row, col].
    seconds: Vec<f32>,
}

/// Time to the goal [s] from every cell.
#[derive(Clone, Copy, Debug)]
pub struct CostToGoView<'a> {
    /// Where the cells lie.
    pub geometry: GridGeometry,
    /// Least time from the cell's centre to the goal's cell [s], finite, shape [row, col].
    pub seconds: &'a [f32],
}

impl CostToGo {
    /// A field for windows of `n_rows` x `n_cols` cells, zero until the first [`CostToGo::update`]. Of the limits it
    /// reads the largest speed, roll and pitch.
    ///
    /// # Errors
    /// A configuration or limit out of range, or a window without a cell inside its border.
    pub fn new(
        config: CostToGoConfig,
        limits: impl Into<MotionLimits>,
        n_rows: usize,
        n_cols: usize,
    ) -> Result<Self, CostToGoError> {
        let limits = limits.into();
        validate(&config, &limits)?;
        if n_rows < 3 || n_cols < 3 {
            return Err(CostToGoError::WindowTooSmall { n_rows, n_cols });
        }
        let n_padded = (n_rows + 2 * PADDING) * (n_cols + 2 * PADDING);
        // The queue spans the longest edge and the spread of the seeds, both counted in shortest edges.
        let longest_edge = stencil::LONGEST_CELLS * config.forbidden_slowdown;
        let seed_spread = libm::hypot(n_rows as f64, n_cols as f64) / config.outside_speed_share;
        let n_buckets = longest_edge.max(seed_spread) as usize + 3;
        Ok(Self {
            config,
            speed_max_mps: limits.high[0] as f32,
            roll_max_rad: limits.roll_max_rad as f32,
            pitch_max_rad: limits.pitch_max_rad as f32,
            n_rows,
            n_cols,
            geometry: GridGeometry { resolution_m: 1.0, origin: [0, 0], n_rows, n_cols },
            slowness: vec![[0.0; 16]; n_padded],
            labels_s: vec![0.0; n_padded],
            queue: BucketQueue::new(n_buckets, n_padded),
            seconds: vec![0.0; n_rows * n_cols],
        })
    }

    /// Solves for the times over `map` to `goal_m`, which may lie beyond it. Allocates nothing.
    ///
    /// # Errors
    /// A map of another shape than the field's, or a goal that is not finite; the field then stays as it was.
    pub fn update(&mut self, map: RiskMapView<'_>, goal_m: [f64; 2]) -> Result<(), CostToGoError> {
        self.check_shape(&map)?;
        if !goal_m.iter().all(|value| value.is_finite()) {
            return Err(CostToGoError::Goal { x_m: goal_m[0], y_m: goal_m[1] });
        }
        self.geometry = map.geometry;
        self.fill_slowness(&map);
        self.labels_s.fill(0.0);
        for row in 0..self.n_rows {
            let start = self.padded(Cell { row, col: 0 });
            self.labels_s[start..start + self.n_cols].fill(f32::INFINITY);
        }
        self.queue.restart((self.geometry.resolution_m / f64::from(self.speed_max_mps)) as f32);
        self.seed(goal_m);
        self.search_outwards();
        for (row, seconds) in self.seconds.chunks_exact_mut(self.n_cols).enumerate() {
            let start = (row + PADDING) * (self.n_cols + 2 * PADDING) + PADDING;
            seconds.copy_from_slice(&self.labels_s[start..start + self.n_cols]);
        }
        Ok(())
    }

    /// The field of the last update.
    pub fn view(&self) -> CostToGoView<'_> {
        CostToGoView { geometry: self.geometry, seconds: &self.seconds }
    }

    fn check_shape(&self, map: &RiskMapView<'_>) -> Result<(), CostToGoError> {
        let GridGeometry { n_rows, n_cols, .. } = map.geometry;
        if (n_rows, n_cols) == (self.n_rows, self.n_cols) && map.n_yaws > 0 {
            return Ok(());
        }
        Err(CostToGoError::MapShape {
            expected_rows: self.n_rows,
            expected_cols: self.n_cols,
            n_rows,
            n_cols,
            n_ground: map.ground.len(),
            n_risks: map.risks.len(),
            n_yaws: map.n_yaws,
        })
    }

    /// Position of a cell in the padded arrays.
    fn padded(&self, cell: Cell) -> usize {
        (cell.row + PADDING) * (self.n_cols + 2 * PADDING) + cell.col + PADDING
    }

    fn is_border(&self, cell: Cell) -> bool {
        cell.row == 0 || cell.col == 0 || cell.row + 1 == self.n_rows || cell.col + 1 == self.n_cols
    }

    fn edges(&self) -> &'static [Edge] {
        match self.config.neighbourhood {
            Neighbourhood::Eight => &EDGES[..8],
            Neighbourhood::Sixteen => &EDGES,
        }
    }

    fn fill_slowness(&mut self, map: &RiskMapView<'_>) {
        let yaw_bins = EDGES.map(|edge| map.yaw_bin(edge.yaw_rad()));
        for (index, risks) in map.risks.chunks_exact(map.n_yaws).enumerate() {
            let flags = map.ground[index].flags;
            let place = self.padded(map.geometry.cell(index));
            self.slowness[place] = yaw_bins.map(|bin| self.slowness_of(flags, risks[bin]));
        }
    }

    /// Time per metre of one pose [s/m].
    fn slowness_of(&self, flags: GroundFlags, risk: Risk) -> f32 {
        if flags.contains(GroundFlags::OBSTACLE) {
            return self.forbidden_slowness();
        }
        if flags.contains(GroundFlags::UNKNOWN) && !risk.is_blocked() {
            return self.slowness_at(self.config.unknown_speed_share);
        }
        // Each comparison fails for NaN, so that a broken value is forbidden.
        let upright = risk.roll_rad <= self.roll_max_rad && risk.pitch_rad <= self.pitch_max_rad;
        let moves = risk.linear_traction * self.config.forbidden_slowdown as f32 > 1.0;
        if upright && moves {
            1.0 / (self.speed_max_mps * risk.linear_traction.min(1.0))
        } else {
            self.forbidden_slowness()
        }
    }

    fn slowness_at(&self, speed_share: f64) -> f32 {
        1.0 / (self.speed_max_mps * speed_share as f32)
    }

    fn forbidden_slowness(&self) -> f32 {
        self.slowness_at(1.0 / self.config.forbidden_slowdown)
    }

    /// Puts the first known times into the queue and decides what the border ring is.
    fn seed(&mut self, goal_m: [f64; 2]) {
        let goal = self.geometry.cell_at(goal_m[0], goal_m[1]);
        let inside = goal.filter(|&cell| !self.is_border(cell));
        let outside_slowness = self.slowness_at(self.config.outside_speed_share);
        let border_slowness = if inside.is_some() { self.forbidden_slowness() } else { outside_slowness };
        for index in 0..self.n_rows * self.n_cols {
            let cell = self.geometry.cell(index);
            if self.is_border(cell) {
                let place = self.padded(cell);
                self.slowness[place] = [border_slowness; 16];
                // From the goal's own cell the line is too short to say where it passes.
                if inside.is_none() && (goal == Some(cell) || !self.crosses_inside(cell, goal_m)) {
                    let [x_m, y_m] = self.geometry.centre_m(cell);
                    let distance_m = libm::hypot(goal_m[0] - x_m, goal_m[1] - y_m);
                    self.improve(place, distance_m as f32 * outside_slowness);
                }
            }
        }
        if let Some(cell) = inside {
            self.improve(self.padded(cell), 0.0);
        }
    }

    /// Whether the straight line from a cell of the border to the goal passes through the window's inside: the
    /// line's parameters between the inner edges overlap for both axes.
    fn crosses_inside(&self, cell: Cell, goal_m: [f64; 2]) -> bool {
        let from_m = self.geometry.centre_m(cell);
        let corner_m = self.geometry.south_west_m();
        let (mut enter, mut leave) = (0.0_f64, 1.0_f64);
        for (axis, n) in [self.n_cols, self.n_rows].into_iter().enumerate() {
            // A centre never lies on an inner edge, so a line along the other axis divides to infinities, not NaN.
            let parameter = |edge: usize| {
                let edge_m = corner_m[axis] + edge as f64 * self.geometry.resolution_m;
                (edge_m - from_m[axis]) / (goal_m[axis] - from_m[axis])
            };
            let (low, high) = (parameter(1), parameter(n - 1));
            enter = enter.max(low.min(high));
            leave = leave.min(low.max(high));
        }
        enter < leave
    }

    fn improve(&mut self, place: usize, time_s: f32) {
        self.labels_s[place] = time_s;
        self.queue.put(place, time_s);
    }

    /// Dijkstra's algorithm from the goal outwards: an edge leads from `from` to the cell just taken out.
    fn search_outwards(&mut self) {
        let stride = (self.n_cols + 2 * PADDING) as isize;
        let resolution_m = self.geometry.resolution_m as f32;
        let edges = self.edges();
        while let Some(to) = self.queue.take() {
            let to_s = self.labels_s[to];
            for (direction, edge) in edges.iter().enumerate() {
                let from = to.wrapping_add_signed(-edge.step(stride));
                if self.labels_s[from] <= to_s {
                    continue;
                }
                let slowness_at = |step: isize| self.slowness[from.wrapping_add_signed(step)][direction];
                let time_s = to_s + resolution_m * edge.time_per_cell(stride, slowness_at);
                if time_s < self.labels_s[from] {
                    self.improve(from, time_s);
                }
            }
        }
    }
}

impl CostToGoView<'_> {
    /// Time from the cell that holds the point [s]; beyond the window, from the nearest cell of its border.
    pub fn nearest_s(&self, x_m: f64, y_m: f64) -> f32 {
        let [col, row] = self.position(x_m, y_m);
        self.seconds[row.round() as usize * self.geometry.n_cols + col.round() as usize]
    }

    /// Time interpolated between the four surrounding cell centres [s]; beyond the window, on its border.
    pub fn interpolated_s(&self, x_m: f64, y_m: f64) -> f32 {
        let [col, row] = self.position(x_m, y_m);
        let west = (col as usize).min(self.geometry.n_cols - 2);
        let south = (row as usize).min(self.geometry.n_rows - 2);
        let (east_share, north_share) = ((col - west as f64) as f32, (row - south as f64) as f32);
        let mix = |from: f32, to: f32, share: f32| from * (1.0 - share) + to * share;
        let along_row = |row: usize| {
            let start = row * self.geometry.n_cols + west;
            mix(self.seconds[start], self.seconds[start + 1], east_share)
        };
        mix(along_row(south), along_row(south + 1), north_share)
    }

    /// Column and row of a point, counted from the south-west cell's centre and held within the window. A NaN
    /// becomes 0, so that the lookups never fail.
    fn position(&self, x_m: f64, y_m: f64) -> [f64; 2] {
        let [west_m, south_m] = self.geometry.south_west_m();
        let place = |value_m: f64, start_m: f64, n: usize| {
            ((value_m - start_m) / self.geometry.resolution_m - 0.5).max(0.0).min((n - 1) as f64)
        };
        [place(x_m, west_m, self.geometry.n_cols), place(y_m, south_m, self.geometry.n_rows)]
    }
}

fn validate(config: &CostToGoConfig, limits: &MotionLimits) -> Result<(), CostToGoError> {
    let check = |field, found: f64, expected, allowed: bool| {
        if allowed { Ok(()) } else { Err(CostToGoError::Config { field, expected, found }) }
    };
    let share =
        |field, found: f64| check(field, found, "a number from 0.01 to 1", (0.01..=1.0).contains(&found));
    let positive =
        |field, found: f64| check(field, found, "a finite number > 0", found > 0.0 && found.is_finite());
    share("unknown_speed_share", config.unknown_speed_share)?;
    share("outside_speed_share", config.outside_speed_share)?;
    let slowdown = config.forbidden_slowdown;
    check("forbidden_slowdown", slowdown, "a number from 1 to 10000", (1.0..=1e4).contains(&slowdown))?;
    positive("limits.speed_max_mps", limits.high[0])?;
    positive("limits.roll_max_rad", limits.roll_max_rad)?;
    positive("limits.pitch_max_rad", limits.pitch_max_rad)
}
