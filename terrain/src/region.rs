//! Rectangles of cells that changed.

use crate::{Cell, GridGeometry};
use std::ops::Range;

/// A contiguous rectangle of cells of a window.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct CellRegion {
    /// Rows, counted from the south.
    pub rows: Range<usize>,
    /// Columns, counted from the west.
    pub cols: Range<usize>,
}

impl CellRegion {
    /// All cells of a window.
    pub fn whole(geometry: &GridGeometry) -> Self {
        Self { rows: 0..geometry.n_rows, cols: 0..geometry.n_cols }
    }

    /// One cell.
    pub fn of_cell(cell: Cell) -> Self {
        Self { rows: cell.row..cell.row + 1, cols: cell.col..cell.col + 1 }
    }

    /// Its cells, row by row from the south-west.
    pub fn cells(&self) -> impl Iterator<Item = Cell> + use<> {
        let cols = self.cols.clone();
        self.rows.clone().flat_map(move |row| cols.clone().map(move |col| Cell { row, col }))
    }

    /// Number of cells.
    pub fn n_cells(&self) -> usize {
        self.rows.len() * self.cols.len()
    }

    /// Grown by `margin` cells on every side, as far as the window reaches.
    pub fn grown(&self, margin: usize, geometry: &GridGeometry) -> Self {
        let grow = |r: &Range<usize>, n: usize| r.start.saturating_sub(margin)..(r.end + margin).min(n);
        Self { rows: grow(&self.rows, geometry.n_rows), cols: grow(&self.cols, geometry.n_cols) }
    }
}

/// Bounding rectangle on the global lattice, so that it keeps its meaning when the window rolls.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct LatticeBounds {
    min: [i64; 2],
    max: [i64; 2],
}

impl LatticeBounds {
    pub(crate) const EMPTY: Self = Self { min: [i64::MAX; 2], max: [i64::MIN; 2] };

    /// Includes the cells from `min` to `max`, both inclusive, as [x, y] lattice indices.
    pub(crate) fn include(&mut self, min: [i64; 2], max: [i64; 2]) {
        for axis in 0..2 {
            self.min[axis] = self.min[axis].min(min[axis]);
            self.max[axis] = self.max[axis].max(max[axis]);
        }
    }

    pub(crate) fn include_bounds(&mut self, other: &Self) {
        self.include(other.min, other.max);
    }

    pub(crate) fn include_window(&mut self, geometry: &GridGeometry) {
        let [x, y] = geometry.origin;
        self.include([x, y], [x + geometry.n_cols as i64 - 1, y + geometry.n_rows as i64 - 1]);
    }

    /// Includes the cells of `new` that are not in `old`.
    pub(crate) fn include_entered(&mut self, old: &GridGeometry, new: &GridGeometry) {
        let size = [new.n_cols as i64, new.n_rows as i64];
        for axis in 0..2 {
            let shift = (new.origin[axis] - old.origin[axis]).clamp(-size[axis], size[axis]);
            let mut min = new.origin;
            let mut max = [min[0] + size[0] - 1, min[1] + size[1] - 1];
            match shift {
                1.. => min[axis] = max[axis] - shift + 1,
                0 => continue,
                _ => max[axis] = min[axis] - shift - 1,
            }
            self.include(min, max);
        }
    }

    /// The part inside a window, `None` when there is none.
    pub(crate) fn within(&self, geometry: &GridGeometry) -> Option<CellRegion> {
        let range = |axis: usize, n: usize| {
            let start = (self.min[axis].max(geometry.origin[axis])) - geometry.origin[axis];
            let end = self.max[axis].min(geometry.origin[axis] + n as i64 - 1) - geometry.origin[axis] + 1;
            (start < end).then_some(start as usize..end as usize)
        };
        (self.min[0] <= self.max[0]).then_some(())?;
        Some(CellRegion { rows: range(1, geometry.n_rows)?, cols: range(0, geometry.n_cols)? })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn window(origin: [i64; 2]) -> GridGeometry {
        GridGeometry { resolution_m: 1.0, origin, n_rows: 3, n_cols: 4 }
    }

    #[test]
    fn the_entered_cells_of_every_roll_are_included_and_a_plain_roll_adds_no_others() {
        for (x, y) in (-6..=6).flat_map(|x| (-6..=6).map(move |y| (x, y))) {
            let (old, new) = (window([0, 0]), window([x, y]));
            let mut bounds = LatticeBounds::EMPTY;
            bounds.include_entered(&old, &new);
            let region = bounds.within(&new);
            let mut n_entered = 0;
            for cell in CellRegion::whole(&new).cells() {
                let [x_m, y_m] = new.centre_m(cell);
                let entered = old.cell_at(x_m, y_m).is_none();
                n_entered += usize::from(entered);
                let included =
                    region.as_ref().is_some_and(|r| r.rows.contains(&cell.row) && r.cols.contains(&cell.col));
                assert!(included || !entered, "shift {x}, {y}, cell {cell:?}");
            }
            if x == 0 || y == 0 {
                assert_eq!(region.map_or(0, |r| r.n_cells()), n_entered, "shift {x}, {y}");
            }
        }
    }

    #[test]
    fn bounds_are_cut_to_the_window() {
        let mut bounds = LatticeBounds::EMPTY;
        assert_eq!(bounds.within(&window([0, 0])), None);
        bounds.include([-5, 1], [1, 9]);
        assert_eq!(bounds.within(&window([0, 0])), Some(CellRegion { rows: 1..3, cols: 0..2 }));
        assert_eq!(bounds.within(&window([2, 0])), None);
        assert_eq!(bounds.within(&window([-9, -9])), None);
        let mut joined = LatticeBounds::EMPTY;
        joined.include_bounds(&LatticeBounds::EMPTY);
        assert_eq!(joined, LatticeBounds::EMPTY);
        joined.include_bounds(&bounds);
        assert_eq!(joined, bounds);
    }

    #[test]
    fn growing_stops_at_the_border() {
        let region = CellRegion { rows: 1..2, cols: 3..4 };
        assert_eq!(region.grown(1, &window([0, 0])), CellRegion { rows: 0..3, cols: 2..4 });
        assert_eq!(region.grown(9, &window([0, 0])), CellRegion::whole(&window([0, 0])));
    }
}
