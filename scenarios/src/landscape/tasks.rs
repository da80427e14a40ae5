//! Starts and goals in a landscape.

use rand::RngExt;
use terrain::{Cell, CellRegion, GridGeometry, GridMap};

use super::{Landscape, LandscapeError};
use crate::random::stream;

/// Level open ground that a start and a goal have around them [m], and its steepest slope [-].
const OPEN_M: f64 = 7.0;
const LEVEL: f64 = 0.2;
/// Ways keep so far from trees and water [m].
const CLEAR_M: f64 = 3.0;
/// Slopes that count as ways: so steep, or so much of the friction of sliding [-].
const STEEPEST: f64 = 0.35;
const FRICTION_SHARE: f64 = 0.6;
/// Draws for each task that is asked for, at most.
const ATTEMPTS: usize = 2000;

/// From where to where.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct RouteTask {
    /// Where the vehicle stands [m].
    pub start_m: [f64; 2],
    /// Which way it faces: to the goal, or to the nearest direction of eight [rad].
    pub yaw_rad: f64,
    /// Where it is to go [m].
    pub goal_m: [f64; 2],
}

impl Landscape {
    /// `n` tasks of a seed. A goal can be reached from its start over ground that is not steep for its friction, 3 m
    /// away
    /// from trees and water; that rule is all that chooses them, and no planner has a say.
    ///
    /// # Errors
    /// Too few such places.
    pub fn tasks(&self, n: usize) -> Result<Vec<RouteTask>, LandscapeError> {
        let slopes = self.slopes();
        let is_clear = self.clear_of(CLEAR_M);
        let is_way = |cell: Cell| {
            let friction = f64::from(self.world.patches[cell].friction.dynamic_friction);
            is_clear[cell] && slopes[cell] <= STEEPEST.min(FRICTION_SHARE * friction)
        };
        let parts = parts(self.world.geometry(), is_way);
        let is_open = self.clear_of(OPEN_M);
        let reach = (OPEN_M / self.world.geometry().resolution_m) as usize;
        let is_end = |cell: Cell| {
            let around = CellRegion::of_cell(cell).grown(reach, self.world.geometry());
            parts[cell] != 0 && is_open[cell] && around.cells().all(|cell| slopes[cell] <= LEVEL)
        };
        let geometry = *self.world.geometry();
        let mut rng = stream(self.seed, &[0x7A5C, self.kind as u64]);
        let ends: Vec<Cell> = CellRegion::whole(&geometry).cells().filter(|cell| is_end(*cell)).collect();
        let mut tasks = Vec::with_capacity(n);
        let [shortest_m, longest_m] = self.kind.distance_m();
        for _ in 0..ATTEMPTS * n {
            if tasks.len() == n || ends.is_empty() {
                break;
            }
            let [start, goal] = [0, 1].map(|_| ends[rng.random_range(0..ends.len())]);
            let [start_m, goal_m] = [start, goal].map(|cell| geometry.centre_m(cell));
            let way_m = [goal_m[0] - start_m[0], goal_m[1] - start_m[1]];
            let is_near = (shortest_m..=longest_m).contains(&way_m[0].hypot(way_m[1]));
            if is_near && parts[start] == parts[goal] {
                let eighth = std::f64::consts::FRAC_PI_4;
                let yaw_rad = (way_m[1].atan2(way_m[0]) / eighth).round() * eighth;
                tasks.push(RouteTask { start_m, yaw_rad, goal_m });
            }
        }
        let (kind, seed, found) = (self.kind.name(), self.seed, tasks.len());
        if found == n { Ok(tasks) } else { Err(LandscapeError::NoTasks { kind, seed, expected: n, found }) }
    }

    fn slopes(&self) -> GridMap<f64> {
        let geometry = *self.world.geometry();
        let slope = |cell: Cell| {
            let [east, north] = terrain::slope_at(&self.world.heights, cell, 1).gradient;
            f64::from(east).hypot(f64::from(north))
        };
        let values = CellRegion::whole(&geometry).cells().map(slope).collect();
        GridMap::from_values(geometry, values).unwrap_or(GridMap::filled(geometry, f64::INFINITY))
    }

    /// Whether no tree and no water is nearer than a distance.
    fn clear_of(&self, distance_m: f64) -> GridMap<bool> {
        let geometry = *self.world.geometry();
        let reach = (distance_m / geometry.resolution_m).ceil() as usize;
        let mut is_clear = GridMap::filled(geometry, true);
        let is_obstacle = |cell: Cell| {
            let patch = &self.world.patches[cell];
            patch.is_water() || patch.obstacle_height_m > 0.0
        };
        for obstacle in CellRegion::whole(&geometry).cells().filter(|cell| is_obstacle(*cell)) {
            for cell in CellRegion::of_cell(obstacle).grown(reach, &geometry).cells() {
                is_clear[cell] = false;
            }
        }
        is_clear
    }
}

/// The number of the connected part that each cell belongs to, 0 for none.
fn parts(geometry: &GridGeometry, is_way: impl Fn(Cell) -> bool) -> GridMap<u32> {
    let mut parts = GridMap::filled(*geometry, 0);
    let mut n_parts = 0;
    for seed in CellRegion::whole(geometry).cells() {
        if parts[seed] != 0 || !is_way(seed) {
            continue;
        }
        n_parts += 1;
        parts[seed] = n_parts;
        let mut open = vec![seed];
        while let Some(cell) = open.pop() {
            for beside in CellRegion::of_cell(cell).grown(1, geometry).cells() {
                if parts[beside] == 0 && is_way(beside) {
                    parts[beside] = n_parts;
                    open.push(beside);
                }
            }
        }
    }
    parts
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::LandscapeKind;

    #[test]
    fn tasks_are_apart_open_and_the_same_for_a_seed() {
        let landscape = Landscape::new(LandscapeKind::Garden, 5).unwrap();
        let tasks = landscape.tasks(50).unwrap();
        assert_eq!(tasks, landscape.tasks(50).unwrap());
        assert_eq!(tasks[..10], landscape.tasks(10).unwrap());
        for RouteTask { start_m, goal_m, yaw_rad } in tasks {
            let way_m = [goal_m[0] - start_m[0], goal_m[1] - start_m[1]];
            assert!((150.0..=280.0).contains(&way_m[0].hypot(way_m[1])));
            let off_rad = (way_m[1].atan2(way_m[0]) - yaw_rad).abs();
            assert!(off_rad <= std::f64::consts::FRAC_PI_8 + 1e-9, "{off_rad}");
            for [x_m, y_m] in [start_m, goal_m] {
                let patch = landscape.world.patch(x_m, y_m);
                assert!(patch.obstacle_height_m == 0.0 && !patch.is_water());
            }
        }
    }

    #[test]
    fn a_wall_parts_a_map_and_a_gap_in_it_joins_the_parts() {
        let geometry = GridGeometry { resolution_m: 1.0, origin: [0, 0], n_rows: 5, n_cols: 5 };
        let wall = parts(&geometry, |cell| cell.col != 2);
        assert_ne!(wall[Cell { row: 0, col: 0 }], wall[Cell { row: 0, col: 4 }]);
        assert_eq!(wall[Cell { row: 3, col: 2 }], 0);
        let gap = parts(&geometry, |cell| cell.col != 2 || cell.row == 1);
        assert_eq!(gap[Cell { row: 0, col: 0 }], gap[Cell { row: 4, col: 4 }]);
    }
}
