//! The ways from pose to pose of a vehicle with a turning circle: a state lattice (Pivtoraiko, Knepper and Kelly,
//! Differentially constrained mobile robot motion planning in state lattices, Journal of Field Robotics 26(3), 2009).
//!
//! Its headings are the directions of the edges between cells. A vehicle drives straight on, turns to either side by a
//! heading or by several, or changes to the next lane on either side; every way ends in the centre of a cell.
//!
//! To the next heading alone, ways would be too long: with a radius of 22 cells a whole turn in sixteen arcs is 1.18
//! circles, with one of 5 cells two, since every arc ends in a cell and no cell is exactly where it would end. By two
//! headings at a time it is 1.03 circles, and by four, with the smaller radius, 1.02.

use super::stencil::{EDGES, Edge};

/// Headings of the lattice.
pub const N_HEADINGS: usize = EDGES.len();

/// Moves that start, and that end, with each heading.
pub const N_MOVES: usize = 7;

/// Radius below which the wider arcs are quarters of a turn instead of eighths [cells].
const RADIUS_OF_QUARTERS_CELLS: f64 = 6.0;

/// Longest piece of an arc or of a change of lanes whose time is that of one cell: what blocks a pose is as wide as the
/// vehicle, several cells, on every side of what it touches.
const PIECE_CELLS: f64 = 2.0;

/// Share of the turning circle's radius that an arc has at least: ends are moved to the centres of cells.
const RADIUS_SHARE: f64 = 0.97;

/// A stretch of a way.
#[derive(Clone, Copy, Debug)]
pub struct Stretch {
    /// The cell that it lies in, eastward and northward from the start.
    pub cell: [isize; 2],
    /// Heading there.
    pub heading: usize,
    /// Its length [cells].
    pub length_cells: f32,
}

/// A way from the centre of a cell to that of another.
#[derive(Clone, Debug)]
pub struct Move {
    /// Heading at the start.
    pub from_heading: usize,
    /// Heading at the end.
    pub to_heading: usize,
    /// The end, eastward and northward from the start [cells].
    pub by: [isize; 2],
    /// What it crosses, in order.
    pub stretches: Vec<Stretch>,
}

impl Move {
    /// Cells that it leads away from its start, to whichever side.
    pub fn reach_cells(&self) -> usize {
        let crossed = self.stretches.iter().map(|stretch| stretch.cell);
        crossed.chain([self.by]).flatten().map(isize::unsigned_abs).max().unwrap_or(0)
    }
}

/// Place of a heading, counted counter-clockwise from east, among the edges.
pub fn direction(heading: usize) -> usize {
    if heading.is_multiple_of(2) { heading / 2 } else { N_HEADINGS / 2 + heading / 2 }
}

/// Unit vector of a heading, east and north.
pub fn unit(heading: usize) -> [f64; 2] {
    let [east, north] = edge(heading).towards.map(|cells| cells as f64);
    let length = libm::hypot(east, north);
    [east / length, north / length]
}

/// All moves of a vehicle whose tightest turn has this radius, by the heading that they start with, straight on last.
pub fn moves(radius_cells: f64) -> Vec<Move> {
    let wide = if radius_cells < RADIUS_OF_QUARTERS_CELLS { 4 } else { 2 };
    let of = |heading: usize| {
        let to = |by: usize| arc(heading, (heading + by) % N_HEADINGS, radius_cells);
        [
            to(1),
            to(N_HEADINGS - 1),
            to(wide),
            to(N_HEADINGS - wide),
            lane(heading, 1, radius_cells),
            lane(heading, -1, radius_cells),
            straight(heading),
        ]
    };
    (0..N_HEADINGS).flat_map(of).collect()
}

fn edge(heading: usize) -> Edge {
    EDGES[direction(heading)]
}

/// Along the edge of the grid.
fn straight(heading: usize) -> Move {
    let by = edge(heading).towards;
    let length_cells = libm::hypot(by[0] as f64, by[1] as f64);
    let at = |share: f64| ([by[0] as f64 * share, by[1] as f64 * share], heading);
    Move { from_heading: heading, to_heading: heading, by, stretches: stretches(length_cells, 0.25, at) }
}

/// To another heading, by an arc of a radius that is no tighter, and straight on before or after it where the
/// centre of a cell asks for that: the shortest such way.
///
/// Where the ways straight on from the start and straight back from the end meet, `before` from the start and `after`
/// from the end, the arc touches both: it spares the lesser of the two, `radius tan(angle / 2)`.
fn arc(from_heading: usize, to_heading: usize, radius_cells: f64) -> Move {
    let (from, to) = (unit(from_heading), unit(to_heading));
    let half_tangent = libm::tan(0.5 * libm::acos(dot(from, to)));
    let angle_rad = 2.0 * libm::atan(half_tangent);
    let spared = |by: [isize; 2]| {
        let by = by.map(|cells| cells as f64);
        [cross(by, to) / cross(from, to), cross(from, by) / cross(from, to)]
    };
    let length = |by: [isize; 2]| {
        let [before, after] = spared(by);
        (before - after).abs() + before.min(after) / half_tangent * angle_rad
    };
    let is_wide = |by: [isize; 2]| {
        let [before, after] = spared(by);
        before.min(after) >= (RADIUS_SHARE * radius_cells * half_tangent).max(f64::MIN_POSITIVE)
    };
    let by = nearest(radius_cells * angle_rad, is_wide, length);
    let [before, after] = spared(by);
    let radius = before.min(after) / half_tangent;
    let lead = (before - after).max(0.0);
    let turned = (to_heading + N_HEADINGS - from_heading) % N_HEADINGS;
    let (side, by_headings) = if 2 * turned < N_HEADINGS { (1, turned) } else { (-1, N_HEADINGS - turned) };
    let left = [-from[1], from[0]].map(|value| side as f64 * value);
    let length_cells = length(by);
    let at = |share: f64| {
        let way = share * length_cells;
        let turned_rad = ((way - lead) / radius).clamp(0.0, angle_rad);
        let (sine, cosine) = libm::sincos(turned_rad);
        let (ahead, aside) = (way.min(lead) + radius * sine, radius * (1.0 - cosine));
        let rest = (way - lead - radius * angle_rad).max(0.0);
        let place = [0, 1].map(|axis| from[axis] * ahead + left[axis] * aside + to[axis] * rest);
        // Of several headings the arc passes those between as well.
        let passed = (turned_rad / angle_rad * by_headings as f64).round() as isize * side;
        (place, (from_heading as isize + passed).rem_euclid(N_HEADINGS as isize) as usize)
    };
    Move { from_heading, to_heading, by, stretches: stretches(length_cells, PIECE_CELLS, at) }
}

/// To the next line of cells along the heading, to the left for a side of 1, to the right for -1. Two arcs take the
/// vehicle aside by `d` over a way of about `2 sqrt(radius d)`.
fn lane(heading: usize, side: isize, radius_cells: f64) -> Move {
    let (towards, along) = (edge(heading).towards, unit(heading));
    let aside = 1.0 / libm::hypot(towards[0] as f64, towards[1] as f64);
    let least = 2.0 * libm::sqrt(radius_cells * aside);
    let ahead = |by: [isize; 2]| dot(along, by.map(|cells| cells as f64));
    let is_lane = |by: [isize; 2]| towards[0] * by[1] - towards[1] * by[0] == side && ahead(by) >= least;
    let by = nearest(least, is_lane, ahead);
    let at = |share: f64| ([by[0] as f64 * share, by[1] as f64 * share], heading);
    let length_cells = libm::hypot(by[0] as f64, by[1] as f64);
    Move {
        from_heading: heading,
        to_heading: heading,
        by,
        stretches: stretches(length_cells, PIECE_CELLS, at),
    }
}

/// Of the cells that will do, that of the shortest way; some are not much farther away than `about`.
fn nearest(
    about: f64,
    will_do: impl Fn([isize; 2]) -> bool,
    length: impl Fn([isize; 2]) -> f64,
) -> [isize; 2] {
    let reach = about.ceil() as isize + 4;
    let square = (-reach..=reach).flat_map(|north| (-reach..=reach).map(move |east| [east, north]));
    let shortest = square.filter(|by| will_do(*by)).min_by(|a, b| length(*a).total_cmp(&length(*b)));
    shortest.unwrap_or([0, 0])
}

/// A way in pieces of at most that many cells, each in the cell and heading that its middle lies in, equal neighbours in
/// one.
fn stretches(length_cells: f64, most_cells: f64, at: impl Fn(f64) -> ([f64; 2], usize)) -> Vec<Stretch> {
    let n = (length_cells / most_cells).ceil();
    let mut found: Vec<Stretch> = Vec::new();
    for k in 0..n as usize {
        let (place, heading) = at((k as f64 + 0.5) / n);
        let (cell, piece) = (place.map(|cells| cells.round() as isize), (length_cells / n) as f32);
        match found.last_mut().filter(|last| (last.cell, last.heading) == (cell, heading)) {
            Some(last) => last.length_cells += piece,
            None => found.push(Stretch { cell, heading, length_cells: piece }),
        }
    }
    found
}

fn dot(a: [f64; 2], b: [f64; 2]) -> f64 {
    a[0] * b[0] + a[1] * b[1]
}

fn cross(a: [f64; 2], b: [f64; 2]) -> f64 {
    a[0] * b[1] - a[1] * b[0]
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::TAU;

    #[test]
    fn headings_go_round_counter_clockwise_from_east() {
        for heading in 0..N_HEADINGS {
            let [from, to] = [heading, (heading + 1) % N_HEADINGS].map(unit);
            let turn_rad = libm::asin(cross(from, to));
            assert!(turn_rad > 0.3 && turn_rad < 0.5, "{heading}: {turn_rad}");
        }
        let [east, north] = unit(0);
        assert!((east - 1.0).abs() < 1e-12 && north.abs() < 1e-12);
    }

    fn length(step: &Move) -> f64 {
        step.stretches.iter().map(|stretch| f64::from(stretch.length_cells)).sum()
    }

    /// Turns of the wider arcs to the left come round, and a whole turn of them, half of it from knight's moves, is
    /// 2 pi R long, but for the centres of cells that they end in.
    #[test]
    fn arcs_keep_to_the_turning_circle_and_come_round() {
        for radius_cells in [1.0, 3.0, 5.0, 6.4, 8.9, 21.6, 40.0] {
            let moves = moves(radius_cells);
            let (mut sum, mut at) = (0.0, [0, 0]);
            for heading in 0..N_HEADINGS {
                let step = &moves[heading * N_MOVES + 2];
                sum += length(step);
                at = [at[0] + step.by[0], at[1] + step.by[1]];
            }
            assert_eq!(at, [0, 0], "the same shape in every quarter");
            let headings = if radius_cells < RADIUS_OF_QUARTERS_CELLS { 4.0 } else { 2.0 };
            let circles = sum / (headings * TAU * radius_cells);
            let most = if radius_cells < 3.0 { 1.45 } else { 1.2 };
            assert!(circles > 0.96 && circles < most, "{radius_cells}: {circles} circles");
        }
    }

    #[test]
    fn ways_hang_together_from_start_to_end() {
        for step in moves(21.6) {
            let mut last = [0, 0];
            for stretch in &step.stretches {
                let jump = [0, 1].map(|axis| (stretch.cell[axis] - last[axis]).abs());
                assert!(jump[0] <= 2 && jump[1] <= 2, "{step:?}");
                last = stretch.cell;
            }
            let rest = [0, 1].map(|axis| (step.by[axis] - last[axis]).abs());
            assert!(rest[0] <= 1 && rest[1] <= 1, "{step:?}");
            let straight = libm::hypot(step.by[0] as f64, step.by[1] as f64);
            assert!(length(&step) >= straight - 1e-5 && length(&step) < 1.12 * straight + 0.1, "{step:?}");
        }
    }
}
