//! The times to the goal, as who reads them sees them.

use traversability::GridGeometry;

/// Time to the goal [s] from every cell.
#[derive(Clone, Copy, Debug)]
pub struct CostToGoView<'a> {
    /// Where the cells lie.
    pub geometry: GridGeometry,
    /// Least time from the cell's centre to the goal [s], finite, shape [row, col]; within its tolerance that of the straight
    /// line.
    pub seconds: &'a [f32],
    /// What keeping to the turning circle takes beyond that [s], shape [heading, row, col]; empty for a vehicle that turns
    /// on the spot. The 16 headings are those of the edges to the 8 adjacent cells and to the 8 a knight's move away,
    /// counter-clockwise from east.
    pub turning_s: &'a [f32],
}

impl CostToGoView<'_> {
    /// Time from the cell that holds the point [s]; beyond the window, from the nearest cell of its border.
    pub fn nearest_s(&self, x_m: f64, y_m: f64) -> f32 {
        let [col, row] = self.position(x_m, y_m);
        self.seconds[row.round() as usize * self.geometry.n_cols + col.round() as usize]
    }

    /// Time interpolated between the four surrounding cell centres [s]; beyond the window, on its border.
    pub fn interpolated_s(&self, x_m: f64, y_m: f64) -> f32 {
        let [col, row] = self.position(x_m, y_m);
        let west = (col as usize).min(self.geometry.n_cols - 2);
        let south = (row as usize).min(self.geometry.n_rows - 2);
        let (east_share, north_share) = ((col - west as f64) as f32, (row - south as f64) as f32);
        let mix = |from: f32, to: f32, share: f32| from * (1.0 - share) + to * share;
        let along_row = |row: usize| {
            let start = row * self.geometry.n_cols + west;
            mix(self.seconds[start], self.seconds[start + 1], east_share)
        };
        mix(along_row(south), along_row(south + 1), north_share)
    }

    /// Column and row of a point, counted from the south-west cell's centre and held within the window. A NaN
    /// becomes 0, so that the lookups never fail.
    fn position(&self, x_m: f64, y_m: f64) -> [f64; 2] {
        let [west_m, south_m] = self.geometry.south_west_m();
        let place = |value_m: f64, start_m: f64, n: usize| {
            ((value_m - start_m) / self.geometry.resolution_m - 0.5).max(0.0).min((n - 1) as f64)
        };
        [place(x_m, west_m, self.geometry.n_cols), place(y_m, south_m, self.geometry.n_rows)]
    }
}
