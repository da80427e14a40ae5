//! The surface as networks read it: layers of plain numbers, padded so that no patch needs a bounds check.

use physics_prior::{CellSet, CellSpan, Planes, ResolutionRatio};
use terrain::{Cell, GridGeometry, GridMap, SurfaceCell, TerrainClass};

/// Layers over a window of the surface's lattice.
#[derive(Clone, Debug)]
pub(super) struct PatchGround {
    planes: Planes,
    ratio: ResolutionRatio,
    per_height_m: f32,
    /// Height of the ground, 0 where unknown [m].
    pub heights_m: Vec<f32>,
    /// 1 where the height is unknown, else 0.
    pub unknown: Vec<f32>,
    /// Features of the cover: height of vegetation over the height scale, probability of loose ground, probability of
    /// an obstacle.
    pub cover: [Vec<f32>; 3],
    /// Number of unknown cells south and west of each corner of a cell, row-major with one more row and column than
    /// the window: how many a rectangle holds is four reads.
    n_unknown: Vec<u32>,
    /// Layers of a cell as they were last read, to the bit; `None` where nothing was read yet.
    last: GridMap<Option<[u32; 5]>>,
    /// Cells that the last reading changed.
    changed: CellSet,
    marks: Vec<bool>,
}

impl PatchGround {
    /// Ground of which nothing is known yet, under footprints that read such spans of cells.
    pub fn unknown<'a>(
        window: GridGeometry,
        ratio: ResolutionRatio,
        height_scale_m: f64,
        felt: impl Iterator<Item = &'a CellSpan>,
    ) -> Self {
        Self::over(window, ratio, (1.0 / height_scale_m) as f32, felt)
    }

    /// Another window, all of which must be read anew.
    pub fn moved_to<'a>(&self, window: GridGeometry, felt: impl Iterator<Item = &'a CellSpan>) -> Self {
        let last = self.last.seen_from(&window, &None);
        Self { last, ..Self::over(window, self.ratio, self.per_height_m, felt) }
    }

    fn over<'a>(
        window: GridGeometry,
        ratio: ResolutionRatio,
        per_height_m: f32,
        felt: impl Iterator<Item = &'a CellSpan>,
    ) -> Self {
        let planes = Planes::new(window, ratio);
        Self {
            last: GridMap::filled(window, None),
            changed: CellSet::new(planes, felt),
            marks: vec![false; window.n_cells()],
            planes,
            ratio,
            per_height_m,
            heights_m: planes.layer(0.0),
            unknown: planes.layer(1.0),
            cover: std::array::from_fn(|_| planes.layer(0.0)),
            n_unknown: vec![0; (window.n_rows + 1) * (window.n_cols + 1)],
        }
    }

    /// Where the cells lie.
    pub fn window(&self) -> &GridGeometry {
        self.planes.window()
    }

    /// How the layers lie in memory.
    pub fn planes(&self) -> &Planes {
        &self.planes
    }

    /// How many surface cells the base advances from one footprint of a line to the next.
    pub fn stride(&self) -> i64 {
        self.ratio.stride()
    }

    /// Features per metre of height.
    pub fn per_height_m(&self) -> f32 {
        self.per_height_m
    }

    /// Whether every cell of a lattice rectangle within the window is known, both corners included.
    pub fn is_known(&self, min: [i64; 2], max: [i64; 2]) -> bool {
        let [west, south] = self.window().origin;
        let sum = |[col, row]: [i64; 2]| {
            self.n_unknown[(row - south) as usize * (self.window().n_cols + 1) + (col - west) as usize]
        };
        let [east, north] = max.map(|index| index + 1);
        sum([east, north]) + sum(min) == sum([min[0], north]) + sum([east, min[1]])
    }

    /// Takes over a surface. What lies beyond it, and what is no number, is unknown.
    pub fn read(&mut self, surface: &GridMap<SurfaceCell>) {
        self.marks.fill(false);
        for index in 0..self.marks.len() {
            self.read_cell(index, surface);
        }
        let first = self.marks.iter().position(|marked| *marked);
        self.changed.hold(&mut self.marks);
        if let Some(first) = first {
            self.count_unknown(first / self.window().n_cols);
        }
    }

    /// Of footprints with base cells at [`physics_prior::ASKED`] positions of a layer from that of `base` on, those that
    /// read a cell which the last reading changed.
    pub fn changed(&self, felt: &[CellSpan], base: [i64; 2]) -> u64 {
        self.changed.meets(felt, self.planes.index(base))
    }

    /// Brings the numbers of unknown cells up to date from a row on.
    fn count_unknown(&mut self, first_row: usize) {
        let GridGeometry { origin: [west, south], n_cols, n_rows, .. } = *self.window();
        for row in first_row..n_rows {
            let (below, above) = self.n_unknown.split_at_mut((row + 1) * (n_cols + 1));
            let below = &below[row * (n_cols + 1)..];
            let mut n_in_row = 0;
            for col in 0..n_cols {
                let index = self.planes.index([west + col as i64, south + row as i64]);
                n_in_row += u32::from(self.unknown[index] > 0.0);
                above[col + 1] = below[col + 1] + n_in_row;
            }
        }
    }

    fn read_cell(&mut self, index: usize, surface: &GridMap<SurfaceCell>) {
        let GridGeometry { origin: [west, south], .. } = *self.window();
        let Cell { row, col } = self.window().cell(index);
        let lattice = [west + col as i64, south + row as i64];
        let values = self.layers_of(surface.at_lattice(lattice).unwrap_or(&SurfaceCell::UNKNOWN));
        let bits = values.map(f32::to_bits);
        if self.last.values_mut()[index].replace(bits) != Some(bits) {
            self.marks[index] = true;
        }
        let index = self.planes.index(lattice);
        let layers = [&mut self.heights_m, &mut self.unknown].into_iter().chain(&mut self.cover);
        layers.zip(values).for_each(|(layer, value)| layer[index] = value);
    }

    /// Height, unknown, cover.
    fn layers_of(&self, cell: &SurfaceCell) -> [f32; 5] {
        let is_known = cell.is_known() && cell.height_m.is_finite();
        let finite = |value: f32| if value.is_finite() { value } else { 0.0 };
        let probability = |class: TerrainClass| finite(cell.class_probability[class as usize]);
        [
            if is_known { cell.height_m } else { 0.0 },
            if is_known { 0.0 } else { 1.0 },
            finite(cell.vegetation_height_m * self.per_height_m),
            probability(TerrainClass::Loose),
            probability(TerrainClass::Obstacle),
        ]
    }

    /// Bytes of the layers.
    pub fn n_bytes(&self) -> usize {
        let layers = [&self.heights_m, &self.unknown].into_iter().chain(&self.cover);
        layers.map(|layer| size_of_val(&**layer)).sum::<usize>()
            + size_of_val(&*self.n_unknown)
            + size_of_val(self.last.values())
            + self.changed.n_bytes()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const WINDOW: GridGeometry = GridGeometry { resolution_m: 0.1, origin: [-3, 4], n_rows: 7, n_cols: 9 };
    const HOLE: Cell = Cell { row: 4, col: 6 };

    fn is_hole([col, row]: [i64; 2]) -> bool {
        (5 * col + 3 * row).rem_euclid(13) == 0
    }

    #[test]
    fn a_rectangle_is_known_if_each_of_its_cells_is() {
        let cell = |index: usize| {
            let terrain::Cell { row, col } = WINDOW.cell(index);
            let is_hole = is_hole([col as i64 - 3, row as i64 + 4]);
            if is_hole { SurfaceCell::UNKNOWN } else { SurfaceCell::certain(0.1, TerrainClass::Open, 0.0) }
        };
        let values = (0..WINDOW.n_cells()).map(cell).collect();
        #[allow(clippy::unwrap_used, reason = "a panic is how a test fails")]
        let (surface, ratio) =
            (GridMap::from_values(WINDOW, values).unwrap(), ResolutionRatio::new(0.3, 0.2).unwrap());
        let mut ground = PatchGround::unknown(WINDOW, ratio, 0.1, std::iter::empty());
        // First without the hole in the middle, as what changes comes.
        let mut before = surface.clone();
        before[HOLE] = SurfaceCell::certain(0.1, TerrainClass::Open, 0.0);
        assert!(!surface[HOLE].is_known());
        ground.read(&before);
        ground.read(&surface);
        let cells = || (4..11).flat_map(|row| (-3..6).map(move |col| [col, row]));
        for (min, max) in cells().flat_map(|min| cells().map(move |max| (min, max))) {
            if min[0] > max[0] || min[1] > max[1] {
                continue;
            }
            let holes = (min[1]..=max[1]).flat_map(|row| (min[0]..=max[0]).map(move |col| [col, row]));
            assert_eq!(ground.is_known(min, max), !holes.into_iter().any(is_hole), "{min:?} {max:?}");
        }
    }
}
