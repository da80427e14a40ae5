//! A world: the shape of the ground and what it is made of.

use std::ops::{Add, Mul, Sub};

use bicycle::Geometry;
use nalgebra::Vector3;
use terrain::{Cell, GridGeometry, GridMap, Knowledge, TerrainClass};

use crate::Stribeck;

/// What one cell of ground is made of.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Patch {
    /// What covers it.
    pub class: TerrainClass,
    /// Height of soft vegetation [m].
    pub vegetation_height_m: f32,
    /// Height of an obstacle above the ground, zero where there is none [m].
    pub obstacle_height_m: f32,
    /// Friction of the ground.
    pub friction: Stribeck,
    /// Resistance of loose or soft ground over load, beside the tyre's own [-].
    pub rolling_resistance: f32,
    /// Shear deformation modulus K of Janosi and Hanamoto on ground that nothing has gone over, zero of firm ground [m]: the
    /// displacement at which 63 % of the friction is there.
    pub shear_deformation_m: f32,
    /// Whether the height was measured or filled in between measurements.
    pub knowledge: Knowledge,
}

impl Patch {
    /// Bare, firm, measured ground.
    pub const fn open(friction: Stribeck) -> Self {
        Self {
            class: TerrainClass::Open,
            vegetation_height_m: 0.0,
            obstacle_height_m: 0.0,
            friction,
            rolling_resistance: 0.0,
            shear_deformation_m: 0.0,
            knowledge: Knowledge::Measured,
        }
    }

    /// The same ground under soft plants.
    pub const fn overgrown(self, vegetation_height_m: f32) -> Self {
        Self { class: TerrainClass::Vegetation, vegetation_height_m, ..self }
    }

    /// Water of a depth that nobody knows: an obstacle of no height.
    pub fn is_water(&self) -> bool {
        self.class == TerrainClass::Obstacle && self.obstacle_height_m == 0.0
    }

    /// The same ground under something that must not be touched; of no height: under water.
    pub const fn obstructed(self, obstacle_height_m: f32) -> Self {
        Self { class: TerrainClass::Obstacle, obstacle_height_m, vegetation_height_m: 0.0, ..self }
    }

    fn is_sound(&self) -> bool {
        let friction = &self.friction;
        [
            self.vegetation_height_m,
            self.obstacle_height_m,
            self.rolling_resistance,
            self.shear_deformation_m,
            friction.static_friction,
            friction.dynamic_friction,
            friction.viscous_friction,
        ]
        .iter()
        .all(|value| value.is_finite() && *value >= 0.0)
            && friction.stribeck_speed_mps.is_finite()
            && friction.stribeck_speed_mps > 0.0
    }
}

/// The whole truth about a piece of ground.
///
/// Beyond its edges the ground goes on at the height of the nearest edge, so that queries are total.
#[derive(Clone, Debug)]
pub struct World {
    /// Name, for reports.
    pub name: String,
    /// Heights at the cells' centres [m]; every value finite. Between centres each square of four is split
    /// into two triangles from south-west to north-east, so that wheels, rays and rigid contact see one surface.
    pub heights: GridMap<f32>,
    /// What the ground is made of; same geometry as `heights`.
    pub patches: GridMap<Patch>,
}

/// Why arrays do not make a world.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum WorldError {
    /// Fewer than two rows or columns: no triangle fits.
    #[error("expected a world of at least 2 x 2 cells, found {n_rows} x {n_cols}")]
    TooSmall {
        /// Rows found.
        n_rows: usize,
        /// Columns found.
        n_cols: usize,
    },
    /// The cell edge is no length.
    #[error("expected a cell edge > 0 m, found {found_m} m")]
    Resolution {
        /// The edge found [m].
        found_m: f64,
    },
    /// A height is not a number.
    #[error("height at row {row}, column {col}: expected a finite number, found {found}")]
    NonFiniteHeight {
        /// Row, 0 = south.
        row: usize,
        /// Column, 0 = west.
        col: usize,
        /// What stands there.
        found: f32,
    },
    /// A ground property is negative or not a number.
    #[error(
        "ground at row {row}, column {col}: expected finite heights and coefficients >= 0, found {found:?}"
    )]
    UnsoundPatch {
        /// Row, 0 = south.
        row: usize,
        /// Column, 0 = west.
        col: usize,
        /// What stands there.
        found: Box<Patch>,
    },
    /// Two layers do not lie on the same cells.
    #[error("layer {layer}: expected the cells of the heights {expected:?}, found {found:?}")]
    OtherCells {
        /// Name of the layer.
        layer: &'static str,
        /// Where the heights lie.
        expected: GridGeometry,
        /// Where the layer lies.
        found: GridGeometry,
    },
}

/// A rectangle along the map axes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bounds {
    /// South-west corner [m].
    pub south_west_m: [f64; 2],
    /// North-east corner [m].
    pub north_east_m: [f64; 2],
}

impl Bounds {
    /// The outer border of a grid's cells.
    pub fn of(geometry: &GridGeometry) -> Self {
        let south_west_m = geometry.south_west_m();
        let extent = |n: usize| n as f64 * geometry.resolution_m;
        let north_east_m =
            [south_west_m[0] + extent(geometry.n_cols), south_west_m[1] + extent(geometry.n_rows)];
        Self { south_west_m, north_east_m }
    }

    /// Its corners [m], counter-clockwise from the south-west.
    pub fn corners_m(&self) -> Vec<[f64; 2]> {
        let ([west_m, south_m], [east_m, north_m]) = (self.south_west_m, self.north_east_m);
        vec![[west_m, south_m], [east_m, south_m], [east_m, north_m], [west_m, north_m]]
    }

    /// Whether the point lies inside or on the border.
    pub fn contains(&self, x_m: f64, y_m: f64) -> bool {
        (self.south_west_m[0]..=self.north_east_m[0]).contains(&x_m)
            && (self.south_west_m[1]..=self.north_east_m[1]).contains(&y_m)
    }
}

/// Where a point lies in its square of four cell centres.
struct Square {
    /// Index of the south-west centre.
    south_west: usize,
    /// Eastward share of the way to the next centre.
    u: f64,
    /// Northward share.
    v: f64,
}

impl World {
    /// Takes heights and ground as a world; refuses what cannot be driven on.
    pub fn new(
        name: impl Into<String>,
        heights: GridMap<f32>,
        patches: GridMap<Patch>,
    ) -> Result<Self, WorldError> {
        let geometry = *heights.geometry();
        let (n_rows, n_cols) = (geometry.n_rows, geometry.n_cols);
        if n_rows < 2 || n_cols < 2 {
            return Err(WorldError::TooSmall { n_rows, n_cols });
        }
        if !(geometry.resolution_m.is_finite() && geometry.resolution_m > 0.0) {
            return Err(WorldError::Resolution { found_m: geometry.resolution_m });
        }
        if patches.geometry() != &geometry {
            let found = *patches.geometry();
            return Err(WorldError::OtherCells { layer: "patches", expected: geometry, found });
        }
        if let Some(index) = heights.values().iter().position(|height_m| !height_m.is_finite()) {
            let Cell { row, col } = geometry.cell(index);
            return Err(WorldError::NonFiniteHeight { row, col, found: heights.values()[index] });
        }
        if let Some(index) = patches.values().iter().position(|patch| !patch.is_sound()) {
            let Cell { row, col } = geometry.cell(index);
            return Err(WorldError::UnsoundPatch { row, col, found: Box::new(patches.values()[index]) });
        }
        Ok(Self { name: name.into(), heights, patches })
    }

    /// A world from a height and a patch for every cell centre.
    pub fn from_fn(
        name: impl Into<String>,
        geometry: GridGeometry,
        height_m: impl Fn(f64, f64) -> f64,
        patch: impl Fn(f64, f64) -> Patch,
    ) -> Result<Self, WorldError> {
        let centres = || (0..geometry.n_cells()).map(|index| geometry.centre_m(geometry.cell(index)));
        let mut heights = GridMap::filled(geometry, 0.0);
        for (value, [x_m, y_m]) in heights.values_mut().iter_mut().zip(centres()) {
            *value = height_m(x_m, y_m) as f32;
        }
        let mut patches = GridMap::filled(geometry, Patch::open(Stribeck::DIRT));
        for (value, [x_m, y_m]) in patches.values_mut().iter_mut().zip(centres()) {
            *value = patch(x_m, y_m);
        }
        Self::new(name, heights, patches)
    }

    /// Where the cells lie.
    pub fn geometry(&self) -> &GridGeometry {
        self.heights.geometry()
    }

    /// The outer border of the cells.
    pub fn bounds(&self) -> Bounds {
        Bounds::of(self.geometry())
    }

    /// Height of the triangulated ground [m]; not a number where a coordinate is none.
    #[inline]
    pub fn height_m(&self, x_m: f64, y_m: f64) -> f64 {
        let square = self.square(x_m, y_m);
        height_on_triangles(self.corners(&square), [square.u, square.v])
    }

    /// Height change per metre east and north of the triangle under the point [-].
    pub fn gradient(&self, x_m: f64, y_m: f64) -> [f64; 2] {
        let square = self.square(x_m, y_m);
        let [south_west, south_east, north_west, north_east] = self.corners(&square);
        let per_cell = if square.u >= square.v {
            [south_east - south_west, north_east - south_east]
        } else {
            [north_east - north_west, north_west - south_west]
        };
        per_cell.map(|rise_m| rise_m / self.geometry().resolution_m)
    }

    /// Upward unit normal of the triangle under the point.
    pub fn normal(&self, x_m: f64, y_m: f64) -> Vector3<f64> {
        let [east, north] = self.gradient(x_m, y_m);
        Vector3::new(-east, -north, 1.0).normalize()
    }

    /// What the ground is made of in the cell that holds the point, or in the nearest one.
    #[inline]
    pub fn patch(&self, x_m: f64, y_m: f64) -> &Patch {
        let geometry = self.geometry();
        let place = |value_m: f64, origin: i64, n: usize| {
            ((value_m / geometry.resolution_m - origin as f64).max(0.0) as usize).min(n - 1)
        };
        let row = place(y_m, geometry.origin[1], geometry.n_rows);
        let col = place(x_m, geometry.origin[0], geometry.n_cols);
        &self.patches[Cell { row, col }]
    }

    /// Terrain unevenness as PIETRA measures it: the standard deviation of the elevation under the vehicle's
    /// footprint [m], the body frame at (`x_m`, `y_m`, `yaw_rad`).
    pub fn unevenness_m(&self, vehicle: &Geometry, x_m: f64, y_m: f64, yaw_rad: f64) -> f64 {
        const ALONG: usize = 18;
        const ACROSS: usize = 10;
        let (sin, cos) = yaw_rad.sin_cos();
        let (mut sum, mut squares) = (0.0, 0.0);
        let base_m = self.height_m(x_m, y_m);
        for i in 0..ALONG * ACROSS {
            let ahead_m =
                ((i / ACROSS) as f64 + 0.5) / ALONG as f64 * vehicle.length_m - vehicle.rear_overhang_m;
            let left_m = (((i % ACROSS) as f64 + 0.5) / ACROSS as f64 - 0.5) * vehicle.width_m;
            let above_m = self
                .height_m(x_m + cos * ahead_m - sin * left_m, y_m + sin * ahead_m + cos * left_m)
                - base_m;
            sum += above_m;
            squares += above_m * above_m;
        }
        let n = (ALONG * ACROSS) as f64;
        (squares / n - (sum / n) * (sum / n)).max(0.0).sqrt()
    }

    /// How much the ground around a point departs from a plane [m]: root mean square over three by three points
    /// `spacing_m` apart.
    pub fn roughness_m(&self, x_m: f64, y_m: f64, spacing_m: f64) -> f64 {
        const STEPS: [f64; 3] = [-1.0, 0.0, 1.0];
        let rows = STEPS.map(|v| STEPS.map(|u| self.height_m(x_m + u * spacing_m, y_m + v * spacing_m)));
        let at = |j: usize, i: usize| rows[j][i];
        let mean_m = rows.as_flattened().iter().sum::<f64>() / 9.0;
        // Least squares on a symmetric stencil: sums of +-1 weighted heights over the six points that count.
        let east = (0..3).map(|j| at(j, 2) - at(j, 0)).sum::<f64>() / 6.0;
        let north = (0..3).map(|i| at(2, i) - at(0, i)).sum::<f64>() / 6.0;
        let residual = |j: usize, i: usize| at(j, i) - mean_m - east * STEPS[i] - north * STEPS[j];
        let squares: f64 = (0..9).map(|k| residual(k / 3, k % 3).powi(2)).sum();
        (squares / 9.0).sqrt()
    }

    #[inline]
    fn square(&self, x_m: f64, y_m: f64) -> Square {
        let geometry = self.heights.geometry();
        let place = |value_m: f64, origin: i64, n: usize| {
            let place = (value_m / geometry.resolution_m - origin as f64 - 0.5).clamp(0.0, (n - 1) as f64);
            let index = (place as usize).min(n - 2);
            (index, place - index as f64)
        };
        let (col, u) = place(x_m, geometry.origin[0], geometry.n_cols);
        let (row, v) = place(y_m, geometry.origin[1], geometry.n_rows);
        Square { south_west: row * geometry.n_cols + col, u, v }
    }

    /// Heights at the south-west, south-east, north-west and north-east corner [m].
    #[inline]
    fn corners(&self, square: &Square) -> [f64; 4] {
        let n_cols = self.heights.geometry().n_cols;
        let south = &self.heights.values()[square.south_west..];
        [south[0], south[1], south[n_cols], south[n_cols + 1]].map(f64::from)
    }
}

/// Height in a square of two triangles that meet on the diagonal from south-west to north-east, at these shares of the
/// way east and north. Corners: south-west, south-east, north-west, north-east.
#[inline(always)]
pub(crate) fn height_on_triangles<T>(
    [south_west, south_east, north_west, north_east]: [T; 4],
    [u, v]: [T; 2],
) -> T
where
    T: Copy + PartialOrd + Add<Output = T> + Sub<Output = T> + Mul<Output = T>,
{
    // Both are computed: a branch would miss half the time.
    let below = south_west + u * (south_east - south_west) + v * (north_east - south_east);
    let above = south_west + v * (north_west - south_west) + u * (north_east - north_west);
    if u >= v { below } else { above }
}
