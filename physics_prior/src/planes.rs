//! How layers of the ground lie in memory.

use terrain::GridGeometry;

use crate::lattice::ResolutionRatio;

/// Numbers of a row of poses that are read at a time: a read may go so far beyond the last one.
const SPAN: usize = bicycle::lanes::SPAN;

/// Order of the cells of a window of the surface's lattice in memory.
///
/// Risk cells may lie several surface cells apart. The columns of a row are therefore kept in as many planes as that
/// distance, so that what adjacent risk cells read is adjacent in memory whatever the ratio of the resolutions.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Planes {
    window: GridGeometry,
    n_planes: usize,
    n_plane_cols: usize,
}

impl Planes {
    /// An order for a window with one column beyond its last.
    pub fn new(window: GridGeometry, ratio: ResolutionRatio) -> Self {
        let n_planes = ratio.stride() as usize;
        Self { window, n_planes, n_plane_cols: window.n_cols / n_planes + 1 }
    }

    /// Where the cells lie.
    pub fn window(&self) -> &GridGeometry {
        &self.window
    }

    /// A layer of the same number everywhere, with as much beyond the last cell as may be read at a time.
    pub fn layer(&self, value: f32) -> Vec<f32> {
        vec![value; self.layer_len()]
    }

    /// Numbers in a layer.
    pub fn layer_len(&self) -> usize {
        self.window.n_rows * self.n_planes * self.n_plane_cols + SPAN
    }

    /// Position of a lattice cell in a layer; the cell that lies [`ResolutionRatio::stride`] further east follows it.
    #[inline(always)]
    pub fn index(&self, lattice: [i64; 2]) -> usize {
        self.place(lattice) as usize
    }

    /// How much further a cell lies than the base cell that it is an offset from: the same for every base cell whose
    /// column leaves the same remainder over [`ResolutionRatio::stride`].
    pub fn delta(&self, base: [i64; 2], offset: [i64; 2]) -> isize {
        let cell = [0, 1].map(|axis| base[axis] + offset[axis]);
        self.place(cell) - self.place(base)
    }

    #[inline(always)]
    fn place(&self, lattice: [i64; 2]) -> isize {
        let [col, row] = [0, 1].map(|axis| (lattice[axis] - self.window.origin[axis]) as isize);
        let (n_planes, n_plane_cols) = (self.n_planes as isize, self.n_plane_cols as isize);
        if n_planes == 1 {
            return row * n_plane_cols + col;
        }
        (row * n_planes + col.rem_euclid(n_planes)) * n_plane_cols + col.div_euclid(n_planes)
    }
}

/// Numbers of a layer from a position on.
#[inline(always)]
pub fn span(layer: &[f32], first: usize, delta: isize) -> &[f32; SPAN] {
    layer[first.wrapping_add_signed(delta)..].first_chunk().unwrap_or(&[0.0; SPAN])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_adjacent_risk_cells_read_is_adjacent_and_every_cell_has_its_place() {
        let window = GridGeometry { resolution_m: 0.1, origin: [-7, 5], n_rows: 4, n_cols: 11 };
        for (risk_m, surface_m) in [(0.1, 0.1), (0.3, 0.1), (0.15, 0.1), (0.05, 0.1)] {
            let ratio = ResolutionRatio::new(risk_m, surface_m).unwrap();
            let planes = Planes::new(window, ratio);
            let layer = planes.layer(0.0);
            let mut taken = vec![false; layer.len()];
            // One column more than the window has.
            for (row, col) in (5..9).flat_map(|row| (-7..5).map(move |col| (row, col))) {
                let index = planes.index([col, row]);
                assert!(!std::mem::replace(&mut taken[index], true), "{risk_m} {col} {row}");
                assert!(index + SPAN <= layer.len());
                let next = planes.delta([col, row], [ratio.stride(), 0]);
                assert!(col + ratio.stride() >= 5 || next == 1, "{risk_m} {col} {row}: {next}");
            }
        }
    }
}
