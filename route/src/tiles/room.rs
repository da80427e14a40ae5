//! The part of a map that lies around some places.

use terrain::{GridGeometry, GridMap};

use super::{LEVEL_MAX, TileError, TileMap};
use crate::GroundCell;

/// Room around a start and a goal that a search sees, as a share of the way between them, and at least [m].
const ROOM: (f64, f64) = (0.25, 50.0);

impl TileMap {
    /// Room around a start and a goal for a way between them [m].
    pub fn room_m([start_m, goal_m]: [[f64; 2]; 2]) -> f64 {
        (ROOM.0 * libm::hypot(goal_m[0] - start_m[0], goal_m[1] - start_m[1])).max(ROOM.1)
    }

    /// The level of the smallest cells, from `least` on, of which at most so many lie around a start and a goal with the
    /// room of [`TileMap::room_m`]; `None` if they lie too far apart even for the largest.
    pub fn level_within(&self, least: u8, ends_m: [[f64; 2]; 2], n_cells_max: f64) -> Option<u8> {
        let sides_m =
            [0, 1].map(|axis| (ends_m[1][axis] - ends_m[0][axis]).abs() + 2.0 * Self::room_m(ends_m));
        let n_cells = |level: u8| sides_m[0] * sides_m[1] / (self.cell_m(level) * self.cell_m(level));
        (least..=LEVEL_MAX).find(|level| n_cells(*level) <= n_cells_max)
    }

    /// A window of a level around some points, with room beyond the outermost [m].
    ///
    /// # Errors
    /// As [`TileMap::window`].
    pub fn around(
        &mut self,
        level: u8,
        points_m: &[[f64; 2]],
        margin_m: f64,
    ) -> Result<GridMap<GroundCell>, TileError> {
        let cell_m = self.cell_m(level);
        let along = |axis: usize| points_m.iter().map(move |point| point[axis]);
        let low = [0, 1]
            .map(|axis| ((along(axis).fold(f64::INFINITY, f64::min) - margin_m) / cell_m).floor() as i64);
        let high = [0, 1]
            .map(|axis| ((along(axis).fold(f64::NEG_INFINITY, f64::max) + margin_m) / cell_m).ceil() as i64);
        let [n_cols, n_rows] = [0, 1].map(|axis| (high[axis] - low[axis]).max(1) as usize);
        self.window(level, &GridGeometry { resolution_m: cell_m, origin: low, n_rows, n_cols })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cells_grow_until_as_few_as_asked_lie_around_start_and_goal() {
        let folder = tempfile::tempdir().unwrap();
        let map = TileMap::open(folder.path(), 0.5, 1 << 20).unwrap();
        // 300 and 400 m apart: 125 m of room, a window of 550 by 650 m, 1.43 million cells of 0.5 m.
        let ends_m = [[100.0, 500.0], [400.0, 100.0]];
        assert_eq!(TileMap::room_m(ends_m), 125.0);
        assert_eq!(map.level_within(0, ends_m, 1.431e6), Some(0));
        assert_eq!(map.level_within(0, ends_m, 1.429e6), Some(1));
        assert_eq!(map.level_within(1, ends_m, 1.431e6), Some(1));
        assert_eq!(map.level_within(0, ends_m, 0.1), None);
        // Near to each other: 50 m all around.
        assert_eq!(TileMap::room_m([[0.0, 0.0], [3.0, 4.0]]), 50.0);
    }
}
