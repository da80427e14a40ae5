//! A map that outgrows memory: square tiles in files, levels of ever larger cells above them, a few held at a time.
//!
//! Level 0 holds what was merged; a cell of level k + 1 stands for four of level k and is made of them when it is first
//! asked for. What [`TileMap::merge`] returned from is on disk: every tile is a file of its own, written whole beside
//! the old one and put in its place, so that a process that is killed leaves the old tile or the new one, never a part.
//! Levels that a changed tile belongs to lose their file before it changes, so that an old level never outlives it.

mod cell;
mod file;
mod keeper;
mod room;

use crate::GroundCell;
pub use cell::MeasuredCell;
use cell::Packed;
pub use keeper::{ClassFriction, MapKeeper};
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use terrain::{Cell, CellRegion, GridGeometry, GridMap};

/// Cells along a tile's edge.
pub const TILE_EDGE: usize = 256;
/// Levels above the finest: a cell of the highest stands for 1024 x 1024.
pub const LEVEL_MAX: u8 = 10;

/// Why a tile or the map cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum TileError {
    /// The system refuses.
    #[error("{}: expected a file or folder to {action}, found: {source}", path.display())]
    System {
        /// The file or folder.
        path: PathBuf,
        /// What was tried.
        action: &'static str,
        /// What the system said.
        source: std::io::Error,
    },
    /// A file holds something else than it should.
    #[error("{}: {field}: expected {expected}, found {found}", path.display())]
    Field {
        /// The file.
        path: PathBuf,
        /// The part of it.
        field: &'static str,
        /// What would do.
        expected: String,
        /// What was found.
        found: String,
    },
    /// A patch has cells of another size than the map.
    #[error("patch: expected cells of {expected_m} m, found {found_m} m")]
    Resolution {
        /// Of the map [m].
        expected_m: f64,
        /// Of the patch [m].
        found_m: f64,
    },
    /// There is no such level.
    #[error("level: expected 0 to {LEVEL_MAX}, found {found}")]
    Level {
        /// The level asked for.
        found: u8,
    },
}

/// Which tile.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
struct Key {
    level: u8,
    /// East and north, in tiles of the level.
    place: [i64; 2],
}

impl Key {
    fn parent(self) -> Option<Self> {
        let place = self.place.map(|index| index.div_euclid(2));
        (self.level < LEVEL_MAX).then(|| Self { level: self.level + 1, place })
    }

    fn child(self, [east, north]: [i64; 2]) -> Option<Self> {
        let place = [2 * self.place[0] + east, 2 * self.place[1] + north];
        self.level.checked_sub(1).map(|level| Self { level, place })
    }
}

/// What became of a patch.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct MergeReport {
    /// Cells of which nothing was known before.
    pub n_new: usize,
    /// Cells whose heights agreed and were averaged by their variances.
    pub n_agreeing: usize,
    /// Cells whose heights contradict each other; the more certain was kept.
    pub n_contradicting: usize,
    /// The largest contradiction [m].
    pub largest_contradiction_m: f32,
}

impl MergeReport {
    /// With what became of another patch.
    pub fn add(&mut self, other: &Self) {
        self.n_new += other.n_new;
        self.n_agreeing += other.n_agreeing;
        self.n_contradicting += other.n_contradicting;
        self.largest_contradiction_m = self.largest_contradiction_m.max(other.largest_contradiction_m);
    }
}

/// A map in a folder.
#[derive(Debug)]
pub struct TileMap {
    folder: PathBuf,
    resolution_m: f64,
    n_held_max: usize,
    held: BTreeMap<Key, Held>,
    /// Every tile that has anything known below it, of all levels.
    known: BTreeSet<Key>,
    n_uses: u64,
}

#[derive(Debug)]
struct Held {
    cells: Vec<Packed>,
    used: u64,
}

impl TileMap {
    /// Opens the map in a folder, which is made if it is missing; at most `memory_bytes` of tiles are held, and eight
    /// tiles at least.
    ///
    /// # Errors
    /// The folder cannot be used, or holds a map of other cells.
    pub fn open(folder: &Path, resolution_m: f64, memory_bytes: usize) -> Result<Self, TileError> {
        std::fs::create_dir_all(folder).map_err(file::system(folder, "make"))?;
        file::agree_on_resolution(folder, resolution_m)?;
        let mut map = Self {
            folder: folder.to_owned(),
            resolution_m,
            n_held_max: (memory_bytes / (TILE_EDGE * TILE_EDGE * size_of::<Packed>())).max(8),
            held: BTreeMap::new(),
            known: BTreeSet::new(),
            n_uses: 0,
        };
        for place in file::finest(folder)? {
            map.make_known(Key { level: 0, place });
        }
        Ok(map)
    }

    /// Whether there is a map in a folder.
    pub fn is_at(folder: &Path) -> bool {
        file::is_at(folder)
    }

    /// Opens a map that is there, whatever the size of its cells.
    ///
    /// # Errors
    /// The folder cannot be used, or holds no map.
    pub fn resume(folder: &Path, memory_bytes: usize) -> Result<Self, TileError> {
        Self::open(folder, file::resolution_m(folder)?, memory_bytes)
    }

    /// Edge of a cell of a level [m].
    pub fn cell_m(&self, level: u8) -> f64 {
        self.resolution_m * f64::from(1_u32 << level.min(LEVEL_MAX))
    }

    /// Tiles of the finest level.
    pub fn n_tiles(&self) -> usize {
        self.known.iter().take_while(|key| key.level == 0).count()
    }

    /// The window of a level that holds all tiles; `None` of an empty map.
    pub fn extent(&self, level: u8) -> Option<GridGeometry> {
        let tiles = || self.known.iter().take_while(|key| key.level == 0);
        let bound = |axis: usize| {
            let along = || tiles().map(move |key| key.place[axis] * TILE_EDGE as i64);
            let per_cell = 1_i64 << level.min(LEVEL_MAX);
            let first = along().min()?.div_euclid(per_cell);
            let end = along().max()? + TILE_EDGE as i64;
            Some((first, (end + per_cell - 1).div_euclid(per_cell) - first))
        };
        let ((east, n_cols), (north, n_rows)) = (bound(0)?, bound(1)?);
        Some(GridGeometry {
            resolution_m: self.cell_m(level),
            origin: [east, north],
            n_rows: n_rows as usize,
            n_cols: n_cols as usize,
        })
    }

    /// Bytes of the tiles that are held.
    pub fn n_bytes(&self) -> usize {
        self.held.len() * TILE_EDGE * TILE_EDGE * size_of::<Packed>()
    }

    /// Takes over what a robot or another source measured. Of heights that contradict each other, by more than three
    /// of their deviations, the more certain is kept; the rest of a cell is the newcomer's.
    ///
    /// # Errors
    /// Cells of another size, or a tile that cannot be read or written; tiles before it are merged and whole.
    pub fn merge(&mut self, patch: &GridMap<MeasuredCell>) -> Result<MergeReport, TileError> {
        let geometry = *patch.geometry();
        self.agree(&geometry)?;
        let mut report = MergeReport::default();
        for place in places(&geometry) {
            let key = Key { level: 0, place };
            let (in_patch, origin) = overlap(&geometry, place);
            let is_known = |cell: &Cell| patch[*cell].ground.is_known();
            let mut cells =
                in_patch.rows.flat_map(|row| in_patch.cols.clone().map(move |col| Cell { row, col }));
            if !cells.clone().any(|cell| is_known(&cell)) {
                continue;
            }
            let mut tile =
                self.tile(key)?.map_or_else(|| vec![Packed::UNKNOWN; TILE_EDGE * TILE_EDGE], <[_]>::to_vec);
            for cell in cells.by_ref().filter(is_known) {
                let row = (geometry.origin[1] + cell.row as i64 - origin[1]) as usize;
                let col = (geometry.origin[0] + cell.col as i64 - origin[0]) as usize;
                tile[row * TILE_EDGE + col].merge(&patch[cell], &mut report);
            }
            self.forget_levels_above(key)?;
            file::write(&self.folder, key, &tile)?;
            self.make_known(key);
            self.hold(key, tile);
        }
        Ok(report)
    }

    /// Refuses cells of another size.
    fn agree(&self, geometry: &GridGeometry) -> Result<(), TileError> {
        let (expected_m, found_m) = (self.resolution_m, geometry.resolution_m);
        let is_same = (found_m / expected_m - 1.0).abs() <= 1e-9;
        is_same.then_some(()).ok_or(TileError::Resolution { expected_m, found_m })
    }

    /// Takes over another map, as of another robot.
    ///
    /// # Errors
    /// As [`TileMap::merge`], or a tile of the other that cannot be read.
    pub fn merge_map(&mut self, other: &mut Self) -> Result<MergeReport, TileError> {
        let mut report = MergeReport::default();
        let keys: Vec<Key> = other.known.iter().take_while(|key| key.level == 0).copied().collect();
        for key in keys {
            let geometry = tile_geometry(key.place, other.resolution_m);
            let Some(tile) = other.tile(key)? else { continue };
            let cells = tile.iter().map(|cell| cell.measured().unwrap_or(MeasuredCell::UNKNOWN)).collect();
            if let Some(patch) = GridMap::from_values(geometry, cells) {
                report.add(&self.merge(&patch)?);
            }
        }
        Ok(report)
    }

    /// A window of a level, whose cells are 2^level times as large as the map's; its lattice is that of the level.
    ///
    /// # Errors
    /// No such level, cells of another size, or a tile that cannot be read.
    pub fn window(&mut self, level: u8, geometry: &GridGeometry) -> Result<GridMap<GroundCell>, TileError> {
        if level > LEVEL_MAX {
            return Err(TileError::Level { found: level });
        }
        let expected_m = self.cell_m(level);
        if (geometry.resolution_m / expected_m - 1.0).abs() > 1e-9 {
            return Err(TileError::Resolution { expected_m, found_m: geometry.resolution_m });
        }
        let mut window = GridMap::filled(*geometry, GroundCell::UNKNOWN);
        for place in places(geometry) {
            let (in_window, origin) = overlap(geometry, place);
            let Some(tile) = self.tile(Key { level, place })? else { continue };
            for row in in_window.rows {
                let in_tile = (geometry.origin[1] + row as i64 - origin[1]) as usize * TILE_EDGE;
                for col in in_window.cols.clone() {
                    let packed = &tile[in_tile + (geometry.origin[0] + col as i64 - origin[0]) as usize];
                    window[Cell { row, col }] = packed.ground();
                }
            }
        }
        Ok(window)
    }

    /// The cells of a tile; `None` where nothing is known.
    fn tile(&mut self, key: Key) -> Result<Option<&[Packed]>, TileError> {
        if !self.known.contains(&key) {
            return Ok(None);
        }
        if !self.held.contains_key(&key) {
            let cells = match file::read(&self.folder, key)? {
                Some(cells) => cells,
                None => self.made_of_children(key)?,
            };
            self.hold(key, cells);
        }
        self.n_uses += 1;
        let used = self.n_uses;
        Ok(self.held.get_mut(&key).map(|held| {
            held.used = used;
            held.cells.as_slice()
        }))
    }

    fn made_of_children(&mut self, key: Key) -> Result<Vec<Packed>, TileError> {
        let mut cells = vec![Packed::UNKNOWN; TILE_EDGE * TILE_EDGE];
        let half = TILE_EDGE / 2;
        for (east, north) in [(0, 0), (1, 0), (0, 1), (1, 1)] {
            let Some(child) = key.child([east, north]) else { continue };
            let Some(fine) = self.tile(child)? else { continue };
            for row in 0..half {
                for col in 0..half {
                    let at = |up: usize, right: usize| fine[(2 * row + up) * TILE_EDGE + 2 * col + right];
                    let four = [at(0, 0), at(0, 1), at(1, 0), at(1, 1)];
                    cells[(row + north as usize * half) * TILE_EDGE + col + east as usize * half] =
                        Packed::of_four(&four);
                }
            }
        }
        file::write(&self.folder, key, &cells)?;
        Ok(cells)
    }

    fn make_known(&mut self, key: Key) {
        let mut next = Some(key);
        while let Some(key) = next.filter(|key| self.known.insert(*key)) {
            next = key.parent();
        }
    }

    fn forget_levels_above(&mut self, key: Key) -> Result<(), TileError> {
        let mut next = key.parent();
        while let Some(key) = next {
            self.held.remove(&key);
            file::remove(&self.folder, key)?;
            next = key.parent();
        }
        Ok(())
    }

    /// Holds a tile, and lets go of those that were used longest ago.
    fn hold(&mut self, key: Key, cells: Vec<Packed>) {
        self.n_uses += 1;
        self.held.insert(key, Held { cells, used: self.n_uses });
        while self.held.len() > self.n_held_max {
            let oldest = self.held.iter().min_by_key(|(_, held)| held.used).map(|(key, _)| *key);
            let Some(oldest) = oldest else { return };
            self.held.remove(&oldest);
        }
    }
}

/// The tiles that a window reaches.
fn places(geometry: &GridGeometry) -> impl Iterator<Item = [i64; 2]> {
    let edge = TILE_EDGE as i64;
    let n = [geometry.n_cols, geometry.n_rows].map(|n| n as i64);
    let range = |axis: usize| {
        let first = geometry.origin[axis].div_euclid(edge);
        first..=(geometry.origin[axis] + n[axis] - 1).div_euclid(edge)
    };
    let (cols, rows) = (range(0), range(1));
    rows.flat_map(move |row| cols.clone().map(move |col| [col, row]))
}

/// Where the cells of a tile of the finest level lie.
fn tile_geometry(place: [i64; 2], resolution_m: f64) -> GridGeometry {
    let origin = place.map(|index| index * TILE_EDGE as i64);
    GridGeometry { resolution_m, origin, n_rows: TILE_EDGE, n_cols: TILE_EDGE }
}

/// The part of a window that lies in a tile, and the lattice index of the tile's south-west cell.
fn overlap(geometry: &GridGeometry, place: [i64; 2]) -> (CellRegion, [i64; 2]) {
    let origin = place.map(|index| index * TILE_EDGE as i64);
    let range = |axis: usize, n: usize| {
        let first = (origin[axis] - geometry.origin[axis]).max(0) as usize;
        let end = (origin[axis] + TILE_EDGE as i64 - geometry.origin[axis]).clamp(0, n as i64) as usize;
        first..end
    };
    (CellRegion { rows: range(1, geometry.n_rows), cols: range(0, geometry.n_cols) }, origin)
}
