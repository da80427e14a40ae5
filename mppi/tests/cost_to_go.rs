//! The cost-to-go field against closed forms and against Bellman-Ford over line integrals of the risk map.

#![allow(clippy::unwrap_used, reason = "a panic is how a test fails")]

use bicycle::Limits;
use mppi::{CostToGo, CostToGoConfig, CostToGoError, CostToGoView, Neighbourhood};
use rand::{RngExt, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;
use traversability::{Cell, GridGeometry, GroundFlags, Risk, RiskMap, RiskMapView, SpeedLimit};

const SPEED_MPS: f64 = 2.0;
const RESOLUTION_M: f64 = 0.5;
const OUTSIDE_SPEED_SHARE: f64 = 0.5;
const UNKNOWN_SPEED_SHARE: f64 = 0.25;
const SLOWDOWN: f64 = 1000.0;

fn limits() -> Limits {
    Limits {
        speed_max_mps: SPEED_MPS,
        reverse_speed_max_mps: 1.0,
        steering_max_rad: 0.5,
        steering_rate_max_radps: 1.0,
        acceleration_max_mps2: 2.0,
        lateral_acceleration_max_mps2: 4.0,
        roll_max_rad: 0.5,
        pitch_max_rad: 0.6,
    }
}

fn config(neighbourhood: Neighbourhood) -> CostToGoConfig {
    CostToGoConfig {
        neighbourhood,
        unknown_speed_share: UNKNOWN_SPEED_SHARE,
        outside_speed_share: OUTSIDE_SPEED_SHARE,
        forbidden_slowdown: SLOWDOWN,
        ..CostToGoConfig::default()
    }
}

fn geometry(n_rows: usize, n_cols: usize) -> GridGeometry {
    GridGeometry { resolution_m: RESOLUTION_M, origin: [-7, 4], n_rows, n_cols }
}

fn field(neighbourhood: Neighbourhood, map: &RiskMap, goal_m: [f64; 2]) -> CostToGo {
    let GridGeometry { n_rows, n_cols, .. } = *map.geometry();
    let mut field = CostToGo::new(config(neighbourhood), &limits(), n_rows, n_cols).unwrap();
    field.update(map.view(), goal_m, 0.0).unwrap();
    field
}

fn at(view: &CostToGoView<'_>, row: usize, col: usize) -> f64 {
    f64::from(view.seconds[view.geometry.index(Cell { row, col })])
}

fn close(found: f64, expected: f64) {
    assert!((found - expected).abs() <= 2e-5 * expected.abs().max(1.0), "{found} is not {expected}");
}

fn inside(geometry: &GridGeometry) -> impl Iterator<Item = Cell> {
    let (n_rows, n_cols) = (geometry.n_rows, geometry.n_cols);
    (1..n_rows - 1).flat_map(move |row| (1..n_cols - 1).map(move |col| Cell { row, col }))
}

/// Blocks every heading of a cell.
fn block(map: &mut RiskMap, row: usize, col: usize) {
    let n_yaws = map.view().n_yaws;
    let start = map.geometry().index(Cell { row, col }) * n_yaws;
    map.fill(|risks, _| risks[start..start + n_yaws].iter_mut().for_each(|risk| *risk = risk.blocked()));
}

fn flag(map: &mut RiskMap, row: usize, col: usize, flags: GroundFlags) {
    let index = map.geometry().index(Cell { row, col });
    map.fill(|_, ground| ground[index].flags = flags);
}

/// Shortest way over `long` x `short` cells (`long` >= `short`) of uniform ground, in cells.
fn shortest_cells(neighbourhood: Neighbourhood, d_col: f64, d_row: f64) -> f64 {
    let (long, short) = (d_col.abs().max(d_row.abs()), d_col.abs().min(d_row.abs()));
    match neighbourhood {
        // As many diagonals as there are short steps, the rest straight.
        Neighbourhood::Eight => short * 2_f64.sqrt() + (long - short),
        // Below slope 1/2, a knight's move for each short step; above, diagonals and knight's moves.
        Neighbourhood::Sixteen if long >= 2.0 * short => short * 5_f64.sqrt() + (long - 2.0 * short),
        Neighbourhood::Sixteen => (long - short) * 5_f64.sqrt() + (2.0 * short - long) * 2_f64.sqrt(),
    }
}

#[test]
fn uniform_ground_gives_the_norm_of_the_neighbourhood_and_bounds_the_straight_line() {
    let traction = 0.8;
    let map = RiskMap::constant(geometry(31, 27), 13, Risk { linear_traction: traction, ..Risk::NONE });
    let goal = Cell { row: 11, col: 8 };
    // The largest excess over the straight line: at 22.5 degrees for 8 directions, and for 16 at half the angle
    // between east and the knight's move.
    let excess_of = |half_rad: f64| 1.0 / half_rad.cos();
    let eight = (Neighbourhood::Eight, excess_of(22.5_f64.to_radians()));
    let sixteen = (Neighbourhood::Sixteen, excess_of(0.5_f64.atan() / 2.0));
    for (neighbourhood, largest_excess) in [eight, sixteen] {
        let field = field(neighbourhood, &map, map.geometry().centre_m(goal));
        for cell in inside(map.geometry()) {
            let (d_col, d_row) = (cell.col as f64 - goal.col as f64, cell.row as f64 - goal.row as f64);
            let found_s = at(&field.view(), cell.row, cell.col);
            let seconds_per_cell = RESOLUTION_M / (SPEED_MPS * f64::from(traction));
            close(found_s, shortest_cells(neighbourhood, d_col, d_row) * seconds_per_cell);
            let straight_s = d_col.hypot(d_row) * seconds_per_cell;
            assert!(found_s >= straight_s * 0.99999);
            assert!(found_s <= straight_s * (largest_excess + 1e-5), "{cell:?}: {found_s} over {straight_s}");
        }
    }
}

#[test]
fn the_way_through_a_gap_is_the_sum_of_its_parts() {
    // Blocked columns 12 to 14 with one open row.
    let mut map = RiskMap::constant(geometry(25, 27), 13, Risk::NONE);
    let (gap_row, start, goal) = (17, Cell { row: 9, col: 3 }, Cell { row: 6, col: 22 });
    for row in (1..24).filter(|&row| row != gap_row) {
        (12..15).for_each(|col| block(&mut map, row, col));
    }
    for neighbourhood in [Neighbourhood::Eight, Neighbourhood::Sixteen] {
        let field = field(neighbourhood, &map, map.geometry().centre_m(goal));
        // Start to the gap's first cell (column 12), two straight cells, the gap's last cell (column 14) to the goal.
        // The mouths are passed by a diagonal that touches the wall on one side only.
        let before = shortest_cells(neighbourhood, 9.0, 8.0);
        let behind = shortest_cells(neighbourhood, 8.0, 11.0);
        let found_cells = at(&field.view(), start.row, start.col) / (RESOLUTION_M / SPEED_MPS);
        close(found_cells, before + 2.0 + behind);
    }
}

#[test]
fn a_diagonal_wall_has_no_gaps() {
    let mut map = RiskMap::constant(geometry(21, 21), 16, Risk::NONE);
    let middle = Cell { row: 10, col: 10 };
    for cell in inside(&geometry(21, 21)) {
        if cell.row.abs_diff(middle.row) + cell.col.abs_diff(middle.col) == 6 {
            block(&mut map, cell.row, cell.col);
        }
    }
    let field = field(Neighbourhood::Sixteen, &map, map.geometry().centre_m(middle));
    let beyond_s = at(&field.view(), 3, 3);
    // The cheapest way through spends at least half a cell, at the slowdown, in the wall.
    assert!(beyond_s > 0.5 * SLOWDOWN * RESOLUTION_M / SPEED_MPS, "slipped through in {beyond_s} s");
}

#[test]
fn headings_are_told_apart() {
    // Eastward bins slide at half traction, all others do not: driving east takes twice as long as west.
    let n_yaws = 16;
    let mut map = RiskMap::constant(geometry(5, 41), n_yaws, Risk::NONE);
    let eastward: Vec<usize> =
        [-0.3, 0.3].map(|yaw_rad: f64| map.view().yaw_bin(yaw_rad)).into_iter().collect();
    map.fill(|risks, _| {
        for risks in risks.chunks_exact_mut(n_yaws) {
            eastward.iter().for_each(|&bin| risks[bin].linear_traction *= 0.5);
        }
    });
    let middle = map.geometry().centre_m(Cell { row: 2, col: 20 });
    let field = field(Neighbourhood::Eight, &map, middle);
    let (from_west_s, from_east_s) = (at(&field.view(), 2, 10), at(&field.view(), 2, 30));
    // A zigzag of diagonals avoids the eastward bins (within 22.5 degrees) at sqrt(2) times the length.
    close(from_east_s, 10.0 * RESOLUTION_M / SPEED_MPS);
    close(from_west_s, 2_f64.sqrt() * from_east_s);
}

#[test]
fn an_enclosed_goal_draws_from_everywhere() {
    let mut map = RiskMap::constant(geometry(21, 23), 13, Risk::NONE);
    let goal = Cell { row: 10, col: 11 };
    for (row, col) in (6..=14).flat_map(|row| (7..=15).map(move |col| (row, col))) {
        if row == 6 || row == 14 || col == 7 || col == 15 {
            block(&mut map, row, col);
        }
    }
    let field = field(Neighbourhood::Eight, &map, map.geometry().centre_m(goal));
    let view = field.view();
    // Straight west from (10, 3): 7 open cells and one blocked.
    let cell_s = RESOLUTION_M / SPEED_MPS;
    close(at(&view, 10, 3), (7.0 + SLOWDOWN) * cell_s);
    // Within the wall itself: half a cell of wall, then three and a half cells.
    close(at(&view, 10, 7), (0.5 * SLOWDOWN + 3.5) * cell_s);
    assert!(at(&view, 10, 7) < at(&view, 10, 6), "the wall's inside leads inwards");
    assert_descends(&view, goal);
}

#[test]
fn a_start_inside_an_obstacle_leads_out() {
    let mut map = RiskMap::constant(geometry(21, 31), 13, Risk::NONE);
    for (row, col) in (7..=13).flat_map(|row| (4..=10).map(move |col| (row, col))) {
        flag(&mut map, row, col, GroundFlags::OBSTACLE);
    }
    let goal = Cell { row: 10, col: 27 };
    let field = field(Neighbourhood::Sixteen, &map, map.geometry().centre_m(goal));
    let view = field.view();
    // From the block's centre (col 7) its edge is 3.5 cells away in every direction.
    let out_s = (3.5 * SLOWDOWN) * RESOLUTION_M / SPEED_MPS;
    let found_s = at(&view, 10, 7);
    assert!(found_s >= out_s && found_s < out_s + 30.0 * RESOLUTION_M / SPEED_MPS, "{found_s}");
    assert_descends(&view, goal);
}

/// Every cell but the goal has a neighbour that is nearer.
fn assert_descends(view: &CostToGoView<'_>, goal: Cell) {
    for cell in inside(&view.geometry).filter(|&cell| cell != goal) {
        let here_s = at(view, cell.row, cell.col);
        assert!(here_s.is_finite());
        let around = (0..9).map(|i| at(view, cell.row + i / 3 - 1, cell.col + i % 3 - 1));
        assert!(around.fold(f64::INFINITY, f64::min) < here_s, "{cell:?} is a trap");
    }
}

#[test]
fn a_goal_due_east_beyond_the_window_adds_the_straight_line_outside() {
    let map = RiskMap::constant(geometry(21, 25), 13, Risk::NONE);
    let ring_west_m = map.geometry().south_west_m()[0] + 24.0 * RESOLUTION_M;
    let [_, row_10_m] = map.geometry().centre_m(Cell { row: 10, col: 0 });
    for beyond_m in [0.4, 3.0, 250.0] {
        let field = field(Neighbourhood::Sixteen, &map, [ring_west_m + beyond_m, row_10_m]);
        for col in 1..24 {
            let [x_m, _] = map.geometry().centre_m(Cell { row: 10, col });
            // Full speed up to the ring, the assumed share from there on; the ring's centre is the last cell that
            // the search itself drives to, so a goal before it costs the way back.
            let outside_m = 0.25 + (beyond_m - 0.25).abs();
            let expected_s = (ring_west_m - x_m) / SPEED_MPS + outside_m / (SPEED_MPS * OUTSIDE_SPEED_SHARE);
            close(at(&field.view(), 10, col), expected_s);
        }
    }
}

#[test]
fn a_goal_in_the_border_ring_draws_from_everywhere() {
    // On the inner edge of the ring, in the middle of a ring cell and in a corner, on every side.
    let geometry = geometry(9, 12);
    let [west_m, south_m] = geometry.south_west_m();
    for [x_cells, y_cells] in
        [[11.0, 4.0], [11.5, 4.5], [1.0 - 1e-9, 4.0], [5.0, 8.0], [5.5, 0.5], [11.5, 8.5]]
    {
        let goal_m = [west_m + x_cells * RESOLUTION_M, south_m + y_cells * RESOLUTION_M];
        let field = field(Neighbourhood::Sixteen, &RiskMap::constant(geometry, 8, Risk::NONE), goal_m);
        let longest_s = 12f64.hypot(9.0) * RESOLUTION_M * 2.0 / (SPEED_MPS * OUTSIDE_SPEED_SHARE);
        for seconds in field.view().seconds {
            assert!(
                f64::from(*seconds) <= longest_s,
                "{seconds} s to the goal in cell ({x_cells}, {y_cells})"
            );
        }
    }
}

#[test]
fn shut_off_from_a_goal_outside_the_way_leads_around_the_window() {
    // Everything but the west side is walled off behind the ring, the goal lies east.
    let (n_rows, n_cols) = (15, 17);
    let mut map = RiskMap::constant(geometry(n_rows, n_cols), 13, Risk::NONE);
    for i in 1..n_cols - 1 {
        block(&mut map, 1, i);
        block(&mut map, n_rows - 2, i);
    }
    (1..n_rows - 1).for_each(|row| block(&mut map, row, n_cols - 2));
    let [x_m, y_m] = map.geometry().centre_m(Cell { row: 7, col: n_cols - 1 });
    let field = field(Neighbourhood::Eight, &map, [x_m + 20.0, y_m]);
    // Lower bound, a taut string: over open ground to the inner north-west corner, then around the corners outside.
    // Upper bound, one such way on the grid: to (12, 1), by two diagonals through the ring to (14, 1), along the ring
    // to the north-east corner, straight to the goal. Lengths in cells; the goal is 40 cells east of the ring.
    let cell_s = RESOLUTION_M / SPEED_MPS;
    let slow = 1.0 / OUTSIDE_SPEED_SHARE;
    let found_s = at(&field.view(), 7, 8);
    let shortest_s = cell_s * (7.5_f64.hypot(6.5) + slow * (15.0 + 40.5_f64.hypot(6.5)));
    let on_grid = shortest_cells(Neighbourhood::Eight, 7.0, 5.0);
    let longest_s = cell_s * (on_grid + slow * (8_f64.sqrt() + 15.0 + 40_f64.hypot(7.0)));
    assert!((shortest_s..=longest_s).contains(&found_s), "{found_s} not in {shortest_s}..{longest_s}");
}

#[test]
fn a_wall_across_the_window_is_driven_around_beyond_it() {
    let mut map = RiskMap::constant(geometry(11, 31), 13, Risk::NONE);
    (1..10).for_each(|row| block(&mut map, row, 15));
    let field = field(Neighbourhood::Eight, &map, map.geometry().centre_m(Cell { row: 5, col: 3 }));
    // Lower bound, a taut string over the wall's end, and a cell of the ring at the assumed speed. Upper bound, such a way
    // on the grid: four diagonals and two cells to (1, 17), a diagonal into the ring, half of it at either speed, two
    // cells in the ring, and the same from there on but for six cells instead of two.
    let slow = 1.0 / OUTSIDE_SPEED_SHARE;
    let shortest_cells = 2.0 * 7.5_f64.hypot(4.5) + slow;
    let longest_cells = 8.0 * 2_f64.sqrt() + 8.0 + 2.0 * 2_f64.sqrt() * (0.5 + 0.5 * slow) + 2.0 * slow;
    let found_cells = at(&field.view(), 5, 23) * SPEED_MPS / RESOLUTION_M;
    assert!((shortest_cells..=longest_cells + 1e-4).contains(&found_cells), "{found_cells}");
}

#[test]
fn unknown_ground_takes_the_assumed_share_of_the_speed() {
    let mut map = RiskMap::constant(geometry(41, 31), 13, Risk { roll_rad: 1.0, ..Risk::OUTSIDE });
    let unknown: Vec<Cell> = inside(map.geometry()).collect();
    unknown.iter().for_each(|cell| flag(&mut map, cell.row, cell.col, GroundFlags::UNKNOWN));
    let field = field(Neighbourhood::Eight, &map, map.geometry().centre_m(Cell { row: 20, col: 3 }));
    close(at(&field.view(), 20, 23), 20.0 * RESOLUTION_M / (SPEED_MPS * UNKNOWN_SPEED_SHARE));
    // A footprint that touches an obstacle forbids an unknown cell too: to get behind a wall of such poses costs one cell
    // of it.
    (1..16).for_each(|col| [18, 22].into_iter().for_each(|row| block(&mut map, row, col)));
    (18..23).for_each(|row| [1, 15].into_iter().for_each(|col| block(&mut map, row, col)));
    let walled = self::field(Neighbourhood::Eight, &map, map.geometry().centre_m(Cell { row: 20, col: 3 }));
    let expected_cells = 19.0 / UNKNOWN_SPEED_SHARE + SLOWDOWN;
    close(at(&walled.view(), 20, 23), expected_cells * RESOLUTION_M / SPEED_MPS);
}

/// Full traction is worth three quarters of the vehicle's speed where no more is allowed, half of the traction half of it.
#[test]
fn ground_is_crossed_no_faster_than_it_may_be() {
    let mut map = RiskMap::constant(geometry(41, 61), 13, Risk::NONE);
    let limit_mps = SpeedLimit::new(0.75 * SPEED_MPS as f32);
    map.ground_mut().iter_mut().for_each(|ground| ground.speed = limit_mps);
    map.fill(|risks, _| {
        for (index, risk) in risks.iter_mut().enumerate() {
            risk.linear_traction = if index / 13 % 61 < 10 { 0.5 } else { 1.0 };
        }
    });
    let field = field(Neighbourhood::Eight, &map, map.geometry().centre_m(Cell { row: 20, col: 3 }));
    // From the middle of column 3 to the end of column 9, 6.5 cells; from there to the middle of column 30, 20.5.
    let expected_s = RESOLUTION_M * (6.5 / (0.5 * SPEED_MPS) + 20.5 / f64::from(limit_mps.mps()));
    close(at(&field.view(), 20, 30), expected_s);
}

#[test]
fn attitudes_over_the_limits_and_broken_values_are_forbidden_but_finite() {
    let limits = limits();
    let forbidden = [
        Risk { roll_rad: limits.roll_max_rad as f32 + 1e-3, ..Risk::NONE },
        Risk { pitch_rad: limits.pitch_max_rad as f32 + 1e-3, ..Risk::NONE },
        Risk { linear_traction: 0.0, ..Risk::NONE },
        Risk { linear_traction: -1.0, ..Risk::NONE },
        Risk { linear_traction: f32::NAN, ..Risk::NONE },
        Risk { roll_rad: f32::NAN, ..Risk::NONE },
        Risk { pitch_rad: f32::INFINITY, ..Risk::NONE },
    ];
    for risk in forbidden {
        // To the border it is farther than to the goal.
        let map = RiskMap::constant(geometry(21, 24), 13, risk);
        let field = field(Neighbourhood::Eight, &map, map.geometry().centre_m(Cell { row: 10, col: 8 }));
        close(at(&field.view(), 10, 15), 7.0 * SLOWDOWN * RESOLUTION_M / SPEED_MPS);
    }
    let within = Risk {
        roll_rad: limits.roll_max_rad as f32,
        pitch_rad: limits.pitch_max_rad as f32,
        linear_traction: f32::INFINITY,
        ..Risk::NONE
    };
    let map = RiskMap::constant(geometry(5, 12), 13, within);
    let field = field(Neighbourhood::Eight, &map, map.geometry().centre_m(Cell { row: 2, col: 2 }));
    close(at(&field.view(), 2, 9), 7.0 * RESOLUTION_M / SPEED_MPS);
}

/// A map of random tractions, attitudes on both sides of the limits, obstacles and unknown cells.
fn random_map(seed: u64, n_rows: usize, n_cols: usize, n_yaws: usize) -> RiskMap {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
    let mut map = RiskMap::constant(geometry(n_rows, n_cols), n_yaws, Risk::NONE);
    map.fill(|risks, ground| {
        for risk in risks {
            *risk = Risk {
                linear_traction: rng.random_range(0.0..1.0),
                angular_traction: rng.random_range(0.0..1.0),
                roll_rad: rng.random_range(0.0..0.55),
                pitch_rad: rng.random_range(0.0..0.65),
            };
            if rng.random_bool(0.05) {
                *risk = risk.blocked();
            }
        }
        for ground in ground {
            ground.flags = match rng.random_range(0..10) {
                0 => GroundFlags::OBSTACLE,
                1 => GroundFlags::UNKNOWN,
                2 => GroundFlags::UNKNOWN.with(GroundFlags::OBSTACLE),
                _ => GroundFlags::default(),
            };
        }
    });
    map
}

/// The same problem in other words: times are line integrals of the risk map, sampled along the segment, and
/// Bellman-Ford relaxes all edges until nothing changes.
struct Oracle<'a> {
    map: RiskMapView<'a>,
    goal_m: [f64; 2],
    reach: i64,
}

impl Oracle<'_> {
    fn on_ring(&self, cell: Cell) -> bool {
        !inside(&self.map.geometry).any(|other| other == cell)
    }

    fn goal_inside(&self) -> bool {
        self.map.geometry.cell_at(self.goal_m[0], self.goal_m[1]).is_some_and(|cell| !self.on_ring(cell))
    }

    fn slowness(&self, x_m: f64, y_m: f64, yaw_rad: f64) -> f64 {
        let cell = self.map.geometry.cell_at(x_m, y_m).unwrap();
        let flags = self.map.ground[self.map.geometry.index(cell)].flags;
        let risk = self.map.risk_at(x_m, y_m, yaw_rad);
        let speed_mps = if self.on_ring(cell) {
            SPEED_MPS * OUTSIDE_SPEED_SHARE
        } else if flags.contains(GroundFlags::OBSTACLE) {
            0.0
        } else if flags.contains(GroundFlags::UNKNOWN) && risk.roll_rad < 3.0 {
            SPEED_MPS * UNKNOWN_SPEED_SHARE
        } else if risk.roll_rad > 0.5 || risk.pitch_rad > 0.6 {
            0.0
        } else {
            SPEED_MPS * f64::from(risk.linear_traction)
        };
        1.0 / speed_mps.max(SPEED_MPS / SLOWDOWN)
    }

    /// Time along the segment between two cell centres: eight samples, none on a cell's edge. A diagonal is no
    /// faster than the better of the two cells on either side of its middle.
    fn edge_s(&self, from: Cell, to: Cell) -> f64 {
        let ([x0, y0], [x1, y1]) = (self.map.geometry.centre_m(from), self.map.geometry.centre_m(to));
        let (dx, dy) = (x1 - x0, y1 - y0);
        let yaw_rad = dy.atan2(dx);
        let along = |share: f64, aside: f64| {
            self.slowness(x0 + share * dx - aside * dy, y0 + share * dy + aside * dx, yaw_rad)
        };
        let mean = (0..8).map(|i| along((f64::from(i) + 0.5) / 8.0, 0.0)).sum::<f64>() / 8.0;
        let diagonal = (dx.abs() - dy.abs()).abs() < 1e-9;
        let corner = if diagonal { along(0.5, 0.1).min(along(0.5, -0.1)) } else { 0.0 };
        dx.hypot(dy) * mean.max(corner)
    }

    fn seed_s(&self, cell: Cell) -> f64 {
        let [x_m, y_m] = self.map.geometry.centre_m(cell);
        if self.goal_inside() {
            let at_goal = self.map.geometry.cell_at(self.goal_m[0], self.goal_m[1]) == Some(cell);
            return if at_goal { 0.0 } else { f64::INFINITY };
        }
        let (dx, dy) = (self.goal_m[0] - x_m, self.goal_m[1] - y_m);
        let looks_through = (0..=20_000).any(|i| {
            let share = f64::from(i) / 20_000.0;
            let point = self.map.geometry.cell_at(x_m + share * dx, y_m + share * dy);
            point.is_some_and(|cell| !self.on_ring(cell))
        });
        let visible = self.on_ring(cell) && !looks_through;
        if visible { dx.hypot(dy) / (SPEED_MPS * OUTSIDE_SPEED_SHARE) } else { f64::INFINITY }
    }

    fn solve(&self) -> Vec<f64> {
        let geometry = self.map.geometry;
        let mut edges = Vec::new();
        for from in (0..geometry.n_cells()).map(|index| geometry.cell(index)) {
            for (d_row, d_col) in (-2..=2_i64).flat_map(|row| (-2..=2_i64).map(move |col| (row, col))) {
                let squared = d_row * d_row + d_col * d_col;
                let (row, col) = (from.row as i64 + d_row, from.col as i64 + d_col);
                let exists =
                    (0..geometry.n_rows as i64).contains(&row) && (0..geometry.n_cols as i64).contains(&col);
                if exists && [1, 2, 5].contains(&squared) && squared <= self.reach {
                    let to = Cell { row: row as usize, col: col as usize };
                    edges.push((geometry.index(from), geometry.index(to), self.edge_s(from, to)));
                }
            }
        }
        let mut times_s: Vec<f64> =
            (0..geometry.n_cells()).map(|index| self.seed_s(geometry.cell(index))).collect();
        loop {
            let before = times_s.clone();
            for &(from, to, edge_s) in &edges {
                times_s[from] = times_s[from].min(times_s[to] + edge_s);
            }
            if times_s == before {
                return times_s;
            }
        }
    }
}

#[test]
fn the_field_is_optimal() {
    let mut field_of =
        [(Neighbourhood::Eight, 2), (Neighbourhood::Sixteen, 5)].map(|(neighbourhood, reach)| {
            (CostToGo::new(config(neighbourhood), &limits(), 14, 17).unwrap(), reach)
        });
    // Inside, in the ring, and outside on each side and corner.
    let goals_m = [
        [0.3, 5.2],
        [1.5, 2.1],
        [-3.4, 6.3],
        [14.0, 4.0],
        [2.0, 60.0],
        [-9.0, -5.0],
        [4.9, 11.0],
        [1.2, 8.6],
    ];
    for (seed, goal_m) in goals_m.into_iter().enumerate() {
        let n_yaws = [13, 16, 8][seed % 3];
        let map = random_map(seed as u64, 14, 17, n_yaws);
        for (field, reach) in &mut field_of {
            field.update(map.view(), goal_m, 0.0).unwrap();
            let expected_s = Oracle { map: map.view(), goal_m, reach: *reach }.solve();
            for (&found_s, expected_s) in field.view().seconds.iter().zip(expected_s) {
                close(f64::from(found_s), expected_s);
            }
        }
    }
}

#[test]
fn the_result_does_not_depend_on_what_was_solved_before() {
    let maps = [1, 2, 3].map(|seed| random_map(seed, 20, 30, 13));
    let goals_m = [[2.0, 5.0], [400.0, -3.0], [0.0, 6.0]];
    let mut reused = CostToGo::new(config(Neighbourhood::Sixteen), &limits(), 20, 30).unwrap();
    for (map, goal_m) in maps.iter().zip(goals_m) {
        reused.update(map.view(), goal_m, 0.0).unwrap();
        let fresh = field(Neighbourhood::Sixteen, map, goal_m);
        let bits = |field: &CostToGo| -> Vec<u32> {
            field.view().seconds.iter().map(|seconds| seconds.to_bits()).collect()
        };
        assert_eq!(bits(&reused), bits(&fresh));
    }
}

#[test]
fn interpolation_is_exact_on_a_plane_and_holds_the_border_value_beyond() {
    let geometry = geometry(6, 9);
    let plane_s = |x_m: f64, y_m: f64| 40.0 + 3.0 * x_m - 2.0 * y_m;
    let seconds: Vec<f32> = (0..geometry.n_cells())
        .map(|index| {
            let [x_m, y_m] = geometry.centre_m(geometry.cell(index));
            plane_s(x_m, y_m) as f32
        })
        .collect();
    let view = CostToGoView { geometry, seconds: &seconds, turning_s: &[] };
    let [west_m, south_m] = geometry.centre_m(Cell { row: 0, col: 0 });
    let [east_m, north_m] = geometry.centre_m(Cell { row: 5, col: 8 });
    for i in 0..200 {
        let (x_m, y_m) = (west_m - 2.0 + 0.05 * f64::from(i), south_m - 1.0 + 0.03 * f64::from(i));
        let held_s = plane_s(x_m.clamp(west_m, east_m), y_m.clamp(south_m, north_m));
        close(f64::from(view.interpolated_s(x_m, y_m)), held_s);
        if let Some(cell) = geometry.cell_at(x_m, y_m) {
            let [centre_x_m, centre_y_m] = geometry.centre_m(cell);
            close(f64::from(view.nearest_s(x_m, y_m)), plane_s(centre_x_m, centre_y_m));
        }
    }
    for broken in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
        assert!(view.interpolated_s(broken, 3.0).is_finite() && view.nearest_s(3.0, broken).is_finite());
    }
}

#[test]
fn bad_input_is_refused_with_its_numbers() {
    let refused = |config: CostToGoConfig, limits: Limits| {
        CostToGo::new(config, &limits, 9, 9).err().map(|error| error.to_string()).unwrap_or_default()
    };
    let good = CostToGoConfig::default();
    for (config, field) in [
        (CostToGoConfig { unknown_speed_share: 0.0, ..good }, "unknown_speed_share"),
        (CostToGoConfig { outside_speed_share: 1.1, ..good }, "outside_speed_share"),
        (CostToGoConfig { outside_speed_share: 1e-38, ..good }, "outside_speed_share"),
        (CostToGoConfig { outside_speed_share: f64::NAN, ..good }, "outside_speed_share"),
        (CostToGoConfig { forbidden_slowdown: 0.5, ..good }, "forbidden_slowdown"),
        (CostToGoConfig { forbidden_slowdown: f64::INFINITY, ..good }, "forbidden_slowdown"),
        (CostToGoConfig { turning_radius_m: -0.1, ..good }, "turning_radius_m"),
        (CostToGoConfig { turning_radius_m: f64::NAN, ..good }, "turning_radius_m"),
        (CostToGoConfig { reverse_speed_share: 0.001, ..good }, "reverse_speed_share"),
        (CostToGoConfig { reverse_speed_share: 1.1, ..good }, "reverse_speed_share"),
    ] {
        assert!(refused(config, limits()).starts_with(field), "{}", refused(config, limits()));
    }
    let still = Limits { speed_max_mps: 0.0, ..limits() };
    assert_eq!(refused(good, still), "limits.speed_max_mps: expected a finite number > 0, found 0");
    let mut field = CostToGo::new(good, &limits(), 9, 9).unwrap();
    let other = RiskMap::constant(geometry(9, 10), 13, Risk::NONE);
    assert!(matches!(
        field.update(other.view(), [0.0; 2], 0.0),
        Err(CostToGoError::MapShape { n_cols: 10, .. })
    ));
    let map = RiskMap::constant(geometry(9, 9), 13, Risk::NONE);
    let headless = RiskMap::constant(geometry(9, 9), 0, Risk::NONE);
    assert!(matches!(field.update(headless.view(), [0.0; 2], 0.0), Err(CostToGoError::MapShape { .. })));
    assert!(matches!(field.update(map.view(), [f64::NAN, 0.0], 0.0), Err(CostToGoError::Goal { .. })));
    assert!(matches!(field.update(map.view(), [0.0; 2], f64::NAN), Err(CostToGoError::Goal { .. })));
    assert!(CostToGo::new(good, &limits(), 2, 9).is_err());
}
