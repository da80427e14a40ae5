//! The surface as networks read it: layers of plain numbers, padded so that no patch needs a bounds check.

use physics_prior::Ratio;
use terrain::{GridGeometry, GridMap, SurfaceCell, TerrainClass};

/// Lanes that are read at a time: a read may go so far beyond the last cell of a row.
pub(super) const SPAN: usize = 16;

/// Layers over a window of the surface's lattice.
///
/// Risk cells may lie several surface cells apart. The columns of a row are therefore kept in as many planes as that
/// distance, so that what adjacent risk cells read is adjacent in memory whatever the ratio of the resolutions.
#[derive(Clone, Debug)]
pub(super) struct PatchGround {
    window: GridGeometry,
    n_planes: usize,
    n_plane_cols: usize,
    per_height_m: f32,
    /// Height of the ground, 0 where unknown [m].
    pub heights_m: Vec<f32>,
    /// 1 where the height is unknown, else 0.
    pub unknown: Vec<f32>,
    /// Features of the cover: height of vegetation over the height scale, probability of loose ground, probability of
    /// an obstacle.
    pub cover: [Vec<f32>; 3],
}

impl PatchGround {
    /// Ground of which nothing is known yet.
    pub fn unknown(window: GridGeometry, ratio: Ratio, height_scale_m: f64) -> Self {
        Self::over(window, ratio.stride() as usize, (1.0 / height_scale_m) as f32)
    }

    /// Unknown ground of another window.
    pub fn moved_to(&self, window: GridGeometry) -> Self {
        Self::over(window, self.n_planes, self.per_height_m)
    }

    fn over(window: GridGeometry, n_planes: usize, per_height_m: f32) -> Self {
        let n_plane_cols = window.n_cols.div_ceil(n_planes) + SPAN;
        let n = window.n_rows * n_planes * n_plane_cols;
        Self {
            window,
            n_planes,
            n_plane_cols,
            per_height_m,
            heights_m: vec![0.0; n],
            unknown: vec![1.0; n],
            cover: std::array::from_fn(|_| vec![0.0; n]),
        }
    }

    /// Where the cells lie.
    pub fn window(&self) -> &GridGeometry {
        &self.window
    }

    /// Features per metre of height.
    pub fn per_height_m(&self) -> f32 {
        self.per_height_m
    }

    /// Position of a lattice cell in the layers; the cell that lies [`Ratio::stride`] further east follows it.
    pub fn index(&self, lattice: [i64; 2]) -> usize {
        self.place(lattice) as usize
    }

    /// How much further a cell lies than the base cell that it is an offset from: the same for every base cell whose
    /// column leaves the same remainder over [`Ratio::stride`].
    pub fn delta(&self, base: [i64; 2], offset: [i64; 2]) -> isize {
        let cell = [0, 1].map(|axis| base[axis] + offset[axis]);
        self.place(cell) - self.place(base)
    }

    fn place(&self, lattice: [i64; 2]) -> isize {
        let [col, row] = [0, 1].map(|axis| (lattice[axis] - self.window.origin[axis]) as isize);
        let (n_planes, n_plane_cols) = (self.n_planes as isize, self.n_plane_cols as isize);
        (row * n_planes + col.rem_euclid(n_planes)) * n_plane_cols + col.div_euclid(n_planes)
    }

    /// Takes over the surface's lattice rectangle from `min` to `max`, both inclusive. What lies beyond the surface,
    /// and what is no number, is unknown.
    pub fn read(&mut self, surface: &GridMap<SurfaceCell>, min: [i64; 2], max: [i64; 2]) {
        let first: [i64; 2] = std::array::from_fn(|axis| min[axis].max(self.window.origin[axis]));
        let n = [self.window.n_cols, self.window.n_rows];
        let last: [i64; 2] =
            std::array::from_fn(|axis| max[axis].min(self.window.origin[axis] + n[axis] as i64 - 1));
        for row in first[1]..=last[1] {
            for col in first[0]..=last[0] {
                self.read_cell([col, row], cell_at(surface, [col, row]));
            }
        }
    }

    fn read_cell(&mut self, lattice: [i64; 2], cell: &SurfaceCell) {
        let index = self.index(lattice);
        let is_known = cell.is_known() && cell.height_m.is_finite();
        self.heights_m[index] = if is_known { cell.height_m } else { 0.0 };
        self.unknown[index] = if is_known { 0.0 } else { 1.0 };
        let finite = |value: f32| if value.is_finite() { value } else { 0.0 };
        let probability = |class: TerrainClass| finite(cell.class_probability[class as usize]);
        self.cover[0][index] = finite(cell.vegetation_height_m * self.per_height_m);
        self.cover[1][index] = probability(TerrainClass::Loose);
        self.cover[2][index] = probability(TerrainClass::Obstacle);
    }

    /// Bytes of the layers.
    pub fn n_bytes(&self) -> usize {
        let layers = [&self.heights_m, &self.unknown].into_iter().chain(&self.cover);
        layers.map(|layer| size_of_val(&**layer)).sum()
    }
}

fn cell_at(surface: &GridMap<SurfaceCell>, lattice: [i64; 2]) -> &SurfaceCell {
    surface.at_lattice(lattice).unwrap_or(&SurfaceCell::UNKNOWN)
}
