//! Heights, grounds and what stands on them, before they are a world.

use terrain::{Cell, CellRegion, GridGeometry, GridMap};

use super::GroundKind;

/// What stands or lies on a cell.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Cover {
    Nothing,
    Tree,
    Water,
}

/// A landscape in the making.
pub(super) struct Sketch {
    pub heights_m: GridMap<f64>,
    pub grounds: GridMap<GroundKind>,
    pub covers: GridMap<Cover>,
    /// Cells of a road or its shoulders, which nothing else may take.
    pub is_road: GridMap<bool>,
}

/// Half of a road's width, and of what is levelled with it [m].
pub(super) const ROAD_HALF_M: f64 = 4.0;
const SHOULDER_M: f64 = 11.0;
/// A road's height is the mean over so much of its way to both sides [m].
const GRADED_M: f64 = 80.0;

impl Sketch {
    pub fn new(heights_m: GridMap<f64>, ground: GroundKind) -> Self {
        let geometry = *heights_m.geometry();
        Self {
            heights_m,
            grounds: GridMap::filled(geometry, ground),
            covers: GridMap::filled(geometry, Cover::Nothing),
            is_road: GridMap::filled(geometry, false),
        }
    }

    pub fn geometry(&self) -> &GridGeometry {
        self.heights_m.geometry()
    }

    /// Cells whose centres lie within a radius, with the distance [m].
    pub fn disc(&self, centre_m: [f64; 2], radius_m: f64) -> Vec<(Cell, f64)> {
        let geometry = self.geometry();
        let Some(middle) = geometry.cell_at(centre_m[0], centre_m[1]) else { return Vec::new() };
        let reach = (radius_m / geometry.resolution_m).ceil() as usize;
        let away_m = |cell: Cell| {
            let [x_m, y_m] = geometry.centre_m(cell);
            (x_m - centre_m[0]).hypot(y_m - centre_m[1])
        };
        let around = CellRegion::of_cell(middle).grown(reach, geometry);
        around.cells().map(|cell| (cell, away_m(cell))).filter(|(_, away_m)| *away_m <= radius_m).collect()
    }

    /// Whether a disc is all on the map, and free of roads and water.
    pub fn is_free(&self, centre_m: [f64; 2], radius_m: f64) -> bool {
        let side_m = self.geometry().n_cols as f64 * self.geometry().resolution_m;
        let is_inside = centre_m.iter().all(|place_m| *place_m >= radius_m && *place_m <= side_m - radius_m);
        let is_open = |cell: Cell| !self.is_road[cell] && self.covers[cell] == Cover::Nothing;
        is_inside && self.disc(centre_m, radius_m).into_iter().all(|(cell, _)| is_open(cell))
    }

    /// Steepest rise at a cell, of the heights beside it [-].
    pub fn slope(&self, cell: Cell) -> f64 {
        let geometry = self.geometry();
        let beside = |rows: [usize; 2], cols: [usize; 2]| {
            let [low, high] = [0, 1].map(|end| self.heights_m[Cell { row: rows[end], col: cols[end] }]);
            let n_cells = (rows[1] - rows[0] + cols[1] - cols[0]).max(1) as f64;
            (high - low) / (n_cells * geometry.resolution_m)
        };
        let Cell { row, col } = cell;
        let (south, west) = (row.saturating_sub(1), col.saturating_sub(1));
        let (north, east) = ((row + 1).min(geometry.n_rows - 1), (col + 1).min(geometry.n_cols - 1));
        beside([row, row], [west, east]).hypot(beside([south, north], [col, col]))
    }

    /// Builds a road along a line of points about a cell apart: graded, with shoulders that lead over to the ground.
    pub fn build_road(&mut self, line_m: &[[f64; 2]]) {
        let raw_m: Vec<f64> =
            line_m.iter().map(|[x_m, y_m]| self.heights_m.at(*x_m, *y_m).copied().unwrap_or(0.0)).collect();
        let graded_m = graded(line_m, &raw_m);
        let mut nearest: GridMap<(f64, f64)> = GridMap::filled(*self.geometry(), (f64::INFINITY, 0.0));
        for (at_m, height_m) in line_m.iter().zip(&graded_m) {
            for (cell, away_m) in self.disc(*at_m, SHOULDER_M) {
                if away_m < nearest[cell].0 {
                    nearest[cell] = (away_m, *height_m);
                }
            }
        }
        for cell in CellRegion::whole(self.geometry()).cells() {
            let (away_m, road_m) = nearest[cell];
            if away_m > SHOULDER_M {
                continue;
            }
            let t = ((away_m - ROAD_HALF_M) / (SHOULDER_M - ROAD_HALF_M)).clamp(0.0, 1.0);
            let share = t * t * (3.0 - 2.0 * t);
            self.heights_m[cell] = road_m + share * (self.heights_m[cell] - road_m);
            self.is_road[cell] = true;
            if away_m <= ROAD_HALF_M {
                self.grounds[cell] = GroundKind::Asphalt;
            }
        }
    }
}

/// Means of heights over the way to both sides.
fn graded(line_m: &[[f64; 2]], raw_m: &[f64]) -> Vec<f64> {
    let mut along_m = vec![0.0];
    for ends in line_m.windows(2) {
        let step_m = (ends[1][0] - ends[0][0]).hypot(ends[1][1] - ends[0][1]);
        along_m.push(along_m[along_m.len() - 1] + step_m);
    }
    let near = |index: usize| {
        let first = along_m.partition_point(|at_m| *at_m < along_m[index] - GRADED_M);
        let behind = along_m.partition_point(|at_m| *at_m <= along_m[index] + GRADED_M);
        &raw_m[first..behind]
    };
    (0..line_m.len()).map(|index| near(index).iter().sum::<f64>() / near(index).len() as f64).collect()
}
