//! A* over cells, headings and the last motion (AnyNav, section 4.2).

mod buckets;

use crate::edges::{Edges, STEPS};
use buckets::Buckets;
use terrain::Cell;

/// How the vehicle came to a cell; its number is part of a state's.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Motion {
    Left,
    Straight,
    Right,
}

const MOTIONS: [Motion; 3] = [Motion::Left, Motion::Straight, Motion::Right];

impl Motion {
    /// The heading after it.
    fn turned(self, heading: usize) -> usize {
        match self {
            Self::Left => (heading + 1) % 8,
            Self::Straight => heading,
            Self::Right => (heading + 7) % 8,
        }
    }

    /// The heading before it.
    fn unturned(self, heading: usize) -> usize {
        match self {
            Self::Left => (heading + 7) % 8,
            Self::Straight => heading,
            Self::Right => (heading + 1) % 8,
        }
    }

    /// Equation 42: what a turn costs after the motion before.
    fn sharpness(self, before: Self) -> f32 {
        match (before, self) {
            (_, Self::Straight) => 0.0,
            (Self::Straight, _) => 1.0,
            (Self::Left, Self::Left) | (Self::Right, Self::Right) => 4.0,
            _ => 0.0,
        }
    }
}

/// A way over the cells of a map.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct CellPath {
    /// From the start's to the goal's.
    pub cells: Vec<Cell>,
    /// Sum over its steps [cells of level ground without friction's or slope's cost].
    pub cost: f64,
    /// States whose neighbours were looked at.
    pub n_expanded: usize,
}

/// No way leads to the goal.
#[derive(Clone, Debug)]
pub(crate) struct Unreachable {
    /// Whether a cell can be reached, row-major.
    pub is_reached: Vec<bool>,
}

/// What each state costs to reach and how it was reached; a state is (cell, heading, last motion).
struct Reached {
    /// 0 for what was not reached.
    cost: Vec<f32>,
    /// Number of the motion before the last one.
    before: Vec<u8>,
}

/// Largest map that can be searched: so many states have numbers of 32 bits.
pub(crate) const CELLS_MAX: usize = u32::MAX as usize / 24;

/// The cheapest way from a cell and heading to another cell.
pub(crate) fn cheapest(
    edges: &Edges,
    steering_weight: f32,
    (start, heading): (Cell, usize),
    goal: Cell,
) -> Result<CellPath, Unreachable> {
    let geometry = edges.geometry();
    let extent = edges.extent();
    let rest = Rest::new(extent, goal);
    let dearest = extent[0][1].max(extent[1][1]) + 4.0 * steering_weight * edges.per_friction_max();
    let width = extent[0][0].min(extent[1][0]).min(1e6);
    // An edge raises cost plus rest by at most its own cost twice: the rest changes by no more than it.
    let mut open = Buckets::new(width, 2.0 * dearest);
    let n_states = geometry.n_cells() * 24;
    // Zeroes come from the system as they are, so that only what is reached takes memory.
    let mut reached = Reached { cost: vec![0.0; n_states], before: vec![0; n_states] };
    let first = state(geometry.index(start), heading, Motion::Straight);
    reached.cost[first] = f32::MIN_POSITIVE;
    open.put(first as u32, f32::MIN_POSITIVE, rest.from(start));
    let mut best: Option<(f32, usize)> = None;
    let mut n_expanded = 0;
    while let Some((from, entered, bound)) = open.take() {
        if best.is_some_and(|(cost, _)| cost <= bound) {
            break;
        }
        let from = from as usize;
        let (index, heading, before) = parts(from);
        let cell = geometry.cell(index);
        let cost = reached.cost[from];
        // It was found again at a lower cost, which has an entry of its own.
        if cost < entered {
            continue;
        }
        if cell == goal {
            best = best.filter(|(least, _)| *least <= cost).or(Some((cost, from)));
            continue;
        }
        n_expanded += 1;
        for motion in MOTIONS {
            let heading = motion.turned(heading);
            let edge = edges.at(index, heading);
            if edge.cost == f32::INFINITY {
                continue;
            }
            let turning = steering_weight * motion.sharpness(before) * edge.per_friction;
            let [east, north] = STEPS[heading];
            let to_cell =
                Cell { row: cell.row.wrapping_add_signed(north), col: cell.col.wrapping_add_signed(east) };
            let to = state(geometry.index(to_cell), heading, motion);
            let cost = cost + edge.cost + turning;
            if reached.cost[to] == 0.0 || cost < reached.cost[to] {
                reached.cost[to] = cost;
                reached.before[to] = before as u8;
                open.put(to as u32, cost, cost + rest.from(to_cell));
            }
        }
    }
    let Some((cost, last)) = best else {
        let is_reached = |states: &[f32]| states.iter().any(|cost| *cost > 0.0);
        return Err(Unreachable { is_reached: reached.cost.chunks_exact(24).map(is_reached).collect() });
    };
    let cells = reached.walk_back(edges, first, last);
    Ok(CellPath { cells, cost: f64::from(cost), n_expanded })
}

impl Reached {
    fn walk_back(&self, edges: &Edges, first: usize, last: usize) -> Vec<Cell> {
        let geometry = edges.geometry();
        let (mut at, mut cells) = (last, Vec::new());
        loop {
            let (index, heading, motion) = parts(at);
            let cell = geometry.cell(index);
            cells.push(cell);
            if at == first {
                break;
            }
            let [east, north] = STEPS[heading];
            let from =
                Cell { row: cell.row.wrapping_add_signed(-north), col: cell.col.wrapping_add_signed(-east) };
            let before = MOTIONS[usize::from(self.before[at])];
            at = state(geometry.index(from), motion.unturned(heading), before);
        }
        cells.reverse();
        cells
    }
}

fn state(index: usize, heading: usize, motion: Motion) -> usize {
    (index * 8 + heading) * 3 + motion as usize
}

fn parts(state: usize) -> (usize, usize, Motion) {
    (state / 24, state / 3 % 8, MOTIONS[state % 3])
}

/// A lower bound of what is left to the goal: the straight and diagonal steps of an empty map at their lowest costs.
/// It never falls by more than a step costs, so that no state has to be expanded twice.
struct Rest {
    goal: Cell,
    straight: f32,
    diagonal: f32,
}

impl Rest {
    fn new([[straight, _], [diagonal, _]]: [[f32; 2]; 2], goal: Cell) -> Self {
        let finite = |cost: f32| if cost.is_finite() { cost } else { 0.0 };
        let (straight, diagonal) =
            (finite(straight.min(2.0 * diagonal)), finite(diagonal.min(2.0 * straight)));
        Self { goal, straight, diagonal }
    }

    #[inline]
    fn from(&self, cell: Cell) -> f32 {
        let away = [cell.row.abs_diff(self.goal.row), cell.col.abs_diff(self.goal.col)];
        let (least, most) = (away[0].min(away[1]) as f32, away[0].max(away[1]) as f32);
        // Rounded down, so that sums in single precision cannot overtake it.
        (least * self.diagonal + (most - least) * self.straight) * (1.0 - 1e-5)
    }
}
