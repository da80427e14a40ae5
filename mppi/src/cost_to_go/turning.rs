//! What keeping to a turning circle takes beyond the field of least time: the same problem over place and heading.
//!
//! Labels are corrected row by row and move by move, as long as a row that a move leads to has improved. Rows are taken
//! against the heading and headings in turn (fast sweeping, Zhao, Mathematics of Computation 74, 2005), so that few are
//! taken twice, and every loop is over a whole row.

use super::lattice::{self, Move, N_HEADINGS, N_MOVES};
use std::f64::consts::TAU;
use std::ops::Range;

/// Most times that all headings are gone through: what is not found by then counts as farther than it is.
const ROUNDS_MAX: usize = 100;

/// Most that turning counts for [s]: where no way leads to the goal at all.
const TURNING_MAX_S: f32 = 1e4;

/// What the search over poses starts from.
pub struct Ground<'a> {
    /// Times per metre [s/m] by edge, shape [row, col] with `padding` around it.
    pub slowness: &'a [[f32; N_HEADINGS]],
    pub padding: usize,
    pub resolution_m: f64,
    /// The field of least time, shape [row, col] [s].
    pub field_s: &'a [f32],
    /// Where the goal lies, column and row counted from the south-west cell's centre.
    pub goal_cells: [f64; 2],
    /// Cells where it counts as reached: places, and the time that is left there [s].
    pub reached: &'a [(usize, f32)],
    /// Places of the cells from which the field leads on beyond the window.
    pub exits: &'a [usize],
    /// Time per metre on the window's border and beyond [s/m].
    pub border_slowness: f32,
}

/// All moves from a row and back to it, as [`Link::bits`].
const ALL_MOVES: u16 = (1 << (2 * N_MOVES)) - 1;

/// Rows of a heading whose labels depend on those of another.
#[derive(Clone, Copy, Debug)]
struct Link {
    heading: usize,
    /// How many rows farther north.
    rows: isize,
    /// By which move: bit k for the k-th that starts with the heading, bit `N_MOVES` + k for the move of the same kind that
    /// ends with it, taken in reverse.
    bits: u16,
}

/// Least time over poses, and all that its computation needs.
pub struct Turning {
    radius_cells: f64,
    /// How many times longer a move takes in reverse; `None` where there is no reverse.
    reverse_slowdown: Option<f32>,
    moves: Vec<Move>,
    /// Moves that end with each heading, by their place, in the order of those that start with it.
    arrivals: [[usize; N_MOVES]; N_HEADINGS],
    headings_rad: [f32; N_HEADINGS],
    /// Cells around the window that moves lead to.
    pad: usize,
    n_rows: usize,
    n_cols: usize,
    /// Time per cell [s], shape [heading, row, col] with padding.
    slowness_s: Vec<f32>,
    /// Time of every move from every cell [s], shape [move, row, col].
    moves_s: Vec<f32>,
    /// Best times so far [s], shape [heading, row, col] with padding.
    labels_s: Vec<f32>,
    /// Who is to be looked at again when a row of a heading has improved.
    links: [Vec<Link>; N_HEADINGS],
    /// Moves from a row, and back to it, that may lead to a better time than before, by [`Link::bits`], shape
    /// [heading, row].
    due: Vec<u16>,
    /// The result [s], shape [heading, row, col].
    turning_s: Vec<f32>,
}

impl Turning {
    pub fn new(radius_cells: f64, reverse_slowdown: Option<f32>, n_rows: usize, n_cols: usize) -> Self {
        let moves = lattice::moves(radius_cells);
        let pad = moves.iter().map(Move::reach_cells).max().unwrap_or(0);
        let n_padded = N_HEADINGS * (n_rows + 2 * pad) * (n_cols + 2 * pad);
        Self {
            radius_cells,
            reverse_slowdown,
            headings_rad: std::array::from_fn(|heading| {
                let [east, north] = lattice::unit(heading);
                libm::atan2(north, east) as f32
            }),
            pad,
            n_rows,
            n_cols,
            slowness_s: vec![0.0; n_padded],
            moves_s: vec![0.0; moves.len() * n_rows * n_cols],
            labels_s: vec![0.0; n_padded],
            links: std::array::from_fn(|heading| links(&moves, heading, reverse_slowdown.is_some())),
            due: vec![0; N_HEADINGS * n_rows],
            arrivals: std::array::from_fn(|heading| arrivals(&moves, heading)),
            turning_s: vec![0.0; N_HEADINGS * n_rows * n_cols],
            moves,
        }
    }

    /// The radius that it was made for.
    pub fn radius_cells(&self) -> f64 {
        self.radius_cells
    }

    /// What turning takes beyond the field, of the last update [s], shape [heading, row, col].
    pub fn turning_s(&self) -> &[f32] {
        &self.turning_s
    }

    /// Solves for all poses. Allocates nothing.
    pub fn update(&mut self, ground: &Ground<'_>) {
        self.fill_slowness(ground);
        self.price_moves();
        self.labels_s.fill(f32::INFINITY);
        self.due.fill(0);
        self.seed(ground);
        self.search();
        self.compare(ground.field_s);
    }

    fn stride(&self) -> usize {
        self.n_cols + 2 * self.pad
    }

    /// Where a row of a heading starts in the padded arrays.
    fn padded(&self, heading: usize, row: usize) -> usize {
        (heading * (self.n_rows + 2 * self.pad) + row + self.pad) * self.stride() + self.pad
    }

    /// How far the end of a move lies from its start in the padded arrays, but for the heading.
    fn step(&self, by: [isize; 2]) -> isize {
        by[1] * self.stride() as isize + by[0]
    }

    fn fill_slowness(&mut self, ground: &Ground<'_>) {
        let cell_m = ground.resolution_m as f32;
        self.slowness_s.fill(ground.border_slowness * cell_m);
        let stride = self.n_cols + 2 * ground.padding;
        for heading in 0..N_HEADINGS {
            let direction = lattice::direction(heading);
            for row in 0..self.n_rows {
                let from =
                    &ground.slowness[(row + ground.padding) * stride + ground.padding..][..self.n_cols];
                let start = self.padded(heading, row);
                for (own, slowness) in self.slowness_s[start..][..self.n_cols].iter_mut().zip(from) {
                    *own = slowness[direction] * cell_m;
                }
            }
        }
    }

    fn price_moves(&mut self) {
        let n_cells = self.n_rows * self.n_cols;
        let mut moves_s = std::mem::take(&mut self.moves_s);
        for (step, times_s) in self.moves.iter().zip(moves_s.chunks_exact_mut(n_cells)) {
            for (row, times_s) in times_s.chunks_exact_mut(self.n_cols).enumerate() {
                times_s.fill(0.0);
                for stretch in &step.stretches {
                    let start =
                        self.padded(stretch.heading, row).wrapping_add_signed(self.step(stretch.cell));
                    let crossed_s = &self.slowness_s[start..][..self.n_cols];
                    for (time_s, crossed_s) in times_s.iter_mut().zip(crossed_s) {
                        *time_s += stretch.length_cells * crossed_s;
                    }
                }
            }
        }
        self.moves_s = moves_s;
    }

    /// Where the goal counts as reached nobody has to turn any more; from an exit it is the field, and what it takes to turn
    /// to the goal from there.
    fn seed(&mut self, ground: &Ground<'_>) {
        let radius_s = self.radius_cells as f32 * ground.border_slowness * ground.resolution_m as f32;
        for &(cell, time_s) in ground.reached {
            self.seed_cell(cell, |_| time_s);
        }
        for &cell in ground.exits {
            let (row, col) = (cell / self.n_cols, cell % self.n_cols);
            let [east, north] = [ground.goal_cells[0] - col as f64, ground.goal_cells[1] - row as f64];
            let way_rad = libm::atan2(north, east) as f32;
            let field_s = ground.field_s[cell];
            self.seed_cell(cell, |heading_rad| field_s + radius_s * lost_rad(heading_rad - way_rad));
        }
    }

    fn seed_cell(&mut self, cell: usize, label_s: impl Fn(f32) -> f32) {
        let (row, col) = (cell / self.n_cols, cell % self.n_cols);
        for heading in 0..N_HEADINGS {
            let place = self.padded(heading, row) + col;
            self.labels_s[place] = label_s(self.headings_rad[heading]);
            self.due[heading * self.n_rows + row] = ALL_MOVES;
            self.tell(heading, row);
        }
    }

    fn search(&mut self) {
        for round in 0..ROUNDS_MAX {
            if self.due.iter().all(|due| *due == 0) {
                break;
            }
            for k in 0..N_HEADINGS {
                let heading = if round.is_multiple_of(2) { k } else { N_HEADINGS - 1 - k };
                let is_northward = lattice::unit(heading)[1] > 0.0;
                for k in 0..self.n_rows {
                    self.look_at(heading, if is_northward { self.n_rows - 1 - k } else { k });
                }
                for k in 0..self.n_rows {
                    self.look_at(heading, if is_northward { k } else { self.n_rows - 1 - k });
                }
            }
        }
    }

    /// Corrects the labels of a row by the moves that are due.
    fn look_at(&mut self, heading: usize, row: usize) {
        let mut due = std::mem::take(&mut self.due[heading * self.n_rows + row]);
        let mut is_better = false;
        for k in 0..N_MOVES {
            // Straight on, which is the last, may lead along the row itself.
            if is_better && k == N_MOVES - 1 && self.moves[heading * N_MOVES + k].by[1] == 0 {
                due |= 1 << k | 1 << (N_MOVES + k);
            }
            if due >> k & 1 == 1 {
                is_better |= self.drive_on(heading * N_MOVES + k, row);
            }
            if due >> (N_MOVES + k) & 1 == 1
                && let Some(slowdown) = self.reverse_slowdown
            {
                is_better |= self.back_up(self.arrivals[heading][k], row, slowdown);
            }
        }
        if is_better {
            self.tell(heading, row);
        }
    }

    /// Labels of a row have improved: whoever depends on them is due.
    fn tell(&mut self, heading: usize, row: usize) {
        for link in &self.links[heading] {
            let row = row.wrapping_add_signed(link.rows);
            if row < self.n_rows {
                self.due[link.heading * self.n_rows + row] |= link.bits;
            }
        }
    }

    /// From a row by a move.
    fn drive_on(&mut self, index: usize, row: usize) -> bool {
        let Move { from_heading, to_heading, by, .. } = self.moves[index];
        let own = self.padded(from_heading, row);
        let there = self.padded(to_heading, row).wrapping_add_signed(self.step(by));
        let moves_s = &self.moves_s[(index * self.n_rows + row) * self.n_cols..][..self.n_cols];
        if own.abs_diff(there) >= self.n_cols {
            return correct(&mut self.labels_s, (own, there), moves_s, 1.0);
        }
        let cells = self.labels_s[own..][..self.n_cols].iter_mut().zip(moves_s);
        if by[0] > 0 {
            correct_in_turn(f32::INFINITY, cells.rev(), 1.0)
        } else {
            correct_in_turn(f32::INFINITY, cells, 1.0)
        }
    }

    /// From a row in reverse by a move that ends there, where it starts within the window.
    fn back_up(&mut self, index: usize, row: usize, slowdown: f32) -> bool {
        let Move { from_heading, to_heading, by, .. } = self.moves[index];
        let start_row = row.wrapping_add_signed(-by[1]);
        if start_row >= self.n_rows {
            return false;
        }
        let cols = columns_within(self.n_cols, by[0]);
        if cols.is_empty() {
            return false;
        }
        let first = cols.start.wrapping_add_signed(-by[0]);
        let own = self.padded(to_heading, row) + cols.start;
        let there = self.padded(from_heading, start_row) + first;
        let moves_s = &self.moves_s[(index * self.n_rows + start_row) * self.n_cols + first..][..cols.len()];
        if own.abs_diff(there) >= self.n_cols {
            return correct(&mut self.labels_s, (own, there), moves_s, slowdown);
        }
        let [west_s, east_s] = [self.labels_s[there], self.labels_s[there + cols.len() - 1]];
        let cells = self.labels_s[own..][..cols.len()].iter_mut().zip(moves_s);
        if by[0] > 0 {
            correct_in_turn(west_s, cells, slowdown)
        } else {
            correct_in_turn(east_s, cells.rev(), slowdown)
        }
    }

    fn compare(&mut self, field_s: &[f32]) {
        for heading in 0..N_HEADINGS {
            for row in 0..self.n_rows {
                let labels_s = &self.labels_s[self.padded(heading, row)..][..self.n_cols];
                let field_s = &field_s[row * self.n_cols..][..self.n_cols];
                let turning_s =
                    &mut self.turning_s[(heading * self.n_rows + row) * self.n_cols..][..self.n_cols];
                for ((turning_s, label_s), field_s) in turning_s.iter_mut().zip(labels_s).zip(field_s) {
                    *turning_s = (label_s - field_s).clamp(0.0, TURNING_MAX_S);
                }
            }
        }
    }
}

/// Places of the moves that end with a heading, in the order of those that start with it: of each kind, one does.
fn arrivals(moves: &[Move], heading: usize) -> [usize; N_MOVES] {
    std::array::from_fn(|k| {
        let ends_there = |place: &usize| moves[*place].to_heading == heading;
        (k..moves.len()).step_by(N_MOVES).find(ends_there).unwrap_or(k)
    })
}

/// Whose labels depend on those of a heading: where the moves that end with it start and, if there is a reverse, where
/// those end that start with it. Along a row itself, nobody has to be told.
fn links(moves: &[Move], heading: usize, has_reverse: bool) -> Vec<Link> {
    let starts = moves.iter().enumerate().filter(|(_, step)| step.to_heading == heading);
    let starts = starts.map(|(place, step)| Link {
        heading: step.from_heading,
        rows: -step.by[1],
        bits: 1 << (place % N_MOVES),
    });
    let ends = moves.iter().enumerate().filter(|(_, step)| has_reverse && step.from_heading == heading);
    let ends = ends.map(|(place, step)| Link {
        heading: step.to_heading,
        rows: step.by[1],
        bits: 1 << (N_MOVES + place % N_MOVES),
    });
    starts.chain(ends).filter(|link| link.heading != heading || link.rows != 0).collect()
}

/// What the tightest turn to a way on open ground loses, e - sin e of the angle e to it [rad]; by its series.
fn lost_rad(turn_rad: f32) -> f32 {
    let e = turn_rad.abs().min(TAU as f32 - turn_rad.abs());
    let square = e * e;
    e * square / 6.0 * (1.0 - square / 20.0 * (1.0 - square / 42.0 * (1.0 - square / 72.0)))
}

/// Columns from which a way back by so many columns stays within the window.
fn columns_within(n_cols: usize, east: isize) -> Range<usize> {
    let [low, high] = [east.max(0), n_cols as isize + east.min(0)];
    low as usize..high.max(low) as usize
}

/// Labels from `own` on become those from `there` on and the times between, where that is less; says whether any did.
/// The two stretches do not overlap.
fn correct(labels_s: &mut [f32], (own, there): (usize, usize), times_s: &[f32], slowdown: f32) -> bool {
    let n = times_s.len();
    let (low, high) = labels_s.split_at_mut(own.max(there));
    let (own_s, there_s) =
        if own < there { (&mut low[own..][..n], &high[..n]) } else { (&mut high[..n], &low[there..][..n]) };
    // A number, because compilers make lanes of "or" over numbers and not over truths; nor of sums where they look for
    // overflow.
    let mut better = 0_u32;
    for ((own_s, there_s), time_s) in own_s.iter_mut().zip(there_s).zip(times_s) {
        let label_s = there_s + slowdown * time_s;
        better |= u32::from(label_s < *own_s);
        *own_s = if label_s < *own_s { label_s } else { *own_s };
    }
    better > 0
}

/// The same along a row itself, from the label before the first cell on, with the time of the move from each cell to the
/// one before it.
fn correct_in_turn<'a>(
    mut before_s: f32,
    cells: impl Iterator<Item = (&'a mut f32, &'a f32)>,
    slowdown: f32,
) -> bool {
    let mut is_better = false;
    for (own_s, time_s) in cells {
        let label_s = before_s + slowdown * time_s;
        is_better |= label_s < *own_s;
        before_s = if label_s < *own_s { label_s } else { *own_s };
        *own_s = before_s;
    }
    is_better
}

#[cfg(test)]
mod tests;
