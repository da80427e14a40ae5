//! Least time to the goal over the known map: the terminal cost that sees further than a rollout.
//!
//! The field solves the shortest-path problem on the grid, an edge costing the time that its length takes at the
//! speed that the ground allows in that direction: `length / (speed x worst-case traction)`, the risk being that of
//! the yaw bin along the edge. It drives forward only and ignores the turning circle: a car cannot follow every path
//! that the field promises, so the field is a lower bound for the vehicle. What a turning circle adds to it, from every
//! place and heading, is found by a second search, in which a vehicle may back up as well.

mod buckets;
mod config;
mod lattice;
mod stencil;
mod turning;
mod view;

use bicycle::MotionLimits;
use buckets::BucketQueue;
pub use config::{CostToGoConfig, CostToGoError, Neighbourhood};
pub use lattice::N_HEADINGS;
use stencil::{EDGES, Edge};
use traversability::{Cell, GridGeometry, GroundFlags, Risk, RiskMapView};
use turning::{Ground, Turning};
pub use view::CostToGoView;

/// Radius beyond which a turning circle is not looked at more closely: it is as wide as the largest windows.
const RADIUS_MAX_CELLS: f64 = 100.0;

/// Cells of padding on every side, so that no neighbour of a cell lies outside the arrays.
const PADDING: usize = 2;

/// The field of least time to the goal, with all the memory that its computation needs.
///
/// The risk map's outermost ring, which has no traction by construction, is the way out of the window when the goal
/// lies beyond it: ring cells that see the goal without looking through the window start with the straight line to it
/// at the speed assumed outside. The others, and all with the goal inside, lead around the window at that speed: what
/// blocks the window may have an end beyond it.
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
    /// Cells where the goal counts as reached: places, of `seconds`, and the time of the straight line to it [s].
    reached: Vec<(usize, f32)>,
    /// Places of the cells from which a way leads out of the window, of `seconds`.
    exits: Vec<usize>,
    /// What a turning circle adds, for maps of the last one's resolution.
    turning: Option<Turning>,
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
        config::validate(&config, &limits)?;
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
            reached: Vec::with_capacity(n_rows * n_cols),
            exits: Vec::with_capacity(2 * (n_rows + n_cols)),
            turning: None,
        })
    }

    /// Solves for the times over `map` to `goal_m`, which may lie beyond it; within `tolerance_m` of it the straight line
    /// counts. Allocates nothing after the first map of a resolution.
    ///
    /// # Errors
    /// A map of another shape than the field's, or a goal that is not finite; the field then stays as it was.
    pub fn update(
        &mut self,
        map: RiskMapView<'_>,
        goal_m: [f64; 2],
        tolerance_m: f64,
    ) -> Result<(), CostToGoError> {
        self.check_shape(&map)?;
        if !goal_m.iter().chain([&tolerance_m]).all(|value| value.is_finite()) {
            return Err(CostToGoError::Goal { x_m: goal_m[0], y_m: goal_m[1], tolerance_m });
        }
        self.geometry = map.geometry;
        self.fill_slowness(&map);
        self.labels_s.fill(0.0);
        for row in 0..self.n_rows {
            let start = self.padded(Cell { row, col: 0 });
            self.labels_s[start..start + self.n_cols].fill(f32::INFINITY);
        }
        self.queue.restart((self.geometry.resolution_m / f64::from(self.speed_max_mps)) as f32);
        self.find_reached(goal_m, tolerance_m);
        self.seed(goal_m);
        self.search_outwards();
        for (row, seconds) in self.seconds.chunks_exact_mut(self.n_cols).enumerate() {
            let start = (row + PADDING) * (self.n_cols + 2 * PADDING) + PADDING;
            seconds.copy_from_slice(&self.labels_s[start..start + self.n_cols]);
        }
        self.keep_to_turning_circle(goal_m);
        Ok(())
    }

    /// Searches over poses what the turning circle adds, if there is one.
    fn keep_to_turning_circle(&mut self, goal_m: [f64; 2]) {
        let radius_cells = self.config.turning_radius_m / self.geometry.resolution_m;
        if radius_cells <= 0.0 {
            return;
        }
        let radius_cells = radius_cells.min(RADIUS_MAX_CELLS);
        let is_fitting = |turning: &Turning| turning.radius_cells().to_bits() == radius_cells.to_bits();
        let fitting = self.turning.take().filter(is_fitting);
        let mut turning = fitting.unwrap_or_else(|| self.turning_circle(radius_cells));
        let corner_m = self.geometry.south_west_m();
        turning.update(&Ground {
            slowness: &self.slowness,
            padding: PADDING,
            resolution_m: self.geometry.resolution_m,
            field_s: &self.seconds,
            goal_cells: [0, 1].map(|axis| (goal_m[axis] - corner_m[axis]) / self.geometry.resolution_m - 0.5),
            reached: &self.reached,
            exits: &self.exits,
            border_slowness: self.slowness_at(self.config.outside_speed_share),
        });
        self.turning = Some(turning);
    }

    fn turning_circle(&self, radius_cells: f64) -> Turning {
        let share = self.config.reverse_speed_share;
        let reverse_slowdown = (share > 0.0).then(|| (1.0 / share) as f32);
        Turning::new(radius_cells, reverse_slowdown, self.n_rows, self.n_cols)
    }

    /// As [`CostToGoConfig::n_headings`].
    pub fn n_headings(&self) -> usize {
        self.config.n_headings()
    }

    /// The field of the last update.
    pub fn view(&self) -> CostToGoView<'_> {
        let turning_s = self.turning.as_ref().map_or(&[][..], Turning::turning_s);
        CostToGoView { geometry: self.geometry, seconds: &self.seconds, turning_s }
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
            let ground = map.ground[index];
            let place = self.padded(map.geometry.cell(index));
            self.slowness[place] = yaw_bins.map(|bin| self.slowness_of(&ground, risks[bin]));
        }
    }

    /// Time per metre of one pose [s/m].
    fn slowness_of(&self, ground: &traversability::Ground, risk: Risk) -> f32 {
        let flags = ground.flags;
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
            1.0 / (self.speed_max_mps * risk.linear_traction.min(1.0)).min(ground.speed.mps())
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

    /// The goal's cell, and those whose centres are within the tolerance, but for the border. From there the straight line
    /// counts, whatever is in its way: the middle draws, and nobody has to come there.
    fn find_reached(&mut self, goal_m: [f64; 2], tolerance_m: f64) {
        self.reached.clear();
        let goal = self.geometry.cell_at(goal_m[0], goal_m[1]);
        let slowness = self.slowness_at(1.0);
        for index in 0..self.n_rows * self.n_cols {
            let cell = self.geometry.cell(index);
            let [x_m, y_m] = self.geometry.centre_m(cell);
            let distance_m = libm::hypot(goal_m[0] - x_m, goal_m[1] - y_m);
            if goal == Some(cell) && !self.is_border(cell) {
                self.reached.push((index, 0.0));
            } else if distance_m <= tolerance_m && !self.is_border(cell) {
                self.reached.push((index, distance_m as f32 * slowness));
            }
        }
    }

    /// Puts the first known times into the queue, and the speed assumed outside on the border ring.
    fn seed(&mut self, goal_m: [f64; 2]) {
        let goal = self.geometry.cell_at(goal_m[0], goal_m[1]);
        let is_inside = goal.is_some_and(|cell| !self.is_border(cell));
        let outside_slowness = self.slowness_at(self.config.outside_speed_share);
        self.exits.clear();
        for index in 0..self.n_rows * self.n_cols {
            let cell = self.geometry.cell(index);
            if self.is_border(cell) {
                if !is_inside {
                    self.exits.push(index);
                }
                let place = self.padded(cell);
                self.slowness[place] = [outside_slowness; 16];
                // From the goal's own cell the line is too short to say where it passes.
                if !is_inside && (goal == Some(cell) || !self.crosses_inside(cell, goal_m)) {
                    let [x_m, y_m] = self.geometry.centre_m(cell);
                    let distance_m = libm::hypot(goal_m[0] - x_m, goal_m[1] - y_m);
                    self.improve(place, distance_m as f32 * outside_slowness);
                }
            }
        }
        for k in 0..self.reached.len() {
            let (index, time_s) = self.reached[k];
            self.improve(self.padded(self.geometry.cell(index)), time_s);
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
