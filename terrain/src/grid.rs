//! Grid geometry on a global lattice, and maps over it.

/// A cell by its place in the grid: `row` counts north, `col` counts east, both from the south-west corner.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Cell {
    /// Row, 0 = south.
    pub row: usize,
    /// Column, 0 = west.
    pub col: usize,
}

/// A rectangle of square cells on the lattice whose cell (0, 0) has its south-west corner at the map origin.
///
/// The window is placed by whole cells, so two windows of the same resolution always agree on where cells lie
/// and a rolling window never resamples.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct GridGeometry {
    /// Edge of a cell [m].
    pub resolution_m: f64,
    /// Lattice index (x, y) of the south-west cell.
    pub origin: [i64; 2],
    /// Number of rows (northward).
    pub n_rows: usize,
    /// Number of columns (eastward).
    pub n_cols: usize,
}

/// Farthest lattice index from the map's origin that windows are placed at: sums and differences of such indices
/// and their centres in metres are exact.
pub const LATTICE_MAX: i64 = 1 << 40;

/// A position farther away than cells can be counted, or none.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[error("expected a position within {limit_m:e} m of the map's origin, found {position_m:?}")]
pub struct DistantPosition {
    /// East, north [m].
    pub position_m: [f64; 2],
    /// Farthest that would do, along each axis [m].
    pub limit_m: f64,
}

impl DistantPosition {
    /// Refuses a position that no window of such cells can be centred at.
    pub fn check(position_m: [f64; 2], resolution_m: f64) -> Result<(), Self> {
        let limit_m = LATTICE_MAX as f64 * resolution_m;
        let is_near = position_m.iter().all(|value| value.abs() <= limit_m);
        if is_near { Ok(()) } else { Err(Self { position_m, limit_m }) }
    }
}

impl GridGeometry {
    /// The window of `n_rows` x `n_cols` cells whose centre lies nearest to (`x_m`, `y_m`), which
    /// [`DistantPosition::check`] must allow: whoever takes in a position refuses others.
    pub fn centred(resolution_m: f64, n_rows: usize, n_cols: usize, x_m: f64, y_m: f64) -> Self {
        let start = |centre_m: f64, n: usize| (centre_m / resolution_m - n as f64 / 2.0).round() as i64;
        Self { resolution_m, origin: [start(x_m, n_cols), start(y_m, n_rows)], n_rows, n_cols }
    }

    /// Number of cells.
    pub fn n_cells(&self) -> usize {
        self.n_rows * self.n_cols
    }

    /// South-west corner of the window [m].
    pub fn south_west_m(&self) -> [f64; 2] {
        [self.origin[0] as f64 * self.resolution_m, self.origin[1] as f64 * self.resolution_m]
    }

    /// Centre of a cell [m].
    pub fn centre_m(&self, cell: Cell) -> [f64; 2] {
        let [x_m, y_m] = self.south_west_m();
        [x_m + (cell.col as f64 + 0.5) * self.resolution_m, y_m + (cell.row as f64 + 0.5) * self.resolution_m]
    }

    /// The cell that holds the point, `None` outside the window or for a non-finite point.
    pub fn cell_at(&self, x_m: f64, y_m: f64) -> Option<Cell> {
        let place = |value_m: f64, origin: i64, n: usize| {
            let lattice = (value_m / self.resolution_m).floor() - origin as f64;
            (lattice >= 0.0 && lattice < n as f64).then_some(lattice as usize)
        };
        Some(Cell {
            row: place(y_m, self.origin[1], self.n_rows)?,
            col: place(x_m, self.origin[0], self.n_cols)?,
        })
    }

    /// Moves values of shape [row, col, any number] from this window to that at another origin, so that they keep their
    /// cells of the lattice; those of cells that enter are `entering`.
    pub fn roll<T: Copy>(&self, values: &mut [T], origin: [i64; 2], entering: T) {
        let (n_rows, n_cols) = (self.n_rows, self.n_cols);
        let per_row = values.len() / n_rows.max(1);
        let per_cell = per_row / n_cols.max(1);
        let [east, north] = [0, 1].map(|axis| origin[axis] - self.origin[axis]);
        let skipped = usize::try_from(east.unsigned_abs()).map_or(n_cols, |columns| columns.min(n_cols));
        let [from, to] = if east >= 0 { [skipped, 0] } else { [0, skipped] }.map(|column| column * per_cell);
        let n_stay = (n_cols - skipped) * per_cell;
        for step in 0..n_rows {
            // A row is read before it is written over.
            let row = if north >= 0 { step } else { n_rows - 1 - step };
            let source = usize::try_from(row as i64 + north).ok().filter(|&source| source < n_rows);
            let n_stay = source.map_or(0, |_| n_stay);
            let start = source.unwrap_or(row) * per_row + from;
            values.copy_within(start..start + n_stay, row * per_row + to);
            let row = &mut values[row * per_row..(row + 1) * per_row];
            row[..to].fill(entering);
            row[to + n_stay..].fill(entering);
        }
    }

    /// Position of a cell in a row-major array.
    pub fn index(&self, cell: Cell) -> usize {
        cell.row * self.n_cols + cell.col
    }

    /// The cell at a position of a row-major array.
    pub fn cell(&self, index: usize) -> Cell {
        Cell { row: index / self.n_cols, col: index % self.n_cols }
    }
}

/// One value per cell, row-major from the south-west corner.
#[derive(Debug, PartialEq)]
pub struct GridMap<T> {
    geometry: GridGeometry,
    values: Vec<T>,
}

impl<T: Clone> Clone for GridMap<T> {
    fn clone(&self) -> Self {
        Self { geometry: self.geometry, values: self.values.clone() }
    }

    /// Keeps the memory that it has.
    fn clone_from(&mut self, source: &Self) {
        self.geometry = source.geometry;
        self.values.clone_from(&source.values);
    }
}

impl<T: Clone> GridMap<T> {
    /// A map that holds `value` everywhere.
    pub fn filled(geometry: GridGeometry, value: T) -> Self {
        Self { geometry, values: vec![value; geometry.n_cells()] }
    }

    /// Moves the window to a new origin by whole cells; cells that enter hold `value`. Nothing is allocated.
    pub fn roll_to(&mut self, origin: [i64; 2], value: T) {
        let GridGeometry { n_rows, n_cols, origin: old, .. } = self.geometry;
        let shift = [origin[0] - old[0], origin[1] - old[1]];
        self.geometry.origin = origin;
        if shift[0].unsigned_abs() >= n_cols as u64 || shift[1].unsigned_abs() >= n_rows as u64 {
            return self.values.fill(value);
        }
        // A cell that stays moves by the same distance in the row-major array, whatever its place.
        let distance = (shift[1] * n_cols as i64 + shift[0]).rem_euclid(self.values.len() as i64);
        self.values.rotate_left(distance as usize);
        let stays = |i: usize, by: i64, n: usize| (0..n as i64).contains(&(i as i64 + by));
        for (row, values) in self.values.chunks_exact_mut(n_cols).enumerate() {
            if !stays(row, shift[1], n_rows) {
                values.fill(value.clone());
            } else if shift[0] > 0 {
                values[n_cols - shift[0] as usize..].fill(value.clone());
            } else {
                values[..shift[0].unsigned_abs() as usize].fill(value.clone());
            }
        }
    }
}

impl<T: Clone> GridMap<T> {
    /// The cells of another window of the same lattice: those of this map keep their values, the others hold `value`.
    pub fn seen_from(&self, window: &GridGeometry, value: &T) -> Self {
        let [west, south] = window.origin;
        let lattice = |Cell { row, col }| [west + col as i64, south + row as i64];
        let at = |index| self.at_lattice(lattice(window.cell(index))).unwrap_or(value).clone();
        Self { geometry: *window, values: (0..window.n_cells()).map(at).collect() }
    }
}

impl<T> GridMap<T> {
    /// A map from values in row-major order; `None` when their number is not the geometry's.
    pub fn from_values(geometry: GridGeometry, values: Vec<T>) -> Option<Self> {
        (values.len() == geometry.n_cells()).then_some(Self { geometry, values })
    }

    /// Where the cells lie.
    pub fn geometry(&self) -> &GridGeometry {
        &self.geometry
    }

    /// All values, row-major.
    pub fn values(&self) -> &[T] {
        &self.values
    }

    /// All values, row-major, to be changed in place.
    pub fn values_mut(&mut self) -> &mut [T] {
        &mut self.values
    }

    /// The value of a cell of the global lattice, given as column and row; `None` outside the window.
    pub fn at_lattice(&self, lattice: [i64; 2]) -> Option<&T> {
        let [col, row] = [0, 1].map(|axis| usize::try_from(lattice[axis] - self.geometry.origin[axis]).ok());
        let col = col.filter(|&col| col < self.geometry.n_cols)?;
        let row = row.filter(|&row| row < self.geometry.n_rows)?;
        Some(&self[Cell { row, col }])
    }

    /// The value under a point of the map frame.
    pub fn at(&self, x_m: f64, y_m: f64) -> Option<&T> {
        self.geometry.cell_at(x_m, y_m).map(|cell| &self[cell])
    }
}

impl<T> std::ops::Index<Cell> for GridMap<T> {
    type Output = T;
    fn index(&self, cell: Cell) -> &T {
        &self.values[self.geometry.index(cell)]
    }
}

impl<T> std::ops::IndexMut<Cell> for GridMap<T> {
    fn index_mut(&mut self, cell: Cell) -> &mut T {
        let index = self.geometry.index(cell);
        &mut self.values[index]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn tiny(origin: [i64; 2], n_rows: usize, n_cols: usize) -> GridGeometry {
        GridGeometry { resolution_m: 0.25, origin, n_rows, n_cols }
    }

    /// A map whose values are the lattice indices of its cells.
    fn labelled(geometry: GridGeometry) -> GridMap<[i64; 2]> {
        let label = |i| {
            let cell = geometry.cell(i);
            [geometry.origin[0] + cell.col as i64, geometry.origin[1] + cell.row as i64]
        };
        GridMap::from_values(geometry, (0..geometry.n_cells()).map(label).collect()).unwrap()
    }

    #[test]
    fn lattice_cells_are_found_inside_the_window_and_nowhere_else() {
        let geometry = GridGeometry { resolution_m: 0.5, origin: [-3, 7], n_rows: 2, n_cols: 4 };
        let map = GridMap::from_values(geometry, (0..8).collect()).unwrap();
        // Column -3 + 2, row 7 + 1: the third of the second row.
        assert_eq!(map.at_lattice([-1, 8]), Some(&6));
        assert_eq!((map.at_lattice([-3, 7]), map.at_lattice([0, 8])), (Some(&0), Some(&7)));
        for outside in [[-4, 7], [1, 7], [-3, 6], [-3, 9]] {
            assert_eq!(map.at_lattice(outside), None, "{outside:?}");
        }
    }

    #[test]
    fn every_cell_of_every_tiny_window_holds_its_centre_and_its_south_west_corner() {
        for (x, y) in (-3..3).flat_map(|x| (-3..3).map(move |y| (x, y))) {
            for (n_rows, n_cols) in (1..4).flat_map(|rows| (1..4).map(move |cols| (rows, cols))) {
                let geometry = tiny([x, y], n_rows, n_cols);
                for index in 0..geometry.n_cells() {
                    let cell = geometry.cell(index);
                    assert_eq!(geometry.index(cell), index);
                    let [x_m, y_m] = geometry.centre_m(cell);
                    assert_eq!(x_m, (x as f64 + cell.col as f64 + 0.5) * 0.25);
                    assert_eq!(geometry.cell_at(x_m, y_m), Some(cell));
                    // A quarter is exact in binary, so corners are too.
                    assert_eq!(geometry.cell_at(x_m - 0.125, y_m - 0.125), Some(cell));
                }
            }
        }
    }

    #[test]
    fn the_window_includes_its_south_and_west_edges_only() {
        let geometry = tiny([-2, -1], 2, 3);
        assert_eq!(geometry.south_west_m(), [-0.5, -0.25]);
        assert_eq!(geometry.cell_at(-0.5, -0.25), Some(Cell { row: 0, col: 0 }));
        assert_eq!(geometry.cell_at(0.25 - 1e-12, 0.25 - 1e-12), Some(Cell { row: 1, col: 2 }));
        for (x_m, y_m) in [(0.25, 0.0), (0.0, 0.25), (-0.5 - 1e-12, 0.0), (0.0, -0.25 - 1e-12)] {
            assert_eq!(geometry.cell_at(x_m, y_m), None);
        }
    }

    #[test]
    fn a_point_that_is_no_place_lies_in_no_cell() {
        for odd in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 1e300] {
            assert_eq!(tiny([0, 0], 2, 2).cell_at(odd, 0.1), None);
            assert_eq!(tiny([0, 0], 2, 2).cell_at(0.1, odd), None);
        }
    }

    #[test]
    fn rolling_keeps_what_stays_for_every_shift_of_a_tiny_map() {
        for (x, y) in (-6..=6).flat_map(|x| (-6..=6).map(move |y| (x, y))) {
            let geometry = tiny([1, -2], 3, 4);
            let mut map = labelled(geometry);
            map.roll_to([1 + x, -2 + y], [99, 99]);
            for (index, value) in map.values().iter().enumerate() {
                let cell = geometry.cell(index);
                let place = [1 + x + cell.col as i64, -2 + y + cell.row as i64];
                let stayed = (1..5).contains(&place[0]) && (-2..1).contains(&place[1]);
                assert_eq!(*value, if stayed { place } else { [99, 99] }, "shift {x}, {y}, cell {cell:?}");
            }
        }
    }

    #[test]
    fn rolled_values_keep_their_cells_for_every_shift() {
        let old = tiny([1, -2], 3, 4);
        for (x, y) in (-6..=6).flat_map(|x| (-5..=5).map(move |y| (x, y))) {
            let new = tiny([1 + x, -2 + y], 3, 4);
            let pairs = |map: &GridMap<[i64; 2]>| {
                map.values().iter().flat_map(|&label| [(label, 0), (label, 1)]).collect::<Vec<_>>()
            };
            let mut values = pairs(&labelled(old));
            old.roll(&mut values, new.origin, ([99, 99], 9));
            for (index, value) in values.iter().enumerate() {
                let [col, row] = labelled(new).values()[index / 2];
                let is_shared = (1..5).contains(&col) && (-2..1).contains(&row);
                let expected = if is_shared { ([col, row], index % 2) } else { ([99, 99], 9) };
                assert_eq!(*value, expected, "{x} {y} {index}");
            }
        }
    }

    #[test]
    fn another_window_sees_the_same_cells() {
        let map = labelled(tiny([1, -2], 3, 4));
        let window = tiny([3, -4], 4, 5);
        let seen = map.seen_from(&window, &[99, 99]);
        assert_eq!(seen.geometry(), &window);
        for (index, value) in seen.values().iter().enumerate() {
            let Cell { row, col } = window.cell(index);
            let place = [3 + col as i64, -4 + row as i64];
            let is_shared = place[0] < 5 && place[1] >= -2;
            assert_eq!(*value, if is_shared { place } else { [99, 99] }, "{place:?}");
        }
    }

    #[test]
    fn a_map_needs_one_value_per_cell() {
        assert!(GridMap::from_values(tiny([0, 0], 2, 3), vec![0; 5]).is_none());
        assert_eq!(labelled(tiny([4, 5], 2, 3)).at(1.3, 1.6), Some(&[5, 6]));
    }

    proptest! {
        #[test]
        fn a_centred_window_has_its_centre_within_half_a_cell(
            x_m in -1e4..1e4_f64, y_m in -1e4..1e4_f64, n_rows in 1..50_usize, n_cols in 1..50_usize,
            resolution_m in 0.01..3.0_f64,
        ) {
            let geometry = GridGeometry::centred(resolution_m, n_rows, n_cols, x_m, y_m);
            let [west_m, south_m] = geometry.south_west_m();
            let half_m = 0.5 * resolution_m * (1.0 + 1e-9);
            prop_assert!((west_m + 0.5 * n_cols as f64 * resolution_m - x_m).abs() <= half_m);
            prop_assert!((south_m + 0.5 * n_rows as f64 * resolution_m - y_m).abs() <= half_m);
        }

        #[test]
        fn a_point_lies_within_half_a_cell_of_its_cells_centre(x_m in -9.0..9.0_f64, y_m in -9.0..9.0_f64) {
            let geometry = GridGeometry { resolution_m: 0.3, origin: [-20, -25], n_rows: 45, n_cols: 41 };
            if let Some(cell) = geometry.cell_at(x_m, y_m) {
                let [centre_x_m, centre_y_m] = geometry.centre_m(cell);
                prop_assert!((centre_x_m - x_m).abs() <= 0.15 + 1e-9 && (centre_y_m - y_m).abs() <= 0.15 + 1e-9);
            } else {
                let inside = (-6.0..6.3).contains(&x_m) && (-7.5..6.0).contains(&y_m);
                prop_assert!(!inside);
            }
        }
    }
}
