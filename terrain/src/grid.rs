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

impl GridGeometry {
    /// The window of `n_rows` x `n_cols` cells whose centre lies nearest to (`x_m`, `y_m`).
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
#[derive(Clone, Debug, PartialEq)]
pub struct GridMap<T> {
    geometry: GridGeometry,
    values: Vec<T>,
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
