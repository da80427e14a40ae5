//! What a vehicle's rolling window saw, kept beyond it.

use super::{MeasuredCell, MergeReport, TileError, TileMap, overlap, places, tile_geometry};
use crate::{FrictionCurve, GroundCell};
use std::collections::BTreeMap;
use terrain::{Cell, CellRegion, GridMap, SurfaceCell, TerrainClass, slope_at};

/// Friction of what a vehicle makes out with its sensors.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ClassFriction {
    /// Of open ground.
    pub open: FrictionCurve,
    /// Of loose ground.
    pub loose: FrictionCurve,
    /// Of ground below plants.
    pub vegetation: FrictionCurve,
}

/// Cells around one of unknown height whose mean is taken for it, where an obstacle hides the ground.
const HIDDEN_REACH: usize = 3;

/// Gathers what a rolling window shows, and merges it into a map of tiles once: a tile when the window has left it, the
/// rest at the end. So a height that many scans were fused into counts as one measurement, with the deviation that they
/// left it.
#[derive(Debug)]
pub struct MapKeeper {
    map: TileMap,
    friction: ClassFriction,
    gathered: BTreeMap<[i64; 2], GridMap<SurfaceCell>>,
    report: MergeReport,
}

impl MapKeeper {
    /// Nothing was seen yet.
    pub fn new(map: TileMap, friction: ClassFriction) -> Self {
        Self { map, friction, gathered: BTreeMap::new(), report: MergeReport::default() }
    }

    /// Takes over what a window shows now; what it shows no more stays as it was.
    ///
    /// # Errors
    /// Cells of another size than the map's, or a tile that cannot be read or written.
    pub fn look(&mut self, window: &GridMap<SurfaceCell>) -> Result<(), TileError> {
        let geometry = *window.geometry();
        self.map.agree(&geometry)?;
        let within: Vec<[i64; 2]> = places(&geometry).collect();
        let left: Vec<[i64; 2]> =
            self.gathered.keys().filter(|place| !within.contains(place)).copied().collect();
        left.into_iter().try_for_each(|place| self.merge(place))?;
        for place in within {
            let (in_window, origin) = overlap(&geometry, place);
            let resolution_m = geometry.resolution_m;
            let tile = self
                .gathered
                .entry(place)
                .or_insert_with(|| GridMap::filled(tile_geometry(place, resolution_m), SurfaceCell::UNKNOWN));
            for row in in_window.rows {
                let to = (geometry.origin[1] + row as i64 - origin[1]) as usize;
                for col in in_window.cols.clone() {
                    let seen = window[Cell { row, col }];
                    if seen.is_known() || seen.class() == TerrainClass::Obstacle {
                        let col = (geometry.origin[0] + col as i64 - origin[0]) as usize;
                        tile[Cell { row: to, col }] = seen;
                    }
                }
            }
        }
        Ok(())
    }

    /// Merges what is left, and returns the map and what became of it all.
    ///
    /// # Errors
    /// A tile that cannot be read or written.
    pub fn finish(mut self) -> Result<(TileMap, MergeReport), TileError> {
        let left: Vec<[i64; 2]> = self.gathered.keys().copied().collect();
        left.into_iter().try_for_each(|place| self.merge(place))?;
        Ok((self.map, self.report))
    }

    fn merge(&mut self, place: [i64; 2]) -> Result<(), TileError> {
        let Some(seen) = self.gathered.remove(&place) else { return Ok(()) };
        let geometry = *seen.geometry();
        let cells = (0..geometry.n_cells()).map(|index| self.measured(&seen, geometry.cell(index)));
        if let Some(patch) = GridMap::from_values(geometry, cells.collect()) {
            let report = self.map.merge(&patch)?;
            self.report.add(&report);
        }
        Ok(())
    }

    fn measured(&self, seen: &GridMap<SurfaceCell>, at: Cell) -> MeasuredCell {
        let (cell, class) = (&seen[at], seen[at].class());
        let is_obstacle = class == TerrainClass::Obstacle;
        let (height_m, deviation_m) = match cell.is_known() {
            true => (cell.height_m, libm::sqrtf(cell.height_variance_m2)),
            false if is_obstacle => hidden(seen, at),
            false => return MeasuredCell::UNKNOWN,
        };
        let friction = match class {
            TerrainClass::Open | TerrainClass::Obstacle => self.friction.open,
            TerrainClass::Loose => self.friction.loose,
            TerrainClass::Vegetation => self.friction.vegetation,
        };
        let roughness_m = Some(slope_at(seen, at, 1).roughness_m).filter(|rough_m| rough_m.is_finite());
        let ground = GroundCell { height_m, friction, roughness_m: roughness_m.unwrap_or(0.0), is_obstacle };
        MeasuredCell { ground, deviation_m }
    }
}

/// Mean of the heights around a cell and their deviation [m]; NaN where none is known.
fn hidden(seen: &GridMap<SurfaceCell>, at: Cell) -> (f32, f32) {
    let around = CellRegion::of_cell(at).grown(HIDDEN_REACH, seen.geometry());
    let heights_m: Vec<f32> =
        around.cells().map(|cell| seen[cell].height_m).filter(|height_m| !height_m.is_nan()).collect();
    let n = heights_m.len() as f32;
    let mean_m = heights_m.iter().sum::<f32>() / n;
    let squares_m2 = heights_m.iter().map(|height_m| (height_m - mean_m).powi(2)).sum::<f32>();
    (mean_m, libm::sqrtf(squares_m2 / n))
}
