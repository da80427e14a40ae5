//! Worlds from measured elevation: coarse grids and their layers, refined to the planning resolution.

use bicycle::Vehicle;
use rand::RngExt;
use rand_distr::{Distribution, Poisson};
use terrain::{Cell, GridGeometry, GridMap, Knowledge};

use crate::random::stream;
use crate::{Bounds, Patch, ROCK_FIELD_DISTANCE_M, Stribeck, World, WorldError};

/// Cells that a world may have: a square kilometre at 0.25 m.
const CELLS_MAX: f64 = 16e6;
/// Passes that smooth what was filled into holes.
const HOLE_PASSES: usize = 30;

/// Measured ground on coarse cells. All layers lie on the cells of the elevation.
#[derive(Clone, Debug)]
pub struct WorldLayers {
    /// Height at the cells' centres [m]; NaN where nothing was measured.
    pub elevation_m: GridMap<f32>,
    /// Highest return above the ground [m].
    pub canopy_height_m: Option<GridMap<f32>>,
    /// Share of returns from low plants [-].
    pub low_vegetation_fraction: Option<GridMap<f32>>,
    /// Open water where above a half.
    pub water: Option<GridMap<f32>>,
    /// Distance to the nearest measurement of the ground [m]; heights farther than half a cell's diagonal from any
    /// count as interpolated.
    pub ground_gap_m: Option<GridMap<f32>>,
}

/// How layers become a world.
///
/// - Heights: Catmull-Rom splines through the coarse cells' centres. A fine cell that holds the centre of a measured
///   coarse cell is measured, every other one interpolated. Holes are filled from their rims.
/// - Plants: as high as `understory_height_m` (or the canopy, where that is lower) times the share of low returns.
/// - Canopy above `canopy_from_m`: passable, but for stems, scattered as a Poisson process of `stems_per_m2`, each an
///   obstacle of `stem_radius_m` and the canopy's height.
/// - Water: an obstacle of no height.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LayerConfig {
    /// Edge of a fine cell [m]; coarser than the layers' cells, these are kept.
    pub resolution_m: f64,
    /// The part to build; all of it where nothing is said.
    pub window: Option<Bounds>,
    /// Canopy from this height on stands on stems [m].
    pub canopy_from_m: f64,
    /// Stems below such canopy [1/m2].
    pub stems_per_m2: f64,
    /// Radius of a stem [m].
    pub stem_radius_m: f64,
    /// Height of plants where all returns come from them [m].
    pub understory_height_m: f64,
}

impl LayerConfig {
    /// The rules at a resolution that shows what a wheel of this machine feels: 40 % of its radius, 2 to 20 cm.
    pub fn for_vehicle(vehicle: &Vehicle) -> Self {
        Self::with_resolution((0.4 * vehicle.geometry.wheel_radius_m).clamp(0.02, 0.2))
    }

    /// The rules for a resolution [m], on the whole map: 350 stems of 0.3 m per hectare.
    pub fn with_resolution(resolution_m: f64) -> Self {
        Self {
            resolution_m,
            window: None,
            canopy_from_m: 2.0,
            stems_per_m2: 0.035,
            stem_radius_m: 0.15,
            understory_height_m: 1.2,
        }
    }
}

/// Why layers make no world.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum LayersError {
    /// A setting is out of range.
    #[error("{field}: expected {expected}, found {found}")]
    Setting {
        /// Name of the setting.
        field: &'static str,
        /// The range that would do.
        expected: &'static str,
        /// The value that was given.
        found: f64,
    },
    /// The window does not overlap the map.
    #[error(
        "window: expected one that overlaps the map from ({:.1}, {:.1}) to ({:.1}, {:.1}) m, found ({:.1}, {:.1}) to ({:.1}, {:.1}) m",
        map.south_west_m[0], map.south_west_m[1], map.north_east_m[0], map.north_east_m[1],
        window.south_west_m[0], window.south_west_m[1], window.north_east_m[0], window.north_east_m[1]
    )]
    WindowOutside {
        /// Where the map lies.
        map: Bounds,
        /// Where the window lies.
        window: Bounds,
    },
    /// Too much to hold.
    #[error(
        "expected at most {most:e} cells, found {found:e}: choose a window or a larger resolution than {resolution_m} m"
    )]
    TooLarge {
        /// Cells allowed.
        most: f64,
        /// Cells asked for.
        found: f64,
        /// Resolution asked for [m].
        resolution_m: f64,
    },
    /// Nothing was measured at all.
    #[error("elevation: expected at least one height, found none")]
    NoHeight,
    /// The cells make no world.
    #[error(transparent)]
    World(#[from] WorldError),
}

impl WorldLayers {
    /// Height alone.
    pub fn bare(elevation_m: GridMap<f32>) -> Self {
        Self {
            elevation_m,
            canopy_height_m: None,
            low_vegetation_fraction: None,
            water: None,
            ground_gap_m: None,
        }
    }

    /// How far start and goal lie apart where nobody says: as in the rock field, or half a side of a small map [m].
    pub fn drive_distance_m(&self) -> f64 {
        let Bounds { south_west_m, north_east_m } = self.bounds();
        let shortest_m = (0..2).map(|k| north_east_m[k] - south_west_m[k]).fold(f64::MAX, f64::min);
        ROCK_FIELD_DISTANCE_M.min(0.5 * shortest_m)
    }

    /// The outer border of the coarse cells.
    pub fn bounds(&self) -> Bounds {
        Bounds::of(self.elevation_m.geometry())
    }

    fn check(&self) -> Result<(), LayersError> {
        let expected = *self.elevation_m.geometry();
        let layers = [
            ("canopy_height", &self.canopy_height_m),
            ("low_veg_fraction", &self.low_vegetation_fraction),
            ("water", &self.water),
            ("ground_gap", &self.ground_gap_m),
        ];
        for (layer, map) in layers {
            if let Some(found) = map.as_ref().map(|map| *map.geometry()).filter(|found| *found != expected) {
                return Err(WorldError::OtherCells { layer, expected, found }.into());
            }
        }
        if self.elevation_m.values().iter().all(|height_m| height_m.is_nan()) {
            return Err(LayersError::NoHeight);
        }
        Ok(())
    }
}

/// Builds the world. The seed places the stems: the same stem stands at the same place in any window.
pub fn world_from_layers(
    name: impl Into<String>,
    layers: &WorldLayers,
    config: &LayerConfig,
    seed: u64,
) -> Result<World, LayersError> {
    layers.check()?;
    let geometry = fine_geometry(layers, config)?;
    let elevation_m = without_holes(&layers.elevation_m);
    let mut heights = GridMap::filled(geometry, 0.0);
    for (index, height_m) in heights.values_mut().iter_mut().enumerate() {
        *height_m = spline(&elevation_m, geometry.centre_m(geometry.cell(index)));
    }
    let mut patches = GridMap::filled(geometry, Patch::open(Stribeck::DIRT));
    for (index, patch) in patches.values_mut().iter_mut().enumerate() {
        *patch = ground(layers, config, geometry.centre_m(geometry.cell(index)));
    }
    mark_measured(layers, &mut patches);
    plant_stems(layers, config, seed, &mut patches);
    Ok(World::new(name, heights, patches)?)
}

fn fine_geometry(layers: &WorldLayers, config: &LayerConfig) -> Result<GridGeometry, LayersError> {
    let positive = [("resolution_m", config.resolution_m), ("canopy_from_m", config.canopy_from_m)];
    let not_negative = [
        ("stems_per_m2", config.stems_per_m2),
        ("stem_radius_m", config.stem_radius_m),
        ("understory_height_m", config.understory_height_m),
    ];
    if let Some((field, found)) = positive.into_iter().find(|(_, v)| !(v.is_finite() && *v > 0.0)) {
        return Err(LayersError::Setting { field, expected: "a finite number > 0", found });
    }
    if let Some((field, found)) = not_negative.into_iter().find(|(_, v)| !(v.is_finite() && *v >= 0.0)) {
        return Err(LayersError::Setting { field, expected: "a finite number >= 0", found });
    }
    let resolution_m = config.resolution_m.min(layers.elevation_m.geometry().resolution_m);
    let map = layers.bounds();
    let window = config.window.unwrap_or(map);
    let low = |axis: usize| (map.south_west_m[axis].max(window.south_west_m[axis]) / resolution_m).ceil();
    let high = |axis: usize| (map.north_east_m[axis].min(window.north_east_m[axis]) / resolution_m).floor();
    let [n_cols, n_rows] = [0, 1].map(|axis| high(axis) - low(axis));
    // Written so that a window that is no number is refused too.
    if !(n_cols >= 2.0 && n_rows >= 2.0) {
        return Err(LayersError::WindowOutside { map, window });
    }
    if n_cols * n_rows > CELLS_MAX {
        return Err(LayersError::TooLarge { most: CELLS_MAX, found: n_cols * n_rows, resolution_m });
    }
    let origin = [low(0) as i64, low(1) as i64];
    Ok(GridGeometry { resolution_m, origin, n_rows: n_rows as usize, n_cols: n_cols as usize })
}

/// What grows and lies on the ground at a point, stems aside.
fn ground(layers: &WorldLayers, config: &LayerConfig, [x_m, y_m]: [f64; 2]) -> Patch {
    let value = |layer: &Option<GridMap<f32>>| {
        let value = layer.as_ref().map(|map| bilinear(map, [x_m, y_m]));
        value.filter(|value| value.is_finite()).map(|value| f64::from(value.max(0.0)))
    };
    let dirt =
        Patch { rolling_resistance: 0.02, knowledge: Knowledge::Interpolated, ..Patch::open(Stribeck::DIRT) };
    let is_water = layers.water.as_ref().and_then(|map| map.at(x_m, y_m)).is_some_and(|water| *water > 0.5);
    if is_water {
        return Patch { friction: Stribeck::MUD, ..dirt.obstructed(0.0) };
    }
    let share = value(&layers.low_vegetation_fraction).unwrap_or(0.0).min(1.0);
    let tallest_m = value(&layers.canopy_height_m).unwrap_or(f64::INFINITY).min(config.understory_height_m);
    let vegetation_height_m = share * tallest_m;
    // Plants below a hand's breadth are what every meadow has.
    if vegetation_height_m < 0.05 {
        return dirt;
    }
    Patch { friction: Stribeck::GRASS, ..dirt }.overgrown(vegetation_height_m as f32)
}

/// Marks the fine cells that hold the centre of a measured coarse cell.
fn mark_measured(layers: &WorldLayers, patches: &mut GridMap<Patch>) {
    let coarse = *layers.elevation_m.geometry();
    let fine = *patches.geometry();
    let near_m = (0.5 * std::f64::consts::SQRT_2 * coarse.resolution_m) as f32;
    for index in 0..coarse.n_cells() {
        let gap_m = layers.ground_gap_m.as_ref().map_or(0.0, |map| map.values()[index]);
        let is_measured = layers.elevation_m.values()[index].is_finite() && gap_m <= near_m;
        let [x_m, y_m] = coarse.centre_m(coarse.cell(index));
        if let Some(cell) = fine.cell_at(x_m, y_m).filter(|_| is_measured) {
            patches[cell].knowledge = Knowledge::Measured;
        }
    }
}

/// Stands stems where the canopy is tall, by random numbers of each coarse cell's own.
fn plant_stems(layers: &WorldLayers, config: &LayerConfig, seed: u64, patches: &mut GridMap<Patch>) {
    let Some(canopy) = &layers.canopy_height_m else { return };
    let coarse = *canopy.geometry();
    let Ok(count) = Poisson::new(config.stems_per_m2 * coarse.resolution_m * coarse.resolution_m) else {
        return;
    };
    for index in 0..coarse.n_cells() {
        let canopy_m = canopy.values()[index];
        if f64::from(canopy_m) < config.canopy_from_m || !canopy_m.is_finite() {
            continue;
        }
        let mut rng = stream(seed, &[0x57E3, index as u64]);
        let centre_m = coarse.centre_m(coarse.cell(index));
        for _ in 0..count.sample(&mut rng) as usize {
            let stem_m =
                centre_m.map(|centre_m| centre_m + coarse.resolution_m * rng.random_range(-0.5..0.5));
            stand_stem(stem_m, config.stem_radius_m, canopy_m, patches);
        }
    }
}

/// Turns the cells whose centre a stem covers, and the one that holds it, into an obstacle.
fn stand_stem([x_m, y_m]: [f64; 2], radius_m: f64, height_m: f32, patches: &mut GridMap<Patch>) {
    let fine = *patches.geometry();
    let reach = (radius_m / fine.resolution_m).ceil() as i64;
    for step in -reach..=reach {
        for side in -reach..=reach {
            let at_m = [x_m + step as f64 * fine.resolution_m, y_m + side as f64 * fine.resolution_m];
            let Some(cell) = fine.cell_at(at_m[0], at_m[1]) else { continue };
            let centre_m = fine.centre_m(cell);
            let is_covered = (centre_m[0] - x_m).hypot(centre_m[1] - y_m) <= radius_m;
            let is_water = patches[cell].friction == Stribeck::MUD;
            if (is_covered || (step == 0 && side == 0)) && !is_water {
                patches[cell] = patches[cell].obstructed(height_m.max(patches[cell].obstacle_height_m));
            }
        }
    }
}

/// Fills holes with the nearest heights, ring by ring, and smooths what was filled.
fn without_holes(elevation_m: &GridMap<f32>) -> GridMap<f32> {
    let geometry = *elevation_m.geometry();
    let mut filled = elevation_m.clone();
    let holes: Vec<usize> = (0..geometry.n_cells()).filter(|&i| elevation_m.values()[i].is_nan()).collect();
    let mean_around = |map: &GridMap<f32>, index: usize| {
        let Cell { row, col } = geometry.cell(index);
        let (mut sum, mut n) = (0.0, 0.0);
        for row in row.saturating_sub(1)..(row + 2).min(geometry.n_rows) {
            for col in col.saturating_sub(1)..(col + 2).min(geometry.n_cols) {
                let height_m = map[Cell { row, col }];
                if height_m.is_finite() {
                    sum += height_m;
                    n += 1.0;
                }
            }
        }
        sum / n
    };
    let mut open = holes.clone();
    while !open.is_empty() {
        let values: Vec<f32> = open.iter().map(|&index| mean_around(&filled, index)).collect();
        for (&index, value) in open.iter().zip(values) {
            filled.values_mut()[index] = value;
        }
        open.retain(|&index| filled.values()[index].is_nan());
    }
    for _ in 0..HOLE_PASSES {
        for &index in &holes {
            filled.values_mut()[index] = mean_around(&filled, index);
        }
    }
    filled
}

/// Index of the centre at or before a place, and the share of the way to the next.
fn place(value_m: f64, origin: i64, resolution_m: f64) -> (i64, f64) {
    let place = value_m / resolution_m - origin as f64 - 0.5;
    (place.floor() as i64, place - place.floor())
}

/// Catmull-Rom spline through the four by four centres around a point; beyond the border the edge goes on.
fn spline(map: &GridMap<f32>, [x_m, y_m]: [f64; 2]) -> f32 {
    let geometry = map.geometry();
    let (col, u) = place(x_m, geometry.origin[0], geometry.resolution_m);
    let (row, v) = place(y_m, geometry.origin[1], geometry.resolution_m);
    let at = |row: i64, col: i64| {
        let row = row.clamp(0, geometry.n_rows as i64 - 1) as usize;
        let col = col.clamp(0, geometry.n_cols as i64 - 1) as usize;
        f64::from(map[Cell { row, col }])
    };
    let along = |values: [f64; 4], t: f64| {
        let [before, start, end, after] = values;
        let (tangent, next_tangent) = (0.5 * (end - before), 0.5 * (after - start));
        let (square, cube) = (t * t, t * t * t);
        start * (2.0 * cube - 3.0 * square + 1.0)
            + tangent * (cube - 2.0 * square + t)
            + end * (3.0 * square - 2.0 * cube)
            + next_tangent * (cube - square)
    };
    let rows: [f64; 4] = std::array::from_fn(|j| {
        let row = row + j as i64 - 1;
        along(std::array::from_fn(|i| at(row, col + i as i64 - 1)), u)
    });
    along(rows, v) as f32
}

/// Bilinear value at a point, without the overshoot of splines; not a number beside a hole.
fn bilinear(map: &GridMap<f32>, [x_m, y_m]: [f64; 2]) -> f32 {
    let geometry = map.geometry();
    let (col, u) = place(x_m, geometry.origin[0], geometry.resolution_m);
    let (row, v) = place(y_m, geometry.origin[1], geometry.resolution_m);
    let at = |row: i64, col: i64| {
        let row = row.clamp(0, geometry.n_rows as i64 - 1) as usize;
        let col = col.clamp(0, geometry.n_cols as i64 - 1) as usize;
        f64::from(map[Cell { row, col }])
    };
    let south = at(row, col) + u * (at(row, col + 1) - at(row, col));
    let north = at(row + 1, col) + u * (at(row + 1, col + 1) - at(row + 1, col));
    (south + v * (north - south)) as f32
}
