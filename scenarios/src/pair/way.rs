//! Whether there is a way from a start to a goal.

use std::cmp::Reverse;
use std::collections::BinaryHeap;
use std::f64::consts::TAU;

use super::Pair;

/// Headings that are tried: every 45 degrees, along the lattice's rows, columns and diagonals.
const STEPS: [[i64; 2]; 8] = [[1, 0], [1, 1], [0, 1], [-1, 1], [-1, 0], [-1, -1], [0, -1], [1, -1]];
/// Poses of a manoeuvre that are looked at.
const PASSED: usize = 4;

/// How a way is searched.
pub(super) struct Way {
    /// Distance of the poses that are tried [m].
    pub spacing_m: f64,
    /// Smallest circle that the front wheels steer [m].
    pub radius_m: f64,
    /// How far around start and goal [m].
    pub within_m: f64,
}

impl Way {
    /// Best-first search over cells and headings, of manoeuvres that a vehicle with front steering can drive. `passes`
    /// says of a pose, x [m], y [m], yaw [rad], whether the vehicle may be there; it is asked once.
    pub(super) fn connects(&self, pair: &Pair, passes: impl Fn(f64, f64, f64) -> bool) -> bool {
        let lattice = Lattice::around(pair, self.within_m, self.spacing_m);
        let manoeuvres = self.manoeuvres();
        let mut asked = vec![None; lattice.n_nodes()];
        let mut may_be = |pose: Node| {
            lattice.holds(pose.cell)
                && *asked[lattice.index(pose)].get_or_insert_with(|| {
                    let [x_m, y_m] = lattice.at_m(pose.cell);
                    passes(x_m, y_m, heading_rad(pose.heading))
                })
        };
        let mut seen = vec![false; lattice.n_nodes()];
        let mut open = BinaryHeap::new();
        seen[lattice.index(lattice.start)] = true;
        open.push((Reverse(0), lattice.start));
        while let Some((_, node)) = open.pop() {
            if lattice.steps_to_goal(node.cell) <= 1 {
                return true;
            }
            for manoeuvre in &manoeuvres[node.heading] {
                let poses = manoeuvre.map(|pose| pose.from(node.cell));
                let end = poses[PASSED - 1];
                if lattice.holds(end.cell)
                    && !seen[lattice.index(end)]
                    && poses.iter().all(|&pose| may_be(pose))
                {
                    seen[lattice.index(end)] = true;
                    open.push((Reverse(lattice.steps_to_goal(end.cell)), end));
                }
            }
        }
        false
    }

    /// Of each heading: a cell forwards or backwards, and an eighth of a turn to either side in either gear.
    fn manoeuvres(&self) -> [Vec<[Node; PASSED]>; 8] {
        std::array::from_fn(|heading| {
            let straight =
                [1, -1].map(|gear| [Node { cell: STEPS[heading].map(|n| gear * n), heading }; PASSED]);
            let gears_and_sides = [(1.0, 1.0), (1.0, -1.0), (-1.0, 1.0), (-1.0, -1.0)];
            let turns = gears_and_sides.map(|(gear, side)| self.turn(heading, gear, side * self.radius_m));
            straight.into_iter().chain(turns).collect()
        })
    }

    /// Poses passed on an eighth of a turn from cell 0 about a centre `radius_m` to the left.
    fn turn(&self, heading: usize, gear: f64, radius_m: f64) -> [Node; PASSED] {
        let whole_rad = gear * radius_m.signum() * TAU / 8.0;
        std::array::from_fn(|i| {
            let turned_rad = whole_rad * (i + 1) as f64 / PASSED as f64;
            let [ahead_m, left_m] = [radius_m * turned_rad.sin(), radius_m * (1.0 - turned_rad.cos())];
            let (sin, cos) = heading_rad(heading).sin_cos();
            let way_m = [ahead_m * cos - left_m * sin, ahead_m * sin + left_m * cos];
            let eighths = (turned_rad / TAU * 8.0).round() as i64;
            let heading = (heading as i64 + eighths).rem_euclid(8) as usize;
            Node { cell: way_m.map(|way_m| (way_m / self.spacing_m).round() as i64), heading }
        })
    }
}

/// A pose of the search.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
struct Node {
    cell: [i64; 2],
    heading: usize,
}

impl Node {
    /// The same pose seen from the world, given from a cell.
    fn from(self, cell: [i64; 2]) -> Self {
        Self { cell: [cell[0] + self.cell[0], cell[1] + self.cell[1]], ..self }
    }
}

/// The poses that a search may visit.
struct Lattice {
    south_west_m: [f64; 2],
    spacing_m: f64,
    n: [i64; 2],
    start: Node,
    goal: [i64; 2],
}

impl Lattice {
    fn around(pair: &Pair, within_m: f64, spacing_m: f64) -> Self {
        let [x_m, y_m, yaw_rad] = pair.start;
        let low_m = [0, 1].map(|k| pair.start[k].min(pair.goal_m[k]) - within_m);
        let high_m = [0, 1].map(|k| pair.start[k].max(pair.goal_m[k]) + within_m);
        let cell = |at_m: [f64; 2]| [0, 1].map(|k| ((at_m[k] - low_m[k]) / spacing_m).round() as i64);
        let start = cell([x_m, y_m]);
        Self {
            // The start lies on the lattice.
            south_west_m: [x_m - start[0] as f64 * spacing_m, y_m - start[1] as f64 * spacing_m],
            spacing_m,
            n: [0, 1].map(|k| ((high_m[k] - low_m[k]) / spacing_m).ceil() as i64 + 1),
            start: Node { cell: start, heading: (yaw_rad / TAU * 8.0).round().rem_euclid(8.0) as usize },
            goal: cell(pair.goal_m),
        }
    }

    fn n_nodes(&self) -> usize {
        8 * (self.n[0] * self.n[1]) as usize
    }

    fn holds(&self, cell: [i64; 2]) -> bool {
        (0..2).all(|k| (0..self.n[k]).contains(&cell[k]))
    }

    fn index(&self, node: Node) -> usize {
        8 * (node.cell[1] * self.n[0] + node.cell[0]) as usize + node.heading
    }

    fn at_m(&self, cell: [i64; 2]) -> [f64; 2] {
        [0, 1].map(|k| self.south_west_m[k] + cell[k] as f64 * self.spacing_m)
    }

    /// Moves of a chess king to the goal.
    fn steps_to_goal(&self, cell: [i64; 2]) -> i64 {
        (0..2).map(|k| (cell[k] - self.goal[k]).abs()).max().unwrap_or(0)
    }
}

/// Yaw of a heading.
pub(super) fn heading_rad(heading: usize) -> f64 {
    heading as f64 * TAU / 8.0
}

#[cfg(test)]
mod tests {
    use super::*;

    const WAY: Way = Way { spacing_m: 0.5, radius_m: 4.0, within_m: 20.0 };
    const PAIR: Pair = Pair { start: [0.0; 3], goal_m: [30.0, 0.0] };

    #[test]
    fn eight_eighths_of_a_turn_end_where_they_began() {
        for turn in 2..6 {
            let mut node = Node { cell: [0, 0], heading: 3 };
            for _ in 0..8 {
                node = WAY.manoeuvres()[node.heading][turn][PASSED - 1].from(node.cell);
            }
            assert_eq!(node, Node { cell: [0, 0], heading: 3 }, "{turn}");
        }
    }

    #[test]
    fn an_eighth_of_a_turn_to_the_left_ahead_ends_where_the_circle_does() {
        // Heading east: 4 sin 45 = 2.83 m ahead and 4 (1 - cos 45) = 1.17 m to the left, in halves of a metre.
        let [ahead_left, ahead_right, back_left, _] =
            [2, 3, 4, 5].map(|turn| WAY.manoeuvres()[0][turn][PASSED - 1]);
        assert_eq!(ahead_left, Node { cell: [6, 2], heading: 1 });
        assert_eq!(ahead_right, Node { cell: [6, -2], heading: 7 });
        assert_eq!(back_left, Node { cell: [-6, 2], heading: 7 });
    }

    #[test]
    fn a_lane_too_narrow_to_turn_in_leads_nowhere_but_along() {
        // The lane runs east; whoever stands in it across can neither turn nor leave it.
        let lane = |width_m: f64| move |_: f64, y_m: f64, _: f64| y_m.abs() < width_m;
        assert!(WAY.connects(&PAIR, lane(0.6)));
        let across = Pair { start: [0.0, 0.0, TAU / 4.0], ..PAIR };
        assert!(!WAY.connects(&across, lane(0.6)));
        assert!(WAY.connects(&across, lane(4.0)));
    }
}
